"""What changes with the driving speed: at any one speed a car with another number, beside a car that has it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.changing_with_speed import FAMILY
from logger.runs import Run
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen
from logger.vehicle.vehicle import Axle, Vehicle

from ...support.lab.secret_runs import CAR, SPEEDS_MPS, posterior_of, secret_runs

SHARE = 0.3
MEAN_MPS = float(np.mean(SPEEDS_MPS))


def car_with_more(number: str, more: float = 0.0, share: float = 0.0) -> Vehicle:
    """The car, with so much more at both axles, or with so large a share more of what each has."""
    def changed(axle: Axle) -> Axle:
        return replace(axle, **{number: (1 + share) * getattr(axle, number) + more})

    assert CAR.rear is not None
    return replace(CAR, front=changed(CAR.front), rear=changed(CAR.rear))


def stiffer(number: str, more: float) -> Callable[[float], Vehicle]:
    return lambda speed_mps: car_with_more(number, more * (speed_mps / MEAN_MPS - 1))


def firmer(speed_mps: float) -> Vehicle:
    return car_with_more("suspension_damping_n_s_per_m", share=SHARE * (speed_mps / MEAN_MPS - 1))


def firm_at_one_end(speed_mps: float) -> Vehicle:
    return car_with_more("suspension_damping_n_s_per_m", share=SHARE if speed_mps > MEAN_MPS else -0.5 * SHARE)


CARS: dict[str, tuple[tuple[float, ...], Callable[[float], Vehicle]]] = {
    "dampers": ((SHARE,), firmer), "dampers at both ends": ((-0.5 * SHARE, SHARE), firm_at_one_end),
    "springs": ((5000.0,), stiffer("suspension_stiffness_n_per_m", 5000.0)),
    "tires": ((40000.0,), stiffer("tire_stiffness_n_per_m", 40000.0)),
}


def steady_runs() -> list[Run]:
    """Two drives, each at one speed from end to end."""
    return [replace(run, speed_mps=np.full(run.count, speed_mps),
                    distance_m=run.distance_m[0] + speed_mps * np.arange(run.count) / run.rate_hz)
            for run, speed_mps in zip(secret_runs().runs, SPEEDS_MPS, strict=True)]


@pytest.mark.slow
@pytest.mark.parametrize("of", CARS)
def test_at_one_speed_it_is_a_car_with_another_number(of: str) -> None:
    runs = steady_runs()
    posterior = posterior_of(SimulatedRuns(runs))
    draft, = (one for one in FAMILY.drafts(LawContext(posterior, posterior.start())) if one.variant == of)
    values, car_at = CARS[of]
    law = chosen(draft.effect, dict(zip(draft.strengths, values, strict=True)))
    for run, speed_mps in zip(runs, SPEEDS_MPS, strict=True):
        one = SimulatedRuns([run])
        (with_law,), (there,), (before,) = (one.predict(compose(car, effects)) for car, effects in (
            (CAR, [law]), (car_at(speed_mps), []), (CAR, [])))
        assert np.std(with_law - there) < 0.001 * np.std(before - there)


def test_runs_at_one_speed_show_nothing_of_it() -> None:
    posterior = posterior_of(SimulatedRuns(steady_runs()[:1]))
    assert FAMILY.drafts(LawContext(posterior, posterior.start())) == []
