"""What slides behind a spring: beside an integrator that shares nothing with ridelog, and on a damper's bench."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

from logger.api.lab.bench import Bench, bench_with
from logger.api.lab.question import CompareQuestion
from logger.commands.main import main
from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.sliding_behind_spring import FAMILY
from logger.lab.selection.add_effect import _best_trial
from logger.vehicle.compose import compose
from logger.vehicle.effect import Effect, chosen

from ...support.drives.part_bench import Array, fitted_error, force_of, moved, write_bench, write_part

FORCE_N, OVER_M, POWER, STIFFNESS, DAMPING = 400.0, 0.002, 3.0, 2000.0, 300.0


def true_force(place_m: Array, rate_mps: float) -> Array:
    """Its equations as its docstring has them: shortening is a negative force."""
    def rates(_t: float, _x: float, v: float, state: list[float]) -> list[float]:
        s = state[0] / OVER_M
        return [v - (rate_mps if s > 0 else -rate_mps) * abs(s) ** POWER]

    def force(x: Array, v: Array, s: Array) -> Array:
        return STIFFNESS * x + DAMPING * v + FORCE_N * s[0] / OVER_M

    return force_of(rates, force, 1, place_m)


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


def test_it_is_the_force_of_its_equations(tmp_path: Path) -> None:
    place_m = moved(1, 8.0, 0.02, 6.0)
    found, linear_n, rate_mps = predicted(tmp_path, place_m, {
        "sliding_force_n": FORCE_N, "yield_travel_m": OVER_M, "power_ratio": POWER})
    true_n = true_force(place_m, rate_mps)
    kept = slice(100, -50)
    assert np.std((found - true_n)[kept]) < 0.01 * np.std((linear_n - true_n)[kept])


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
