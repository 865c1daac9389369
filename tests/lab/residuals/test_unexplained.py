"""What repeats along the way is found, distinguished from what hums in time, and described."""

from __future__ import annotations

import numpy as np
import pytest

from logger.api.lab.words import line_sentence, looks_like
from logger.lab.diagnosis import refit
from logger.lab.residuals.breakdown import ModelResiduals
from logger.lab.residuals.unexplained import removed_from, shape_of, spatial_line_of
from logger.runs import Run
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose

from ...support.lab.runs_with_residual import CAR, a_run, beside_with, measuring
from ...support.lab.secret_runs import hidden, posterior_of, secret_runs


def _with_turns(radius_m: float) -> ModelResiduals:
    def shaken(run: Run, _model: object, rng: np.random.Generator) -> np.ndarray:
        return 0.05 * np.sin(run.distance_m / radius_m) + rng.normal(0, 0.03, run.count)

    return beside_with(shaken)


def test_what_a_wheel_does_in_each_turn_is_found_and_noise_is_not() -> None:
    turns = spatial_line_of(_with_turns(0.31))
    assert turns is not None and turns.found
    assert 1 / (2 * np.pi * turns.at_per_m) == pytest.approx(0.31, rel=0.02)
    assert "A wheel of 0.31 m radius" in line_sentence(turns)
    noise = [spatial_line_of(beside_with(lambda run, _, rng: rng.normal(0, 0.03, run.count), seed))
             for seed in range(10)]
    assert not [one for one in noise if one is None or one.found]


def humming(speeds_mps: list[float], swing: float, at_hz: float | None,
            at_per_m: float | None = None) -> ModelResiduals:
    """The model beside runs in which something hums in time, or along the way."""
    rng = np.random.default_rng(4)

    def shaken(run: Run) -> np.ndarray:
        time_s = np.arange(run.count) / run.rate_hz
        turns = at_hz * time_s if at_hz is not None else (at_per_m or 0.0) * run.distance_m
        return 0.05 * np.sin(2 * np.pi * turns) + rng.normal(0, 0.03, run.count)

    runs = SimulatedRuns([a_run(f"run{i}", speed, 40.0, i, swing) for i, speed in enumerate(speeds_mps)])
    car = compose(CAR)
    predictions = runs.predict(car)
    measured = [measuring(run, one + shaken(run)) for run, one in zip(runs.runs, predictions, strict=True)]
    return ModelResiduals(measured, car, predictions, runs.respond(car))


def test_what_hums_at_a_steady_speed_may_repeat_in_time_or_along_the_way() -> None:
    turns = spatial_line_of(humming([14.0], 0.0, 7.0))
    assert turns is not None and turns.found and turns.steady
    said = line_sentence(turns)
    assert "every 2.00 m of road or 7.0 times a second" in said and "wheel" not in said


def test_two_steady_speeds_tell_a_wheel_from_a_hum() -> None:
    wheel = spatial_line_of(humming([10.0, 14.0], 0.0, None, 0.5))
    assert wheel is not None and wheel.found and not wheel.steady and "A wheel of 0.32 m" in line_sentence(wheel)
    hum = spatial_line_of(humming([10.0, 14.0], 0.0, 7.0))
    assert hum is not None and not hum.found


def test_a_speed_that_swings_tells_them_too() -> None:
    wheel = spatial_line_of(humming([14.0], 0.1, None, 0.5))
    assert wheel is not None and wheel.found and not wheel.steady
    hum = spatial_line_of(humming([14.0], 0.1, 7.0))
    assert hum is not None and not hum.found


@pytest.mark.slow
def test_the_shape_of_a_fitted_model_is_that_of_its_residuals() -> None:
    posterior = posterior_of(secret_runs([hidden("sensor_offset", offset_m=0.4)]))
    state = refit(posterior, posterior.start()).state
    removed = removed_from(posterior, posterior.start().predictions, state)
    found = shape_of(posterior, state, removed)
    assert not removed.drifting_sensors
    residuals = found.residuals.residual
    for run, residual, whole in zip(posterior.runs.runs, residuals, posterior.residuals(state), strict=True):
        assert residual == pytest.approx(whole[run.first:])
    said = looks_like(found)
    assert said and all(one.endswith(".") for one in said)
