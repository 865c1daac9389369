"""A mass that is pulled and let go, with a record of what it did and nothing else, through the commands."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.support.command import called
from tests.support.slow import release, slow

M, K, C = 0.79, 280.0, 2.1
VEHICLE = f"name: mass\nmodel: single_mass\nmass_kg: {M} +- 1%\nstiffness_n_per_m: 350\ndamping_n_s_per_m: 4\n"


def decay(place: Path, lasts_s: float = 3.0, friction_n: float = 0.0, step_m: float = 0.0005, from_m: float = -0.07,
          seed: int = 3, held: int = 0) -> Path:
    """A run with a record of a mass from 7 cm below its rest, held there for so many samples, read in steps [m]."""
    time_s = np.arange(0, lasts_s, 0.01)
    state = solve_ivp(lambda _t, s: [s[1], -(K * s[0] + C * s[1] + friction_n * np.tanh(s[1] / 1e-3)) / M],
                      (0, lasts_s), [from_m, 0.0], t_eval=time_s, rtol=1e-8, atol=1e-10, max_step=2e-3).y
    noisy = state[0] + np.random.default_rng(seed).normal(0, 2e-4, len(time_s))
    before = from_m + np.random.default_rng(seed + 1).normal(0, 2e-4, held)
    noisy, time_s = np.concatenate([before, noisy]), np.arange(held + len(noisy)) / 100
    place.mkdir()
    rows = zip(time_s, step_m * np.round(noisy / step_m), strict=True)
    (place / "drive.csv").write_text("t_s,displacement_m\n" + "".join(f"{t:.2f},{x:.6f}\n" for t, x in rows))
    (place.parent / "vehicle.yaml").write_text(VEHICLE)
    return place


def test_spring_and_damper_are_found_from_a_record_alone(tmp_path: Path) -> None:
    found = called("identify", "--json", "--vehicle", tmp_path / "vehicle.yaml", "--free",
                   "stiffness_n_per_m,damping_n_s_per_m", decay(tmp_path / "run"))
    answer = json.loads(found.stdout)
    assert answer["error_after"] < 0.02
    for name, true in (("stiffness_n_per_m", K), ("damping_n_s_per_m", C)):
        assert answer["parameters"][name] == pytest.approx(true, abs=4 * answer["standard_errors"][name])
        assert answer["standard_errors"][name] < 0.03 * true
    (run := tmp_path / "run" / "excitation.csv").write_text(
        "t_s,elevation_m\n" + "".join(f"{i / 100:.2f},0\n" for i in range(300)))
    again = json.loads(called("identify", "--json", "--vehicle", tmp_path / "vehicle.yaml", "--free",
                              "stiffness_n_per_m,damping_n_s_per_m", run.parent).stdout)
    assert again["parameters"] == pytest.approx(answer["parameters"])


def test_no_error_of_the_file_is_said_where_it_gives_no_numbers(tmp_path: Path) -> None:
    run, vehicle, fitted = decay(tmp_path / "run"), tmp_path / "vehicle.yaml", tmp_path / "fitted.yaml"
    vehicle.write_text(VEHICLE.replace("350", "unknown").replace(" 4\n", " unknown\n"))
    called("identify", "--vehicle", vehicle, "--out", fitted, run)
    guessed, found = (called("compare", "--vehicle", one, run).stdout for one in (vehicle, fitted))
    assert "with guesses for what the vehicle's file leaves unknown" in " ".join(guessed.split())
    assert "with the vehicle's file unchanged" in " ".join(found.split())
    added = called("add-effect", "dry_friction", "--vehicle", vehicle, "--out", tmp_path / "added.yaml", run).stdout
    assert "guesses for what the vehicle's file leaves unknown" in next(
        line for line in added.splitlines() if line.startswith("Before"))


def test_ten_samples_a_second_are_compared(tmp_path: Path) -> None:
    """No low-pass is looked for below a third of them."""
    drive = decay(tmp_path / "run", lasts_s=6.0) / "drive.csv"
    head, *rows = drive.read_text().splitlines()
    drive.write_text("\n".join([head, *rows[::10]]) + "\n")
    assert called("compare", "--tolerance", "0.5", "--vehicle", tmp_path / "vehicle.yaml", drive.parent).returncode == 0


def test_what_was_held_before_is_cut_off_and_said(tmp_path: Path) -> None:
    decay(tmp_path / "run"), decay(tmp_path / "held", held=150)
    asked = "--vehicle", tmp_path / "vehicle.yaml", "--free", "stiffness_n_per_m,damping_n_s_per_m", "--json"
    found, held = (called("identify", *asked, tmp_path / run) for run in ("run", "held"))
    assert json.loads(held.stdout)["parameters"] == pytest.approx(json.loads(found.stdout)["parameters"], rel=5e-3)
    assert "held still for its first 1.5" in held.stderr and "held still" not in found.stderr


def test_nothing_is_left_out_and_nothing_is_missing(tmp_path: Path) -> None:
    run = decay(tmp_path / "run")
    answer = json.loads(called("compare", "--json", "--tolerance", "0.5", "--vehicle", tmp_path / "vehicle.yaml", run
                               ).stdout)
    assert answer["runs"][0]["samples"] == 300
    assert "lacks nothing" in answer["evidence"][0]


def test_a_decay_that_no_test_relates_to_its_motion_is_not_called_noise(tmp_path: Path) -> None:
    """Friction that stops it after two swings, read in steps of 2 mm."""
    run = decay(tmp_path / "run", lasts_s=1.0, friction_n=2.0, step_m=0.002)
    answer = json.loads(called("compare", "--json", "--tolerance", "unknown", "--vehicle", tmp_path / "vehicle.yaml",
                               run).stdout)
    assert "it is no white noise" in answer["evidence"][0] and "ridelog diagnose" in answer["evidence"][-1]


@pytest.mark.parametrize(("from_m", "repeats"), slow((-0.07, True), (-0.04, False)))
def test_what_is_let_go_from_the_same_place_repeats(tmp_path: Path, from_m: float, repeats: bool) -> None:
    runs = decay(tmp_path / "one"), decay(tmp_path / "two", from_m=from_m, seed=4)
    said = called("compare", "--tolerance", "0.5", "--vehicle", tmp_path / "vehicle.yaml", *runs).stdout
    assert ("one and two are repeats" in " ".join(said.replace(f"{tmp_path}/", "").split())) is repeats


@pytest.mark.slow
def test_a_mode_that_is_too_sharp_to_be_met_by_chance_is_found(tmp_path: Path) -> None:
    """A leaf of steel, damping ratio 0.08 %, as the textbook has it; nobody knows its spring."""
    time_s, omega, runs = np.arange(0, 8, 0.005), 2 * np.pi * 12.55, []
    for name, from_m in (("one", 0.008), ("two", 0.004)):
        rings = np.exp((-0.0008 + 1j * np.sqrt(1 - 0.0008**2)) * omega * time_s)
        accel_mps2 = np.random.default_rng(len(runs)).normal(-from_m * omega**2 * rings.real, 0.05)
        (tmp_path / name).mkdir()
        np.savetxt(tmp_path / name / "drive.csv", np.stack([time_s, accel_mps2], axis=1), "%.6f", ",",
                   header="t_s,accel_z_mps2", comments="")
        runs.append(tmp_path / name)
    (tmp_path / "leaf.yaml").write_text("name: leaf\nmodel: single_mass\nmass_kg: 0.4 +- 1%\n"
                                        "stiffness_n_per_m: unknown\ndamping_n_s_per_m: unknown\n")
    found = json.loads(called("compare", "--json", "--vehicle", tmp_path / "leaf.yaml", *runs).stdout)
    assert found["refitted"]["error"] < 0.05
    numbers = json.loads(called("identify", "--json", "--vehicle", tmp_path / "leaf.yaml", *runs).stdout)["parameters"]
    assert numbers["stiffness_n_per_m"] / numbers["mass_kg"] == pytest.approx(omega**2, rel=1e-3)
    assert numbers["damping_n_s_per_m"] / numbers["mass_kg"] == pytest.approx(2 * 0.0008 * omega, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("frequency_hz", [20.0, *release(170.0), 400.0])
def test_three_periods_of_a_stiff_mass_are_enough(frequency_hz: float, tmp_path: Path) -> None:
    """1 kg with a damping ratio of 3 %, let go 1 mm from its rest, as the textbook has it."""
    w, share = 2 * np.pi * frequency_hz, 0.03
    damped = w * np.sqrt(1 - share**2)
    time_s = np.arange(66) / (20 * frequency_hz)
    decays = 0.001 * np.exp(-share * w * time_s)
    way_m = decays * (np.cos(damped * time_s) + share * w / damped * np.sin(damped * time_s))
    rate_mps = -decays * w**2 / damped * np.sin(damped * time_s)
    accel_mps2 = -(w**2) * way_m - 2 * share * w * rate_mps
    accel_mps2 += np.random.default_rng(1).normal(0, 1e-3 * accel_mps2.std(), len(time_s))
    (tmp_path / "run").mkdir()
    np.savetxt(tmp_path / "run" / "drive.csv", np.stack([time_s, accel_mps2], axis=1), "%.9g", ",",
               header="t_s,accel_z_mps2", comments="")
    vehicle = tmp_path / "vehicle.yaml"
    vehicle.write_text(f"name: mass\nmodel: single_mass\nmass_kg: 1\nstiffness_n_per_m: {w**2}\n"
                       f"damping_n_s_per_m: {2 * share * w}\n")
    assert json.loads(called("compare", "--json", "--vehicle", vehicle, tmp_path / "run").stdout)["error"] < 2e-3
    assert json.loads(called("diagnose", "--json", "--vehicle", vehicle, tmp_path / "run").stdout)["verdict"] == []


@pytest.mark.parametrize(("vehicle", "lasts_s", "words"), [
    (VEHICLE, 0.6, "run/drive.csv: expected a record of 0.896 s or longer, found 0.6 s"),
    ("name: part\nmodel: component\nstiffness_n_per_m: 1\ndamping_n_s_per_m: 1\n", 3.0,
     "run: expected an excitation.csv with t_s,displacement_m, as the vehicle is a part that its bench moves"),
])
def test_what_is_no_free_decay_is_refused_in_one_line(tmp_path: Path, vehicle: str, lasts_s: float, words: str) -> None:
    run = decay(tmp_path / "run", lasts_s)
    (tmp_path / "vehicle.yaml").write_text(vehicle)
    for verb in ("compare", "diagnose", "plan"):
        found = called(verb, "--vehicle", tmp_path / "vehicle.yaml", run)
        assert (found.returncode, found.stderr.count("\n")) == (2, 1)
        assert found.stderr.endswith(f"{words}\n")


def test_a_plan_needs_a_run_that_something_drives(tmp_path: Path) -> None:
    found = called("plan", "--vehicle", tmp_path / "vehicle.yaml", decay(tmp_path / "run"))
    assert found.returncode == 2
    assert "nothing drives this" in found.stderr


@pytest.mark.slow
def test_friction_of_what_is_let_go_is_named(tmp_path: Path) -> None:
    run = decay(tmp_path / "run", friction_n=0.4)
    answer = json.loads(called("diagnose", "--json", "--tolerance", "0.5", "--vehicle", tmp_path / "vehicle.yaml", run
                               ).stdout)
    assert answer["verdict"] == ["dry_friction"]
    (friction,) = (one for one in answer["candidates"] if one["effect"] == "dry_friction")
    assert friction["parameters"]["friction_force_n"] == pytest.approx(0.4, rel=0.05)
