"""``ridelog learn-car`` over drives of a car by equations of their own (``support.drives.unmeasured_car``)."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from logger.api.learn_car import _check_braking
from logger.errors import BadInput
from logger.estimation.drive_spectra import (
    BLOCK_S,
    DRIVE_SPECTRA,
    DriveSpectra,
    SpectraKeeper,
    drive_spectra,
    middles_hz,
)
from logger.identification.unknown_car import BlockRoads, CarKnowledge, LearnedCar, UnknownCar, misfit
from logger.service import wiring
from logger.service.config import load_config
from logger.shipped import vehicle_file
from logger.store.formats.drive_file import Drive
from logger.store.formats.vehicle_file import read_model
from logger.store.log.log_writer import SegmentLog
from logger.vehicle.uncertain import cars_off

from ..support.command import called
from ..support.drives.logged_rows import ROW
from ..support.drives.unmeasured_car import FINE_SENSOR, MPH, UnmeasuredCar, driven, mixed, written
from ..support.slow import release

CAR = UnmeasuredCar()
SECONDS = 120.0


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return written(tmp_path_factory.mktemp("drives"), mixed(CAR, 3, SECONDS))


@pytest.fixture(scope="module")
def learned(runs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path, Path]:
    folder = tmp_path_factory.mktemp("learned")
    found = called("learn-car", *runs, "--wheelbase", 2.68, "--mass", 1400, "--json", "--out", folder / "car.yaml",
                   "--out", folder / "car.html")
    assert found.returncode == 0, found.stderr
    return json.loads(found.stdout), folder / "car.yaml", folder / "car.html"


@pytest.mark.slow
def test_frequencies_and_damping_are_those_of_the_car(learned: tuple[dict[str, Any], Path, Path]) -> None:
    found = learned[0]
    for end in ("front", "rear"):
        for name, true in zip(("bounce_hz", "damping_ratio", "hop_hz"), getattr(CAR, end), strict=False):
            value, error = (found[key][f"{end}.{name}"] for key in ("parameters", "standard_errors"))
            assert abs(value - true) < 3.5 * error < 0.6 * true
    assert abs(found["parameters"]["wheelbase_m"] - CAR.wheelbase_m) < 0.02
    assert all(one["std_share"] < 0.5 * one["std_share_before"] for one in found["iri"])


@pytest.mark.slow
def test_the_file_is_a_vehicle_whose_errors_the_box_can_use(learned: tuple[dict[str, Any], Path, Path]) -> None:
    _, path, page = learned
    model = read_model(path)
    assert len(cars_off(model.vehicle, model.effects, model.errors)) >= 10
    assert "sprung_mass_kg" not in model.errors.standard_errors  # type: ignore[union-attr]
    whole_kg = 2 * sum((model.vehicle.sprung_mass_kg, model.vehicle.front.unsprung_mass_kg,
                        model.vehicle.rear.unsprung_mass_kg))  # type: ignore[union-attr]
    assert whole_kg == pytest.approx(1400)
    assert path.read_text().startswith("# Learned by ridelog learn-car from 4 drives")
    assert "Spectra at" in page.read_text() and "<svg" in page.read_text()


@pytest.mark.slow
@pytest.mark.parametrize("wrong_m", [2.66 * 1.1, *release(2.66 * 0.9)])
def test_a_wrong_wheelbase_is_named(runs: list[Path], wrong_m: float) -> None:
    found = called("learn-car", *runs, "--wheelbase", wrong_m)
    assert found.returncode == 1 and found.stdout == ""
    assert "the distance that the drives show, 2.6" in found.stderr and len(found.stderr.splitlines()) == 1


def test_short_drives_at_one_speed_are_of_no_other_axis_by_chance(tmp_path: Path) -> None:
    rng, count = np.random.default_rng(0), 1300
    for _ in range(300):
        speed, off = (np.repeat(rng.normal(mean, 0.1, 13), 100) for mean in (20.0, 0.0))
        felt = rng.normal(0.0, 0.5, count) + off
        _check_braking("drive", Drive(tmp_path, 100.0, np.arange(count) / 100, felt, speed, np.cumsum(speed) / 100,
                                      None, None))


@pytest.mark.parametrize("beside", [0.1, 0.5])
def test_braking_that_is_read_as_up_and_down_is_refused(beside: float, runs: list[Path], tmp_path: Path) -> None:
    turned = []
    for number, run in enumerate(runs[1:3]):
        drive = np.genfromtxt(run / "drive.csv", delimiter=",", names=True)
        drive["accel_z_mps2"] = (np.gradient(drive["speed_mps"], drive["t_s"]) + beside * drive["accel_z_mps2"]
                                 + np.random.default_rng(number).normal(0.0, 0.15, len(drive)))
        folder = tmp_path / run.name
        folder.mkdir()
        np.savetxt(folder / "drive.csv", drive, "%.6f", ",", header=",".join(drive.dtype.names or ()), comments="")
        turned.append(folder)
    found = called("learn-car", *turned, "--wheelbase", 2.66)
    assert found.returncode == 1
    share, error = map(float, re.search(  # type: ignore[union-attr]
        r"feels ([\d.]+) ± ([\d.]+) times the car's braking: it is another axis", found.stderr).groups())
    assert abs(share - 1) < 3 * error < 0.3


@pytest.mark.slow
def test_drives_of_two_cars_are_refused(runs: list[Path], tmp_path: Path) -> None:
    other = UnmeasuredCar(2.66, 0.4, (1.5, 0.4, 12.8, 0.1), (1.6, 0.35, 12.6, 0.12))
    drive, = written(tmp_path, mixed(other, 5, 2 * SECONDS, speeds_mps=(45 * MPH,)))
    found = called("learn-car", *runs[:2], drive.rename(tmp_path / "strange"), runs[2], "--wheelbase", 2.66)
    assert found.returncode == 1 and len(found.stderr.splitlines()) == 1
    assert "strange: this drive is not from the same car as the others" in found.stderr


@pytest.mark.parametrize("within", [0.0, 0.15])
def test_the_waviness_within_a_drive_is_learned(within: float) -> None:
    """Powers that are drawn about what a car reads of roads with this deviation from block to block."""
    rng = np.random.default_rng(1)
    speed = np.repeat(np.linspace(8.0, 26.0, 10), 30)
    shape = (len(speed), len(middles_hz()))
    empty = DriveSpectra(speed, np.zeros(len(speed)), np.ones(shape), np.full(len(speed), 1e-5), np.arange(300) // 100)
    problem = UnknownCar(empty, CarKnowledge(2.66))
    x, own = problem.knowledge.mean, within * rng.standard_normal(len(speed))
    roads = BlockRoads(rng.normal(-12.0, 0.7, len(speed)), own, np.zeros(3))
    road, noise = problem.expected_power(x, roads)
    problem.power = (road + noise) * rng.gamma(problem.weight) / problem.weight
    found, _ = problem.with_blocks(x, problem.start(x))
    learned = LearnedCar(problem.knowledge, x, np.eye(len(x)), found, 0.0, True)
    assert problem.waviness_within(learned) == pytest.approx(max(float(own.std()), 0.06), abs=0.04)


def test_roads_of_unlike_waviness_are_no_trailer() -> None:
    """The right car's misfit is that of chance, however little the waviness changes within a drive (17 where that of
    drives is left out)."""
    rng = np.random.default_rng(2)
    speed = np.repeat(np.linspace(8.0, 26.0, 10), 30)
    empty = DriveSpectra(speed, np.zeros(300), np.ones((300, len(middles_hz()))), np.full(300, 1e-5),
                         np.arange(300) // 100)
    problem = UnknownCar(empty, CarKnowledge(2.66, waviness_within=0.05))
    x = problem.knowledge.mean
    roads = BlockRoads(rng.normal(-12.0, 0.7, 300), np.zeros(300), np.array([-0.3, 0.1, 0.4]))
    road, noise = problem.expected_power(x, roads)
    problem.spectra.power[:] = (road + noise) * rng.gamma(problem.weight) / problem.weight
    assert 0.8 < misfit(problem, x) < 1.25


def test_the_spread_of_a_speed_is_that_under_the_window() -> None:
    """By steady rises: the squares of a Hann window have a variance of (1 / 12 - 5 / (8 pi2)) of their length's square.
    """
    time_s = np.arange(3000) / 100
    noise = np.random.default_rng(0).standard_normal(3000)
    spectra = drive_spectra(noise, 10 + 0.2 * time_s, np.ones(3000, bool), 100.0)
    deviation = 0.2 * BLOCK_S * np.sqrt(1 / 12 - 5 / (8 * np.pi**2))
    np.testing.assert_allclose(spectra.spread * spectra.speed_mps, deviation, rtol=1e-3)


@pytest.mark.slow
def test_one_speed_says_what_to_add(tmp_path: Path) -> None:
    runs = written(tmp_path, mixed(CAR, 4, 2 * SECONDS, speeds_mps=(30 * MPH,)))
    found = called("learn-car", *runs, "--wheelbase", 2.66)
    assert found.returncode == 0 and "add one at 30 and one at 90 km/h" in found.stdout
    assert "Only one drive" in found.stdout


def test_what_is_no_drive_is_refused_in_one_line(tmp_path: Path, runs: list[Path]) -> None:
    for words, said in (((tmp_path / "none", "--wheelbase", 2.66), "found no such file"),
                        ((*runs, "--wheelbase", 266), "--wheelbase 266: expected 1.5 to 6 m"),
                        ((*runs, "--wheelbase", 2.66, "--sensor", "left_m=1"), "expected ahead_m=METRES"),
                        ((runs[0], runs[0], "--wheelbase", 2.66), "expected every drive once"),
                        ((runs[3], "--wheelbase", 2.66), "expected at least two minutes of steady driving")):
        found = called("learn-car", *words)
        assert found.returncode == 2 and said in found.stderr and len(found.stderr.splitlines()) == 1


@pytest.mark.slow
def test_friction_is_named_and_stays_in_the_errors(learned: tuple[dict[str, Any], Path, Path], tmp_path: Path) -> None:
    """Friction of 60 N acts as damping that is weaker where suspensions move fast."""
    drives = mixed(replace(CAR, friction_n=60.0), 8, 2 * SECONDS)
    found = called("learn-car", *written(tmp_path, drives), "--wheelbase", 2.66, "--json")
    assert found.returncode == 0, found.stderr
    answer = json.loads(found.stdout)
    said, = answer["effects_missing"]
    assert "damping ratio" in said and "as with friction" in said
    end, rough, smooth = re.fullmatch(  # type: ignore[union-attr]
        r".*: its (\w+) damping ratio is ([\d.]+) .*move fast and ([\d.]+) .*move slowly.*", said).groups()
    value, error = (answer[key][f"{end}.damping_ratio"] for key in ("parameters", "standard_errors"))
    assert getattr(CAR, end)[1] < float(rough) < value < float(smooth)
    assert error > value * np.log(float(smooth) / float(rough))
    assert learned[0]["effects_missing"] == []


@pytest.mark.slow
def test_uneven_dampers_are_named_with_their_ratio(learned: tuple[dict[str, Any], Path, Path], tmp_path: Path) -> None:
    """By the harmonics of the wheels' hop, of forces that follow by equations of their own."""
    rng = np.random.default_rng(3)
    drives = [driven(replace(CAR, rebound=2.0), rng, 2 * SECONDS, mph * MPH, 2.0, 4.0, FINE_SENSOR)
              for mph in (20, 35, 60)]
    found = called("learn-car", *written(tmp_path, drives, FINE_SENSOR), "--wheelbase", 2.66, "--json")
    said, = json.loads(found.stdout)["effects_missing"]
    ratio, error = map(float, re.findall(r"[\d.]+", said)[:2])
    assert "dampers are asymmetric" in said and abs(ratio - 2.0) < 3 * error < 1.0
    assert learned[0]["effects_missing"] == []


@pytest.mark.slow
def test_two_cars_are_no_nonlinear_one_where_each_has_its_own_roads(tmp_path: Path) -> None:
    """One drives smooth roads only, the other rough ones only."""
    rng = np.random.default_rng(21)
    other = UnmeasuredCar(2.66, 0.4, (1.5, 0.4, 12.8, 0.1), (1.6, 0.35, 12.6, 0.12))
    drives = [driven(car, rng, 2 * SECONDS, mps, 2.0, iri) for car, iri in ((CAR, 0.8), (other, 10.0))
              for mps in (20 * MPH, 50 * MPH)]
    found = called("learn-car", *written(tmp_path, drives), "--wheelbase", 2.66)
    assert found.returncode == 1 and "not from the same car" in found.stderr


@pytest.mark.slow
def test_last_year_s_file_says_what_changed(learned: tuple[dict[str, Any], Path, Path], tmp_path: Path) -> None:
    worn = UnmeasuredCar(front=(1.25, 0.28, 11.6, 0.12), rear=(1.42, 0.13, 11.1, 0.14))
    found = called("learn-car", *written(tmp_path, mixed(worn, 6, 1.5 * SECONDS)), "--wheelbase", 2.66, "--compare",
                   learned[1], "--json")
    changes = json.loads(found.stdout)["changes"][0]
    assert "rear damping ratio -" in changes and "front" not in changes
    kept = json.loads(found.stdout)["kept_back"]
    assert kept["drives"] == 4 and kept["misfit_after"] < 1.2 < kept["misfit_before"]
    assert "rear damping ratio of 0.1" not in found.stdout  # worn, yet no worse than a tenth of critical


@pytest.mark.slow
def test_a_limp_damper_and_a_trailer_are_named(tmp_path: Path) -> None:
    """The trailer: an axle 4 m behind the rear one shakes the body by a third of what the rear one does."""
    limp = UnmeasuredCar(rear=(1.42, 0.05, 11.1, 0.14))
    found = called("learn-car", *written(tmp_path / "limp", mixed(limp, 7, 1.5 * SECONDS)), "--wheelbase", 2.66)
    assert found.returncode == 0, found.stderr
    assert "The rear damping ratio of 0.0" in found.stdout and "worn damper" in found.stdout
    towing = []
    for accel, speed in mixed(CAR, 9, 1.5 * SECONDS):
        at = np.arange(len(accel))
        towing.append((accel + 0.35 * np.interp(at - 400 / np.maximum(speed, 1.0), at, accel), speed))
    found = called("learn-car", *written(tmp_path / "towing", towing), "--wheelbase", 2.66)
    assert "a trailer" in found.stdout + found.stderr


def test_the_demo_writes_drives_and_says_what_to_type(tmp_path: Path) -> None:
    found = called("demo", "--car", "--unpack", "--out", tmp_path / "car")
    assert found.returncode == 0
    assert re.search(r"Next: ridelog learn-car \S+30kmh .* --wheelbase 2.39 --out \S+mycar.yaml", found.stdout)
    assert sorted(one.name for one in (tmp_path / "car").rglob("*.csv")) == 4 * ["drive.csv"]


@pytest.mark.slow
def test_the_demo_learns_its_car(tmp_path: Path) -> None:
    found = called("demo", "--car", "--out", tmp_path)
    assert found.returncode == 0, found.stderr
    rows = re.findall(r"^(?:front|rear)\.\w+ +([\d.]+) +([\d.]+)$", found.stdout, re.MULTILINE)
    assert len(rows) == 6 and all(abs(float(mine) / float(true) - 1) < 0.1 for true, mine in rows)
    assert (tmp_path / "mycar.html").exists()


def _logged(folder: Path, number: int, run: Path, vehicle: str = "generic", felt_mps2: float = 9.8) -> None:
    """A session's log whose sidecar keeps what the service keeps of a drive, as samples come."""
    drive = np.genfromtxt(run / "drive.csv", delimiter=",", names=True)
    keeper = SpectraKeeper(100.0, 2 * (0.147**2 + 0.153**2 / 12) / 100)
    for low in range(0, len(drive), 57):
        some = drive[low:low + 57]
        keeper.push(felt_mps2 + some["accel_z_mps2"], some["speed_mps"], np.ones(len(some), bool))
    keeper.break_off()
    log = SegmentLog(folder, number, {"vehicle": {"name": vehicle}}, 10**6,
                     more=lambda: {DRIVE_SPECTRA: keeper.fields()})
    log.append(ROW)
    log.close()


@pytest.mark.slow
def test_sidecars_of_logs_do_for_drives_and_a_vehicle_that_is_not_the_car_is_found_out(
        runs: list[Path], learned: tuple[dict[str, Any], Path, Path], tmp_path: Path) -> None:
    for number, run in enumerate(runs, 1):
        _logged(tmp_path, number, run, "rav4-2009" if number == 2 else "generic")
    assert max(path.stat().st_size for path in tmp_path.glob("*.json")) < 15_000
    found = called("learn-car", tmp_path, "--wheelbase", 2.68, "--json")
    assert found.returncode == 0, found.stderr
    answer, (dumps, *_) = json.loads(found.stdout), learned
    for name, value in answer["parameters"].items():  # steps of 1 dB and other edges of blocks move a number a little
        assert abs(value - dumps["parameters"][name]) < 0.7 * dumps["standard_errors"][name], name
    said, = answer["other_than_settings"]
    assert "do not fit rav4-2009" in said and "its IRI is" in said
    _logged(tmp_path, 5, runs[0], felt_mps2=0.4)
    refused = called("learn-car", tmp_path, "--wheelbase", 2.68)
    assert refused.returncode == 1 and "vertical_axis feels 0.04 g" in refused.stderr
    assert len(refused.stderr.splitlines()) == 1


@pytest.mark.slow
def test_vehicle_auto_is_what_the_box_learned_of_its_drives(runs: list[Path], tmp_path: Path) -> None:
    logs, settings, stick = tmp_path / "logs", tmp_path / "ridelog.yaml", tmp_path / "stick"
    logs.mkdir()
    settings.write_text(f"vehicle: auto\nwheelbase_m: 2.68\nlog: {{directory: {logs}}}\n")
    for number, run in enumerate(runs, 1):
        _logged(logs, number, run)
    assert load_config(settings).vehicle == vehicle_file("generic")
    assert called("run", "--learn-car", "--config", settings).returncode == 0
    config = load_config(settings)
    assert config.vehicle == logs / "car-00004.yaml"
    assert wiring.dump_header(config).vehicle == str(config.vehicle)  # which replay --vehicle reads
    assert wiring.car_of(config).vehicle.name == "learned-car"
    assert wiring.iri_share_std(wiring.car_of(config), wiring.instrument(config.accelerometer)) < 0.08
    assert called("run", "--learn-car", "--config", settings).stdout == "no new drives\n"
    stick.mkdir()
    called("export", "--to", stick, "--config", settings)
    assert [path.name for path in stick.rglob("car-*.yaml")] == ["car-00004.yaml"]
    settings.write_text(settings.read_text().replace("wheelbase_m: 2.68\n", ""))
    with pytest.raises(BadInput, match="vehicle: auto: expected wheelbase_m"):
        load_config(settings)


def test_a_learned_car_that_a_card_has_spoilt_is_passed_over(
        tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    settings = tmp_path / "ridelog.yaml"
    settings.write_text(f"vehicle: auto\nwheelbase_m: 2.68\nlog: {{directory: {tmp_path}}}\n")
    (tmp_path / "car-00009.yaml").write_bytes(bytes(512))
    assert load_config(settings).vehicle == vehicle_file("generic")
    whole = tmp_path / "car-00008.yaml"
    whole.write_bytes(vehicle_file("rav4-2009").read_bytes())
    assert load_config(settings).vehicle == whole
    assert caplog.messages and all("car-00009.yaml" in one for one in caplog.messages)


def test_logs_that_keep_nothing_or_what_cannot_be_are_refused_in_one_line(tmp_path: Path) -> None:
    for number, (kept, said) in enumerate((({}, "found none in 1 file:"), ({"form": 9}, "leave the log out"),
                                           ({"form": 1, "noise": 1e-4, "data": "AAAA"}, "leave the log out"))):
        folder = tmp_path / str(number)
        folder.mkdir()
        log = SegmentLog(folder, 1, {DRIVE_SPECTRA: kept} if kept else {}, 10**6)
        log.append(ROW)
        log.close()
        found = called("learn-car", folder, "--wheelbase", 2.66)
        assert found.returncode == 2 and said in found.stderr and len(found.stderr.splitlines()) == 1
