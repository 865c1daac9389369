"""Force curves of a fitted car, against laws written by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from logger.lab.residuals.fitted_laws import RATE, fitted_car
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_model
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.effects.damper_blow_off import EFFECT as BLOW_OFF
from logger.vehicle.effects.roll import EFFECT as ROLL


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
