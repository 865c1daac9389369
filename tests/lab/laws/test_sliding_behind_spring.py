"""What slides behind a spring: beside an integrator that shares nothing with ridelog, and on a damper's bench."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from logger.api.lab.bench import Bench, bench_with
from logger.api.lab.question import CompareQuestion
from logger.commands.main import main
from logger.lab.diagnosis import begin_search
from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.sliding_behind_spring import FAMILY
from logger.lab.selection.add_effect import _best_trial
from logger.vehicle.compose import compose
from logger.vehicle.effect import Effect, chosen

from ...support.drives.part_bench import RATE_HZ, Array, fitted_error, force_of, moved, write_bench, write_part

FORCE_N, OVER_M, POWER, STIFFNESS, DAMPING = 400.0, 0.002, 3.0, 2000.0, 300.0
BACKLASH_M = 4e-4


def test_a_part_without_spring_and_damper_gives_no_size_to_begin_with() -> None:
    nothing = SimpleNamespace(suspension_stiffness_n_per_m=0.0, suspension_damping_n_s_per_m=0.0)
    context = SimpleNamespace(vehicle=SimpleNamespace(front=nothing, is_part=True), reach=lambda what, share: 0.02)
    assert FAMILY.drafts(context) == []  # type: ignore[arg-type]


def true_force(place_m: Array, rate_mps: float, play_m: float) -> Array:
    """Its equations as its docstring has them: shortening is a negative force."""
    def pulls(s: Array | float) -> Array:
        return np.asarray((s - np.clip(s, -play_m, play_m)) / OVER_M)

    def rates(_t: float, _x: float, v: float, state: list[float]) -> list[float]:
        s = float(pulls(state[0]))
        return [v - (rate_mps if s > 0 else -rate_mps) * abs(s) ** POWER]

    def force(x: Array, v: Array, s: Array) -> Array:
        return STIFFNESS * x + DAMPING * v + FORCE_N * pulls(s[0])

    return force_of(rates, force, 1, place_m)


def backlash(place_m: Array) -> Array:
    """A brake of 260 N that is 15 % stronger where it is slow, behind 2 MN/m with play."""
    stiffness, times = 2e6, 20
    fine = np.arange(len(place_m) * times) / times
    x = CubicSpline(np.arange(len(place_m)), place_m)(np.minimum(fine, len(place_m) - 1))
    slack, at = BACKLASH_M + 260.0 / stiffness, 0.0
    stood = np.array([at := min(max(at, each - slack), each + slack) for each in x])
    stretch = x - stood
    brakes = 1 + 0.15 * np.exp(-np.abs(np.gradient(x)) * times * RATE_HZ / 0.03)
    return np.asarray((stiffness * (stretch - np.clip(stretch, -BACKLASH_M, BACKLASH_M)) * brakes)[::times])


def bench_of(folder: Path, place_m: Array) -> tuple[Bench, Effect]:
    """A part's bench, and a law of the family."""
    vehicle, run = folder / "part.yaml", write_bench(folder / "run", place_m, np.sin(np.arange(len(place_m)) / 9))
    vehicle.write_text(f"name: part\nmodel: component\nstiffness_n_per_m: {STIFFNESS}\n"
                       f"damping_n_s_per_m: {DAMPING}\npreload_n: 0\n")
    bench = bench_with(CompareQuestion(vehicle, run, anyway=True), thin=False)
    posterior = bench.posterior()
    context = LawContext(posterior, posterior.start([]))
    return bench, FAMILY.drafts(context)[0].effect


def predicted(folder: Path, place_m: Array, values: dict[str, float]) -> tuple[Array, Array, float]:
    """Forces (n,) of a part with the law, and without it; the rate at which the law has its force."""
    bench, effect = bench_of(folder, place_m)
    law = chosen(effect, effect.usual | values)
    found, linear_n = (bench.runs.predict(compose(bench.model.vehicle, some))[0] for some in ([law], []))
    return found, linear_n, law.values["sliding_rate_m_per_s"]


@pytest.mark.slow
def test_the_file_of_a_law_is_kept_where_its_fit_begins_at_another_size(tmp_path: Path) -> None:
    bench, effect = bench_of(tmp_path, moved(1, 4.0, 0.02, 6.0))
    posterior = bench.posterior(searches=True)
    begun = _best_trial(posterior, posterior.start([]), (chosen(effect, effect.usual, file="law.py"),))
    assert begun is not None and begun.effects[-1].file == "law.py"


@pytest.mark.slow
def test_what_nobody_knows_of_its_beginning_pulls_no_harder_than_it_slides(tmp_path: Path) -> None:
    """Friction that gives over 20 um: what slides forgets its beginning within the samples that are left out, which
    fix no state of it."""
    found, linear_n, _ = predicted(tmp_path, moved(1, 8.0, 0.02, 6.0), {
        "sliding_force_n": FORCE_N, "yield_travel_m": 2e-5, "power_ratio": 8.5})
    assert 0.8 * FORCE_N < np.abs(found - linear_n).max() < 1.5 * FORCE_N


@pytest.mark.parametrize("play_m", [0.0, 0.001])
def test_it_is_the_force_of_its_equations(tmp_path: Path, play_m: float) -> None:
    place_m = moved(1, 8.0, 0.02, 6.0)
    found, linear_n, rate_mps = predicted(tmp_path, place_m, {
        "sliding_force_n": FORCE_N, "yield_travel_m": OVER_M, "power_ratio": POWER, "play_m": play_m})
    true_n = true_force(place_m, rate_mps, play_m)
    kept = slice(100, -50)
    assert np.std((found - true_n)[kept]) < 0.01 * np.std((linear_n - true_n)[kept])


@pytest.mark.slow
def test_friction_with_backlash_is_nearer_than_lugre_and_bouc_wen(tmp_path: Path) -> None:
    """On its bench, its file's numbers of the right size: fitted to one record, and asked for another."""
    places = [moved(seed, 12.0, share * 0.008, 4.0) for seed, share in ((1, 1.0), (2, 0.7))]
    forces = [backlash(one) + np.random.default_rng(seed).normal(0, 0.6, len(one)) for seed, one in enumerate(places)]
    vehicle = tmp_path / "part.yaml"
    vehicle.write_text("name: part\nmodel: component\nstiffness_n_per_m: 0 +- 60000\n"
                       "damping_n_s_per_m: 5000 +- 100%\npreload_n: unknown\n", "utf-8")
    seen, kept = (bench_with(CompareQuestion(vehicle, write_bench(tmp_path / name, *one)), thin=False).posterior(
        searches=name == "seen") for name, one in zip(("seen", "kept"), zip(places, forces, strict=True), strict=True))
    search, before = begin_search(seen, {}, (), lambda words: None)
    draft = FAMILY.drafts(LawContext(seen, before.state))[1]
    found = search.best_of(draft.effect, before, {}).state
    play_m = found.effects[-1].values["play_m"]
    assert abs(play_m - BACKLASH_M) < 0.05 * BACKLASH_M
    run = kept.runs.runs[0]
    left = run.main(kept.state_at(found.effects, found.logs).predictions[0]) - run.measured_mps2
    ours = left[run.first:].std() / forces[1].std()
    theirs = min(fitted_error(name, [(places[0], forces[0])], (places[1], forces[1])) for name in ("lugre", "bouc_wen"))
    print(f"ours {ours:.4f}, theirs {theirs:.4f}, play {1e6 * play_m:.1f} um")
    assert ours < 0.5 * theirs


@pytest.mark.release
def test_a_damper_s_law_is_nearer_than_lugre_and_bouc_wen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    vehicle, runs, kept = write_part(tmp_path, "valves with play")
    law, better = tmp_path / "law.py", tmp_path / "better.yaml"
    assert main(["learn", "--vehicle", str(vehicle), "--out", str(law), *map(str, runs)]) == 0
    advice = capsys.readouterr().out.partition("Next: ridelog ")[2].splitlines()[0]
    assert main(shlex.split(advice.replace("with-law.yaml", str(better)))) == 0
    capsys.readouterr()
    main(["compare", "--vehicle", str(better), str(write_bench(tmp_path / "kept", *kept)), "--json"])
    ours = json.loads(capsys.readouterr().out)["error"]
    columns = [[np.loadtxt(run / name, delimiter=",", skiprows=1)[:, 1] for name in ("excitation.csv", "drive.csv")]
               for run in runs]
    theirs = min(fitted_error(name, [(one, two) for one, two in columns], kept) for name in ("lugre", "bouc_wen"))
    assert ours < 0.5 * theirs
