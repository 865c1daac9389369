"""A mount as a whole, beside an integrator and a fractional law that share nothing with ridelog."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from logger.api.lab.bench import bench_with
from logger.api.lab.question import CompareQuestion
from logger.lab.diagnosis import begin_search
from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.mount_as_a_whole import FAMILY
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen

from ...support.drives.part_bench import RATE_HZ, Array, force_of, moved, write_bench

STIFFNESS, DAMPING = 5e4, 100.0
LAW = {"spring_square_n": 8.0, "spring_cube_n": 5.0, "damper_n": -2.0, "creep_n_per_m": 4e4, "creep_power": 0.4,
       "friction_n": 60.0, "friction_travel_m": 2e-4, "sharpness_ratio": 1.0, "late_travel_ratio": 3.0,
       "late_force_ratio": 1.5, "load_ratio": 0.3}


def test_it_is_the_force_of_its_equations(tmp_path: Path) -> None:
    place_m = moved(3, 6.0, 0.004, 12.0)
    vehicle, run = tmp_path / "part.yaml", write_bench(tmp_path / "run", place_m, np.sin(np.arange(len(place_m)) / 9))
    vehicle.write_text(f"name: part\nmodel: component\nstiffness_n_per_m: {STIFFNESS}\n"
                       f"damping_n_s_per_m: {DAMPING}\npreload_n: 0\n", "utf-8")
    bench = bench_with(CompareQuestion(vehicle, run, anyway=True), thin=False)
    posterior = bench.posterior()
    context = LawContext(posterior, posterior.start([]))
    effect = FAMILY.drafts(context)[0].effect
    law = chosen(effect, effect.usual | LAW)
    usual_m, usual_mps = context.reach("travel_m", 0.9), context.reach("rate_mps", 0.9)
    assert law.values.keys() == {*LAW, "usual_travel_m"}
    rest_m = float(np.mean(place_m - context.responses[0].travel_m[:, 0]))
    branch = STIFFNESS * 0.8 * 4 ** (0.4 * np.arange(4)) / np.sum(4 ** (0.4 * np.arange(4)))
    slides, over_m = 60.0 * 1.5 ** np.arange(3) / np.sum(1.5 ** np.arange(3)), 2e-4 * 3.0 ** np.arange(3)

    def rates(_t: float, _x: float, v: float, state: list[float]) -> list[float]:
        creeping = [v - one / (0.4 / 4**k) for k, one in enumerate(state[:4])]
        return [*creeping, *(v / over * (1 - abs(z) * (v * z > 0)) for z, over in zip(state[4:], over_m, strict=True))]

    def force(x: Array, v: Array, state: Array) -> Array:
        at = (x - rest_m) / usual_m
        return np.asarray(8.0 * at**2 + 5.0 * at**3 - 2.0 * v / usual_mps + branch @ state[:4]
                          + np.maximum(1 + 0.3 * at, 0) * (slides @ state[4:]))

    true_n = force_of(rates, force, 7, place_m)
    with_law_n, linear_n = (bench.runs.predict(compose(bench.model.vehicle, some))[0] for some in ([law], []))
    kept = slice(200, -50)
    assert np.std((with_law_n - linear_n - true_n)[kept]) < 0.02 * np.std(true_n[kept])


@pytest.mark.slow
def test_rubber_of_a_fractional_order_is_found(tmp_path: Path) -> None:
    """Zener's rubber with a derivative of order 0.42, whose file takes its damping for ten times too much: the best of
    LuGre's law, Bouc-Wen's and a branch of Maxwell with friction, each with a spring, leaves .048 on such a record."""
    vehicle, posteriors = tmp_path / "part.yaml", []
    vehicle.write_text("name: part\nmodel: component\nstiffness_n_per_m: 0 +- 300000\n"
                       "damping_n_s_per_m: 9000 +- 100%\npreload_n: unknown\n", "utf-8")
    for seed in (1, 2):
        place_m = moved(seed, 8.0, 0.0015 / seed**0.5, 25.0)
        turn = 2j * np.pi * np.fft.rfftfreq(4 * len(place_m), 1 / RATE_HZ)
        part = (turn * 0.01) ** 0.42
        force_n = np.fft.irfft((1.8e5 + 5.2e5 * part / (1 + part)) * np.fft.rfft(place_m, 4 * len(place_m)))
        noise_n = np.random.default_rng(seed).normal(0, 0.5, len(place_m))
        run = write_bench(tmp_path / f"run{seed}", place_m, force_n[: len(place_m)] + noise_n)
        posteriors.append(bench_with(CompareQuestion(vehicle, run)).posterior(searches=seed == 1))
    seen, kept = posteriors
    search, before = begin_search(seen, {}, (), lambda words: None)
    found = search.best_of(FAMILY.drafts(LawContext(seen, before.state))[0].effect, before, {}).state
    run = kept.runs.runs[0]
    left = (run.main(kept.state_at(found.effects, found.logs).predictions[0]) - run.measured_mps2)[run.first:]
    assert float(np.std(left) / np.std(run.measured_mps2[run.first:])) < 0.03
