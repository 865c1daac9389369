"""Rigs that forces drive, and single masses, through the commands: the motion is that of an integrator of scipy's,
which shares nothing with ridelog."""

import json
import re
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import butter, lsim, sosfiltfilt

import ridelog
from logger.api.lab.bench import bench_with
from logger.api.lab.question import CompareQuestion
from logger.commands.main import main
from logger.errors import BadInput
from logger.lab.another_car import LikeliestRig
from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.hum import FAMILY as HUM
from logger.lab.likelihood.map_fit import align, fit_to_the_end
from logger.lab.likelihood.standard_errors import standard_errors
from logger.vehicle.effect import chosen
from logger.vehicle.named_parameters import read

from ..support.drives.course import Course, integrated
from ..support.slow import release, slow

Array = npt.NDArray[np.float64]
RATE_HZ = 250.0
TIME_S = np.arange(0, 12, 1 / RATE_HZ)
FINE_S = np.arange(16 * len(TIME_S)) / (16 * RATE_HZ)


def noise(highest_hz: float, size: float, seed: int) -> Course:
    """Low-passed noise of an r.m.s. ``size``, which begins and ends at rest."""
    drawn = np.random.default_rng(seed).standard_normal(len(TIME_S))
    slow = sosfiltfilt(butter(4, highest_hz, fs=RATE_HZ, output="sos"), drawn)
    return Course(RATE_HZ, size * slow / slow.std() * np.minimum(1.0, np.minimum(TIME_S, TIME_S[::-1])) ** 2)


@dataclass(frozen=True)
class Bench:
    """A mass on a base [kg, N/m, N s/m], or two of them, on each other and on a tire; further forces by its travel, and
    of the guide that it goes along, which stands on the ground: friction, grown over 1 mm/s and so many times as large
    at rest, of which excess 1 / e is left at 30 mm/s, drag, and a spring to it; what an orifice adds to the damper, by
    the square of its rate; and play of the spring, this way in each direction."""

    mass: float = 0.3
    spring: float = 30.0
    damper: float = 0.4
    cubic: float = 0.0
    wheel: float = 0.0
    tire: float = 0.0
    guide_n: float = 0.0
    holds: float = 1.0
    guide_drag: float = 0.0
    guide_spring: float = 0.0
    orifice: float = 0.0
    play_m: float = 0.0

    @property
    def yaml(self) -> str:
        if not self.wheel:
            return (f"name: bench\nmodel: single_mass\nmass_kg: {self.mass}\nstiffness_n_per_m: {self.spring}\n"
                    f"damping_n_s_per_m: {self.damper}\n")
        return (f"name: bench\nmodel: quarter_car\nsprung_mass_kg: {self.mass}\nfront:\n"
                f"  unsprung_mass_kg: {self.wheel}\n  suspension_stiffness_n_per_m: {self.spring}\n"
                f"  suspension_damping_n_s_per_m: {self.damper}\n"
                f"  tire_stiffness_n_per_m: {self.tire}\ncontact_patch_m: 0\n")

    def moved(self, base: Course, on_body: Callable[[Array], Array], on_wheel: Callable[[Array], Array]
              ) -> Mapping[str, Array]:
        """What its sensors measure when forces push its parts up."""
        def accelerations(t: Any, body_m: Any, wheel_m: Any, body_mps: Any, wheel_mps: Any) -> tuple[Any, Any]:
            ground_m = base(t)
            if not self.wheel:
                wheel_m, wheel_mps = ground_m, base(t, 1)
            travel_m, rate_mps = body_m - wheel_m, body_mps - wheel_mps
            felt_m = travel_m
            if self.play_m:
                felt_m = np.sign(travel_m) * np.maximum(np.abs(travel_m) - self.play_m, 0.0)
            force = self.spring * felt_m + self.damper * rate_mps + self.cubic * travel_m**3
            force = force + self.orifice * rate_mps * abs(rate_mps)
            guide = self.guide_drag * body_mps + self.guide_spring * body_m
            if self.guide_n:
                more = 1.0 + (self.holds - 1.0) * np.exp(-(body_mps / 0.03)**2)
                guide = guide + self.guide_n * np.tanh(body_mps / 0.001) * more
            wheel = (force - self.tire * (wheel_m - ground_m) + on_wheel(t)) / self.wheel if self.wheel else 0.0
            return (on_body(t) - force - guide) / self.mass, wheel

        y = integrated(lambda t, y: (*y[2:], *accelerations(t, *y)), 4, TIME_S, 1e-8, 1e-11, 0.004)
        wheel_m, wheel_mps = (y[1], y[3]) if self.wheel else (base(TIME_S), base(TIME_S, 1))
        return {"accel_z_mps2": accelerations(TIME_S, *y)[0], "displacement_m": y[0], "velocity_mps": y[2],
                "travel_m": y[0] - wheel_m, "wheel_m": wheel_m, "rate_mps": y[2] - wheel_mps}


def written(folder: Path, columns: Mapping[str, Array], driving: Mapping[str, Array], said: str) -> Path:
    folder.mkdir()
    for name, table in (("drive.csv", columns), ("excitation.csv", driving)):
        samples = len(next(iter(table.values())))
        np.savetxt(folder / name, np.stack([TIME_S[:samples], *table.values()], axis=1), "%.12g", ",",
                   header=",".join(["t_s", *table]), comments="")
    (folder / "run.yaml").write_text(said)
    return folder


NOTHING = Course(RATE_HZ, np.zeros(len(TIME_S)))
BODY = "forces: {force_n: {on: body}}\n"


@cache
def ringing(damper: float) -> tuple[Bench, Course, Mapping[str, Array]]:
    """A mass that rings at 8 Hz, a force on it, and what its sensors measure: integrated once for all tests."""
    bench, push = Bench(0.8, 2000.0, damper), noise(30.0, 8.0, 4)
    return bench, push, bench.moved(NOTHING, push, NOTHING)


@pytest.mark.parametrize("bench", [
    Bench(2.5, 900.0, 12.0, 0.0, 0.4, 5400.0), *slow(Bench(), Bench(60e3, 6e6, 5e4))])
def test_every_signal_of_a_rig_on_a_shaken_base_under_forces_is_exact(
        bench: Bench, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    base, push = noise(15.0, 0.003, 1), noise(20.0, bench.spring / 100, 2)
    apart = noise(20.0, bench.spring / 200, 3) if bench.wheel else NOTHING
    seen = bench.moved(base, lambda t: push(t) + apart(t), lambda t: -apart(t))
    driving = {"elevation_m": base(TIME_S), "force_n": push(TIME_S)}
    said = "forces:\n  force_n: {on: body}\n"
    if bench.wheel:
        driving["force_damper_n"] = apart(TIME_S)
        said += "  force_damper_n: {between: [body, wheel]}\n"
    said += "signals: {rate_mps: {measures: velocity, of: suspension}}\n"
    names = ("accel_z_mps2", "displacement_m", "velocity_mps", "travel_m", "rate_mps")
    run = written(tmp_path / "run", {name: seen[name] for name in names}, driving, said)
    (tmp_path / "bench.yaml").write_text(bench.yaml)
    assert main(["compare", "--vehicle", str(tmp_path / "bench.yaml"), str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["error"] < 1e-3
    assert set(found["signals"]) == {*names[1:]}
    assert max(found["signals"].values()) < 1e-3
    for name in names[1:]:  # any of them may be all that was measured
        alone = written(tmp_path / name, {name: seen[name]}, driving, said.replace("[body, wheel]", "[wheel, body]")
                        if name == "rate_mps" else said.partition("signals")[0])
        assert ridelog.compare(tmp_path / "bench.yaml", [alone]).error < 1e-3, name


def test_a_part_alone_has_no_motion_of_its_own(tmp_path: Path) -> None:
    part = tmp_path / "damper.yaml"
    part.write_text("name: damper\nmodel: component\nstiffness_n_per_m: 0\ndamping_n_s_per_m: 1500\n")
    moved = tmp_path / "excitation.csv"
    moved.write_text("t_s,displacement_m\n" + "".join(f"{0.01 * n:.2f},0\n" for n in range(20)))
    for asked in (["modes"], ["simulate", "--excitation", str(moved), "--out", str(tmp_path / "drive.csv")]):
        with pytest.raises(BadInput, match="damper: expected a mass that moves, found model: component"):
            main([*asked, "--vehicle", str(part)])


def test_a_step_of_force_on_a_free_axis_is_what_the_textbook_says(tmp_path: Path) -> None:
    """From rest at 0: v = F / c (1 - exp(-c t / m))."""
    (tmp_path / "axis.yaml").write_text(Bench(95.0, 0.0, 200.0).yaml)
    run = written(tmp_path / "run", {"velocity_mps": TIME_S}, {"force_n": np.full(len(TIME_S), 30.0)}, BODY)
    assert main(["simulate", "--vehicle", str(tmp_path / "axis.yaml"), "--excitation", str(run / "excitation.csv"),
                 "--rate", "250", "--output", "velocity", "--output", "displacement", "--out",
                 str(run / "drive.csv")]) == 0
    drive = np.genfromtxt(run / "drive.csv", delimiter=",", names=True)
    speed_mps = 30.0 / 200.0 * (1 - np.exp(-200.0 / 95.0 * TIME_S))
    inside = slice(100, -100)
    assert drive["velocity_mps"][inside] == pytest.approx(speed_mps[inside], rel=1e-6)
    way_m = 30.0 / 200.0 * TIME_S - 95.0 / 200.0 * speed_mps
    assert drive["displacement_m"][inside] == pytest.approx(way_m[inside], rel=1e-5)


def test_a_hardening_spring_under_a_force_is_what_the_integrator_says(tmp_path: Path) -> None:
    bench = Bench(0.3, 2000.0, 4.0, 2e6)
    push = noise(15.0, 8.0, 4)
    seen = bench.moved(NOTHING, push, NOTHING)
    text = bench.yaml + "effects:\n- {name: progressive_spring, cubic_stiffness_n_per_m3: 2e6}\n"
    (tmp_path / "bench.yaml").write_text(text)
    run = written(tmp_path / "run", {"displacement_m": seen["displacement_m"]}, {"force_n": push(TIME_S)}, BODY)
    assert ridelog.compare(tmp_path / "bench.yaml", [run]).error < 0.01
    (tmp_path / "bench.yaml").write_text(bench.yaml)
    assert ridelog.compare(tmp_path / "bench.yaml", [run]).error > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("bench", [
    Bench(0.3, 2000.0, 4.0, play_m=5.7e-4), Bench(2.45, 980.0, 12.0, wheel=1.0, tire=6300.0, play_m=5.7e-4)])
def test_a_spring_with_play_in_its_seat_is_what_the_integrator_says(
        bench: Bench, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """And the play is found where the file says another stiffness and no play."""
    base = noise(8.0, 0.0015, 4)
    seen = bench.moved(base, NOTHING, NOTHING)
    run = written(tmp_path / "run", {"accel_z_mps2": seen["accel_z_mps2"]}, {"elevation_m": base(TIME_S)},
                  "source: me\n")
    (tmp_path / "true.yaml").write_text(f"{bench.yaml}effects:\n- {{name: play, half_gap_m: {bench.play_m}}}\n")
    assert ridelog.compare(tmp_path / "true.yaml", [run]).error < 0.02  # corners jerk above what a recorder keeps
    (tmp_path / "bench.yaml").write_text(replace(bench, spring=0.8 * bench.spring).yaml)
    assert ridelog.compare(tmp_path / "bench.yaml", [run]).error > 0.1
    assert main(["add-effect", "play", "--vehicle", str(tmp_path / "bench.yaml"), "--out", str(tmp_path / "with.yaml"),
                 str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    error_m = found["standard_errors"]["half_gap_m"]
    assert abs(found["parameters"]["half_gap_m"] - bench.play_m) < 2 * error_m < 0.025 * bench.play_m
    assert found["error_after"] < 0.03


FRICTION = "{name: frame_friction, friction_force_n: 0.8, transition_velocity_m_per_s: 0.001}"
DRAG = "{name: frame_damping, body_damping_n_s_per_m: 3}"
HELD = "{name: frame_spring, body_stiffness_n_per_m: 500}"


@pytest.mark.slow
@pytest.mark.parametrize("hidden", [
    {"guide_n": 0.8}, {"guide_drag": 3.0}, {"guide_n": 0.8, "guide_drag": 3.0}, {"guide_spring": 500.0},
    {"guide_spring": 500.0, "wheel": 0.3, "tire": 4000.0}])
def test_a_mass_that_goes_along_a_guide_on_the_ground_is_what_the_integrator_says(
        hidden: dict[str, float], tmp_path: Path) -> None:
    bench, base, push = Bench(1.2, 900.0, 4.0, **hidden), noise(12.0, 0.001, 5), noise(12.0, 0.5, 6)
    seen = bench.moved(base, push, NOTHING)
    run = written(tmp_path / "run", {"velocity_mps": seen["velocity_mps"]},
                  {"elevation_m": base(TIME_S), "force_n": push(TIME_S)}, BODY)
    effects = [one for one, there in ((FRICTION, "guide_n"), (DRAG, "guide_drag"), (HELD, "guide_spring"))
               if there in hidden]
    (tmp_path / "bench.yaml").write_text(f"{bench.yaml}effects: [{', '.join(effects)}]\n")
    assert ridelog.compare(tmp_path / "bench.yaml", [run]).error < 0.01
    (tmp_path / "bench.yaml").write_text(bench.yaml)
    assert ridelog.compare(tmp_path / "bench.yaml", [run]).error > 0.2


@pytest.mark.slow
@pytest.mark.parametrize(("hidden", "name", "number", "moves"), [
    ({"guide_n": 0.8}, "frame_friction", "friction_force_n", True),
    ({"guide_drag": 12.0}, "frame_damping", "body_damping_n_s_per_m", True),
    ({"guide_spring": 400.0}, "frame_spring", "body_stiffness_n_per_m", True),
    ({"guide_n": 0.8}, "dry_friction", "friction_force_n", False),  # of a base at rest nobody can tell its guide
])
def test_what_acts_on_a_single_mass_from_its_guide_is_named(
        hidden: dict[str, float], name: str, number: str, moves: bool, tmp_path: Path) -> None:
    bench = Bench(1.2, 900.0, 4.0, **hidden)
    base, push = (noise(12.0, 0.001, 5), NOTHING) if moves else (NOTHING, noise(12.0, 1.0, 6))
    velocity_mps = bench.moved(base, push, NOTHING)["velocity_mps"]
    velocity_mps = velocity_mps + 0.001 * np.random.default_rng(7).standard_normal(len(velocity_mps))
    driving = {"elevation_m": base(TIME_S)} if moves else {"force_n": push(TIME_S)}
    run = written(tmp_path / "run", {"velocity_mps": velocity_mps}, driving, "source: me\n" if moves else BODY)
    known = Bench(1.2, 880.0, 4.1).yaml.replace("1.2", "1.2 +- 1%")  # a base that moves shows ratios alone
    (tmp_path / "bench.yaml").write_text(known)
    found = ridelog.diagnose(tmp_path / "bench.yaml", [run])
    assert found.verdict == (name,)
    assert found.candidates[0].parameters[number] == pytest.approx(next(iter(hidden.values())), rel=0.04)


@pytest.mark.slow
@pytest.mark.parametrize(("friction_n", "push_n", "names"), [
    (0.0, 0.0, set()), *release((0.0, 5.0, {"constant_force"})),
    (15.0, 5.0, {"constant_force", "dry_friction"})])
def test_a_free_axis_is_named_what_acts_on_it_by_its_places_alone(
        friction_n: float, push_n: float, names: set[str], tmp_path: Path) -> None:
    """Its record begins anywhere, on its way, and it drifts; nothing of it is above 4 Hz. The file is a fifth off."""
    true, push = Bench(95.0, 0.0, 200.0, guide_n=friction_n), noise(4.0, 60.0, 9)
    place_m = true.moved(NOTHING, lambda t: push(t) + push_n, NOTHING)["displacement_m"]
    place_m = place_m + 0.7 + np.random.default_rng(2).normal(0.0, 5e-6, len(place_m))
    run = written(tmp_path / "run", {"displacement_m": place_m}, {"force_n": push(TIME_S)}, BODY)
    (tmp_path / "axis.yaml").write_text(Bench(80.0, 0.0, 240.0).yaml)
    found = ridelog.diagnose(tmp_path / "axis.yaml", [run])
    assert set(found.verdict) == names
    by_name = {one.effect: one.parameters for one in found.candidates}
    if push_n:
        assert by_name["constant_force"]["push_n"] == pytest.approx(push_n, rel=0.02)
    if friction_n:
        assert by_name["dry_friction"]["friction_force_n"] == pytest.approx(friction_n, rel=0.02)
    assert ridelog.identify(tmp_path / "axis.yaml", [run], free=["mass_kg", "damping_n_s_per_m"]).error_after < (
        0.02 if not names else 1.0)


def test_a_run_with_forces_is_written_as_it_was_read(tmp_path: Path) -> None:
    said = "forces: {force_n: {on: body}}\nsignals: {place_m: {measures: displacement, kind: encoder}}\n"
    run = written(tmp_path / "run", {"place_m": np.sin(TIME_S)}, {"force_n": np.cos(TIME_S)}, said)
    ridelog.write_run(tmp_path / "again", first := ridelog.read_run(run))
    again = ridelog.read_run(tmp_path / "again")
    assert first.facts == again.facts
    assert (again.facts.main.name, again.facts.main.kind) == ("place_m", "encoder")
    assert again.excitation is not None
    assert again.excitation.forces == first.excitation.forces
    assert again.excitation.force_n == pytest.approx(np.cos(TIME_S)[:, None], abs=1e-9)
    assert (tmp_path / "again" / "excitation.csv").read_text().startswith("t_s,force_n\n")


@pytest.mark.parametrize(("header", "said", "complaint"), [
    ("t_s,force_n", None, "excitation.csv:1: expected a run.yaml beside it that says what force_n acts on"),
    ("t_s,force_n", "source: me\n", "excitation.csv:1: expected a run.yaml .* what force_n acts on"),
    ("t_s,elevation_m", BODY, "excitation.csv:1: expected a column force_n, as the run.yaml beside it says"),
    ("t_s,force_kN", BODY, "excitation.csv:1: expected .* forces in newtons .* found force_kN"),
    ("t_s,force_front_lbf", BODY, "excitation.csv:1: expected .* forces in newtons .* found force_front_lbf"),
    ("t_s,elevation_mm", BODY, "excitation.csv:1: expected elevations in metres"),
    ("t_s,force", BODY, "excitation.csv:1: expected the header t_s,elevation_m"),
    ("t_s,force_n", "forces: {force_n: {on: front_wheel}}\n", "run.yaml: force_n: this vehicle has no front wheel"),
    ("t_s,force_n", "forces: {force_n: {on: base}}\n", "run.yaml:1: expected one of body, wheel"),
    ("t_s,force_n", "forces: {force_n: body}\n", "run.yaml:1: expected a mapping"),
    ("t_s,force_n", "forces: {force_n: {}}\n", "run.yaml:1: expected on: a part, or between: two parts"),
    ("t_s,force_n", "forces: {force_n: {between: [ground, body]}}\n", "run.yaml:1: expected two parts, as .body, wh"),
])
def test_forces_that_cannot_be_are_refused_in_one_line(tmp_path: Path, header: str, said: str | None, complaint: str
                                                       ) -> None:
    run = written(tmp_path / "run", {"accel_z_mps2": np.sin(TIME_S)}, {"force_n": np.sin(TIME_S)}, said or "")
    if said is None:
        (run / "run.yaml").unlink()
    text = (run / "excitation.csv").read_text()
    (run / "excitation.csv").write_text(text.replace("t_s,force_n", header))
    (tmp_path / "bench.yaml").write_text(Bench().yaml)
    with pytest.raises(BadInput, match=complaint):
        main(["compare", "--vehicle", str(tmp_path / "bench.yaml"), str(run)])


def test_columns_of_different_length_are_refused(tmp_path: Path) -> None:
    run = written(tmp_path / "run", {"accel_z_mps2": np.sin(TIME_S)}, {"elevation_m": np.sin(TIME_S),
                                                                      "force_n": np.sin(TIME_S)}, BODY)
    lines = (run / "excitation.csv").read_text().splitlines()
    (run / "excitation.csv").write_text("\n".join([*lines[:-1], lines[-1].rpartition(",")[0]]) + "\n")
    (tmp_path / "bench.yaml").write_text(Bench().yaml)
    with pytest.raises(BadInput, match=f"excitation.csv:{len(lines)}: expected"):
        main(["compare", "--vehicle", str(tmp_path / "bench.yaml"), str(run)])


def bench_of_a_part(folder: Path, more: str = "") -> Path:
    """A damper with friction and some mass that its bench moves by a few centimetres, by its equation alone."""
    way = noise(3.0, 0.02, 6)
    x_m, v_mps, a_mps2 = (way(TIME_S, order) for order in range(3))
    force_n = 12.0 + 400.0 * x_m + 90.0 * v_mps + 2.0 * a_mps2 + 15.0 * np.tanh(v_mps / 0.01)
    (folder / "part.yaml").write_text(
        "name: damper\nmodel: component\nstiffness_n_per_m: 400\ndamping_n_s_per_m: 90\npreload_n: 12\nmass_kg: 2\n"
        "effects:\n- {name: dry_friction, friction_force_n: 15, transition_velocity_m_per_s: 0.01}\n" + more)
    return written(folder / "run", {"force_n": force_n}, {"displacement_m": x_m}, "source: me\n")


def test_a_part_alone_on_its_bench_answers_as_its_equation_says(tmp_path: Path) -> None:
    run = bench_of_a_part(tmp_path)
    # The record has gone through no filter, and friction jerks above what a recorder keeps.
    assert ridelog.compare(tmp_path / "part.yaml", [run]).error < 0.02
    ridelog.write_run(tmp_path / "again", ridelog.read_run(run))
    assert (tmp_path / "again" / "excitation.csv").read_text().startswith("t_s,displacement_m\n")
    part = ridelog.read_vehicle(tmp_path / "part.yaml").with_numbers(
        {"damping_n_s_per_m": 60.0, "preload_n": -5.0, "mass_kg": 3.0})
    found = ridelog.identify(part, tmp_path / "again", ["damping_n_s_per_m", "preload_n", "mass_kg"])
    assert list(found.parameters.values()) == pytest.approx([90.0, 12.0, 2.0], rel=0.01)
    ridelog.write_vehicle(tmp_path / "found.yaml", found.model)
    assert ridelog.read_vehicle(tmp_path / "found.yaml").vehicle == found.model.vehicle


@pytest.mark.parametrize(("drive_loses", "excitation_ends_s"), [(None, 12.0), (700, 12.0), (None, 7.0)])
def test_uneven_clocks_are_laid_on_even_times_and_nothing_is_compared_beyond_the_excitation(
        tmp_path: Path, drive_loses: int | None, excitation_ends_s: float, capsys: pytest.CaptureFixture[str]) -> None:
    """Steps of a microcontroller's clock that are off by a quarter, one sample lost: the force is that of the equation
    at each time."""
    way, draw = noise(3.0, 0.02, 6), np.random.default_rng(5)
    (tmp_path / "run").mkdir()
    for name, column in (("excitation.csv", "displacement_m"), ("drive.csv", "force_n")):
        time_s = np.sort(TIME_S + draw.normal(0.0, 0.25 / RATE_HZ, len(TIME_S)) * (draw.random(len(TIME_S)) < 0.2))
        time_s = np.clip(time_s, 0, TIME_S[-1]) + 1e-7 * np.arange(len(time_s))
        if name == "drive.csv":
            time_s = np.delete(time_s, drive_loses) if drive_loses is not None else time_s
            values = 400.0 * way(time_s) + 90.0 * way(time_s, 1)
        else:
            time_s = time_s[time_s <= excitation_ends_s]
            values = way(time_s)
        np.savetxt(tmp_path / "run" / name, np.stack([time_s, values], axis=1), "%.12g", ",", header=f"t_s,{column}",
                   comments="")
    (tmp_path / "part.yaml").write_text("name: damper\nmodel: component\nstiffness_n_per_m: 400\n"
                                        "damping_n_s_per_m: 90\n")
    assert main(["compare", "--vehicle", str(tmp_path / "part.yaml"), str(tmp_path / "run"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["error"] < 0.01
    not_driven = [one["amount"] for one in found["left_out"] if "without excitation" in one["why"]]
    assert not_driven == ([pytest.approx(12.0 - excitation_ends_s, abs=0.02)] if excitation_ends_s < 12 else [])


def test_a_part_may_be_moved_by_its_velocity(tmp_path: Path) -> None:
    """As a bench of dampers writes it; it need not end where it began."""
    w = 2 * np.pi * 20.25 / TIME_S[-1]
    velocity_mps, way_m = 0.4 * np.cos(w * TIME_S), 0.4 / w * np.sin(w * TIME_S)
    force = {"force_n": 2e4 * way_m + 900 * velocity_mps}
    run = written(tmp_path / "run", force, {"velocity_mps": velocity_mps}, "source: me\n")
    (part := tmp_path / "part.yaml").write_text("name: part\nmodel: component\nstiffness_n_per_m: 2e4\n"
                                                "damping_n_s_per_m: 900\n")
    assert ridelog.compare(part, run).error < 1e-3
    off = written(tmp_path / "off", force, {"velocity_mps": velocity_mps + 0.01}, "source: me\n")
    with pytest.raises(BadInput, match=r"found a drift by 0.158 m beside a stroke of 0.112 m: give "):
        ridelog.compare(part, off)
    np.savetxt(run / "excitation.csv", np.stack([TIME_S, velocity_mps, way_m], axis=1), "%.9g", ",",
               header="t_s,velocity_mps,force_n", comments="")
    with pytest.raises(BadInput, match=r"a part that is moved \(displacement_m or velocity_mps\) or forces on it, "):
        ridelog.compare(part, run)


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "jitter", "lost", "why"), [
    ("gaps", 0.0, 102, "without a reading"), ("gaps", 0.3, 102, "without a reading"),
    ("clipped", 0.0, 0.09 * len(TIME_S), "at an end of the sensor's range, except as bounds")])
def test_what_drops_out_or_is_clipped_changes_no_result(
        fault: str, jitter: float, lost: float, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Three drop-outs of 48 to 240 ms, also by a clock that is off by a third of a step, and a sensor that is at its
    ends for a tenth of the time: what is found is right, and the same as by a whole record."""
    bench, push, seen = ringing(6.0)
    (tmp_path / "bench.yaml").write_text(bench.yaml.replace("2000.0", "1500 +- 30%").replace("6.0", "4 +- 50%"))
    draw, kept = np.random.default_rng(7), np.ones(len(TIME_S), bool)
    time_s = TIME_S + draw.uniform(-jitter, jitter, len(TIME_S)) / RATE_HZ * (TIME_S > 0)
    seen_mps2 = Course(RATE_HZ, seen["accel_z_mps2"])(time_s) + draw.normal(0.0, 0.02, len(TIME_S))
    whole = np.stack([time_s, seen_mps2], axis=1)
    for first, end in ((700, 712), (1500, 1560), (2200, 2230)):
        kept[first:end] = fault == "clipped"
    end_mps2 = np.quantile(np.abs(seen_mps2), 0.91)
    spoilt = np.stack([time_s, np.clip(seen_mps2, -end_mps2, end_mps2)], axis=1) if fault == "clipped" else whole[kept]
    found = []
    for name, table in (("whole", whole), ("spoilt", spoilt)):
        run = written(tmp_path / name, {"accel_z_mps2": seen_mps2}, {"force_n": push(TIME_S)}, BODY)
        np.savetxt(run / "drive.csv", table, "%.10g", ",", header="t_s,accel_z_mps2", comments="")
        found.append(identified(capsys, tmp_path / "bench.yaml", run))
    assert [one["amount"] for one in found[1]["left_out"] if one["why"] == why] == [pytest.approx(lost, rel=0.05)]
    assert not [one for one in found[0]["left_out"] if one["why"] == why]
    for name, true in {"stiffness_n_per_m": 2000.0, "damping_n_s_per_m": 6.0}.items():
        by_whole, by_rest = (one["parameters"][name] for one in found)
        error = found[1]["standard_errors"][name]
        assert abs(by_rest - true) < 3 * error < 0.02 * true and abs(by_rest - by_whole) < 2 * error


def test_a_record_that_is_mostly_clipped_or_mostly_not_there_is_refused(tmp_path: Path) -> None:
    bench, push, seen = ringing(6.0)
    (tmp_path / "bench.yaml").write_text(bench.yaml)
    size = np.median(np.abs(seen["accel_z_mps2"])) / 2
    run = written(tmp_path / "run", {"accel_z_mps2": np.clip(seen["accel_z_mps2"], -size, size)},
                  {"force_n": push(TIME_S)}, BODY)
    with pytest.raises(BadInput, match=r"found 7\d% of them exactly at the largest or smallest value"):
        ridelog.compare(tmp_path / "bench.yaml", [run])
    lines = (run / "drive.csv").read_text().splitlines()
    (run / "drive.csv").write_text("\n".join(lines[:100] + lines[-100:]) + "\n")
    with pytest.raises(BadInput, match=r"drive.csv:101: expected samples evenly 0.004 s apart, found a step of 11.2"):
        ridelog.compare(tmp_path / "bench.yaml", [run])


@pytest.mark.slow
@pytest.mark.parametrize("damping", ["1500 +- 50%", "unknown"])
def test_the_mass_of_a_fixture_is_told_from_an_early_force(damping: str, tmp_path: Path,
                                                           capsys: pytest.CaptureFixture[str]) -> None:
    """3 kg between the load cell and a damper; then, in the same file, a mass that nobody asks for."""
    way = noise(8.0, 0.01, 6)
    force_n = 1200.0 * way(TIME_S, 1) + 3.0 * way(TIME_S, 2) + 50.0
    force_n += np.random.default_rng(1).normal(0.0, 2.0, len(force_n))
    run = written(tmp_path / "run", {"force_n": force_n}, {"displacement_m": way(TIME_S)}, "source: me\n")
    text = f"name: part\nmodel: component\nstiffness_n_per_m: 0 +- 2000\ndamping_n_s_per_m: {damping}\n"
    (tmp_path / "part.yaml").write_text(f"{text}preload_n: unknown\n")
    assert main(["diagnose", "--vehicle", str(tmp_path / "part.yaml"), str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == ["payload"]
    fixture = found["candidates"][0]
    assert abs(fixture["parameters"]["mass_kg"] - 3.0) < 3 * fixture["standard_errors"]["mass_kg"] < 0.3
    (tmp_path / "part.yaml").write_text(f"{text}mass_kg: 2 +- 50%\npreload_n: unknown\n")
    with pytest.raises(BadInput, match=r"payload.*its mass is a parameter of its file"):
        main(["add-effect", "payload", "--vehicle", str(tmp_path / "part.yaml"), "--out", str(tmp_path / "with.yaml"),
              str(run)])


@pytest.mark.slow
def test_the_low_pass_of_a_load_cell_is_found(tmp_path: Path) -> None:
    """A damper beside a spring, and an amplifier of first order with 5 ms, by their equations."""
    way = noise(12.0, 0.01, 6)
    felt_n = Course(RATE_HZ, 30000.0 * way(TIME_S) + 1900.0 * way(TIME_S, 1))
    (force_n,) = integrated(lambda t, y: [(felt_n(t) - y[0]) / 0.005], 1, TIME_S, 1e-8, 1e-8, 0.004)
    force_n = force_n + np.random.default_rng(1).normal(0.0, 2.0, len(force_n))
    run = written(tmp_path / "run", {"force_n": force_n}, {"displacement_m": way(TIME_S)}, "source: me\n")
    (tmp_path / "part.yaml").write_text(
        "name: part\nmodel: component\nstiffness_n_per_m: 25000 +- 30%\ndamping_n_s_per_m: 1500 +- 50%\n")
    found = ridelog.add_effect("sensor_bandwidth", tmp_path / "part.yaml", [run])
    assert found.parameters["cutoff_hz"] == pytest.approx(1 / (2 * np.pi * 0.005), rel=0.01)
    assert found.error_after < 0.02 < 0.1 < found.error_refitted


@pytest.mark.slow
def test_knees_that_differ_by_direction_are_found_and_added(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                            capsys: pytest.CaptureFixture[str]) -> None:
    """Valves of a damper in rebound and in bump: 2400 N s/m up to 0.12 m/s and then 0.3 of it, 1000 up to 0.2 and then
    0.4. The command that diagnose prints adds the effects in the form in which it found them."""
    way = noise(4.0, 0.012, 6)
    rate_mps = way(TIME_S, 1)
    force_n = np.where(rate_mps > 0, 2400 * (np.minimum(rate_mps, 0.12) + 0.3 * np.maximum(rate_mps - 0.12, 0)),
                       1000 * (np.maximum(rate_mps, -0.2) + 0.4 * np.minimum(rate_mps + 0.2, 0)))
    force_n += np.random.default_rng(1).normal(0.0, 1.0, len(force_n))
    written(tmp_path / "run", {"force_n": force_n}, {"displacement_m": way(TIME_S)}, "source: me\n")
    (tmp_path / "part.yaml").write_text("name: part\nmodel: component\nstiffness_n_per_m: 0 +- 2000\n"
                                        "damping_n_s_per_m: 1500 +- 50%\npreload_n: unknown\n")
    monkeypatch.chdir(tmp_path)
    assert main(["diagnose", "--vehicle", "part.yaml", "run"]) == 0
    *_, following = capsys.readouterr().out.split("Next: ridelog ")
    assert main([*shlex.split(following), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["parameters"]["damper_asymmetry.rebound_to_bump_ratio"] == pytest.approx(2.4, rel=0.02)
    assert found["parameters"]["damper_blow_off.rebound_to_bump_knee_ratio"] == pytest.approx(0.6, rel=0.02)
    assert found["error_after"] < 1.1 * found["noise_floor_error"]


@pytest.mark.slow
def test_play_of_a_part_that_moves_by_some_gaps_is_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    way = noise(3.0, 0.003, 6)
    x_m = way(TIME_S)
    force_n = 4000.0 * np.sign(x_m) * np.maximum(np.abs(x_m) - 0.00083, 0.0) + 90.0 * way(TIME_S, 1)
    force_n += np.random.default_rng(1).normal(0.0, 0.05, len(force_n))
    run = written(tmp_path / "run", {"force_n": force_n}, {"displacement_m": x_m}, "source: me\n")
    text = "name: bush\nmodel: component\ndamping_n_s_per_m: 90\npreload_n: 0\nstiffness_n_per_m: "
    (tmp_path / "part.yaml").write_text(f"{text}3500\n")
    assert main(["add-effect", "play", "--vehicle", str(tmp_path / "part.yaml"), "--out", str(tmp_path / "with.yaml"),
                 str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["parameters"]["half_gap_m"] == pytest.approx(0.00083, rel=0.01)
    assert found["error_after"] < 0.01
    (tmp_path / "part.yaml").write_text(f"{text}0\n")
    with pytest.raises(BadInput, match="play: it needs a spring"):
        main(["add-effect", "play", "--vehicle", str(tmp_path / "part.yaml"), "--out", str(tmp_path / "o.yaml"),
              str(run)])


def test_a_law_of_a_travel_is_known_no_better_than_that_travel(tmp_path: Path) -> None:
    """k x^3 of an x that is read 1 % too large is 3 % too small, whatever the noise. Gains of displacement
    sensors and load cells are off by a per cent."""
    way = noise(3.0, 0.003, 6)
    x_m = way(TIME_S)
    force_n = 4000.0 * x_m + 4e8 * x_m**3 + 90.0 * way(TIME_S, 1)
    force_n += np.random.default_rng(1).normal(0.0, 0.05, len(force_n))
    run = written(tmp_path / "run", {"force_n": force_n}, {"displacement_m": 1.01 * x_m}, "source: me\n")
    (tmp_path / "part.yaml").write_text("name: bush\nmodel: component\ndamping_n_s_per_m: 90 +- 30%\npreload_n: 0\n"
                                        "stiffness_n_per_m: 3500 +- 30%\n")
    found = ridelog.add_effect("progressive_spring", tmp_path / "part.yaml", [run])
    name = "cubic_stiffness_n_per_m3"
    assert found.standard_errors[name] / found.parameters[name] == pytest.approx(np.hypot(0.03, 0.01), rel=0.1)
    assert abs(found.parameters[name] - 4e8) < 2 * found.standard_errors[name]


@pytest.mark.slow
def test_the_size_of_a_rig_is_known_no_better_than_the_force_that_drives_it(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A mass on a spring with play, under a force that is read 1 % too large: mass, spring and damper are, too."""
    bench, push = Bench(2.5, 3000.0, 9.0, play_m=5e-4), noise(25.0, 12.0, 8)
    seen = bench.moved(NOTHING, push, NOTHING)["accel_z_mps2"]
    seen = seen + np.random.default_rng(1).normal(0.0, 0.01, len(seen))
    run = written(tmp_path / "run", {"accel_z_mps2": seen}, {"force_n": 1.01 * push(TIME_S)}, BODY)
    (tmp_path / "mass.yaml").write_text("name: mass\nmodel: single_mass\nmass_kg: 2.6 +- 20%\n"
                                        "stiffness_n_per_m: 2500 +- 50%\ndamping_n_s_per_m: 12 +- 50%\n")
    assert main(["add-effect", "play", "--vehicle", str(tmp_path / "mass.yaml"), "--out", str(tmp_path / "with.yaml"),
                 str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    numbers = {one["name"]: one for one in found["vehicle_parameters"]}
    true = {"mass_kg": bench.mass, "stiffness_n_per_m": bench.spring, "damping_n_s_per_m": bench.damper}
    for name, number in numbers.items():
        assert 0.009 < number["with_standard_error"] / number["with"] < 0.015
        assert abs(number["with"] - true[name]) < 2 * number["with_standard_error"]
    assert abs(found["parameters"]["half_gap_m"] - bench.play_m) < 2 * found["standard_errors"]["half_gap_m"] < 1e-5


def test_gains_of_one_recorder_are_not_averaged_over_its_runs(tmp_path: Path) -> None:
    """A mass is known no better than force over acceleration, however many runs one load cell (1 %) and one
    accelerometer (0.5 %) recorded."""
    bench, push, moved = ringing(6.0)
    (tmp_path / "mass.yaml").write_text(bench.yaml.replace("0.8", "0.8 +- 20%").replace("2000.0", "2000 +- 50%"))
    rng = np.random.default_rng(2)
    runs = [written(tmp_path / f"run{number}", {
        "accel_z_mps2": moved["accel_z_mps2"] + rng.normal(0.0, 0.02, len(TIME_S))}, {"force_n": push(TIME_S)}, BODY)
            for number in range(4)]
    posterior = bench_with(CompareQuestion(tmp_path / "mass.yaml", runs)).posterior()
    errors = standard_errors(fit_to_the_end(align(posterior, posterior.start())))
    assert errors.logs[posterior.prior.names.index("mass_kg")] == pytest.approx(np.hypot(0.01, 0.005), rel=0.02)


@pytest.mark.slow
def test_runs_that_contradict_each_other_make_errors_larger(tmp_path: Path) -> None:
    """Friction that no model knows damps weak motion more than strong motion. Noise and gains alone would make 1.3 %;
    by what each run calls for, weighted by the power of its motion, the mean of all has a standard error of 9 %."""
    bench, rng, runs = Bench(0.8, 2000.0, 6.0, guide_n=0.6), np.random.default_rng(2), []
    (tmp_path / "mass.yaml").write_text(bench.yaml.replace("2000.0", "2000 +- 50%").replace("6.0\n", "unknown\n"))
    pushed_n = np.array([3.0, 5.0, 9.0, 16.0])
    for seed, force_n in enumerate(pushed_n):
        push = noise(30.0, force_n, seed)
        moved = bench.moved(NOTHING, push, NOTHING)["accel_z_mps2"]
        runs.append(written(tmp_path / f"run{seed}", {"accel_z_mps2": moved + rng.normal(0.0, 0.02, len(TIME_S))},
                            {"force_n": push(TIME_S)}, BODY))
    fitted = []
    for some in (runs, *([one] for one in runs)):
        posterior = bench_with(CompareQuestion(tmp_path / "mass.yaml", some)).posterior()
        model = fit_to_the_end(align(posterior, posterior.start()))
        place = posterior.prior.names.index("damping_n_s_per_m")
        fitted.append((model.state.logs[place], standard_errors(model).logs[place]))
    (mean, error), *each = fitted
    weights = pushed_n**2 / (pushed_n**2).sum()
    by_hand = np.sqrt(4 / 3 * np.square(weights * ([one for one, _ in each] - mean)).sum())
    assert 2.5 * each[-1][1] < error < by_hand


def test_a_part_is_moved_or_pushed(tmp_path: Path) -> None:
    run = bench_of_a_part(tmp_path)
    text = (run / "excitation.csv").read_text().replace("t_s,displacement_m", "t_s,displacement_m,force_n")
    (run / "excitation.csv").write_text("\n".join([text.splitlines()[0], *(
        f"{line},0" for line in text.splitlines()[1:])]) + "\n")
    with pytest.raises(BadInput, match=r"excitation.csv:1: expected a part that is moved .* found both"):
        ridelog.compare(tmp_path / "part.yaml", [run])
    way = {"displacement_m": np.sin(TIME_S)}
    run = written(tmp_path / "other", {"accel_z_mps2": np.sin(TIME_S)}, way, "source: me\n")
    with pytest.raises(BadInput, match=r"part.yaml: .*expected its force to be measured of a component"):
        ridelog.compare(tmp_path / "part.yaml", [run])


@pytest.mark.slow
def test_a_second_mode_is_a_mass_that_swings_on_the_first(tmp_path: Path) -> None:
    """A beam of which a force drives two modes where its sensor sits, the second above all that its file has. Two
    masses of which one swings on the other move alike: together they have the mass of both modes (R. M. Foster,
    Bell System Technical Journal 3, 1924, 259)."""
    masses, springs, dampers = [1.2, 3.6], [3300.0, 3.6 * (2 * np.pi * 46)**2], [3.0, 40.0]
    push, accel = noise(70.0, 8.0, 4), 0.0
    for mass, spring, damper in zip(masses, springs, dampers, strict=True):
        mode = ([1.0, 0.0, 0.0], [mass, damper, spring])
        accel = accel + lsim(mode, push(FINE_S), FINE_S)[1][::16]
    accel = accel + np.random.default_rng(8).normal(0.0, 0.02, len(TIME_S))
    run = written(tmp_path / "run", {"accel_z_mps2": accel}, {"force_n": push(TIME_S)}, BODY)
    (tmp_path / "beam.yaml").write_text(
        "name: beam\nmodel: single_mass\nmass_kg: 1.2 +- 2%\nstiffness_n_per_m: 2000 +- 60%\n"
        "damping_n_s_per_m: unknown\n")
    found = ridelog.diagnose(tmp_path / "beam.yaml", [run])
    assert found.verdict == ("occupant",)
    assert found.steps[-1][1] < 0.05


@pytest.mark.slow
def test_what_swings_sharply_on_a_mass_that_nobody_knows_is_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                                                   ) -> None:
    """A twelfth of the mass at 11 Hz, damped by 4 %: two masses in SciPy's linear simulation."""
    mass, hung, omega = 3.0, 0.25, 2 * np.pi * 11.0
    spring, damper = hung * omega**2, 2 * 0.04 * omega * hung
    within = np.array([[-(3500 + spring) / mass, spring / mass, -(9 + damper) / mass, damper / mass],
                       [spring / hung, -spring / hung, damper / hung, -damper / hung]])
    system = (np.vstack([np.eye(4)[2:], within]), np.array([[0.0], [0.0], [1 / mass], [0.0]]),
              within[:1], np.array([[1 / mass]]))
    push = noise(25.0, 8.0, 6)
    accel = lsim(system, push(FINE_S), FINE_S)[1][::16] + np.random.default_rng(8).normal(0.0, 0.01, len(TIME_S))
    run = written(tmp_path / "run", {"accel_z_mps2": accel}, {"force_n": push(TIME_S)}, BODY)
    (tmp_path / "rig.yaml").write_text("name: rig\nmodel: single_mass\nmass_kg: 3.05 +- 2%\n"
                                       "stiffness_n_per_m: 4100\ndamping_n_s_per_m: 5\n")
    assert main(["add-effect", "occupant", "--tolerance", "unknown", "--vehicle", str(tmp_path / "rig.yaml"), "--out",
                 str(tmp_path / "with.yaml"), str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["parameters"]
    assert found["frequency_hz"] == pytest.approx(11.0, rel=0.005)
    assert found["damping_ratio"] == pytest.approx(0.04, rel=0.05)
    assert found["mass_kg"] == pytest.approx(hung, rel=0.05)


@pytest.mark.slow
def test_a_circuit_of_tiny_numbers_is_named_a_hardening_spring(tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                                              ) -> None:
    """Places alone are measured, of a mass of 5 mg; the file is off by some per cent."""
    true = Bench(5e-4, 1.0, 2.5e-3, 30.0)
    push = noise(20.0, 0.02, 5)
    measured = true.moved(NOTHING, push, NOTHING)["displacement_m"]
    measured = measured + np.random.default_rng(8).normal(0.0, 2e-3 * measured.std(), len(measured))
    run = written(tmp_path / "run", {"displacement_m": measured}, {"force_n": push(TIME_S)}, BODY)
    (tmp_path / "box.yaml").write_text(Bench(5.1e-4, 0.98, 2.5e-3).yaml)
    assert main(["diagnose", "--vehicle", str(tmp_path / "box.yaml"), str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == ["progressive_spring"]
    best = next(one for one in found["candidates"] if one["effect"] == "progressive_spring")
    assert best["parameters"]["cubic_stiffness_n_per_m3"] == pytest.approx(30.0, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("holds", [1.6, 1.0])
def test_how_much_more_friction_holds_than_it_rubs_is_found_where_it_does(holds: float, tmp_path: Path) -> None:
    true = Bench(1.2, 900.0, 4.0, guide_n=0.8, holds=holds)
    push = noise(12.0, 1.5, 6)
    velocity_mps = true.moved(NOTHING, push, NOTHING)["velocity_mps"]
    velocity_mps = velocity_mps + 0.0005 * np.random.default_rng(7).standard_normal(len(velocity_mps))
    run = written(tmp_path / "run", {"velocity_mps": velocity_mps}, {"force_n": push(TIME_S)}, BODY)
    (tmp_path / "bench.yaml").write_text(Bench(1.2, 880.0, 4.1).yaml)
    found = ridelog.add_effect("dry_friction", tmp_path / "bench.yaml", [run])
    assert found.parameters["friction_force_n"] == pytest.approx(0.8, rel=0.05)
    assert found.parameters["static_to_sliding_ratio"] == pytest.approx(holds, rel=0.1 * (holds > 1))
    assert found.parameters["stribeck_velocity_m_per_s"] == pytest.approx(0.03 if holds > 1 else 0.05, rel=0.2)
    assert found.error_after < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("quadratic", [-5e3, 0.0])
def test_a_spring_that_is_stiffer_to_one_side_is_found_where_it_is(quadratic: float, tmp_path: Path) -> None:
    """As an air spring is: of a part, by its equation alone."""
    way = noise(3.0, 0.02, 6)
    x_m = way(TIME_S)
    force_n = 400.0 * x_m + 90.0 * way(TIME_S, 1) + quadratic * x_m**2 + 1e5 * x_m**3
    force_n += np.random.default_rng(1).normal(0.0, 0.05, len(force_n))
    run = written(tmp_path / "run", {"force_n": force_n}, {"displacement_m": x_m}, "source: me\n")
    (tmp_path / "part.yaml").write_text(
        "name: spring\nmodel: component\nstiffness_n_per_m: 360\ndamping_n_s_per_m: unknown\n")
    found = ridelog.add_effect("progressive_spring", tmp_path / "part.yaml", [run])
    assert found.parameters["cubic_stiffness_n_per_m3"] == pytest.approx(1e5, rel=0.02)
    assert found.parameters["quadratic_stiffness_n_per_m2"] == pytest.approx(quadratic, rel=0.02, abs=1e-6)


def test_springs_that_incline_are_found_by_their_geometry(tmp_path: Path) -> None:
    """Two of 2500 N/m and 45 mm, stretched to 60 mm across the travel, which goes as far."""
    way = noise(3.0, 0.02, 6)
    x_m = way(TIME_S)
    long_m = np.hypot(0.06, x_m)
    force_n = 2 * 2500.0 * (long_m - 0.045) * x_m / long_m + 90.0 * way(TIME_S, 1)
    force_n += np.random.default_rng(1).normal(0.0, 0.05, len(force_n))
    run = written(tmp_path / "run", {"force_n": force_n}, {"displacement_m": x_m}, "source: me\n")
    (tmp_path / "part.yaml").write_text(
        "name: spring\nmodel: component\nstiffness_n_per_m: 1100\ndamping_n_s_per_m: unknown\n")
    found = ridelog.add_effect("progressive_spring", tmp_path / "part.yaml", [run])
    assert found.parameters["levelling_per_m2"] == pytest.approx(1 / 0.06**2, rel=0.02)
    assert found.parameters["cubic_stiffness_n_per_m3"] == pytest.approx(2500 * 0.045 / 0.06**3, rel=0.02)


@pytest.mark.slow
def test_the_zero_of_the_force_on_a_hardening_spring_is_found(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A spring that is not linear works around another place under a force that is there all the time."""
    true = Bench(5e-4, 1.0, 2.5e-3, 30.0)
    push = noise(20.0, 0.02, 5)
    off_n = 0.02 * 0.15
    measured = true.moved(NOTHING, lambda t: push(t) + off_n, NOTHING)["displacement_m"]
    measured = measured + np.random.default_rng(8).normal(0.0, 2e-3 * measured.std(), len(measured))
    run = written(tmp_path / "run", {"displacement_m": measured}, {"force_n": push(TIME_S)}, BODY)
    (tmp_path / "box.yaml").write_text(
        true.yaml + "effects:\n- {name: progressive_spring, cubic_stiffness_n_per_m3: 30}\n")
    assert main(["add-effect", "constant_force", "--vehicle", str(tmp_path / "box.yaml"), "--out",
                 str(tmp_path / "with.yaml"), str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["parameters"]["push_n"] == pytest.approx(off_n, rel=0.1)
    assert found["error_after"] < 0.3 * found["error_before"]


@pytest.mark.slow
def test_an_orifice_and_a_coil_that_saturates_are_found(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The first of them is in the vehicle's file; the other is added, and all of the motion is explained."""
    true, command = Bench(orifice=2.0), noise(20.0, 0.6, 9)
    measured = true.moved(NOTHING, lambda t: 0.8 * np.tanh(command(t) / 0.8), NOTHING)["accel_z_mps2"]
    measured = measured + np.random.default_rng(8).normal(0.0, 2e-3 * measured.std(), len(measured))
    run = written(tmp_path / "run", {"accel_z_mps2": measured}, {"force_n": command(TIME_S)}, BODY)
    for one, other, number, is_there in (
            ("orifice_damping, quadratic_damping_n_s2_per_m2: 2", "force_limit", "limit_n", 0.8),
            ("force_limit, limit_n: 0.8", "orifice_damping", "quadratic_damping_n_s2_per_m2", 2.0)):
        (tmp_path / "rig.yaml").write_text(f"{true.yaml}effects:\n- {{name: {one}}}\n")
        assert main(["add-effect", other, "--vehicle", str(tmp_path / "rig.yaml"), "--out",
                     str(tmp_path / f"{other}.yaml"), str(run), "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["parameters"][number] == pytest.approx(is_there, rel=0.02)
        assert found["error_after"] < 0.01


@pytest.mark.slow
def test_an_amplifier_that_clips_is_no_coil_that_saturates(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    true, command = Bench(2.0, 1800.0, 8.0), noise(20.0, 6.0, 9)
    measured = true.moved(NOTHING, lambda t: np.clip(command(t), -7.0, 7.0), NOTHING)["accel_z_mps2"]
    measured = measured + np.random.default_rng(8).normal(0.0, 2e-3 * measured.std(), len(measured))
    run = written(tmp_path / "run", {"accel_z_mps2": measured}, {"force_n": command(TIME_S)}, BODY)
    (tmp_path / "rig.yaml").write_text(true.yaml)
    assert main(["add-effect", "force_limit", "--vehicle", str(tmp_path / "rig.yaml"), "--out",
                 str(tmp_path / "with.yaml"), str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["parameters"]["limit_n"] == pytest.approx(7.0, rel=0.02)
    assert found["parameters"]["sharpness_ratio"] > 10.0
    assert found["error_after"] < 0.02


def test_a_rig_that_no_force_drives_has_no_coil_that_saturates(tmp_path: Path) -> None:
    table = noise(20.0, 0.01, 3)
    run = written(tmp_path / "run", {"accel_z_mps2": Bench().moved(table, lambda t: 0.0 * t, NOTHING)["accel_z_mps2"]},
                  {"elevation_m": table(TIME_S)}, "source: me\n")
    (tmp_path / "rig.yaml").write_text(Bench().yaml)
    with pytest.raises(BadInput, match="force_limit: it needs a rig that a measured force drives"):
        main(["add-effect", "force_limit", "--vehicle", str(tmp_path / "rig.yaml"), "--out",
              str(tmp_path / "out.yaml"), str(run)])


@pytest.mark.slow
def test_rubber_that_creeps_is_no_mass_on_a_spring(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An isolator of 1.8 t on a shaken base, whose rubber is a spring, a damper, and a spring with a damper in series;
    its acceleration alone was measured."""
    mass, spring, damper, creeping, creep_s = 1800.0, 9e5, 4e3, 5e5, 0.02
    base = noise(25.0, 0.002, 11)
    away = [[0, 1, 0], [-spring / mass, -damper / mass, -creeping / mass], [0, 1, -1 / creep_s]]  # from the base
    measured = lsim((away, [[0], [-1], [0]], [away[1]], [[0]]), base(FINE_S, 2), FINE_S)[1][::16]
    measured = measured + np.random.default_rng(12).normal(0.0, 0.003 * measured.std(), len(measured))
    run = written(tmp_path / "run", {"accel_z_mps2": measured}, {"elevation_m": base(TIME_S)}, "source: me\n")
    (tmp_path / "rig.yaml").write_text("name: isolator\nmodel: single_mass\nmass_kg: 1800 +- 2%\n"
                                       "stiffness_n_per_m: 6e5\ndamping_n_s_per_m: 6000\n")
    rig = str(tmp_path / "rig.yaml")
    assert main(["diagnose", "--vehicle", rig, "--tolerance", "unknown", str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == ["maxwell_element"] and not found["unexplained"]
    numbers = found["candidates"][0]["parameters"]
    assert numbers["relaxation_time_s"] == pytest.approx(creep_s, rel=0.05)
    assert numbers["maxwell_stiffness_n_per_m"] == pytest.approx(creeping, rel=0.05)


def test_a_blow_on_a_quick_rig_needs_three_of_its_periods(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """After the first 2 s, which are left out: 2.38 s for a mass that rings at 8 Hz."""
    bench, push, did = ringing(2.0)
    (tmp_path / "rig.yaml").write_text(bench.yaml)
    for count, taken in ((600, True), (590, False)):
        run = written(tmp_path / f"{count}", {"accel_z_mps2": did["accel_z_mps2"][:count]},
                      {"force_n": push(TIME_S)[:count]}, BODY)
        command = ["compare", "--vehicle", str(tmp_path / "rig.yaml"), str(run), "--json"]
        if taken:
            assert main(command) == 0
            assert json.loads(capsys.readouterr().out)["error"] < 0.01
        else:
            with pytest.raises(BadInput, match=r"expected a record of 2\.38 s or longer, found 2\.36 s"):
                main(command)


def test_a_short_test_of_a_part_is_taken_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A bench that makes five turns a second needs no five: what moves the part is known, so it has no past."""
    whole = TIME_S <= 2.0
    x_m, v_mps = 0.02 * np.sin(10 * np.pi * TIME_S), 0.2 * np.pi * np.cos(10 * np.pi * TIME_S)
    run = written(tmp_path / "run", {"force_n": 400.0 * x_m + 90.0 * v_mps}, {"displacement_m": x_m}, "source: me\n")
    for name in ("drive.csv", "excitation.csv"):
        lines = (run / name).read_text().splitlines()
        (run / name).write_text("\n".join(lines[:1 + whole.sum()]) + "\n")
    (tmp_path / "part.yaml").write_text("name: damper\nmodel: component\nstiffness_n_per_m: 400\n"
                                        "damping_n_s_per_m: 90\npreload_n: 0\n")
    assert main(["compare", "--vehicle", str(tmp_path / "part.yaml"), str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["error"] < 1e-4
    assert found["runs"][0]["samples"] == pytest.approx(whole.sum() - 25, abs=1)


@pytest.mark.slow
def test_what_a_part_pulls_back_with_at_rest_is_found_beside_its_friction(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its file says a damper and no preload; the numbers are those of its equation, and all of its force is explained.
    A search that starts at friction which grows with the rate ends at friction that does not."""
    way = noise(3.0, 0.02, 6)
    x_m, v_mps = way(TIME_S), way(TIME_S, 1)
    force_n = -40.0 + 400.0 * x_m + 90.0 * v_mps + 15.0 * np.sign(v_mps)
    force_n += np.random.default_rng(3).normal(0.0, 0.5, len(force_n))
    run = written(tmp_path / "run", {"force_n": force_n}, {"displacement_m": x_m}, "source: me\n")
    (tmp_path / "part.yaml").write_text("name: damper\nmodel: component\nstiffness_n_per_m: 380\n"
                                        "damping_n_s_per_m: 100\npreload_n: 0\n")
    assert main(["add-effect", "dry_friction:transition_velocity_m_per_s=0.001", "--vehicle",
                 str(tmp_path / "part.yaml"), "--out", str(tmp_path / "with.yaml"), str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["parameters"]["friction_force_n"] == pytest.approx(15.0, abs=0.3)
    now = ridelog.read_vehicle(tmp_path / "with.yaml").vehicle
    assert now.preload_n == pytest.approx(-40.0, abs=0.5)
    assert now.front.suspension_damping_n_s_per_m == pytest.approx(90.0, rel=0.02)
    assert ridelog.compare(tmp_path / "with.yaml", [run]).error < 0.1


@pytest.mark.slow
def test_friction_of_a_part_is_named_through_the_noise_of_its_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                                                    ) -> None:
    """0.1 % of its way, which is 2 mm/s of its rate at 250 samples a second. The load cell reads 1 % too much."""
    way, drawn = noise(3.0, 0.02, 6), np.random.default_rng(4)
    force_n = 1.01 * (90.0 * way(TIME_S, 1) + 5.0 * np.tanh(way(TIME_S, 1) / 0.002)) - 8.0
    run = written(tmp_path / "run", {"force_n": force_n + drawn.normal(0.0, 0.3, len(force_n))},
                  {"displacement_m": way(TIME_S) + drawn.normal(0.0, 2e-5, len(TIME_S))}, "source: me\n")
    (tmp_path / "part.yaml").write_text("name: damper\nmodel: component\nstiffness_n_per_m: 0\n"
                                        "damping_n_s_per_m: 80\npreload_n: 0\n")
    assert main(["diagnose", "--vehicle", str(tmp_path / "part.yaml"), str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == ["dry_friction"]
    assert not found["unexplained"]
    friction = found["candidates"][0]
    off_n = friction["parameters"]["friction_force_n"] - 5.0
    assert abs(off_n) < 3 * friction["standard_errors"]["friction_force_n"]


@pytest.mark.slow
@pytest.mark.parametrize(("slides_n", "late_s", "names"), [
    (0.0, 0.0, {"damper_blow_off"}), (0.0, 0.003, {"damper_blow_off", "time_offset"}),
    (110.0, 0.0, {"damper_blow_off", "hysteresis"})])
def test_a_force_that_gives_before_it_slides_is_no_delay(slides_n: float, late_s: float, names: set[str],
                                                         tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Four strokes of a damper of which nobody knows the numbers or where it stands: a knee, friction that gives by 0.2
    mm (P. Dahl, AIAA Journal 14 (1976) 1675) or a load cell that is late."""
    finely_s = np.arange(0, 1.2, 1 / (20 * RATE_HZ))
    x_m = 0.0045 * np.minimum(1.0, finely_s / 0.5) * np.sin(6 * np.pi * finely_s + 0.3)
    v_mps = np.gradient(x_m, finely_s)
    inner, slid = np.clip(v_mps, -0.03, 0.03), np.zeros(len(x_m))
    for place, way_m in enumerate(np.diff(x_m)):
        slid[place + 1] = np.clip(slid[place] + way_m / 2e-4 * (1 - np.sign(way_m) * slid[place]), -1, 1)
    force_n = 60.0 + 2000.0 * x_m + 9000.0 * (inner + 0.15 * (v_mps - inner)) + slides_n * slid
    force_n = np.interp(finely_s - late_s, finely_s, force_n)[::20]
    force_n += np.random.default_rng(1).normal(0.0, 3.0, len(force_n))
    run = written(tmp_path / "run", {"force_n": force_n}, {"displacement_m": x_m[::20]}, "source: me\n")
    (tmp_path / "part.yaml").write_text("name: damper\nmodel: component\nstiffness_n_per_m: 0 +- 10000\n"
                                        "damping_n_s_per_m: 3000 +- 100%\npreload_n: unknown\n")
    assert main(["diagnose", "--vehicle", str(tmp_path / "part.yaml"), str(run)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    known = {"damper_blow_off", "dry_friction", "hysteresis", "time_offset", "top_mount_compliance"}
    # Far below its cut-off a low-pass of a load cell is a delay.
    assert {name for name in known if f"{name} is missing" in said
            or f"Either {name} or sensor_bandwidth is missing" in said} == names
    assert "natural frequencies" not in said and "drive one bump" not in said


@pytest.mark.slow
def test_a_record_follows_its_force_though_the_vehicles_mode_lies_elsewhere(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A rig that rings at 8 Hz (damping ratio 0.8 %), its spring 60 % too stiff in the file; then under a force that
    was another test's."""
    _, push, moved = ringing(0.6)
    (tmp_path / "bench.yaml").write_text(
        "name: bench\nmodel: single_mass\nmass_kg: 0.8\nstiffness_n_per_m: 3200 +- 60%\ndamping_n_s_per_m: unknown\n")
    other = noise(30.0, 8.0, 5)
    seen = {"displacement_m": moved["displacement_m"]}
    runs = [str(written(tmp_path / name, seen, {"force_n": force(TIME_S)}, BODY))
            for name, force in (("right", push), ("wrong", other))]
    vehicle = str(tmp_path / "bench.yaml")
    assert main(["compare", "--vehicle", vehicle, runs[0], "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["refitted"]["error"] < 0.01
    with pytest.raises(BadInput, match="is it another run's excitation"):
        main(["compare", "--vehicle", vehicle, runs[1]])


@pytest.mark.slow
def test_a_short_record_follows_its_force_though_its_mode_moves_with_amplitude(tmp_path: Path) -> None:
    """Eight seconds of a spring that hardens, and that is half as stiff in the file; then under another force."""
    count, bench, push = round(8.0 * RATE_HZ), Bench(0.8, 2000.0, 3.0, 4e7), noise(30.0, 8.0, 4)
    seen = {"displacement_m": bench.moved(NOTHING, push, NOTHING)["displacement_m"][:count]}
    (tmp_path / "bench.yaml").write_text(replace(bench, spring=1000.0).yaml)
    right, wrong = (str(written(tmp_path / name, seen, {"force_n": force(TIME_S)[:count]}, BODY))
                    for name, force in (("right", push), ("wrong", noise(30.0, 8.0, 5))))
    vehicle = str(tmp_path / "bench.yaml")
    assert main(["compare", "--vehicle", vehicle, right]) == 0
    with pytest.raises(BadInput, match="is it another run's excitation"):
        main(["compare", "--vehicle", vehicle, wrong])


@pytest.mark.slow
def test_waves_below_the_bounce_of_a_rig_that_nobody_knows_say_nothing_of_its_way_up(tmp_path: Path) -> None:
    """A shaken mass that rubs, whose spring may be anything: nothing moves it below the bounce of its file."""
    fast = sosfiltfilt(butter(4, (5, 25), "bandpass", fs=RATE_HZ, output="sos"),
                       np.random.default_rng(5).standard_normal(len(TIME_S)))
    base = Course(RATE_HZ, 8e-4 * fast / fast.std() * np.minimum(1.0, np.minimum(TIME_S, TIME_S[::-1])) ** 2)
    (tmp_path / "bench.yaml").write_text(
        "name: bench\nmodel: single_mass\nmass_kg: 2.5\nstiffness_n_per_m: unknown\ndamping_n_s_per_m: unknown\n")
    seen = Bench(2.5, 5200.0, 9.0, guide_n=2.0).moved(base, NOTHING, NOTHING)["accel_z_mps2"]
    run = written(tmp_path / "run", {"accel_z_mps2": seen}, {"elevation_m": base(TIME_S)}, "source: bench\n")
    assert main(["compare", "--vehicle", str(tmp_path / "bench.yaml"), str(run)]) == 0


@pytest.mark.parametrize(("acts", "pushed", "guide_n", "words"), [
    (1.0, -1.0, 0.0, "Forces of the opposite sign would explain most"), (1.0, 1.0, 0.0, None),
    (1.9, 1.0, 0.0, None), (0.0, 1e-4, 1.0, None),
    *slow((1.0, 0.22481, 0.0, "Forces several times as large would explain most"), (1.0, 1.0, 1.0, None))],
    ids=["sign", "right", "a correction less than the force", "one that explains little", "pounds", "friction"])
def test_a_force_that_is_not_what_it_says_is_said(
        acts: float, pushed: float, guide_n: float, words: str | None, tmp_path: Path,
        capsys: pytest.CaptureFixture[str]) -> None:
    """Beside a base that moves it more; its body was weighed."""
    bench, push = Bench(2.5, 900.0, 12.0, 0.0, 0.4, 5400.0, guide_n=guide_n), noise(20.0, 2.0, 2)
    base = noise(15.0, 0.006, 1)
    record = {"accel_z_mps2": bench.moved(base, lambda t: acts * push(t), NOTHING)["accel_z_mps2"]}
    run = written(tmp_path / "run", record, {"elevation_m": base(TIME_S), "force_n": pushed * push(TIME_S)}, BODY)
    (tmp_path / "bench.yaml").write_text(bench.yaml.replace("2.5", "2.5 +- 1%"))
    assert main(["compare", "--vehicle", str(tmp_path / "bench.yaml"), str(run)]) == 0
    found = " ".join(capsys.readouterr().out.split())
    assert words in found if words else "Forces" not in found


@pytest.mark.slow
def test_where_forces_are_not_what_they_say_the_rest_is_found_with_their_gain(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An actuator that pulls three times as strongly as its record pushes; the body rubs on its guide."""
    bench, push = Bench(2.5, 900.0, 12.0, 0.0, 0.4, 5400.0, guide_n=1.0), noise(20.0, 2.0, 2)
    base = noise(15.0, 0.006, 1)
    seen = bench.moved(base, lambda t: -3.2 * push(t), NOTHING)["accel_z_mps2"]
    read = seen + np.random.default_rng(1).normal(0.0, 0.02, len(seen))
    driving = {"elevation_m": base(TIME_S), "force_n": push(TIME_S)}
    run = written(tmp_path / "run", {"accel_z_mps2": read}, driving, BODY)
    (tmp_path / "bench.yaml").write_text(bench.yaml.replace("2.5", "2.5 +- 1%"))
    assert main(["diagnose", "--vehicle", str(tmp_path / "bench.yaml"), str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert sorted(found["verdict"]) == ["force_gain", "frame_friction"]
    values = {one["effect"]: one["parameters"] for one in found["candidates"]}
    assert values["force_gain"]["gain"] == pytest.approx(-3.2, rel=0.02)
    assert values["frame_friction"]["body_friction_force_n"] == pytest.approx(1.0, rel=0.04)
    assert found["candidates"][0]["error"] < 0.02 and found["unexplained"] is False


def test_what_forces_drive_the_other_way_is_upside_down_or_they_are(tmp_path: Path) -> None:
    """On a base that moves it less."""
    bench, push, base = Bench(2.5, 900.0, 12.0, 0.0, 0.4, 5400.0), noise(20.0, 2.0, 2), noise(15.0, 1e-4, 1)
    (tmp_path / "bench.yaml").write_text(bench.yaml)
    record = {"accel_z_mps2": bench.moved(base, push, NOTHING)["accel_z_mps2"]}
    run = written(tmp_path / "run", record, {"elevation_m": base(TIME_S), "force_n": -push(TIME_S)}, BODY)
    with pytest.raises(BadInput, match="found them upside down, or forces of the opposite sign: with the sign changed"):
        main(["compare", "--vehicle", str(tmp_path / "bench.yaml"), str(run)])


@pytest.mark.parametrize(("frame", "lacks"), [({}, False), ({"wheel": 0.4, "tire": 5400.0}, True)])
def test_a_residual_that_follows_a_force_is_said_and_no_error_is_called_sound(
        frame: dict[str, float], lacks: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a mass on a frame that gives, which its file does not know; it rests until it is pushed."""
    bench, push = Bench(2.5, 900.0, 12.0, **frame), noise(20.0, 3.0, 2)
    (tmp_path / "bench.yaml").write_text(Bench(2.5).yaml.replace("30.0", "800 +- 50%").replace("0.4", "10 +- 50%"))
    pushed, rests = push(TIME_S), int(0.5 * RATE_HZ)
    moved = bench.moved(NOTHING, push, NOTHING)["accel_z_mps2"]
    read = np.r_[np.zeros(rests), moved[:-rests]] + np.random.default_rng(1).normal(0, 0.02, len(TIME_S))
    driving = {"force_n": np.r_[np.zeros(rests), pushed[:-rests]]}
    run = written(tmp_path / "run", {"accel_z_mps2": read}, driving, BODY)
    assert main(["identify", "--vehicle", str(tmp_path / "bench.yaml"), str(run)]) == 0
    words = capsys.readouterr().out
    assert ("Do residuals follow the input?" in words) and ("the model lacks an effect" in words) is lacks
    assert "at rest until it is driven" in words and ("can be trusted" in words) is not lacks


def test_a_guess_of_its_spring_makes_no_record_early_after_the_refit(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bench = Bench(2.5, 900.0, 12.0, guide_n=1.0)
    (tmp_path / "bench.yaml").write_text(bench.yaml.replace("900.0", "750 +- 50%"))
    runs = [str(written(tmp_path / f"run-{seed}", {"accel_z_mps2": bench.moved(base, NOTHING, NOTHING)["accel_z_mps2"]},
                        {"elevation_m": base(TIME_S)}, "source: bench\n"))
            for seed in (1, 2, 3) for base in [noise(10.0, 0.004, seed)]]
    assert main(["compare", "--vehicle", str(tmp_path / "bench.yaml"), *runs]) == 0
    found = " ".join(capsys.readouterr().out.split())
    assert "After the refit" in found and "leads the model" not in found


@pytest.mark.slow
@pytest.mark.parametrize(("read", "pushed", "words"), [
    (1 / 9.80665, 1.0, r"0\.10\d times .* it looks like accel_z_mps2 in g \("),
    (1.0, 1e-3, r"found accel_z_mps2 9\d\d times .* it looks like accel_z_mps2 in mm/s2 or force_n in kN \("),
], ids=["g", "kN"])
def test_another_unit_is_said(tmp_path: Path, read: float, pushed: float, words: str) -> None:
    """Of a mass that was weighed, its spring known to a third."""
    bench, push, moved = ringing(6.0)
    record = {"accel_z_mps2": moved["accel_z_mps2"] * read}
    (tmp_path / "bench.yaml").write_text(bench.yaml.replace("0.8", "0.8 +- 1%").replace("2000.0", "1500 +- 30%"))
    run = written(tmp_path / "run", record, {"force_n": push(TIME_S) * pushed}, BODY)
    right = written(tmp_path / "right", {"accel_z_mps2": moved["accel_z_mps2"]}, {"force_n": push(TIME_S)}, BODY)
    for verb in ("compare", "identify"):
        for runs in ([run], [right, run]):
            with pytest.raises(BadInput, match=words) as refused:
                main([verb, "--vehicle", str(tmp_path / "bench.yaml"), *map(str, runs)])
            assert str(refused.value).startswith(f"{run}:")


def test_a_number_far_from_what_its_file_knows_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bench, push, moved = ringing(6.0)
    record = {"displacement_m": moved["displacement_m"]}
    (tmp_path / "bench.yaml").write_text(bench.yaml.replace("2000.0", "1800 +- 2%"))
    run = written(tmp_path / "run", record, {"force_n": push(TIME_S)}, BODY)
    assert main(["identify", "--vehicle", str(tmp_path / "bench.yaml"), str(run)]) == 0
    assert "stiffness_n_per_m came out 5.3 standard deviations from its prior in" in " ".join(
        "".join(capsys.readouterr()).split())


@pytest.mark.slow
def test_what_hangs_on_a_weighed_mass_is_told_by_its_move_though_other_numbers_are_open(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A shaker's armature of 0.62 kg on 5 kg, whose spring and damper nobody knows."""
    push = noise(25.0, 9.0, 3)
    moved = Bench(5.62, 23000.0, 31.0).moved(NOTHING, push, NOTHING)["accel_z_mps2"]
    read = moved + np.random.default_rng(1).normal(0.0, 0.02, len(moved))
    run = written(tmp_path / "run", {"accel_z_mps2": read}, {"force_n": push(TIME_S)}, BODY)
    (tmp_path / "plate.yaml").write_text("name: plate\nmodel: single_mass\nmass_kg: 5 +- 1%\n"
                                         "stiffness_n_per_m: 16000 +- 50%\ndamping_n_s_per_m: unknown\n")
    assert main(["diagnose", "--vehicle", str(tmp_path / "plate.yaml"), str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == [] and found["beyond_tolerance"]["mass_kg"] == pytest.approx(0.124, abs=0.01)
    assert found["shift_explained_by"]["effect"] == "payload"
    assert found["shift_explained_by"]["parameters"]["mass_kg"] == pytest.approx(0.62, rel=0.12)


@pytest.mark.slow
def test_the_noise_of_what_drives_a_rig_is_in_the_errors_of_its_numbers(tmp_path: Path) -> None:
    """The resonance makes more of it than of all other noise: by the residual's level alone the errors of spring and
    damper over the mass would be a quarter. (The scale of all three is that of the sensor.)"""
    bench, over_mass, off = Bench(0.8, 2000.0, 2.0), np.array([[-1.0, 1, 0], [-1, 0, 1]]), []
    (tmp_path / "bench.yaml").write_text(bench.yaml.replace("2000.0", "1800 +- 50%").replace("2.0\n", "unknown\n"))
    for seed in range(3):
        push = noise(30.0, 8.0, 4 + seed)
        record = {"displacement_m": bench.moved(NOTHING, push, NOTHING)["displacement_m"]}
        force_n = push(TIME_S) + np.random.default_rng(seed).normal(0.0, 0.16, len(TIME_S))
        run = written(tmp_path / f"run{seed}", record, {"force_n": force_n}, BODY)
        posterior = bench_with(CompareQuestion(tmp_path / "bench.yaml", [run])).posterior()
        model = fit_to_the_end(align(posterior, posterior.start()))
        found = posterior.prior.vehicle(posterior.vehicle, model.state.logs)
        logs = np.log([read(found, name) / true for name, true in zip(
            posterior.prior.names, (0.8, 2000.0, 2.0), strict=True)])
        covariance = over_mass @ standard_errors(model).covariance @ over_mass.T
        off += [*(over_mass @ logs / np.sqrt(np.diag(covariance)))]
    assert np.sqrt(np.mean(np.square(off))) < 2.0


@pytest.mark.slow
def test_two_effects_are_added_together(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Either alone is biased, and it is said that more is missing."""
    way = noise(8.0, 0.004, 6)
    rate = way(TIME_S, 1)
    force_n = np.where(rate > 0, 130.0, 90.0) * rate + 3.0 * np.tanh(rate / 0.002)
    force_n += np.random.default_rng(1).normal(0.0, 0.05, len(TIME_S))
    run = written(tmp_path / "run", {"force_n": force_n}, {"displacement_m": way(TIME_S)}, "source: me\n")
    (tmp_path / "part.yaml").write_text("name: part\nmodel: component\nstiffness_n_per_m: 0 +- 100\n"
                                        "damping_n_s_per_m: 100 +- 50%\npreload_n: unknown\n")

    def added(names: str) -> str:
        assert main(["add-effect", names, "--vehicle", str(tmp_path / "part.yaml"), "--out",
                     str(tmp_path / "with.yaml"), str(run)]) == 0
        return " ".join(capsys.readouterr().out.split())

    assert "Something more is missing" in added("damper_asymmetry")
    assert "Something more is missing" not in added("damper_asymmetry+dry_friction:transition_velocity_m_per_s=2e-3")
    values = {one.effect.name: one.values for one in ridelog.read_vehicle(tmp_path / "with.yaml").effects}
    assert values["dry_friction"]["friction_force_n"] == pytest.approx(3.0, rel=0.02)
    assert values["damper_asymmetry"]["rebound_to_bump_ratio"] == pytest.approx(130 / 90, rel=0.01)


def test_the_zeros_of_sensors_are_in_no_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bench, push, seen = ringing(6.0)
    (tmp_path / "bench.yaml").write_text(bench.yaml)
    errors = []
    for zero in (0.0, 1.5):
        run = written(tmp_path / f"zero-{zero:g}", {"accel_z_mps2": seen["accel_z_mps2"] + zero,
                                                    "displacement_m": seen["displacement_m"] + 0.01 * zero},
                      {"force_n": push(TIME_S)}, BODY)
        assert main(["compare", "--vehicle", str(tmp_path / "bench.yaml"), "--json", "--anyway", str(run)]) == 0
        errors.append(json.loads(capsys.readouterr().out)["error"])
    assert errors[1] == pytest.approx(errors[0], rel=1e-3) and errors[1] < 0.01


@pytest.mark.parametrize(("times", "words"), [
    (-1.0, r"found -\S+ times what the model says: it looks like the opposite sign \("),
    (0.0, "drive.csv: expected displacement_m after the first 2 s, found zeros only"), *slow(
        (1000.0, r"expected displacement_m in m, found \d+ times .* it looks like mm \("), (2.0, None))],
    ids=["turned over", "none", "mm", "twice"])
def test_another_unit_or_sign_of_another_signal_is_said(
        tmp_path: Path, times: float, words: str | None, capsys: pytest.CaptureFixture[str]) -> None:
    """Its spring a third too soft in the file; a gain of two is no unit."""
    bench, push, seen = ringing(6.0)
    (tmp_path / "bench.yaml").write_text(bench.yaml.replace("2000.0", "1500 +- 30%"))
    run = written(tmp_path / "run", {**{name: seen[name] for name in ("accel_z_mps2", "velocity_mps", "travel_m")},
                                     "displacement_m": times * seen["displacement_m"]}, {"force_n": push(TIME_S)}, BODY)
    asked = ["compare", "--vehicle", str(tmp_path / "bench.yaml"), str(run)]
    if words is None:
        assert main(asked) == 0
        return
    with pytest.raises(BadInput, match=words):
        main(asked)
    if times:
        assert main([*asked, "--anyway"]) == 0
        assert "it leaves more than noise of displacement_m." in capsys.readouterr().out.replace("\n", " ")


def test_runs_of_which_the_first_signals_have_other_units_are_refused(tmp_path: Path) -> None:
    bench, push, seen = ringing(6.0)
    (tmp_path / "bench.yaml").write_text(bench.yaml)
    runs = [str(written(tmp_path / name, {name: seen[name]}, {"force_n": push(TIME_S)}, BODY))
            for name in ("accel_z_mps2", "displacement_m")]
    for verb, more in (("compare", []), ("identify", ["--free", "stiffness_n_per_m"])):
        with pytest.raises(BadInput, match=r"expected a column accel_z_mps2, as in .*, found displacement_m first"):
            main([verb, "--vehicle", str(tmp_path / "bench.yaml"), *runs, *more])


def test_a_mass_that_its_base_moves_against_the_force_on_it_is_not_called_upside_down(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bench, push, _ = ringing(6.0)
    base = Course(RATE_HZ, -2.0 * push(TIME_S) / bench.spring)
    seen = bench.moved(base, push, NOTHING)["accel_z_mps2"]
    run = written(tmp_path / "run", {"accel_z_mps2": seen}, {"elevation_m": base(TIME_S), "force_n": push(TIME_S)},
                  BODY)
    (tmp_path / "bench.yaml").write_text(bench.yaml)
    assert main(["compare", "--vehicle", str(tmp_path / "bench.yaml"), "--json", str(run)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["error"] < 0.003
    assert not any("small errors in the parameters" in one for one in found["evidence"])  # there is nothing to explain


@pytest.mark.slow
def test_a_wheel_s_accelerometer_in_g_is_told_though_no_numbers_are_known(tmp_path: Path) -> None:
    bench, push, base = Bench(2.5, 900.0, 12.0, 0.0, 0.4, 5400.0), noise(20.0, 8.0, 2), noise(15.0, 2e-3, 1)
    seen = bench.moved(base, push, NOTHING)
    wheel = CubicSpline(TIME_S, seen["wheel_m"])(TIME_S, 2) / 9.80665
    text = bench.yaml
    for number in ("2.5", "0.4", "900.0", "12.0", "5400.0"):
        text = text.replace(f" {number}", f" {0.9 * float(number):g} +- 50%")
    (tmp_path / "bench.yaml").write_text(text)
    run = written(tmp_path / "run", {"accel_z_mps2": seen["accel_z_mps2"], "wheel_mps2": wheel},
                  {"elevation_m": base(TIME_S), "force_n": push(TIME_S)},
                  BODY + "signals: {wheel_mps2: {measures: acceleration, of: wheel}}\n")
    with pytest.raises(BadInput, match=r"expected wheel_mps2 in m/s2, found 0\.1\d+ times .* it looks like g \("):
        main(["compare", "--vehicle", str(tmp_path / "bench.yaml"), str(run)])


@pytest.mark.parametrize(("gains", "errors", "as_read", "is_misread"), [
    ([1.0, 9.8], [0.1, 0.1], None, True), ([1.0, -1.0], [0.1, 0.1], None, True),
    ([1.0, 9.8], [0.1, 0.1], [0.1, 0.2], False),  # another rig explains it as it was read
    ([9.8, 9.8], [0.1, 0.1], None, False),  # so does the first signal
    ([1.0, 9.8], [0.5, 0.1], None, False), ([1.0, 9.8], [0.1, 0.5], None, False),
    ([1.0, 4.0], [0.1, 0.1], None, False)])
def test_a_signal_is_misread_where_it_alone_follows_times_a_factor(
        gains: list[float], errors: list[float], as_read: list[float] | None, is_misread: bool) -> None:
    run = SimpleNamespace(signals=[SimpleNamespace(measures="acceleration")])
    rig = LikeliestRig([np.array(gains)], [np.array(errors)], 5.0, [] if as_read is None else [np.array(as_read)])
    assert rig.misread_signals([run])[0].tolist() == [is_misread]  # type: ignore[list-item]


@pytest.mark.parametrize(("damper", "refused"), [("1500 +- 20%", True), *slow(("unknown", False))])
def test_a_part_whose_force_is_in_kilonewtons_is_refused_if_its_damper_is_known(
        tmp_path: Path, damper: str, refused: bool) -> None:
    way = noise(8.0, 0.004, 6)
    force_kn = 1.7 * way(TIME_S, 1) + np.random.default_rng(1).normal(0.0, 0.002, len(TIME_S))
    run = written(tmp_path / "run", {"force_n": force_kn}, {"displacement_m": way(TIME_S)}, "source: me\n")
    (tmp_path / "part.yaml").write_text("name: part\nmodel: component\nstiffness_n_per_m: 0 +- 2000\n"
                                        f"damping_n_s_per_m: {damper}\npreload_n: unknown\n")
    asked = ["compare", "--vehicle", str(tmp_path / "part.yaml"), str(run)]
    if refused:
        with pytest.raises(BadInput, match=r"found force_n 0\.00\d+ times .* it looks like force_n in kN"):
            main(asked)
    else:
        assert main(asked) == 0


@pytest.mark.parametrize(("spoilt", "words"), [
    (lambda force_n: -force_n, "found the opposite sign"),
    (lambda force_n: np.clip(force_n, -0.6, 0.4), "of them exactly at the largest or smallest value"),
    (lambda force_n: np.where(abs(TIME_S - 5.0) < 0.5, 0.3, force_n), "found 0.3 from 4.504 to"),
], ids=["sign", "clipped", "stuck"])
def test_a_force_that_was_not_measured_rightly_is_refused_in_one_line(
        tmp_path: Path, spoilt: Callable[[Array], Array], words: str) -> None:
    way = noise(8.0, 0.004, 6)
    force_n = 90.0 * way(TIME_S) + 4.0 * way(TIME_S, 1) + np.random.default_rng(1).normal(0.0, 0.002, len(TIME_S))
    run = written(tmp_path / "run", {"force_n": spoilt(force_n)}, {"displacement_m": way(TIME_S)}, "source: me\n")
    (tmp_path / "part.yaml").write_text(
        "name: part\nmodel: component\ndamping_n_s_per_m: 5\npreload_n: 0\nstiffness_n_per_m: 100\n")
    for verb, more in (("compare", []), ("identify", ["--free", "damping_n_s_per_m"])):
        with pytest.raises(BadInput, match=f"run/drive.csv: force_n: expected .*{words}"):
            main([verb, "--vehicle", str(tmp_path / "part.yaml"), str(run), *more])


def identified(capsys: pytest.CaptureFixture[str], vehicle: Path, run: Path, *more: str) -> dict[str, Any]:
    assert main(["identify", "--vehicle", str(vehicle), str(run), "--json", *more]) == 0
    return dict(json.loads(capsys.readouterr().out))


@pytest.mark.slow
def test_what_a_file_does_not_know_is_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of a spring with 37 N of preload, and of no damper at all: none within its standard error."""
    way = noise(8.0, 0.004, 6)
    force_n = 2e4 * way(TIME_S) + 37.0 + np.random.default_rng(1).normal(0.0, 0.5, len(TIME_S))
    run = written(tmp_path / "run", {"force_n": force_n}, {"displacement_m": way(TIME_S)}, "source: me\n")
    (part := tmp_path / "part.yaml").write_text("name: part\nmodel: component\ndamping_n_s_per_m: unknown\n"
                                                "stiffness_n_per_m: 3e4 +- 30%\npreload_n: unknown\n")
    found = identified(capsys, part, run, "--out", str(tmp_path / "found.yaml"))
    for name, true in {"preload_n": 37.0, "stiffness_n_per_m": 2e4, "damping_n_s_per_m": 0.0}.items():
        assert abs(found["parameters"][name] - true) < 3 * found["standard_errors"][name]
    assert 0 < found["standard_errors"]["damping_n_s_per_m"] < 1
    assert found["cannot_tell"] == []
    again = identified(capsys, tmp_path / "found.yaml", run)
    assert again["parameters"] == pytest.approx(found["parameters"], rel=1e-3)
    one = identified(capsys, part, run, "--free", "stiffness_n_per_m")
    assert set(one["parameters"]) == set(found["parameters"])
    part.write_text("name: part\nmodel: component\ndamping_n_s_per_m: 1\nstiffness_n_per_m: 2e4\n")
    with pytest.raises(BadInput, match=r"--free: expected the parameters to fit, as .* gives all of them exactly"):
        main(["identify", "--vehicle", str(part), str(run)])


@pytest.mark.parametrize(("bench", "signal", "mass"), [
    (Bench(2.0, 1e5, 60.0), "displacement_m", "2 +- 5%"),  # 36 Hz
    (Bench(0.02, 600.0, 0.3), "accel_z_mps2", "unknown"),  # 28 Hz
    (Bench(50.0, 400.0, 20.0), "velocity_mps", "50 +- 5%"),  # 0.45 Hz
    (Bench(5.0, 8e3, 30.0, wheel=1.0, tire=3e4), "accel_z_mps2", "5.0"),  # 5.6 and 31 Hz
], ids=["stiff", "small", "slow", "two-masses"])
def test_modes_far_from_those_of_a_car_are_found(bench: Bench, signal: str, mass: str, tmp_path: Path,
                                                 capsys: pytest.CaptureFixture[str]) -> None:
    """Of a rig whose springs and dampers its file calls unknown."""
    push = noise(40.0, bench.mass, 7)
    seen = bench.moved(NOTHING, push, NOTHING)[signal]
    run = written(tmp_path / "run", {signal: seen + np.random.default_rng(1).normal(0.0, 0.01 * seen.std(), len(seen))},
                  {"force_n": push(TIME_S)}, BODY)
    unknown = re.sub(r"((?:stiffness|damping)_\w+): .*", r"\1: unknown", bench.yaml)
    (rig := tmp_path / "rig.yaml").write_text(re.sub(r"\bmass_kg: .*", f"mass_kg: {mass}", unknown))
    found = identified(capsys, rig, run)
    true = {"mass_kg": bench.mass, "stiffness_n_per_m": bench.spring, "damping_n_s_per_m": bench.damper}
    true |= {f"front.suspension_{name}": true[name] for name in ("stiffness_n_per_m", "damping_n_s_per_m")}
    true["front.tire_stiffness_n_per_m"] = bench.tire
    for name, value in found["parameters"].items():
        assert value == pytest.approx(true[name], abs=4 * found["standard_errors"][name])


@pytest.mark.parametrize(("rests", "lasts", "sign"), [(7500, 2000, 1), (0, 800, 1), (0, 2000, -1)],
                         ids=["after-a-rest", "short", "upside-down"])
def test_modes_are_found_wherever_they_are_in_a_record(rests: int, lasts: int, sign: int, tmp_path: Path,
                                                       capsys: pytest.CaptureFixture[str]) -> None:
    """Of 36 Hz; a record that is upside down is called so, unless the model's forces are."""
    bench, push = Bench(2.0, 1e5, 60.0), noise(40.0, 2.0, 7)
    seen = sign * bench.moved(NOTHING, push, NOTHING)["accel_z_mps2"][:lasts]
    (run := tmp_path / "run").mkdir()
    for name, column, samples in (("drive", "accel_z_mps2", seen), ("excitation", "force_n", push(TIME_S[:lasts]))):
        whole = np.concatenate([np.random.default_rng(1).normal(0.0, 1e-3 * samples.std(), rests), samples])
        np.savetxt(run / f"{name}.csv", np.stack([np.arange(len(whole)) / RATE_HZ, whole], axis=1), "%.9g", ",",
                   header=f"t_s,{column}", comments="")
    (run / "run.yaml").write_text(BODY)
    (rig := tmp_path / "rig.yaml").write_text("name: rig\nmodel: single_mass\nmass_kg: 2 +- 1%\n"
                                              "stiffness_n_per_m: unknown\ndamping_n_s_per_m: unknown\n")
    if sign < 0:
        with pytest.raises(BadInput, match="expected it to follow force_n, found the opposite sign"):
            ridelog.identify(rig, run)
        rig.write_text(rig.read_text() + "effects: [{name: force_gain, gain: -1.0}]\n")
    assert identified(capsys, rig, run)["parameters"]["stiffness_n_per_m"] == pytest.approx(1e5, rel=0.03)


@pytest.mark.slow
def test_no_size_is_seen_in_accelerations_of_a_mass_that_little_damps(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """13 t, 12 in its file: all that is found of it is 8 % too small."""
    way = noise(8.0, 0.004, 6)
    seen = Bench(13e3, 4e6, 9e3).moved(way, NOTHING, NOTHING)["accel_z_mps2"]
    run = written(tmp_path / "run", {"accel_z_mps2": seen + np.random.default_rng(1).normal(0.0, 0.005, len(seen))},
                  {"elevation_m": way(TIME_S)}, "source: me\n")
    (mass := tmp_path / "mass.yaml").write_text("name: mass\nmodel: single_mass\nmass_kg: 12e3 +- 10%\n"
                                                "stiffness_n_per_m: 3.5e6 +- 30%\ndamping_n_s_per_m: unknown\n")
    assert main(["diagnose", "--vehicle", str(mass), str(run), "--json"]) == 0
    spring = json.loads(capsys.readouterr().out)["fitted_parameters"]["stiffness_n_per_m"]
    assert abs(spring["value"] - 4e6) < 3 * spring["standard_error"]
    assert spring["standard_error"] == pytest.approx(0.095 * spring["value"], rel=0.1)  # with what is known of it


def test_what_accelerations_do_not_show_is_as_uncertain_as_the_file_says(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A mass on a shaken base moves the same with all numbers larger by one factor."""
    true, way = Bench(0.8, 2000.0, 3.0), noise(8.0, 0.004, 6)
    seen = true.moved(way, NOTHING, NOTHING)["accel_z_mps2"]
    run = written(tmp_path / "run", {"accel_z_mps2": seen + np.random.default_rng(1).normal(0.0, 0.02, len(seen))},
                  {"elevation_m": way(TIME_S)}, "source: me\n")
    (mass := tmp_path / "mass.yaml").write_text("name: mass\nmodel: single_mass\nmass_kg: 0.84 +- 5%\n"
                                                "stiffness_n_per_m: [1000, 4000]\ndamping_n_s_per_m: unknown\n")
    found = identified(capsys, mass, run)
    for name, value in {"mass_kg": 0.84, "stiffness_n_per_m": 2100.0, "damping_n_s_per_m": 3.15}.items():
        assert found["parameters"][name] == pytest.approx(value, rel=0.01)
        assert found["standard_errors"][name] == pytest.approx(0.05 * value, rel=0.05)


@pytest.mark.parametrize("rate_hz", [100, 200, 240, 1000])
def test_the_shortest_test_of_a_part_is_compared_at_any_rate(rate_hz: int, tmp_path: Path,
                                                             capsys: pytest.CaptureFixture[str]) -> None:
    """A sine of 5 Hz for just over a second, noise of 0.2 N: a damper of 100 N s/m where the file says 150."""
    time_s = np.arange(int(1.01 * rate_hz)) / rate_hz
    way_m, rate_mps = 0.01 * np.sin(31.416 * time_s), 0.31416 * np.cos(31.416 * time_s)
    drawn = np.random.default_rng(1).normal(0.0, 0.2, len(time_s))
    run = tmp_path / "run"
    run.mkdir()
    for name, head, values in (("excitation.csv", "t_s,displacement_m", way_m),
                               ("drive.csv", "t_s,force_n", 100.0 * rate_mps + drawn)):
        np.savetxt(run / name, np.stack([time_s, values], axis=1), "%.9g", ",", header=head, comments="")
    (tmp_path / "part.yaml").write_text("name: part\nmodel: component\nstiffness_n_per_m: 0 +- 100\n"
                                        "damping_n_s_per_m: 150 +- 60%\npreload_n: 0\n")
    assert main(["compare", "--vehicle", str(tmp_path / "part.yaml"), str(run), "--json"]) == 0
    refitted = json.loads(capsys.readouterr().out)["refitted"]
    assert refitted["shifts"]["damping_n_s_per_m"] == pytest.approx(-1 / 3, abs=0.02)


@pytest.mark.slow
def test_whether_a_record_of_two_signals_follows_its_force_is_seen_in_the_first(tmp_path: Path) -> None:
    """The vehicle's mode lies elsewhere; then under a force that was another test's."""
    _, push, moved = ringing(0.6)
    (tmp_path / "bench.yaml").write_text(
        "name: bench\nmodel: single_mass\nmass_kg: 0.8\nstiffness_n_per_m: 3200 +- 60%\ndamping_n_s_per_m: unknown\n")
    other = noise(30.0, 8.0, 5)
    seen = {name: moved[name] for name in ("displacement_m", "velocity_mps")}
    runs = [str(written(tmp_path / name, seen, {"force_n": force(TIME_S)}, BODY))
            for name, force in (("right", push), ("wrong", other))]
    vehicle = str(tmp_path / "bench.yaml")
    assert main(["compare", "--vehicle", vehicle, runs[0]]) == 0
    with pytest.raises(BadInput, match="is it another run's excitation"):
        main(["compare", "--vehicle", vehicle, runs[1]])


def second_of_a_part(folder: Path, force: Callable[[Array, Array], Array]) -> Path:
    """A record of 1.25 s that ends in the middle of a stroke; its force by travel and rate."""
    folder.mkdir()
    time_s = np.arange(150) / 120
    travel_m, rate_mps = 0.02 * np.cos(9 * time_s) + 0.03, -0.18 * np.sin(9 * time_s)
    for name, column, values in (("excitation.csv", "displacement_m", travel_m),
                                 ("drive.csv", "force_n", force(travel_m, rate_mps))):
        np.savetxt(folder / name, np.stack([time_s, values], axis=1), "%.9g", ",", header=f"t_s,{column}", comments="")
    return folder


def test_a_second_of_a_part_stands_where_its_bench_holds_it(tmp_path: Path) -> None:
    """The approach of 2 s was longer than the record, and drifted off by centimetres: a stop stood elsewhere."""
    run = second_of_a_part(tmp_path / "short", lambda travel_m, rate_mps: 90 * rate_mps + 2e6 * travel_m**3)
    (tmp_path / "part.yaml").write_text(
        "name: part\nmodel: component\nstiffness_n_per_m: 0\ndamping_n_s_per_m: 90\n"
        "effects:\n- {name: progressive_spring, cubic_stiffness_n_per_m3: 2.0e+6}\n")
    assert ridelog.compare(tmp_path / "part.yaml", [run]).error < 0.01


def test_a_second_of_a_part_is_not_cut_to_a_band_as_most_of_it_would_be_lost(tmp_path: Path) -> None:
    run = second_of_a_part(tmp_path / "short", lambda travel_m, rate_mps: 90 * rate_mps + 400 * travel_m)
    (tmp_path / "part.yaml").write_text("name: part\nmodel: component\nstiffness_n_per_m: 400\n"
                                        "damping_n_s_per_m: 80\n")
    with pytest.raises(BadInput, match=r"a record of 1\.9 s or longer where its band is cut.*found 1\.3 s"):
        main(["compare", "--vehicle", str(tmp_path / "part.yaml"), "--low-pass", "20", str(run)])


def test_a_force_may_hum_by_kilonewtons(tmp_path: Path) -> None:
    """It was m/s2, 100 at most, which ended the command."""
    run = second_of_a_part(tmp_path / "short", lambda travel_m, rate_mps: 9e4 * rate_mps + 4e3 * np.sin(
        2 * np.pi * 31 / 120 * np.arange(len(travel_m))))
    (tmp_path / "part.yaml").write_text("name: part\nmodel: component\nstiffness_n_per_m: 0\ndamping_n_s_per_m: 9e+4\n")
    posterior = bench_with(CompareQuestion(tmp_path / "part.yaml", [run])).posterior()
    steady, *_ = HUM.drafts(LawContext(posterior, posterior.start()))
    assert {one.name for one in steady.effect.parameters} == {"cos_n", "sin_n", "frequency_hz"}
    found = HUM.words(steady, chosen(steady.effect, {"cos_n": 4e3, "sin_n": 0.0, "frequency_hz": 31.0}), str)
    assert "a hum of 2.8e+03 N r.m.s." in found
