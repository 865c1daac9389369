"""What changed long ago is another number of the car: beside one that has it from the beginning."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.lab.laws.families.changing_with_time import _draft
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen
from logger.vehicle.vehicle import Axle

from ...support.lab.secret_runs import CAR, secret_runs

LONG_AFTER = slice(600, None)  # ten time constants, and what rings after them


@pytest.mark.slow
@pytest.mark.parametrize(("what", "more", "number"), [
    (("springs", "travel_m", "50000.0", "BODY_AND_WHEEL"), 5000.0, "suspension_stiffness_n_per_m"),
    (("tires", "deflection_m", "50000.0", "WHEEL_AND_GROUND"), 5000.0, "tire_stiffness_n_per_m"),
    (("dampers", "rate_mps", "laws.damping_n_s_per_m", "BODY_AND_WHEEL"), None, "suspension_damping_n_s_per_m")])
def test_long_after_it_is_a_car_with_that_number(what: tuple[str, str, str, str], more: float | None, number: str
                                                 ) -> None:
    def changed(axle: Axle | None) -> Axle | None:
        was = 0.0 if axle is None else getattr(axle, number)
        return axle and replace(axle, **{number: was + (0.1 * was if more is None else more)})

    runs = SimulatedRuns(secret_runs().runs)
    law = chosen(_draft(*what, 60.0).effect, {"changed_ratio": 0.1, "time_s": 0.6})
    front = changed(CAR.front)
    assert front is not None
    other = replace(CAR, front=front, rear=changed(CAR.rear))
    for with_law, there, before in zip(*(runs.predict(compose(car, effects)) for car, effects in (
            (CAR, [law]), (other, []), (CAR, []))), strict=True):
        apart = float(np.std((with_law - there)[LONG_AFTER]))
        assert apart < 0.01 * float(np.std((before - there)[LONG_AFTER]))
