"""Drives whose distances wander are laid on one distance by the road that they felt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.lab.likelihood.priors import Tolerance
from logger.lab.unknown_road.diagnosis import diagnose_same_road
from logger.lab.unknown_road.same_road import SameRoad, fit, placed_by_road
from logger.runs import Run
from logger.store.formats.effect_file import shipped_effects

from .test_diagnosis import CAR, named, run_of

TOLERANCE = Tolerance(numbers=0.04)
WANDERING_M = 0.3


def wandering(run: Run, period_s: float, off_m: float = WANDERING_M) -> Run:
    """The same run, its distances off by now more and now less, as a receiver's speeds put it."""
    time_s = np.arange(run.count) / run.rate_hz
    return replace(run, distance_m=run.distance_m + off_m * np.sin(2 * np.pi * time_s / period_s))


@pytest.fixture(scope="module")
def true_runs() -> list[Run]:
    return [run_of([], speed_mps, 90.0, number) for number, speed_mps in enumerate((7.0, 12.0))]


def test_the_second_follows_the_first(true_runs: list[Run]) -> None:
    first, second = true_runs
    given = [first, wandering(second, 9.0)]
    found = placed_by_road(given, CAR, TOLERANCE)
    assert (found[0].distance_m == first.distance_m).all()
    inner = slice(200, -200)  # beyond the middle of the last window the lag is that of this
    before_m, after_m = (np.std((one.distance_m - second.distance_m)[inner]) for one in (given[1], found[1]))
    assert after_m < before_m / 3
    errors = [problem.error(problem.start()) for problem in (SameRoad(one, CAR, TOLERANCE) for one in (given, found))]
    assert errors[1] < errors[0] / 2


@pytest.mark.slow
def test_a_delay_is_not_tried_on_distances_that_follow_the_road(true_runs: list[Run]) -> None:
    problem = SameRoad(true_runs, CAR, TOLERANCE, exact_places=False)
    effects = {name: shipped_effects()[name] for name in ("time_offset", "sensor_gain")}
    found = diagnose_same_road(problem, effects)
    assert "GPS distances" in found.untried["time_offset"] and "sensor_gain" not in found.untried


@pytest.mark.slow
def test_an_effect_is_found_although_the_distances_wander() -> None:
    """Laid anew with what was found, and judged against the drives as they lay before."""
    hidden = named("sensor_mount_resonance", frequency_hz=16.0, damping_ratio=0.1)
    first, second = (run_of([hidden], speed_mps, 90.0, number) for number, speed_mps in enumerate((7.0, 12.0)))
    problem = SameRoad(placed_by_road([first, wandering(second, 9.0, 0.15)], CAR, TOLERANCE), CAR, TOLERANCE,
                       exact_places=False)
    effects = {name: shipped_effects()[name] for name in ("sensor_mount_resonance", "sensor_gain", "tire_damping")}
    found = diagnose_same_road(problem, effects)
    (one,) = found.missing
    assert one.effect.name == "sensor_mount_resonance"
    assert one.values["frequency_hz"] == pytest.approx(16.0, rel=0.02)
    exact = SameRoad([first, second], CAR, TOLERANCE)
    true = exact.start([hidden])
    attainable = exact.error(fit(exact.preconditioned(true), true).state)
    assert found.steps[-1].error < 1.15 * attainable
    for before, after in found.by_run:
        assert 0.5 < before / found.steps[1].error < 2.0  # of runs about as loud
        assert after < before
