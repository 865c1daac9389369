"""``ridelog estimate`` on simulated runs, whose roads are known."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from logger.commands.main import main
from logger.errors import BadInput
from logger.estimation.batch import band_passed
from logger.profiles.track import Track
from logger.roads import iso8608
from logger.roads.iri import iri
from logger.runs import RecordFacts
from logger.shipped import vehicle_file
from logger.store.formats.drive_file import write_profile, write_run_facts
from logger.store.formats.profile_file import read_profile

from ..support.command import called

ROAD = Track(0.05, iso8608.generate(iso8608.gd_n0_from_iri(4.0), 800, 0.05, 12), 100.0)
CAR = "rav4-2009"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """800 m at 16 m/s."""
    path = tmp_path_factory.mktemp("run")
    write_profile(path / "profile.csv", ROAD)
    assert main(["simulate", "--vehicle", CAR, "--profile", str(path / "profile.csv"), "--speed", "16", "--noise",
                 "0.05", "--out", str(path / "drive.csv")]) == 0
    return path


def reported(capsys: pytest.CaptureFixture[str], run: Path, *arguments: object, car: Path | str = CAR
             ) -> dict[str, Any]:
    capsys.readouterr()
    assert main(["estimate", str(run), "--vehicle", str(car), "--json", *map(str, arguments)]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    result: dict[str, Any] = json.loads(out)
    return result


@pytest.fixture(scope="module")
def plain(folder: Path) -> dict[str, Any]:
    """What is reported of that run, not to be changed."""
    result: dict[str, Any] = json.loads(called("estimate", folder, "--vehicle", CAR, "--json").stdout)
    return result


OWN = """
import numpy as np
from logger.vehicle.effect import Parameter, RoadEffect, Scale

class Written(RoadEffect):
    name = title = source = signature = shown_by = "written_low"
    parameters = (Parameter("times", 2.0, 1.0, 10.0, 1.0, Scale.LINEAR, (2.0,), "how much higher the road is"),)

    def road(self, p, spacing_m, elevation_m):
        return p.times * elevation_m

EFFECT = Written()
"""


@pytest.mark.slow
def test_the_road_that_an_effect_makes_of_the_profile_is_compared_with(
    folder: Path, plain: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "written.py").write_text(OWN, "utf-8")
    car = tmp_path / "car.yaml"
    car.write_text(vehicle_file(CAR).read_text("utf-8").replace(
        "effects: []", "effects: [{name: written_low, file: written.py, times: 2}]"), "utf-8")
    write_profile(tmp_path / "profile.csv", Track(ROAD.spacing_m, ROAD.elevation_m / 2, ROAD.start_m))
    (tmp_path / "drive.csv").write_bytes((folder / "drive.csv").read_bytes())
    found = reported(capsys, tmp_path, car=car)
    exact, same = (np.array([one["iri_exact_m_per_km"] for one in each["windows"]], float) for each in (plain, found))
    np.testing.assert_allclose(same, exact, rtol=1e-3)
    assert found["comparison"]["bias"] == pytest.approx(plain["comparison"]["bias"], abs=1e-3)
    assert found["road_effects"] == ["written_low"] and "road_effects" not in plain
    assert main(["estimate", str(tmp_path), "--vehicle", str(car)]) == 0
    assert "Compared with the profile as changed by written_low in the vehicle's file." in capsys.readouterr().out


def read(run: Path) -> dict[str, np.ndarray]:
    names, *_ = (run / "drive.csv").read_text().split("\n", 1)
    table = np.loadtxt(run / "drive.csv", delimiter=",", skiprows=1)
    return dict(zip(names.split(","), table.T.copy(), strict=True))


def write(run: Path, columns: dict[str, np.ndarray]) -> Path:
    run.mkdir(exist_ok=True)
    np.savetxt(run / "drive.csv", np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns),
               comments="", fmt="%.8g")
    return run / "drive.csv"


def shortened(folder: Path, place: Path) -> Path:
    """The first 240 m of the drive."""
    return write(place, {name: column[:1500] for name, column in read(folder).items()})


def test_windows_beside_the_profile_and_the_limit(plain: dict[str, Any]) -> None:
    result = plain
    found, limit = result["comparison"], result["limit"]
    assert result["iri_m_per_km"] == pytest.approx(iri(ROAD.elevation_m, 0.05), rel=0.03)
    assert abs(found["bias"]) < 0.03
    assert found["r2"] == pytest.approx(found["limit_r2"], abs=0.06)
    assert 0.55 < found["within_one"] < 0.85
    assert found["within_two"] > 0.88
    assert limit["r2_this_road"] < limit["r2_iri_1_to_10"] < 1
    assert result["iri_std_m_per_km"] == pytest.approx(limit["std_m_per_km"], rel=0.15)
    assert result["compared"]
    first = result["windows"][0]
    assert first["distance_start_m"] == pytest.approx(14 * 7.62)  # the first whole one from 100 m on
    assert first["speed_mps"] == pytest.approx(16)
    assert sum(row["window_count"] for row in result["speeds"]) == result["window_count"] == len(result["windows"])
    assert [(row["from_mps"], row["to_mps"]) for row in result["speeds"]] == [(15, 20)]


@pytest.mark.slow
def test_the_estimated_profile_is_the_road_within_the_range_reported(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = reported(capsys, folder, "--profile-out", tmp_path / "road.csv")
    assert result["profile_files"] == [str(tmp_path / "road.csv")]
    profile = read_profile(tmp_path / "road.csv")
    x = profile.start_m + profile.spacing_m * np.arange(len(profile.elevation_m))
    inside = (x > 105) & (x < 895)
    road = np.interp(x[inside], 100 + 0.05 * np.arange(len(ROAD.elevation_m)), ROAD.elevation_m)
    shortest_m, longest_m = result["shortest_wavelength_m"], result["longest_wavelength_m"]
    assert shortest_m < 1
    assert longest_m > 40
    true = band_passed(road, profile.spacing_m, shortest_m, longest_m)
    middle = slice(round(longest_m / 2 / profile.spacing_m), -round(longest_m / 2 / profile.spacing_m))
    found = profile.elevation_m[inside][middle]
    assert np.corrcoef(found, true[middle])[0, 1] > 0.9
    assert np.std(found) == pytest.approx(np.std(true[middle]), rel=0.15)


def test_windows_as_csv(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = reported(capsys, shortened(folder, tmp_path), "--out", tmp_path / "windows.csv", "--window", "30.48")
    with (tmp_path / "windows.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(result["windows"])
    for row, window in zip(rows, result["windows"], strict=True):
        assert row["flags"] == "|".join(window.pop("flags"))
        assert list(row) == [*window, "flags"]
        for name, value in window.items():
            assert row[name] == "" if value is None else float(row[name]) == pytest.approx(value, rel=1e-6)
    assert float(rows[1]["distance_end_m"]) - float(rows[1]["distance_start_m"]) == pytest.approx(30.48)


def test_a_drive_alone_is_estimated_without_comparison(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    alone = shortened(folder, tmp_path)
    by_file, by_folder = reported(capsys, alone), reported(capsys, tmp_path)
    (tmp_path / "profile.csv").write_bytes((folder / "profile.csv").read_bytes())
    with_road = reported(capsys, tmp_path)
    assert with_road["compared"] and len(by_file["windows"]) > 20
    assert not by_file["compared"]
    assert "comparison" not in by_file
    assert "iri_exact_m_per_km" not in by_file["windows"][0]
    for result in (by_file, by_folder):
        assert [w["iri_m_per_km"] for w in result["windows"]] == [w["iri_m_per_km"] for w in with_road["windows"]]


@pytest.mark.slow
def test_another_rate(tmp_path: Path, folder: Path, plain: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "profile.csv").write_bytes((folder / "profile.csv").read_bytes())
    assert main(["simulate", "--vehicle", CAR, "--profile", str(folder / "profile.csv"), "--speed", "16", "--noise",
                 "0.07", "--rate", "208", "--out", str(tmp_path / "drive.csv")]) == 0
    result = reported(capsys, tmp_path, "--noise", "0.07")
    assert result["rate_hz"] == pytest.approx(208)
    assert result["comparison"]["r2"] == pytest.approx(result["comparison"]["limit_r2"], abs=0.06)
    assert abs(result["comparison"]["bias"]) < 0.03
    assert result["limit"]["std_m_per_km"] == pytest.approx(plain["limit"]["std_m_per_km"], rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "step", "rate"), [
    (0.11, 0.0, 100), pytest.param(0.2, 0.613, 100, marks=pytest.mark.slow),
    pytest.param(0.15, 0.0, 208, marks=pytest.mark.slow)])
def test_the_noise_is_learned_from_the_drive(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], noise: float, step: float, rate: int
) -> None:
    assert main(["simulate", "--vehicle", CAR, "--profile", str(folder / "profile.csv"), "--speed", "16", "--noise",
                 f"{noise}", "--step", f"{step}", "--rate", f"{rate}", "--out", str(tmp_path / "drive.csv")]) == 0
    (tmp_path / "profile.csv").write_bytes((folder / "profile.csv").read_bytes())
    result = reported(capsys, tmp_path, "--step", step)
    assert abs(result["noise_mps2"] - noise) < 2.5 * result["noise_std_mps2"]
    assert 0.02 * noise < result["noise_std_mps2"] < 0.2 * noise
    taken = reported(capsys, tmp_path, "--step", step, "--noise", 0.05)
    assert taken["noise_mps2"] == 0.05 and taken["noise_std_mps2"] is None
    assert result["comparison"]["r2"] > taken["comparison"]["r2"] - 0.01
    assert main(["estimate", str(tmp_path), "--vehicle", CAR, "--step", str(step)]) == 0
    lines = capsys.readouterr().out.splitlines()
    at = lines.index(f"Learned from the drive: noise of {result['noise_mps2']:.3g} ± "
                     f"{result['noise_std_mps2']:.1g} m/s2 in a reading")
    assert lines[at + 1].startswith("Assumed: ")


@pytest.mark.slow
def test_the_noise_of_a_run_is_what_its_facts_say(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                                 ) -> None:
    for name in ("drive.csv", "profile.csv"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    write_run_facts(tmp_path, RecordFacts(noise_mps2=0.08))
    said = reported(capsys, tmp_path)
    assert (said["noise_mps2"], said["noise_std_mps2"], said["noise_learned"]) == (0.08, None, None)
    assert reported(capsys, tmp_path, "--noise", "auto")["noise_learned"]
    assert reported(capsys, tmp_path, "--noise", "0.06")["noise_mps2"] == 0.06


@pytest.mark.slow
def test_the_step_of_a_run_is_what_its_facts_say(folder: Path, plain: dict[str, Any], tmp_path: Path,
                                                 capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("drive.csv", "profile.csv"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    write_run_facts(tmp_path, RecordFacts(step_mps2=0.613))
    assert reported(capsys, tmp_path)["step_mps2"] == 0.613
    assert reported(capsys, tmp_path, "--step", 0.0)["step_mps2"] == 0.0
    assert reported(capsys, tmp_path, "--resample", "100")["step_mps2"] == 0.0  # laid on other times
    assert plain["step_mps2"] == 0.0


@pytest.mark.parametrize("step", [0.0, 0.03, 0.613])
def test_a_drive_that_tells_nothing_of_the_noise_says_so(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], step: float
) -> None:
    columns = read(folder)
    columns["speed_mps"] *= 0.0
    columns["distance_m"] *= 0.0
    columns["accel_z_mps2"] = np.random.default_rng(1).normal(0, 0.5, len(columns["t_s"]))
    write(tmp_path, columns)
    result = reported(capsys, tmp_path, "--step", step)
    assert (result["noise_learned"], result["noise_std_mps2"], result["noise_mps2"]) == (False, None, 0.05)
    assert main(["estimate", str(tmp_path), "--vehicle", CAR, "--noise", "auto", "--step", str(step)]) == 0
    assert "This drive does not show the sensor's noise. Assumed: 0.05 m/s2" in capsys.readouterr().out


@pytest.mark.slow
def test_a_distance_that_goes_back_a_little_is_computed_from_the_speed(
    folder: Path, plain: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = read(folder)
    columns["distance_m"] += 0.3 * (columns["t_s"].astype(int) % 2)
    write(tmp_path, columns)
    (tmp_path / "profile.csv").write_bytes((folder / "profile.csv").read_bytes())
    result = reported(capsys, tmp_path)
    assert result["distance_moved_m"] == pytest.approx(0.15, abs=0.03)
    assert result["comparison"]["r2"] > plain["comparison"]["r2"] - 0.08


def test_the_screen_says_what_was_assumed_and_what_is_possible(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = reported(capsys, folder, "--noise", 0.05)
    done = called("estimate", folder, "--vehicle", vehicle_file(CAR), "--noise", 0.05, "--profile-out",
                  tmp_path / "p.csv")
    assert (done.returncode, done.stderr) == (0, f"Wrote {tmp_path / 'p.csv'}\n")
    assert "noise of 0.05 m/s2 in a reading (--noise), not rounded (--step)" in done.stdout
    assert f"IRI {result['iri_m_per_km']:.2f} m/km on average" in done.stdout
    assert f"R2 {result['limit']['r2_iri_1_to_10']:.3f} over roads of IRI 1 to 10" in done.stdout
    assert f"standard error {result['limit']['std_m_per_km']:.2f} m/km at 16 m/s" in done.stdout
    assert f"{result['comparison']['r2']:.3f}" in done.stdout
    assert f"Profile: {tmp_path / 'p.csv'}" in done.stdout
    assert max(map(len, done.stdout.splitlines())) < 170


def test_more_in_the_readings_than_is_explained_is_said(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = read(folder)
    columns["accel_z_mps2"] += 0.4 * np.random.default_rng(3).standard_normal(len(columns["t_s"]))
    drive = write(tmp_path, columns)
    assert main(["estimate", str(drive), "--vehicle", CAR, "--noise", "0.05"]) == 0
    assert "readings that vehicle and noise do not explain" in capsys.readouterr().out


@pytest.mark.parametrize("speed_mps", [0.0, 5.0])
def test_a_drive_without_a_window(speed_mps: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    t = np.arange(100) / 100
    drive = write(tmp_path, {"t_s": t, "accel_z_mps2": 0.1 * np.sin(9 * t), "speed_mps": 0 * t + speed_mps,
                             "distance_m": speed_mps * t})
    result = reported(capsys, drive)
    assert (result["window_count"], result["answered_count"], result["windows"]) == (0, 0, [])
    assert main(["estimate", str(drive), "--vehicle", CAR, "--out", str(tmp_path / "w.csv")]) == 0
    assert "No IRI: the drive is shorter than one window" in capsys.readouterr().out


def test_a_short_drive_has_windows_without_a_profile(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """96 m."""
    drive = write(tmp_path, {name: column[:600] for name, column in read(folder).items()})
    road, windows = tmp_path / "p.csv", tmp_path / "w.csv"
    asked = ["estimate", str(drive), "--vehicle", CAR, "--profile-out", str(road), "--out", str(windows)]
    assert main(asked) == 0
    out, err = capsys.readouterr()
    assert any(line.startswith("IRI ") for line in out.splitlines())
    why = (f"ridelog: {drive}: No profile in {road}: no stretch is longer than the longest wavelength that the "
           "readings resolve")
    assert err.startswith(why)
    assert windows.read_text().count("\n") > 10
    assert main([*asked, "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["profile_files"] == []
    assert err == f"{why}\nWrote {windows}\n"
    assert not road.exists()


def test_no_file_is_written_over_another(folder: Path, tmp_path: Path) -> None:
    """The folder's files reached by name, by way of another folder, and by a link; parts of a profile too."""
    run, car = tmp_path / "run", tmp_path / "car.yaml"
    run.mkdir()
    for name in ("drive.csv", "profile.csv"):
        (run / name).write_bytes((folder / name).read_bytes())
    car.write_bytes(vehicle_file(CAR).read_bytes())
    (run / "p-2.csv").symlink_to(run / "drive.csv")
    (run / "drive-3.csv").write_bytes((run / "drive.csv").read_bytes())
    before = {path: path.read_bytes() for path in (car, *run.iterdir())}
    new = tmp_path / "new.csv"
    for arguments in (("--out", run / "drive.csv"), ("--profile-out", run / "profile.csv"), ("--out", car),
                      ("--profile-out", run / ".." / "run" / "drive.csv"), ("--out", run / "p-2.csv"),
                      ("--out", new, "--profile-out", tmp_path / "run" / ".." / "new.csv")):
        expected = ("a different file each time",) if new in arguments else (
            "a file other than the input", "a file that does not belong to a run")
        complaints = [f"{arguments[-2]} {arguments[-1]}: expected {words}" for words in expected]
        assert refusal(run, *map(str, arguments), car=str(car)) in complaints
    for start, *arguments in ((run, "--profile-out", run / "p.csv"),
                              (run / "drive-3.csv", "--profile-out", run / "drive.csv"),
                              (run, "--out", tmp_path / "new-12.csv", "--profile-out", new)):
        assert "its parts could overwrite" in refusal(start, *map(str, arguments))
    assert {path: path.read_bytes() for path in (car, *run.iterdir())} == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["car.yaml", "run"]


@pytest.mark.parametrize(("factor", "words"), [(3.6, "3.6"), (0.85, "0.85"), (1.15, "1.15")])
def test_a_speed_that_does_not_go_with_the_distance(
    folder: Path, tmp_path: Path, factor: float, words: str
) -> None:
    columns = read(folder)
    way_m = columns["distance_m"][-1] - columns["distance_m"][0]
    drive = write(tmp_path, columns | {"speed_mps": columns["speed_mps"] * factor})
    assert refusal(drive) == (
        f"{drive}: expected speed_mps and distance_m to agree within 10%, found {way_m * factor:.4g} m by speed_mps, "
        f"{words} times the {way_m:.4g} m of distance_m (km/h would give 3.6)")
    standing = write(tmp_path, columns | {"distance_m": 0 * columns["distance_m"]})
    assert "infinitely many times the 0 m of distance_m" in refusal(standing)


@pytest.mark.slow
def test_readings_that_may_be_in_g_are_said_to_be(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = read(folder)
    in_g = columns["accel_z_mps2"] / 9.80665
    rms = in_g.std()
    hints = {}
    drive = write(tmp_path, columns | {"accel_z_mps2": 1 + in_g})
    with pytest.raises(BadInput, match=r"drive\.csv: expected accelerations in m/s2, found a mean of 1\.000.*--unit g"):
        main(["estimate", str(drive), "--vehicle", CAR])
    for name, readings, noise in (("m/s2", columns["accel_z_mps2"], 0.05), ("nearly gravity", 1.06 + in_g, 0.05),
                                  ("little", in_g, 1.05 * rms), ("enough", in_g, 0.95 * rms)):
        drive = write(tmp_path, columns | {"accel_z_mps2": readings})
        capsys.readouterr()
        assert main(["estimate", str(drive), "--vehicle", CAR, "--noise", f"{noise:.4f}"]) == 0
        hints[name] = [line for line in capsys.readouterr().out.splitlines() if "in g?" in line]
    assert hints["m/s2"] == hints["enough"] == []
    assert hints["nearly gravity"][0].startswith("Acceleration in g? While driving it is 1.06 on average and ")
    assert hints["little"][0].endswith(f"less than the noise of {1.05 * rms:.4f} (--noise).")
    drive = write(tmp_path, columns | {"accel_z_mps2": 0.04 / rms * in_g})
    assert main(["estimate", str(drive), "--vehicle", CAR]) == 0
    assert "0.04 r.m.s., less than the noise of 0.05 that sensors have." in capsys.readouterr().out


@pytest.mark.slow
def test_a_road_without_any_roughness_in_places_has_a_limit_all_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", "--vehicle", CAR, "--profile", "400", "--obstacle",
                 "bump:start_m=200,height_m=0.08,width_m=3.6", "--speed", "16", "--noise", "0.05", "--out",
                 str(tmp_path / "drive.csv"), "--out", str(tmp_path / "profile.csv")]) == 0
    result = reported(capsys, tmp_path)
    on_profile = [window for window in result["windows"] if window["iri_exact_m_per_km"] is not None]
    assert min(window["iri_exact_m_per_km"] for window in on_profile) == pytest.approx(0, abs=1e-3)
    assert min(window["limit_std_m_per_km"] for window in on_profile) > 0


def refusal(run: Path, *arguments: str, car: str = CAR) -> str:
    with pytest.raises(BadInput) as refused:
        main(["estimate", str(run), "--vehicle", car, *arguments])
    return str(refused.value)


def test_files_that_will_not_do(folder: Path, tmp_path: Path) -> None:
    good = {name: column[:2000] for name, column in read(folder).items()}
    drive = tmp_path / "drive.csv"

    def refused(**changed: np.ndarray) -> str:
        write(tmp_path, good | changed)
        return refusal(tmp_path).removeprefix(str(drive))

    back, jump, fast, wild = (good[name].copy() for name in ("distance_m", "distance_m", "speed_mps", "accel_z_mps2"))
    back[700:] -= 3.0
    jump[700:] += 9.0
    fast[10], wild[20] = 151.0, 2e6
    assert refused(distance_m=back) == (f":702: expected a distance no more than 1 m below the largest so "
                                        f"far, {back[699]:.10g} m, found {back[700]:.10g}")
    assert refused(distance_m=jump) == (f":702: expected a distance at most 2.5 m after {jump[699]:.10g} m, "
                                        f"found {jump[700]:.10g}")
    assert refused(speed_mps=fast) == ":12: expected speed_mps within 150 m/s, found 151"
    assert refused(accel_z_mps2=wild) == ":22: expected accel_z_mps2 within 1e6 m/s2, found 2e+06"
    assert refused(t_s=good["t_s"] * 100 / 79) == ": expected at least 80 samples a second, found 79"
    drive.write_text("t_s,accel_z_mps2,speed_mps\n0,0,0\n")
    assert refusal(tmp_path).startswith(f"{drive}:1: expected a header with t_s,accel_z_mps2,speed_mps,distance_m")
    drive.write_text("t_s,accel_z_mps2,speed_mps,distance_m\n0,0,0,0\n")
    assert refusal(tmp_path) == f"{drive}:3: expected at least two samples, found the end of the file"
    assert "expected a readable file" in refusal(tmp_path / "nothing")
    write(tmp_path, good)
    (tmp_path / "profile.csv").write_text("distance_m,elevation_m\n0,0\n0.5,x\n")
    assert refusal(tmp_path).startswith(f"{tmp_path / 'profile.csv'}:3: expected a number")


@pytest.mark.parametrize(("arguments", "complaint"), [
    (("--noise", "0"), "--noise 0: expected auto, or 0.0001 to 100 m/s2"),
    (("--step", "-1"), "--step -1: expected 0 to 100 m/s2"),
    (("--window", "nan"), "--window nan: expected 1 to 1000 m"),
])
def test_wrong_use_is_one_line(folder: Path, arguments: tuple[str, ...], complaint: str) -> None:
    assert refusal(folder, *arguments).startswith(complaint)
    assert refusal(folder, car="rav5").startswith("no vehicle 'rav5' comes with ridelog")
