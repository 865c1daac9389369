"""A run that is driven by time, through the commands and in Python: a bench quarter car of 2.5 kg on a shaker, moved by
an integrator that shares nothing with ridelog (``support.drives.bench_rig``)."""

import json
import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

import ridelog
from logger.commands.main import main
from logger.errors import BadInput

from ..support.drives.bench_rig import RATE_HZ, Recorded, Rig, random_table, shaken, swept_table, write_run
from ..support.slow import slow

NOISE_MPS2 = 0.01


@cache
def randomly_shaken(rig: Rig, lasts_s: float, seed: int) -> Recorded:
    return shaken(rig, random_table(lasts_s, seed))


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a rig's file (its body 2 % too heavy, its spring 2 % too soft) and runs without friction."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "rig.yaml").write_text(Rig().vehicle_yaml(1.02))
    (folder / "true.yaml").write_text(Rig().vehicle_yaml())
    for name, seen in (("random", randomly_shaken(Rig(), 12.0, 1)), ("sweep", shaken(Rig(), swept_table(12.0)))):
        write_run(folder / name, seen, NOISE_MPS2, 2)
    return folder


def reported(capsys: pytest.CaptureFixture[str], *words: object) -> dict:
    assert main([*map(str, words), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.slow
def test_a_comparison_falls_to_the_noise_and_knows_no_speed_and_no_place(
        bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = bench / "compare.html"
    found = reported(capsys, "compare", "--vehicle", bench / "rig.yaml", bench / "random", bench / "sweep",
                     "--out", page)
    measured = np.concatenate([np.loadtxt(bench / name / "drive.csv", delimiter=",", skiprows=1)[1000:, 1]
                               for name in ("random", "sweep")])
    floor = NOISE_MPS2 / float(np.sqrt((measured**2).mean()))
    assert found["error"] > 5 * floor
    assert found["refitted"]["error"] < 1.15 * floor
    assert found["where"]["speed"] == found["where"]["place"] == []
    assert sum(one["error_power_share"] for one in found["where"]["frequency"]) == pytest.approx(1.0)
    assert not found["missing"]
    assert "The worst place" in page.read_text()
    assert main(["compare", "--vehicle", str(bench / "true.yaml"), str(bench / "random")]) == 0
    words = capsys.readouterr().out
    assert "Speed" not in words
    assert "Worst places" not in words


@pytest.mark.slow
def test_the_true_rig_is_right_without_a_fit(bench: Path) -> None:
    found = ridelog.compare(bench / "true.yaml", [bench / "random"])
    measured = ridelog.read_run(bench / "random").accel_z_mps2[1000:]
    assert found.error < 1.1 * NOISE_MPS2 / float(np.sqrt((measured**2).mean()))


@pytest.mark.slow
def test_what_needs_a_road_cannot_be_tried_and_nothing_is_missing(
        bench: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = reported(capsys, "diagnose", "--vehicle", bench / "rig.yaml", bench / "random")
    assert (found["verdict"], found["unexplained"]) == ([], False)
    why = found["not_tried"]
    assert all("driven by time" in why[name] for name in ("speed_scale", "tire_enveloping", "roll"))
    with pytest.raises(BadInput, match="driven by time"):
        main(["add-effect", "speed_scale", "--vehicle", str(bench / "rig.yaml"), str(bench / "random"),
              "--out", str(bench / "out.yaml")])


def of_mass(bench: Path, folder: Path, mass: str) -> Path:
    """The rig's file with another mass of the body in it."""
    text = (bench / "true.yaml").read_text()
    assert "\nsprung_mass_kg: 2.5\n" in text
    (folder / "other.yaml").write_text(text.replace("\nsprung_mass_kg: 2.5\n", f"\nsprung_mass_kg: {mass}\n"))
    return folder / "other.yaml"


@pytest.mark.parametrize("run", slow("random", "sweep"))
def test_numbers_of_the_rig_are_identified(bench: Path, run: str, tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    found = reported(capsys, "identify", "--vehicle", of_mass(bench, tmp_path, "4"), bench / run, "--free",
                 "sprung_mass_kg,front.suspension_damping_n_s_per_m")
    assert found["converged"]
    assert found["at_bound"] == []
    assert found["parameters"]["sprung_mass_kg"] == pytest.approx(2.5, rel=2e-3)
    assert found["parameters"]["front.suspension_damping_n_s_per_m"] == pytest.approx(12.0, rel=1e-2)
    with pytest.raises(BadInput, match="random: expected a road for speed_scale; the run is driven by time"):
        main(["identify", "--vehicle", str(bench / "true.yaml"), str(bench / "random"), "--free", "speed_scale"])


def test_times_in_milliseconds_are_refused_at_once(bench: Path, tmp_path: Path) -> None:
    run = shutil.copytree(bench / "random", tmp_path / "run")
    lines = (run / "drive.csv").read_text().splitlines()
    rows = [line.split(",") for line in lines[1:]]
    (run / "drive.csv").write_text("\n".join(
        [lines[0], *(",".join([f"{1000 * float(time_s):.10g}", *more]) for time_s, *more in rows)]))
    with pytest.raises(BadInput, match=r"drive\.csv: expected .* samples a second or more, .*t_s in ms"):
        main(["identify", "--vehicle", str(bench / "true.yaml"), str(run), "--free", "sprung_mass_kg"])


def test_a_fit_with_coloured_noise_that_ends_at_a_bound_says_what_to_try(
        bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["identify", "--vehicle", str(of_mass(bench, tmp_path, "[3, 5]")), str(bench / "sweep"), "--free",
             "sprung_mass_kg"]
    main([*words, "--noise", "ar"])
    assert "try --noise white" in capsys.readouterr().out
    main([*words, "--noise", "white"])
    assert "At a bound" in (reported_white := capsys.readouterr().out)
    assert "try --noise white" not in reported_white


@pytest.mark.slow
@pytest.mark.parametrize("more", [False, True])
def test_a_record_that_was_low_passed_is_compared_below(bench: Path, tmp_path: Path, more: bool,
                                                        capsys: pytest.CaptureFixture[str]) -> None:
    """Butterworth's order 8 at 15 Hz, forth and back, on the body's record: the table moves up to 25 Hz. The true rig
    leaves next to nothing (the filter takes 5 % where the band ends, and less below); other signals were not filtered.
    """
    if more:
        with_signals(tmp_path / "run", Rig(), 12.0, 1)
    else:
        shutil.copytree(bench / "random", tmp_path / "run")
    path, sections = tmp_path / "run" / "drive.csv", butter(8, 15.0, fs=RATE_HZ, output="sos")
    drive = np.loadtxt(path, delimiter=",", skiprows=1)
    drive[:, 1] = sosfiltfilt(sections, drive[:, 1])
    head = path.read_text().splitlines()[0]
    np.savetxt(path, drive, "%.9g", ",", header=head, comments="")
    found = reported(capsys, "compare", "--vehicle", bench / "true.yaml", tmp_path / "run")
    assert found["low_passed_at_hz"] == pytest.approx(15.0, rel=0.05)
    assert 12.0 < found["pass_band_hz"][1] < 15.0
    assert found["error"] < 0.006
    if more:
        assert found["signals"]["wheel_accel_mps2"] == pytest.approx(0.02 / float(drive[1000:, 2].std()), rel=0.25)


def test_a_simulated_rig_is_what_the_integrator_says(bench: Path, tmp_path: Path,
                                                     capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run"
    run.mkdir()
    shutil.copy(bench / "random" / "excitation.csv", run)
    made = reported(capsys, "simulate", "--vehicle", bench / "true.yaml", "--excitation", run / "excitation.csv",
                "--rate", RATE_HZ, "--output", "travel", "--out", run / "drive.csv")
    assert made["more_columns"] == ["travel_front_m"]
    assert (run / "drive.csv").read_text().startswith("t_s,accel_z_mps2,travel_front_m\n")
    seen = randomly_shaken(Rig(), 12.0, 1)
    drive = np.loadtxt(run / "drive.csv", delimiter=",", skiprows=1)
    kept = slice(500, len(drive) - 50)
    assert drive[kept, 1] == pytest.approx(seen.body_mps2[kept], abs=2e-3 * float(seen.body_mps2.std()))
    assert drive[kept, 2] == pytest.approx(seen.travel_m[kept], abs=2e-3 * float(seen.travel_m.std()))
    with pytest.raises(BadInput, match="--speed: expected none with --excitation"):
        main(["simulate", "--vehicle", str(bench / "true.yaml"), "--excitation", str(run / "excitation.csv"),
              "--speed", "3", "--out", str(run / "other.csv")])


def test_a_run_in_python_is_read_shown_and_written(bench: Path, tmp_path: Path) -> None:
    run = ridelog.read_run(bench / "random")
    assert run.profile is None
    assert run.excitation is not None
    assert "excitation" in repr(run)
    assert "speed" not in repr(run)
    ridelog.write_run(tmp_path / "again", run)
    again = ridelog.read_run(tmp_path / "again")
    assert again.excitation is not None
    assert again.excitation.elevation_m == pytest.approx(run.excitation.elevation_m, abs=1e-9)
    assert sorted(path.name for path in (tmp_path / "again").iterdir()) == ["drive.csv", "excitation.csv"]
    with pytest.raises(BadInput, match="expected a drive over a road"):
        ridelog.estimate(run, "rav4-2009")


def test_clocks_of_another_rate_and_another_start_are_one_clock(bench: Path, tmp_path: Path) -> None:
    """Half the excitation's samples, and a record that begins 1.5 s after it."""
    for name, step in (("excitation.csv", 2), ("drive.csv", 1)):
        lines = (bench / "random" / name).read_text().splitlines()
        rows = lines[1::step] if name == "excitation.csv" else lines[1 + 750:]
        (tmp_path / name).write_text("\n".join([lines[0], *rows]) + "\n")
    found = ridelog.compare(bench / "true.yaml", [tmp_path])
    assert found.error < 0.02


@pytest.mark.parametrize(("name", "text", "complaint"), [
    ("excitation.csv", "t_s,height_m\n0,0\n", "excitation.csv:1: expected the header t_s,elevation_m"),
    ("excitation.csv", "t_s,elevation_m\n0,0\n1,0\n", "excitation.csv:4: expected at least 4 samples"),
    ("excitation.csv", "t_s,elevation_m\n0,0\n1,0\n2,0\n9,0\n", "excitation.csv:5: expected samples evenly"),
    ("excitation.csv", "t_s,elevation_m\n0,0\n1,nan\n2,0\n3,0\n", "excitation.csv:3: expected a number for elevation"),
    ("excitation.csv", "t_s,elevation_m\n70,0\n71,0\n72,0\n73,0\n", "expected times of the same clock as in drive.csv"),
    ("excitation.csv", "t_s,elevation_m\n0,0\n9,0\n18,0\n27,0\n", "expected an excitation that moves the rig"),
    ("excitation.csv", "t_s,elevation_m\n0,0\n1,1\n2,0\n3,0\n", "expected 3.09 s .* while its excitation lasts"),
    ("drive.csv", "t_s,accel_mps2\n0,0\n1,0\n", "drive.csv:1: expected a header with t_s,accel_z_mps2\\["),
    ("profile.csv", "distance_m,elevation_m\n0,0\n1,0\n", "expected profile.csv or excitation.csv, found both"),
])
def test_what_will_not_do_is_refused_in_one_line(bench: Path, tmp_path: Path, name: str, text: str,
                                                 complaint: str) -> None:
    shutil.copytree(bench / "random", tmp_path / "run")
    (tmp_path / "run" / name).write_text(text)
    with pytest.raises(BadInput, match=complaint):
        main(["compare", "--vehicle", str(bench / "rig.yaml"), str(tmp_path / "run")])


SIGNALS = ("signals:\n  wheel_accel_mps2: {measures: acceleration, of: front_wheel}\n"
           "  front_travel_m: {measures: travel, of: front_suspension}\n")


def with_signals(folder: Path, rig: Rig, lasts_s: float, seed: int, declared: str = SIGNALS) -> Path:
    """A run with the wheel's acceleration (noise of 0.02 m/s2) and the suspension's travel (20 um, and no known zero)
    as well."""
    seen, rng = randomly_shaken(rig, lasts_s, seed), np.random.default_rng(9)
    n = len(seen.time_s)
    write_run(folder, seen, NOISE_MPS2, 8, {"wheel_accel_mps2": seen.wheel_mps2 + rng.normal(0, 0.02, n),
                                            "front_travel_m": 0.03 + seen.travel_m + rng.normal(0, 2e-5, n)})
    (folder / "run.yaml").write_text(declared)
    return folder


@pytest.mark.slow
def test_all_signals_fall_to_their_noise(bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = with_signals(tmp_path / "run", Rig(), 12.0, 1)
    found = reported(capsys, "compare", "--vehicle", bench / "rig.yaml", run)
    drive = np.loadtxt(run / "drive.csv", delimiter=",", skiprows=1)[1000:]
    floors = dict(zip(("wheel_accel_mps2", "front_travel_m"), (0.02, 2e-5) / drive[:, 2:].std(axis=0), strict=True))
    for name, floor in floors.items():
        assert found["refitted"]["signals"][name] == pytest.approx(floor, rel=0.25), name
    assert found["signals"]["front_travel_m"] > 5 * floors["front_travel_m"]
    assert main(["compare", "--vehicle", str(bench / "rig.yaml"), str(run)]) == 0
    assert "Errors of the other signals: wheel_accel_mps2" in capsys.readouterr().out
    alone = reported(capsys, "compare", "--vehicle", bench / "rig.yaml", bench / "random")
    assert alone["signals"] == {}


@pytest.mark.slow
def test_a_recorder_with_a_clock_of_its_own_hides_nothing(bench: Path, tmp_path: Path,
                                                          capsys: pytest.CaptureFixture[str]) -> None:
    """80 ppm slow, as two crystals may differ: 30 s long, it begins right and is early by 1.2 ms in the mean."""
    seen = randomly_shaken(Rig(), 30.0, 5)
    early = CubicSpline(seen.time_s, seen.body_mps2)(seen.time_s * (1 + 8e-5))
    write_run(tmp_path / "run", replace(seen, body_mps2=early), NOISE_MPS2, 3)
    found = reported(capsys, "diagnose", "--vehicle", bench / "rig.yaml", tmp_path / "run")
    assert found["verdict"] == ["time_offset"]
    assert found["removed"]["distance"]["clock_ppm"] == pytest.approx(-80, abs=1)
    assert found["errors"][-2]["error"] < 1.1 * found["noise_floor_error"]


@pytest.mark.slow
def test_a_recorder_that_is_late_by_half_a_sample_moves_no_number(bench: Path, tmp_path: Path,
                                                                  capsys: pytest.CaptureFixture[str]) -> None:
    """All its channels, by 2 ms of 4; nothing else is missing."""
    run, late_s = with_signals(tmp_path / "run", Rig(), 12.0, 1), 0.002
    rows = np.loadtxt(run / "drive.csv", delimiter=",", skiprows=1)
    late = CubicSpline(rows[:, 0], rows[:, 1:])(np.maximum(rows[:, 0] - late_s, 0.0))
    np.savetxt(run / "drive.csv", np.column_stack([rows[:, 0], late]), "%.12g", ",", comments="",
               header="t_s,accel_z_mps2,wheel_accel_mps2,front_travel_m")
    found = reported(capsys, "diagnose", "--vehicle", bench / "rig.yaml", run)
    assert found["verdict"] == [] and found["unexplained"] is False
    assert found["removed"]["distance"]["lag_s"] == pytest.approx(late_s, abs=1e-4)


def test_signals_come_back_from_python(tmp_path: Path) -> None:
    run = ridelog.read_run(with_signals(tmp_path / "run", Rig(), 6.0, 1))
    assert list(run.more) == ["wheel_accel_mps2", "front_travel_m"]
    ridelog.write_run(tmp_path / "again", run)
    again = ridelog.read_run(tmp_path / "again")
    assert again.facts == run.facts
    assert again.more["front_travel_m"] == pytest.approx(run.more["front_travel_m"], rel=1e-9)


@pytest.mark.parametrize(("declared", "complaint"), [
    ("signals:\n  rear_mps2: {measures: acceleration, of: body}\n",
     "run.yaml:2: expected a signal that is a column of the drive.csv beside it, found rear_mps2"),
    ("signals:\n  accel_z_mps2: {measures: acceleration, of: body}\n",
     "run.yaml:2: expected a signal beside the columns"),
    ("signals:\n  front_travel_m: {measures: noise}\n", "run.yaml:2: expected one of acceleration, velocity, displ"),
    ("signals:\n  front_travel_m: {measures: travel, of: rear_suspension}\n",
     "signal front_travel_m: this vehicle has no rear suspension"),
])
def test_signals_that_cannot_be_are_refused_in_one_line(bench: Path, tmp_path: Path, declared: str,
                                                        complaint: str) -> None:
    run = with_signals(tmp_path / "run", Rig(), 6.0, 1, declared)
    with pytest.raises(BadInput, match=complaint):
        main(["compare", "--vehicle", str(bench / "rig.yaml"), str(run)])


@pytest.mark.slow
def test_two_more_signals_name_and_measure_the_friction(bench: Path, tmp_path: Path,
                                                        capsys: pytest.CaptureFixture[str]) -> None:
    run = with_signals(tmp_path / "run", Rig(friction_n=0.5), 9.0, 7)
    found = reported(capsys, "diagnose", "--vehicle", bench / "rig.yaml", run)
    assert found["verdict"] == ["dry_friction"]
    added = reported(capsys, "add-effect", "dry_friction", "--vehicle", bench / "rig.yaml", run,
                 "--out", tmp_path / "with.yaml")
    force, error = (added[key]["friction_force_n"] for key in ("parameters", "standard_errors"))
    assert abs(force - 0.5) < 3 * error
    for one in added["signals"].values():
        assert one["error_after"] < 1.3 * one["noise_floor_error"] < 0.1 * one["error_refitted"]


@pytest.mark.slow
@pytest.mark.parametrize("kind", [pytest.param("random", marks=pytest.mark.release), "sweep"])
def test_dry_friction_in_a_bench_rig_is_named_and_measured(
        bench: Path, tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    """0.5 N in a rig of 25 N. The force is known to the tolerance of the masses at best, as forces over masses move."""
    table = random_table(14.0, 7) if kind == "random" else swept_table(10.0)
    seen = shaken(Rig(friction_n=0.5), table)
    write_run(tmp_path / "run", seen, NOISE_MPS2, 8)
    found = reported(capsys, "diagnose", "--vehicle", bench / "rig.yaml", tmp_path / "run",
                     "--tolerance", "0.04")
    assert found["verdict"] == ["dry_friction"]
    out = tmp_path / "with.yaml"
    added = reported(capsys, "add-effect", "dry_friction", "--vehicle", bench / "rig.yaml", tmp_path / "run",
                     "--out", out, "--tolerance", "0.04")
    force, error = (added[key]["friction_force_n"] for key in ("parameters", "standard_errors"))
    assert 0.002 < error < 0.01
    assert abs(force - 0.5) < 3 * error
    assert added["error_after"] < 0.02 < 4 * 0.02 < added["error_refitted"]
    assert added["error_after"] < 1.3 * added["noise_floor_error"]
    again = reported(capsys, "diagnose", "--vehicle", out, tmp_path / "run")
    assert again["verdict"] == []
