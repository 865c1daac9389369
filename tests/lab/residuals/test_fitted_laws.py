"""Force curves of a fitted car, against laws written by hand."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from logger.api.lab.bench import bench_with
from logger.api.lab.question import CompareQuestion
from logger.lab.diagnosis import refit
from logger.lab.residuals.fitted_laws import RATE, fitted_car, force_by_rate
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_model
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.effects.damper_blow_off import EFFECT as BLOW_OFF
from logger.vehicle.effects.roll import EFFECT as ROLL
from logger.vehicle.uncertain import NumberErrors

from ...support.drives.part_bench import RATE_HZ, moved, write_bench


@pytest.mark.parametrize("more", [[], [chosen(ROLL, {"track_width_m": 1.5, "roll_inertia_kg_m2": 500.0})]])
def test_a_damper_is_compared_with_that_of_the_same_axle(more: list[Chosen]) -> None:
    """Beyond its knee a damper falls to 0.4 of its slope, on two wheels or on the four of a car that rolls."""
    vehicle = read_model(vehicle_file("rav4-2009")).vehicle
    fitted = [chosen(BLOW_OFF, {"knee_velocity_m_per_s": 0.1, "slope_ratio": 0.4}), *more]
    wheels = 4 if more else 2
    motion = np.linspace(-0.5, 0.5, 1001)[:, None] * np.ones(wheels)
    posterior = SimpleNamespace(
        prior=SimpleNamespace(names=(), deviations=()), car=lambda effects, _: compose(vehicle, effects),
        runs=SimpleNamespace(runs=[SimpleNamespace(first=0)],
                             respond=lambda car, _: [SimpleNamespace(rate_mps=motion, travel_m=motion / 10)]),
        distance_error_m=lambda record: None)
    states = (SimpleNamespace(effects=effects, logs=np.zeros(0), record=None) for effects in ([], fitted))
    found = fitted_car(cast(Any, posterior), *cast(Any, states))
    curves = [curve for curve in found.curves if curve.motion == RATE]
    assert [curve.axle for curve in curves] == ["front", "rear"]
    for curve, axle in zip(curves, (vehicle.front, vehicle.rear), strict=True):
        assert axle is not None
        slope, rate = axle.suspension_damping_n_s_per_m, np.abs(curve.at)
        assert curve.before_n == pytest.approx(slope * curve.at)
        by_hand = np.sign(curve.at) * slope * np.where(rate < 0.1, rate, 0.1 + 0.4 * (rate - 0.1))
        assert curve.after_n == pytest.approx(by_hand, abs=1e-6)


def test_of_a_part_the_force_is_shown_over_its_motion_sample_by_sample(tmp_path: Path) -> None:
    """A damper of 900 N s/m, whose file says 450, on a spring."""
    place_m = moved(3, 6.0, 0.02, 8.0)
    rate_mps = np.gradient(place_m, 1 / RATE_HZ)
    force_n = 900.0 * rate_mps + 2000.0 * place_m
    vehicle, run = tmp_path / "part.yaml", write_bench(tmp_path / "run", place_m, force_n)
    vehicle.write_text("name: part\nmodel: component\nstiffness_n_per_m: 2000 +- 10%\ndamping_n_s_per_m: 450 +- 100%\n"
                       "preload_n: 0\n", "utf-8")
    posterior = bench_with(CompareQuestion(vehicle, run, anyway=True), thin=False).posterior()
    stood = posterior.start([])
    part = fitted_car(posterior, stood, refit(posterior, stood).state).on_bench
    assert part is not None
    np.testing.assert_allclose(np.diff(part.travel_m), np.diff(place_m[-len(part.travel_m):]), atol=1e-5)
    of = np.stack([part.travel_m, part.rate_mps, np.ones(len(part.rate_mps))], axis=1)
    for force, damping in ((part.before_n, 450.0), (part.after_n, 900.0), (part.measured_n, 900.0)):
        assert np.linalg.lstsq(of, force)[0][:2] == pytest.approx([2000.0, damping], rel=0.02)


def test_errors_of_damping_and_knee_are_those_of_the_force() -> None:
    """c v up to the knee w, c (w + s (v - w)) beyond: the derivative by w is c (1 - s)."""
    vehicle = read_model(vehicle_file("rav4-2009")).vehicle
    damping, at_mps = vehicle.front.suspension_damping_n_s_per_m, np.array([-0.3, -0.05, 0.05, 0.3])
    knee = chosen(BLOW_OFF, {"knee_velocity_m_per_s": 0.1, "slope_ratio": 0.4})
    force_n, error_n = force_by_rate(vehicle, [knee], NumberErrors({
        "front.suspension_damping_n_s_per_m": 0.001 * damping, "damper_blow_off.knee_velocity_m_per_s": 1e-4},
        ((), (0.0,))), at_mps)
    assert force_n == pytest.approx(damping * np.array([-0.18, -0.05, 0.05, 0.18]))
    beyond, before = 1e-4 * damping * np.hypot(1.8, 0.6), 5e-5 * damping
    assert error_n == pytest.approx([beyond, before, before, beyond], rel=0.01)
