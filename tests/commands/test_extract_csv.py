"""``ridelog extract --csv`` as a person runs it: a simulated drive whose truth is known, as phones write it."""

from __future__ import annotations

import json
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest
import yaml

from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle

from ..support.command import called
from ..support.drives.phones import LAYOUTS, Phone, phone_in, phyphox, rotation, table
from ..support.drives.simulated_drive import LEAD_M, SPACING_M, DemoDrive, DrivePlan, RoadStretch, simulate_drive

PLAN = DrivePlan(
    speed_knots=((0, 0), (4, 0), (14, 13), (40, 11), (50, 14), (75, 12), (85, 0), (92, 0)),
    stretches=(RoadStretch(1200, 90),), seed=11,
)
FROM_M, TO_M = 100.0, 800.0


@pytest.fixture(scope="module")
def drive() -> DemoDrive:
    return simulate_drive(PLAN, read_vehicle(vehicle_file("rav4-2009")))


@pytest.fixture(scope="module")
def phone(drive: DemoDrive) -> Phone:
    rng = np.random.default_rng(4)
    return phone_in(drive, rng, rotation(rng))


@pytest.fixture(scope="module")
def line(drive: DemoDrive, tmp_path_factory: pytest.TempPathFactory) -> Path:
    at_m = SPACING_M * np.arange(len(drive.road.elevation_m)) - LEAD_M
    inside = (at_m >= FROM_M) & (at_m <= TO_M)
    lat, lon = (np.interp(at_m[inside], drive.motion.distance_m, one)
                for one in (drive.motion.lat_deg, drive.motion.lon_deg))
    return table(tmp_path_factory.mktemp("line") / "line.csv", "distance_m,elevation_m,lat_deg,lon_deg",
                 at_m[inside] - FROM_M, drive.road.elevation_m[inside], lat, lon, form="%.8f")


def columns(run: Path) -> dict[str, np.ndarray]:
    read = np.genfromtxt(run / "drive.csv", delimiter=",", names=True)
    return {name: read[name] for name in read.dtype.names}


def run_of(done: CompletedProcess[str]) -> Path:
    assert done.returncode == 0, done.stderr
    (one,) = json.loads(done.stdout)["runs"]
    return Path(one["run"])


def truth(drive: DemoDrive, time_s: np.ndarray) -> np.ndarray:
    accel = np.interp(time_s, drive.motion.time_s, drive.accel_mps2)
    return accel - accel.mean()


def refused(*words: object) -> str:
    done = called("extract", *words)
    assert done.returncode == 2, done.stdout
    assert len(done.stderr.splitlines()) == 1
    return done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_at_any_angle_gives_what_the_car_did(
        layout: str, drive: DemoDrive, phone: Phone, tmp_path: Path) -> None:
    done = called("extract", "--csv", *LAYOUTS[layout](phone, tmp_path / layout), "--out", tmp_path / "runs", "--json")
    run = run_of(done)
    found = columns(run)
    assert set(found) == {"t_s", "accel_z_mps2", "speed_mps", "distance_m", "lat_deg", "lon_deg", "usable"}
    time_s = found["t_s"] - (62_608 if layout == "sensor_log" else 0)
    off = found["accel_z_mps2"] - truth(drive, time_s)
    assert off.std() < 0.05  # noise of 0.01, and what braking leaks through a level that is 0.5 degrees off
    true_m = np.interp(time_s, drive.motion.time_s, drive.motion.distance_m)
    assert np.ptp(found["distance_m"] - true_m) < 3.0
    facts = yaml.safe_load((run / "run.yaml").read_text())
    assert facts["sensor"]["step_mps2"] == pytest.approx(0.0024, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["phyphox", pytest.param("own_names", marks=pytest.mark.release)])
def test_the_lab_finds_the_same_error_as_on_the_true_drive(
        layout: str, drive: DemoDrive, phone: Phone, line: Path, tmp_path: Path) -> None:
    done = called("extract", "--csv", *LAYOUTS[layout](phone, tmp_path / layout), "--out", tmp_path / "runs",
                  "--profile", line, "--vehicle", "rav4-2009", "--json")
    run = run_of(done)
    assert json.loads(done.stdout)["runs"][0]["by_road"]
    found = columns(run)
    exact = tmp_path / "exact"
    exact.mkdir()
    distance, speed = (np.interp(found["t_s"], drive.motion.time_s, one)
                       for one in (drive.motion.distance_m - FROM_M, drive.motion.speed_mps))
    table(exact / "drive.csv", "t_s,accel_z_mps2,speed_mps,distance_m", found["t_s"], truth(drive, found["t_s"]), speed,
          distance, form="%.6f")
    (exact / "profile.csv").write_text((run / "profile.csv").read_text())
    moving = found["speed_mps"] > 0.5
    assert np.sqrt(np.mean((found["distance_m"] - distance)[moving] ** 2)) < 0.1
    for vehicle, within in (("sedan-2015", 0.02), ("rav4-2009", 0.05)):
        errors = []
        for one in (run, exact):
            reported = called("compare", "--json", "--vehicle", vehicle, one)
            assert reported.returncode == 0, reported.stderr
            errors.append(json.loads(reported.stdout)["error"])
        assert abs(errors[0] - errors[1]) < within, (vehicle, errors)


def test_a_phone_that_slips_is_cut_there_and_levelled_again(drive: DemoDrive, phone: Phone, tmp_path: Path) -> None:
    slipped = phone.time_s > 55.0
    force = phone.force_mps2.copy()
    angle = np.radians(40)
    force[slipped] = force[slipped] @ np.array(
        [[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    words = phyphox(Phone(**{**vars(phone), "force_mps2": force}), tmp_path / "ride")
    done = called("extract", "--csv", *words, "--out", tmp_path / "runs", "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert [Path(one["run"]).name for one in said["runs"]] == ["ride", "ride-2"]
    assert any("tilted" in note and "cut the record there" in note for note in said["notes"])
    for name in ("ride", "ride-2"):
        found = columns(tmp_path / "runs" / name)
        assert (found["accel_z_mps2"] - truth(drive, found["t_s"])).std() < 0.15


@pytest.mark.slow
def test_repeated_samples_are_dropped_and_the_true_rate_is_reported(drive: DemoDrive, tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    taken = phone_in(drive, rng, rotation(rng), rate_hz=102.0, jitter=0.0)
    time_s = np.arange(taken.time_s[0], taken.time_s[-1], 1 / 200)
    last = np.searchsorted(taken.time_s, time_s, side="right") - 1
    held = Phone(**{**vars(taken), "time_s": time_s, "force_mps2": taken.force_mps2[last]})
    done = called("extract", "--csv", *phyphox(held, tmp_path / "ride"), "--out", tmp_path / "runs", "--json")
    found = columns(run_of(done))
    assert any("the sensor gave 102 Hz" in note for note in json.loads(done.stdout)["notes"])
    off = found["accel_z_mps2"] - truth(drive, found["t_s"] - 0.0025)  # half of a row late, on average
    assert off.std() < 0.1 * truth(drive, found["t_s"]).std()


@pytest.mark.slow
def test_a_slow_phone_is_reported_and_a_slower_one_refused(drive: DemoDrive, tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    done = called("extract", "--csv", *phyphox(phone_in(drive, rng, rotation(rng), rate_hz=51.0), tmp_path / "fifty"),
                "--out", tmp_path / "runs")
    assert done.returncode == 0, done.stderr
    assert "shows nothing above 23 Hz" in done.stdout
    facts = yaml.safe_load((tmp_path / "runs" / "fifty" / "run.yaml").read_text())
    assert facts["pass_band_hz"] == [0.0, pytest.approx(22.95, abs=0.2)]
    slow = phyphox(phone_in(drive, rng, rotation(rng), rate_hz=20.0), tmp_path / "twenty")
    assert "higher rate" in refused("--csv", *slow, "--out", tmp_path / "runs")


def test_holes_and_clipped_samples_are_marked(drive: DemoDrive, phone: Phone, tmp_path: Path) -> None:
    hole = (phone.time_s > 30.0) & (phone.time_s < 30.3)
    end = 0.97 * np.abs(phone.force_mps2[:, int(np.argmax(np.abs(phone.gravity_mps2[0])))]).max()
    kept = Phone(**{**vars(phone), "time_s": phone.time_s[~hole],
                    "force_mps2": phone.force_mps2[~hole].clip(-end, end)})
    run = run_of(called("extract", "--csv", *phyphox(kept, tmp_path / "ride"), "--out", tmp_path / "runs", "--json"))
    found = columns(run)
    inside = (found["t_s"] > 30.02) & (found["t_s"] < 30.28)
    assert (found["usable"][inside] == 0).all()
    assert (found["usable"] == 2).any()
    assert (found["usable"] == 1).mean() > 0.98


@pytest.mark.slow
def test_gravity_taken_out_needs_the_axis_that_points_up(drive: DemoDrive, phone: Phone, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    flat = phone_in(drive, rng, np.eye(3))
    header = '"Time (s)",' + ",".join(f'"Linear Acceleration {axis} (m/s^2)"' for axis in "xyz")
    (tmp_path / "ride").mkdir()
    table(tmp_path / "ride" / "Linear Accelerometer.csv", header, flat.time_s,
          *(flat.force_mps2 - flat.gravity_mps2).T)
    phyphox(flat, tmp_path / "other")
    (tmp_path / "other" / "Location.csv").rename(tmp_path / "ride" / "Location.csv")
    words = ("--csv", tmp_path / "ride", "--out", tmp_path / "runs")
    assert "--up z" in refused(*words)
    for up, sign in (("--up=z", 1.0), ("--up=-z", -1.0)):
        found = columns(run_of(called("extract", *words, up, "--json")))
        assert (found["accel_z_mps2"] - sign * truth(drive, found["t_s"])).std() < 0.05
    assert "leave out --up" in refused("--csv", tmp_path / "other" / "Accelerometer.csv", "--location",
                                       tmp_path / "ride" / "Location.csv", "--out", tmp_path / "runs", "--up", "z")


def near_1(folder: Path, header: str, scale: float = 1.0) -> tuple[Path, Path]:
    """A recording without gravity of a car that gains 1 m/s each second all along, and its fixes."""
    time_s = np.arange(0, 12, 0.01)
    rng = np.random.default_rng(5)
    axes = scale * (np.array([1.0, 0.0, 0.0]) + 0.4 * rng.standard_normal((len(time_s), 3)))
    fix_s = np.arange(0.0, 13.0)
    return (table(folder / "accel.csv", header, time_s, *axes.T),
            table(folder / "speed.csv", "t_s,speed_mps", fix_s, 2 + fix_s))


LINEAR = '"Time (s)",' + ",".join(f'"Linear Acceleration {axis} (m/s^2)"' for axis in "xyz")
NAMED = "t=t:s,x=ax:{0},y=ay:{0},z=az:{0},t=t_s:s,speed=speed_mps:m/s"


@pytest.mark.parametrize(("header", "unit", "scale"), [(LINEAR, None, 1.0), ("t,ax,ay,az", "m/s2", 1.0),
                                                       ("t,ax,ay,az", "g", 1 / 9.80665), ("t,ax,ay,az", "mg", 101.97)])
def test_a_unit_that_was_said_holds_though_the_mean_is_near_1(
        header: str, unit: str | None, scale: float, tmp_path: Path) -> None:
    """The mean is the car's own acceleration: what looks like gravity in g is none where the unit is said."""
    accel, speeds = near_1(tmp_path, header, scale)
    words = ("--csv", accel, "--location", speeds, "--out", tmp_path / "o", *(
        () if unit is None else ("--columns", NAMED.format(unit))))
    found = columns(run_of(called("extract", *words, "--up", "z", "--json")))
    assert found["accel_z_mps2"].std() == pytest.approx(0.4, rel=0.05)
    assert "--up z" in refused(*words)


def test_without_a_unit_and_without_gravity_the_unit_is_asked_for(tmp_path: Path) -> None:
    accel, speeds = near_1(tmp_path, "t,ax,ay,az")
    words = ("--csv", accel, "--location", speeds, "--out", tmp_path / "o", "--columns", NAMED.replace(":{0}", ""))
    assert "x=ax:UNIT" in refused(*words, "--up", "z")


def test_a_column_that_was_named_is_not_replaced_by_a_known_one(tmp_path: Path) -> None:
    accel, _ = near_1(tmp_path, "t_s,accel_x_mps2,accel_y_mps2,accel_z_mps2")
    words = ("--csv", accel, "--out", tmp_path / "o", "--speed", "10", "--up", "z", "--columns")
    assert "z=az to name a column, found none of that name" in refused(*words, "t=t_s,x=accel_x_mps2,z=az")
    every = ",".join(f"{axis}=accel_{axis}_mps2:mg" for axis in "xyz")
    found = columns(run_of(called("extract", *words, every, "--json")))  # t as in the layout
    assert found["accel_z_mps2"].std() == pytest.approx(0.4 * 9.80665e-3, rel=0.05)


def steady(folder: Path, still: slice = slice(0)) -> tuple[Path, Path]:
    """40 s at 36 to 38 km/h, in whole km/h in each row; on some rows the sensor stands still."""
    time_s = np.arange(0, 40, 0.01)
    accel = np.array([0.0, 0.0, 9.81]) + 0.3 * np.random.default_rng(6).standard_normal((len(time_s), 3))
    accel[still] = accel[still][:1]
    log = table(folder / "log.csv", "t,ax,ay,az,v", time_s, *accel.T, np.floor(36 + time_s / 16), form="%.3f")
    return log, table(folder / "obd.csv", "t,v", np.arange(0.0, 40.0), np.floor(36 + np.arange(40.0) / 16))


NAMES = "t=t:s,x=ax:m/s2,y=ay:m/s2,z=az:m/s2"


def test_an_unchanged_speed_is_driven_all_the_way(tmp_path: Path) -> None:
    log, obd = steady(tmp_path)
    for words in ((log, "--columns", f"{NAMES},speed=v:km/h"), (log, "--location", obd, "--columns",
                                                                 f"{NAMES},speed=v:km/h")):
        done = called("extract", "--csv", *words, "--out", tmp_path / "o", "--json")
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout)
        assert sum(one["metres"] for one in found["runs"]) == pytest.approx(39 * 36.75 / 3.6, rel=0.04)
        assert found["left_out"] == []


def test_places_that_are_repeated_while_the_car_drives_on_are_no_fix_and_are_counted(tmp_path: Path) -> None:
    log, _ = steady(tmp_path)
    fix_s = np.arange(0.0, 40.0)
    held_s = np.where((fix_s > 12) & (fix_s < 28), 12.0, fix_s)
    places = table(tmp_path / "gps.csv", "t,lat,lon,v", fix_s, 45 + 10 * held_s / 111_195, 7 + 0 * fix_s,
                   36 + 0 * fix_s, form="%.9f")
    words = ("--location", places, "--columns", f"{NAMES},lat=lat,lon=lon,speed=v:km/h", "--out", tmp_path / "o")
    found = json.loads(called("extract", "--csv", log, *words, "--json").stdout)
    assert len(found["runs"]) == 2
    (lost,) = found["left_out"]
    assert (lost["unit"], lost["why"]) == ("s", "without a fix for more than 10 s, or at an end")
    assert lost["amount"] == pytest.approx(16.0, abs=2.0)
    assert "Not used: 1" in called("extract", "--csv", log, *words).stdout


@pytest.mark.parametrize(("still", "runs"), [((1000, 2000), 2), ((0, 1000), 1), ((2500, 4000), 1)])
def test_a_sensor_that_stood_still_ends_a_run(still: tuple[int, int], runs: int, tmp_path: Path) -> None:
    log, _ = steady(tmp_path, slice(*still))
    done = called("extract", "--csv", log, "--columns", NAMES, "--speed", "10", "--out", tmp_path / "o", "--json")
    found = json.loads(done.stdout)
    assert len(found["runs"]) == runs
    stood_s = (still[1] - still[0]) / 100
    assert sum(one["seconds"] for one in found["runs"]) == pytest.approx(40 - stood_s, abs=1.5)
    (lost,) = found["left_out"]
    assert lost["why"] == "in which the sensor was frozen on all axes"
    assert lost["amount"] == pytest.approx(stood_s, abs=0.1)


def test_an_axis_that_stands_still_alone_is_named(tmp_path: Path) -> None:
    log, _ = steady(tmp_path)
    values = np.genfromtxt(log, delimiter=",", skip_header=1)
    values[1000:2000, 3] = values[1000, 3]
    log = table(tmp_path / "log.csv", "t,ax,ay,az,v", *values.T, form="%.3f")
    found = json.loads(called("extract", "--csv", log, "--columns", NAMES, "--speed", "10", "--out", tmp_path / "o",
                              "--json").stdout)
    assert [note for note in found["notes"] if note.startswith("z alone is frozen for ")]


@pytest.mark.parametrize("rate_hz", [10, 50, 100])
def test_fixes_as_quick_as_readings_are_thinned_not_dropped(rate_hz: int, tmp_path: Path) -> None:
    log, _ = steady(tmp_path)
    fix_s = np.arange(0.0, 40.0, 1 / rate_hz)
    obd = table(tmp_path / "obd.csv", "t_s,speed_mph", fix_s, 20 + 2 * np.sin(fix_s), form="%.4f")
    found = json.loads(called("extract", "--csv", log, "--location", obd, "--columns", f"{NAMES},t=t_s",
                              "--out", tmp_path / "o", "--json").stdout)
    assert found["left_out"] == []
    (run,) = found["runs"]
    assert run["metres"] == pytest.approx(20 * 0.44704 * run["seconds"], rel=0.01)
    assert run["seconds"] == pytest.approx(40, abs=0.6)


def test_a_reading_a_second_is_no_record_and_one_that_is_all_clipped_no_run(tmp_path: Path) -> None:
    time_s = np.arange(0, 40, 0.01)
    noise = 0.3 * np.random.default_rng(7).standard_normal((len(time_s), 3))
    held = noise[np.arange(len(time_s)) // 100 * 100] + np.array([0, 0, 9.81])
    ends = np.clip(noise, -0.05, 0.05) + np.array([0, 0, 9.81])
    for accel, said in ((held, "found 1 written at 100 Hz"), (ends, "without a good reading")):
        log = table(tmp_path / "log.csv", "t,ax,ay,az", time_s, *accel.T, form="%.3f")
        assert said in refused("--csv", log, "--columns", NAMES, "--speed", "10", "--out", tmp_path / "o")


def test_one_axis_and_a_steady_speed_are_enough(drive: DemoDrive, tmp_path: Path) -> None:
    time_s = np.arange(10, 60, 0.01)
    accel = np.interp(time_s, drive.motion.time_s, drive.accel_mps2)
    path = table(tmp_path / "phone.csv", "t,az", time_s, accel + 9.81)
    found = columns(run_of(called("extract", "--csv", path, "--columns", "t=t:s,up=az:m/s2", "--speed", "4.5", "--out",
                                tmp_path / "runs", "--json")))
    assert set(found) == {"t_s", "accel_z_mps2", "speed_mps", "distance_m", "usable"}
    assert np.allclose(found["speed_mps"], 4.5, atol=1e-6)
    assert np.ptp(found["distance_m"]) == pytest.approx(4.5 * np.ptp(found["t_s"]), abs=1e-3)
    assert np.allclose(found["accel_z_mps2"], truth(drive, found["t_s"]), atol=1e-5)  # on the grid: as it was read


@pytest.mark.slow
def test_what_cannot_be_used_is_refused_in_one_line(drive: DemoDrive, phone: Phone, line: Path, tmp_path: Path) -> None:
    phyphox(phone, tmp_path / "good")
    accel, places = tmp_path / "good" / "Accelerometer.csv", tmp_path / "good" / "Location.csv"
    rows = accel.read_text().splitlines()
    (tmp_path / "cell.csv").write_text("\n".join([*rows[:40], rows[40].replace("E+00", "E+0o", 1), *rows[41:]]))
    (tmp_path / "back.csv").write_text("\n".join([rows[0], *rows[3000:], *rows[1:3000]]))
    (tmp_path / "none.csv").write_text(rows[0] + "\n")
    (tmp_path / "text.csv").write_text("nothing of the kind\n")
    (tmp_path / "odd.csv").write_text("when,thing,other\n1,2,3\n")
    (tmp_path / "sum.csv").write_text("\n".join(["t;x;y;z", *rows[1:]]))
    (tmp_path / "later").mkdir()
    later = table(tmp_path / "later" / "Location.csv", "t_s,speed_mps", phone.fix_s + 5000, phone.speed_mps)
    speeds = table(tmp_path / "later" / "speed.csv", "t_s,speed_mps", phone.fix_s, phone.speed_mps)
    kmh = table(tmp_path / "later" / "kmh.csv", "t_s,lat_deg,lon_deg,speed_mps", phone.fix_s, phone.lat_deg,
                phone.lon_deg, 3.6 * phone.speed_mps, form="%.9f")
    table(tmp_path / "line.csv", "t,ax,ay,az", phone.time_s, *phone.force_mps2.T)
    names = ("--columns", "t=t:s,x=x:UNIT,y=y,z=z")
    for words, said in (
        ((accel,), "expected a speed, or latitude and longitude, found neither"),
        ((accel, "--location", later), "by the clock of Accelerometer.csv"),
        ((accel, "--location", kmh), "agrees with the positions"),
        ((accel, "--location", speeds, "--profile", line), "latitude and longitude, which --profile needs"),
        ((tmp_path / "cell.csv", "--location", places), "cell.csv:41: expected a number for"),
        ((tmp_path / "back.csv", "--location", places), "the clock was set back"),
        ((tmp_path / "none.csv", "--location", places), "none.csv:2: expected numbers below the header"),
        ((tmp_path / "text.csv",), "text.csv:1: expected a header"),
        ((tmp_path / "odd.csv",), "give --columns"),
        ((tmp_path / "gone.csv",), "expected a readable file"),
        ((tmp_path / "sum.csv", *names), "--columns: expected x=x:UNIT"),
        ((tmp_path / "sum.csv", "--location", places, "--columns", "t=t,x=x:g,y=y:g,z=z:g"), "name it: x=x:m/s2"),
        ((tmp_path / "sum.csv", "--columns", "when=t"), "--columns: expected ROLE=COLUMN"),
        ((tmp_path / "later",), "expected columns of a known program"),
        ((tmp_path / "line.csv", "--location", places), "give --columns"),
    ):
        found = refused("--csv", *words, "--out", tmp_path / "runs")
        assert said in found, found
    assert "together with --csv" in refused("x.dump", "--out", tmp_path / "runs", "--speed", "4")
    assert "found both" in refused("x.dump", "--csv", accel, "--out", tmp_path / "runs")
    assert "expected a DUMP, or --csv" in refused("--out", tmp_path / "runs")
    assert not (tmp_path / "runs").exists()


def test_of_two_recordings_the_good_one_is_done(phone: Phone, tmp_path: Path) -> None:
    phyphox(phone, tmp_path / "good")
    (tmp_path / "bad.csv").write_text("a,b\n1,2\n")
    done = called("extract", "--csv", tmp_path / "bad.csv", tmp_path / "good", "--out", tmp_path / "runs")
    assert done.returncode == 1
    assert "bad.csv" in done.stderr
    assert (tmp_path / "runs" / "good" / "drive.csv").exists()
