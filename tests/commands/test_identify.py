"""``ridelog identify``: numbers with their errors, a vehicle that can be read back, refusals, and one line else."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import ridelog
from logger.commands.main import main
from logger.errors import BadInput
from logger.identification.identifiability import NotIdentifiable
from logger.shipped import vehicle_file
from logger.simulation.virtual_drive import SimulatedRuns
from logger.store.formats.drive_file import write_drive, write_profile
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import CarModel, read_model, read_vehicle, write_model
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen
from logger.vehicle.vehicle import Vehicle

from ..support.drives.bumps import bump_record, road_record

Array = npt.NDArray[np.float64]

CAR = read_vehicle(vehicle_file("rav4-2009"))
MASS, DAMPERS = "sprung_mass_kg", "both.suspension_damping_n_s_per_m"
FRICTION = "dry_friction.friction_force_n"


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Two drives over bumps, from 12 m before them."""
    folders = []
    for seed, height_m in enumerate((0.15, 0.10)):
        folder = tmp_path_factory.mktemp(f"run{seed}")
        record = bump_record(CAR, 8.0, seed=seed, height_m=height_m, start_m=12.0)
        write_drive(folder / "drive.csv", {"t_s": record.time_s, "accel_z_mps2": record.measured_mps2,
                                           "speed_mps": record.speed_mps, "distance_m": record.distance_m})
        write_profile(folder / "profile.csv", record.track)
        folders.append(str(folder))
    return folders


def identify(runs: list[str], free: str, *more: str, vehicle: str = "rav4-2009") -> int:
    return main(["identify", *runs, "--vehicle", vehicle, "--free", free, *more])


def car_of(folder: Path, mass: str, dampers: str = "1776") -> str:
    """A file of the car with another mass and other dampers in it."""
    file = folder / "car.yaml"
    file.write_text(re.sub(r"(?m)^(sprung_mass_kg:) [\d.]+", rf"\1 {mass}", vehicle_file("rav4-2009").read_text(
        "utf-8")).replace("1776", dampers), "utf-8")
    return str(file)


def test_for_a_program(runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "fitted.yaml"
    assert identify(runs, f"{MASS},{DAMPERS}", "--json", "--out", str(out), vehicle=car_of(tmp_path, "700")) == 0
    reported = json.loads(capsys.readouterr().out)
    assert {"parameters", "standard_errors", "error_before", "error_after", "converged"} <= reported.keys()
    assert reported["converged"] is True
    for name, truth in ((MASS, 875), (DAMPERS, 1776)):
        assert reported["parameters"][name] == pytest.approx(truth, abs=4 * reported["standard_errors"][name])
    assert reported["error_after"] < 0.1 < reported["error_before"]
    assert reported["residuals_white_p_value"] > 0.001
    assert reported["residuals_free_of_road_p_value"] > 0.001
    written = read_vehicle(out)
    assert written.sprung_mass_kg == reported["parameters"][MASS]
    assert written.rear is not None
    assert written.front.suspension_damping_n_s_per_m == written.rear.suspension_damping_n_s_per_m
    assert f"# {MASS}: " in out.read_text("utf-8")


def test_for_a_person(runs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert identify(runs, f"{MASS},{DAMPERS}", "--noise", "white") == 0
    text = capsys.readouterr().out
    for words in ("Converged in", "95 % interval", "std. error", MASS, "as white noise of 0.0",
                  "These runs determine every free parameter.", "Best determined combination:"):
        assert words in text
    several = repr(ridelog.identify("rav4-2009", runs, [MASS, DAMPERS], tries=2, low_pass_hz=20.0))
    assert "3 of 3 starts" in several and "below 20 Hz" in several


def test_a_model_that_lacks_something(runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(vehicle_file("rav4-2009").read_text("utf-8").replace("1776", "900"), "utf-8")
    assert main(["identify", *runs, "--vehicle", str(wrong), "--free", MASS, "--noise", "white"]) == 0
    text = capsys.readouterr().out
    assert "yes, the model lacks an effect" in text
    assert "the standard errors are a guide only" in text


def test_what_the_runs_cannot_tell(runs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(NotIdentifiable, match="pitch_inertia_kg_m2") as caught:
        identify(runs, f"{MASS},pitch_inertia_kg_m2")
    assert caught.value.exit_status == 1
    assert identify(runs, "pitch_inertia_kg_m2", "--json") == 1
    printed = capsys.readouterr()
    reported = json.loads(printed.out)
    assert (reported["parameters"], reported["converged"], reported["error_after"]) == ({}, False, None)
    assert "pitch_inertia_kg_m2" in reported["cannot_tell"][0]
    assert printed.err.count("\n") == 1


def other_run(run: str, folder: Path, change: Callable[[Array], Array]) -> str:
    """A run with other readings, samples (n,) of them being given."""
    drive = np.genfromtxt(Path(run) / "drive.csv", delimiter=",", names=True)
    columns = {name: drive[name] for name in drive.dtype.names}
    folder.mkdir(exist_ok=True)
    write_drive(folder / "drive.csv", {**columns, "accel_z_mps2": change(columns["accel_z_mps2"])})
    (folder / "profile.csv").write_bytes((Path(run) / "profile.csv").read_bytes())
    return str(folder)


@pytest.mark.parametrize(("change", "message"), [
    (lambda z: 0 * z, "expected accelerations after the first 2 s, found zeros only"),
    (lambda z: 0 * z - 0.4, "expected accelerations after the first 2 s, found -0.4 m/s2 throughout"),
    (lambda z: np.repeat(np.round(z[::3], 3), 3)[: len(z)], "expected every sample to be a new measurement, found "
                                                            "6[0-9]%"),
    (lambda z: z + 9.81, "expected gravity to be removed, found 9.8[0-9] m/s2 on average"),
    (lambda z: -z - 9.81, "expected gravity to be removed, found -9.8[0-9] m/s2 on average"),
])
def test_readings_that_are_none(runs: list[str], tmp_path: Path, change: Callable[[Array], Array],
                                message: str) -> None:
    with pytest.raises(BadInput, match=f"{tmp_path.name}/bad/drive.csv: {message}"):
        identify([runs[0], other_run(runs[1], tmp_path / "bad", change)], MASS)


def test_another_road_than_the_one_that_was_driven(runs: list[str], tmp_path: Path,
                                                   capsys: pytest.CaptureFixture[str]) -> None:
    other = other_run(runs[0], tmp_path / "other", np.array)
    write_profile(tmp_path / "other" / "profile.csv", road_record(CAR, 10.0, 4.0, 2, gd_n0_cm3=4000.0).track)
    assert identify([other], MASS, "--json") == 1
    reported = json.loads(capsys.readouterr().out)
    assert (reported["parameters"], reported["converged"]) == ({}, False)
    assert "explains nothing of what was measured" in reported["cannot_tell"][0]


@pytest.mark.parametrize("more", [
    (), pytest.param(("--obstacle", "bump:height_m=0.15,width_m=2.6"), marks=pytest.mark.slow)])
def test_a_sensor_upside_down(runs: list[str], tmp_path: Path, more: tuple[str, ...]) -> None:
    run = other_run(runs[0], tmp_path / "turned", np.negative)
    place = ",bump.start_m,speed_scale" if more else ""
    with pytest.raises(NotIdentifiable, match="the acceleration seems upside down"):
        identify([f"{run}/drive.csv" if more else run], f"{MASS},{DAMPERS}{place}", *more)
    assert identify([f"{runs[0]}/drive.csv" if more else runs[0]], f"{MASS},{DAMPERS}{place}", *more) == 0


def test_what_speaks_against_an_estimate_is_reported(runs: list[str], tmp_path: Path,
                                                 capsys: pytest.CaptureFixture[str]) -> None:
    wrong = car_of(tmp_path, "[600, 700]", dampers="900")
    assert identify(runs, MASS, "--noise", "white", "--json", vehicle=wrong) == 0
    reported = json.loads(capsys.readouterr().out)["cannot_tell"]
    assert len(reported) == 3
    expected = (f"{MASS} ended at a bound", "are not white", "follow the input")
    for words, found in zip(expected, reported, strict=True):
        assert words in found
    assert identify(runs, MASS, "--noise", "white", vehicle=car_of(tmp_path, "[600, 700]")) == 0
    assert "all that was asked" not in capsys.readouterr().out
    assert identify(runs, MASS, "--json") == 0
    assert json.loads(capsys.readouterr().out)["cannot_tell"] == []


def test_a_simulation_without_noise(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    road = tmp_path / "profile.csv"
    assert main(["road", "generate", "--class", "C", "--length", "200", "--seed", "1", "--out", str(road)]) == 0
    assert main(["simulate", "--vehicle", "rav4-2009", "--profile", str(road), "--speed", "14", "--out",
                 str(tmp_path / "drive.csv")]) == 0
    capsys.readouterr()
    assert identify([str(tmp_path)], f"{MASS},{DAMPERS}", "--json", vehicle=car_of(tmp_path, "700")) == 0
    reported = json.loads(capsys.readouterr().out)
    assert (reported["converged"], reported["cannot_tell"]) == (True, [])
    assert [reported["parameters"][name] for name in (MASS, DAMPERS)] == pytest.approx([875, 1776], rel=1e-6)


@pytest.mark.slow
def test_a_bump_of_which_only_the_kind_is_known(runs: list[str], tmp_path: Path,
                                                capsys: pytest.CaptureFixture[str]) -> None:
    drives = []
    for run in runs:
        drives.append(tmp_path / f"drive{len(drives)}.csv")
        drives[-1].write_bytes((Path(run) / "drive.csv").read_bytes())
    files = [str(path) for path in drives]
    assert identify(files, f"{MASS},each.bump.height_m", "--obstacle", "bump:height_m=0.13,width_m=2.6",
                    "--json") == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["converged"] is True
    for name, truth in ((MASS, 875), ("run1.bump.height_m", 0.15), ("run2.bump.height_m", 0.10),
                        ("run1.bump.start_m", 12.0), ("run2.bump.start_m", 12.0)):
        assert reported["parameters"][name] == pytest.approx(truth, abs=4 * reported["standard_errors"][name])
    assert reported["bounds"]["run2.bump.height_m"] == pytest.approx([0.0065, 1.0])
    assert identify(files[:1], "step.height_m", "--obstacle", "step:start_m=12,height_m=0.1", "--noise", "white") == 0
    assert "yes, the model lacks an effect" in capsys.readouterr().out


def rubbing_vehicle(folder: Path, friction_n: float, car: Vehicle = CAR) -> str:
    """The car with dry friction, as a file."""
    file = folder / "rubbing.yaml"
    write_model(file, CarModel(car, (chosen(shipped_effects()["dry_friction"], {"friction_force_n": friction_n}),)))
    return str(file)


@pytest.fixture(scope="module")
def rubbing_run(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A drive of a car with 90 N of friction over a good road."""
    folder = tmp_path_factory.mktemp("rubbing")
    run = road_record(CAR, 15.0, 12.0, 1, gd_n0_cm3=16.0)
    car = compose(CAR, (chosen(shipped_effects()["dry_friction"], {"friction_force_n": 90.0}),))
    noise = 0.05 * np.random.default_rng(1).standard_normal(run.count)
    write_drive(folder / "drive.csv", {"t_s": run.time_s, "accel_z_mps2": SimulatedRuns([run]).predict(car)[0] + noise,
                                       "speed_mps": run.speed_mps, "distance_m": run.distance_m})
    write_profile(folder / "profile.csv", run.track)
    return str(folder)


@pytest.mark.slow
def test_the_number_of_an_effect_beside_one_of_the_car(rubbing_run: str, tmp_path: Path,
                                                       capsys: pytest.CaptureFixture[str]) -> None:
    vehicle, out = rubbing_vehicle(tmp_path, 50.0, replace(CAR, sprung_mass_kg=820.0)), tmp_path / "fitted.yaml"
    asked = ["identify", rubbing_run, "--vehicle", vehicle, "--free", f"{MASS},{FRICTION}"]
    assert main([*asked, "--json", "--out", str(out)]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert (reported["converged"], reported["cannot_tell"]) == (True, [])
    for name, truth in ((MASS, 875), (FRICTION, 90)):
        assert reported["parameters"][name] == pytest.approx(truth, abs=3 * reported["standard_errors"][name])
    assert (reported["start"][FRICTION], reported["bounds"][FRICTION]) == (50.0, [0.0, 2000.0])
    written = read_model(out)
    (friction,) = written.effects
    assert written.vehicle.sprung_mass_kg == reported["parameters"][MASS]
    assert friction.values["friction_force_n"] == reported["parameters"][FRICTION]
    assert friction.standard_errors["friction_force_n"] == reported["standard_errors"][FRICTION]
    assert main(asked) == 0
    text = capsys.readouterr().out
    assert f"{FRICTION} " in text
    assert "starts end at the same values" in text
    assert "These runs determine every free parameter." in text


@pytest.mark.parametrize(("free", "more", "message"), [
    (f"{MASS},payload.mass_kg", (), "has dry_friction; add it with 'ridelog add-effect payload --vehicle"),
    ("dry_friction.force_n", (), "expected dry_friction.friction_force_n, dry_friction.transition_velocity"),
    (MASS, ("--unmeasured-road",), "a car without effects where the road was not measured, found dry_friction"),
])
def test_effects_that_cannot_be_found_are_one_line(rubbing_run: str, tmp_path: Path, free: str, more: tuple[str, ...],
                                                   message: str) -> None:
    with pytest.raises(BadInput, match=message):
        main(["identify", rubbing_run, "--vehicle", rubbing_vehicle(tmp_path, 50.0), "--free", free, *more])


def test_an_effect_that_the_car_lacks_is_one_line(runs: list[str]) -> None:
    with pytest.raises(BadInput, match="rav4-2009 has none; add it with 'ridelog add-effect dry_friction"):
        identify(runs, FRICTION)


@pytest.mark.slow
def test_roads_that_were_not_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = []
    for speed_mps in (10.0, 17.0):
        record = road_record(CAR, 120.0 / speed_mps, speed_mps, 3, swing_mps=0.5)
        files.append(str(tmp_path / f"{speed_mps:g}.csv"))
        write_drive(Path(files[-1]), {"t_s": record.time_s, "accel_z_mps2": record.measured_mps2,
                                      "speed_mps": record.speed_mps, "distance_m": record.distance_m})
    out = tmp_path / "fitted.yaml"
    assert identify(files, f"{MASS},road.waviness", "--same-road", "--json", "--out", str(out),
                    vehicle=car_of(tmp_path, "800")) == 0
    reported = json.loads(capsys.readouterr().out)
    assert {"parameters", "standard_errors", "error_before", "error_after", "converged"} <= reported.keys()
    assert reported["parameters"][MASS] == pytest.approx(875, abs=4 * reported["standard_errors"][MASS])
    assert reported["road"]["road1.gd_n0_cm3"] == pytest.approx(64, rel=0.6)
    assert read_vehicle(out).sprung_mass_kg == reported["parameters"][MASS]
    assert identify(files[:1], MASS, "--unmeasured-road") == 0
    text = capsys.readouterr().out
    for words in ("Converged in", "road1.gd_n0_cm3", "noise_mps2", "to be one of ISO 8608", "Poorly determined"):
        assert words in text
    assert identify(files[:1], "pitch_inertia_kg_m2", "--unmeasured-road", "--json") == 1
    assert "pitch_inertia_kg_m2" in json.loads(capsys.readouterr().out)["cannot_tell"][0]
    with pytest.raises(NotIdentifiable):
        identify(files[:1], "pitch_inertia_kg_m2", "--unmeasured-road")


@pytest.mark.parametrize(("free", "more", "message"), [
    (MASS, ("--unmeasured-road", "--obstacle", "bump:height_m=0.1,width_m=2"),
     "--obstacle: expected a road whose profile is known"),
    (MASS, ("--same-road", "--noise", "ar"), "--noise: expected a road whose profile is known"),
    (MASS, ("--same-road", "--unmeasured-road"), "--unmeasured-road: expected no --same-road with it"),
    ("contact_patch_m", ("--unmeasured-road",), "cannot be found where the road is not known"),
    ("road.waviness", ("--unmeasured-road",), "expected names with commas"),
    (MASS, ("--obstacle", "bump:start_m=5,height_m=0.1"),
     r"--obstacle bump:start_m=5,height_m=0.1: expected \[start_m=M,\]height_m=M,width_m=M"),
    (MASS, ("--obstacle", "step:height=0.1"), r"expected \[start_m=M,\]height_m=M"),
    (MASS, ("--obstacle", "step:start_m=5,height_m=0"), "expected a height other than 0"),
    ("bump.height_m", (), "give it a bump or a step first"),
    ("run3.speed_scale", (), "there are 2 runs"),
    (f"each.{MASS}", (), "expected a parameter of the road after each."),
    ("mass", (), "no parameter 'mass'; expected one of sprung_mass_kg"),
    ("", (), "expected names with commas"),
    ("front.tire_stiffness_n_per_m,both.tire_stiffness_n_per_m", (), "expected every parameter once"),
    (MASS, ("--obstacle", "hole:depth_m=1"), "hole: expected bump or step"),
])
def test_wrong_use_is_one_line(runs: list[str], free: str, more: tuple[str, ...], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        identify(runs, free, *more)


def test_both_axles_stay_within_the_ranges_that_the_file_gives_of_them(
        runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert identify(runs[:1], DAMPERS, "--json", vehicle=car_of(tmp_path, "875", dampers="[1500, 1700]")) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["bounds"][DAMPERS] == [1500, 1700] and reported["at_bound"] == [DAMPERS]


def test_a_run_that_was_given_twice(runs: list[str]) -> None:
    with pytest.raises(BadInput, match="expected every run once, found it twice"):
        identify([runs[0], runs[1], f"{runs[0]}/."], MASS)


def test_a_car_that_stands(runs: list[str], tmp_path: Path) -> None:
    t_s = np.arange(800) / 100
    write_drive(tmp_path / "still.csv", {"t_s": t_s, "accel_z_mps2": np.sin(t_s), "speed_mps": 0 * t_s,
                                         "distance_m": 0 * t_s})
    with pytest.raises(BadInput, match="--obstacle bump: expected a drive over it, found a car that stands"):
        identify([str(tmp_path / "still.csv")], MASS, "--obstacle", "bump:height_m=0.1,width_m=2")


def test_a_run_too_short_for_the_low_pass_is_the_one_named(runs: list[str], tmp_path: Path) -> None:
    record = bump_record(CAR, 2.6)
    write_drive(tmp_path / "short.csv", {"t_s": record.time_s, "accel_z_mps2": record.measured_mps2,
                                         "speed_mps": record.speed_mps, "distance_m": record.distance_m})
    bump = {"start_m": 2.0, "height_m": 0.1, "width_m": 2.0}
    asked = {"vehicle": "rav4-2009", "free": [MASS], "obstacles": {"bump": bump}}
    with pytest.raises(BadInput, match=r"short.csv: expected more than [0-9]+ samples for a low pass of 2 Hz"):
        ridelog.identify(runs=[f"{runs[0]}/drive.csv", tmp_path / "short.csv"], low_pass_hz=2.0, **asked)
    for wrong, said in (({"low_pass_hz": 70.0}, "below 50 Hz"), ({"tries": -1}, "expected 0 to 1000")):
        with pytest.raises(BadInput, match=said):
            ridelog.identify(runs=runs[:1], **asked, **wrong)


def test_runs_of_different_rates(runs: list[str], tmp_path: Path) -> None:
    time_s = np.arange(400) / 50
    write_drive(tmp_path / "drive.csv", {"t_s": time_s, "accel_z_mps2": np.sin(time_s), "speed_mps": 0 * time_s + 5,
                                         "distance_m": 5 * time_s})
    write_profile(tmp_path / "profile.csv", bump_record(CAR).track)
    with pytest.raises(BadInput, match="expected 100 samples a second"):
        identify([*runs, str(tmp_path)], MASS)
