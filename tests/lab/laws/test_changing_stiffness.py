"""A stiffness that changed long ago is another stiffness: beside a car that has it from the beginning."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.lab.laws.families.changing_stiffness import _draft
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen
from logger.vehicle.vehicle import Axle

from ...support.lab.secret_runs import CAR, secret_runs

LONG_AFTER = slice(600, None)  # ten time constants, and what rings after them


@pytest.mark.slow
@pytest.mark.parametrize(("of", "number"), [("springs", "suspension_stiffness_n_per_m"),
                                            ("tires", "tire_stiffness_n_per_m")])
def test_long_after_it_is_a_car_with_that_stiffness(of: str, number: str) -> None:
    def changed(axle: Axle | None) -> Axle | None:
        return axle and replace(axle, **{number: getattr(axle, number) + 5000.0})

    runs = SimulatedRuns(secret_runs().runs)
    law = chosen(_draft(of, 50000.0, 60.0).effect, {"changed_n_per_m": 5000.0, "time_s": 0.6})
    front = changed(CAR.front)
    assert front is not None
    other = replace(CAR, front=front, rear=changed(CAR.rear))
    for with_law, there, before in zip(*(runs.predict(compose(car, effects)) for car, effects in (
            (CAR, [law]), (other, []), (CAR, []))), strict=True):
        apart = float(np.std((with_law - there)[LONG_AFTER]))
        assert apart < 0.01 * float(np.std((before - there)[LONG_AFTER]))
