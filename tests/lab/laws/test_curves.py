"""Curves of a motion: one that rests for half of the time, as a decay does that has died away, has one point at rest; a
damper's is behind the spring of its oil, beside an integrator that shares nothing with ridelog."""

from pathlib import Path

import numpy as np

from logger.api.lab.bench import bench_with
from logger.api.lab.question import CompareQuestion
from logger.lab.laws.families import force_by_rate, force_by_travel
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen
from logger.vehicle.effects.top_mount_compliance import EFFECT as MOUNT

from ...support.drives.part_bench import force_of, moved, write_bench

DAMPING, OIL = 900.0, 1.5e5


def test_a_motion_that_rests_for_half_of_the_time_has_one_point_at_rest() -> None:
    law = force_by_travel.FAMILY.free("curve", [0.0, 0.01, 0.03], 5.0)
    assert law.places == (-0.03, -0.01, 0.01, 0.03)


def test_a_damper_s_curve_is_behind_the_spring_of_its_oil(tmp_path: Path) -> None:
    """A valve that opens at other rates in rebound than in compression: F = law(x' - F' / k)."""
    draft = force_by_rate.FAMILY.free("curve", [0.05, 0.2, 0.5], 100.0)
    values = dict(zip(draft.strengths, (-200.0, -120.0, -60.0, 40.0, 160.0, 700.0), strict=True))
    law = chosen(draft.effect, draft.effect.usual | values)
    at_mps = np.linspace(-2.0, 2.0, 40001)
    by_rate_n = DAMPING * at_mps + draft.force_n(values, at_mps, DAMPING)
    place_m = moved(3, 6.0, 0.02, 8.0)

    def rates(_t: float, x: float, _v: float, state: list[float]) -> list[float]:
        return [float(np.interp(OIL * (x - state[0]), by_rate_n, at_mps))]

    true_n = force_of(rates, lambda x, v, s: OIL * (x - s[0]), 1, place_m)
    vehicle, run = tmp_path / "part.yaml", write_bench(tmp_path / "run", place_m, true_n)
    vehicle.write_text(f"name: part\nmodel: component\nstiffness_n_per_m: 0\ndamping_n_s_per_m: {DAMPING}\n"
                       "preload_n: 0\n", "utf-8")
    bench = bench_with(CompareQuestion(vehicle, run, anyway=True), thin=False)
    oil = chosen(MOUNT, MOUNT.usual | {"mount_stiffness_n_per_m": OIL})
    rigid_n, found_n = (bench.runs.predict(compose(bench.model.vehicle, some))[0] for some in ([law], [law, oil]))
    kept = slice(100, -50)
    assert np.std((found_n - true_n)[kept]) < 0.01 * np.std((rigid_n - true_n)[kept])
