"""SimulatedRuns whose residual is made to measure, for the tests of the lab's comparison."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
import numpy.typing as npt

from logger.lab.residuals.breakdown import ModelResiduals
from logger.profiles.track import Track
from logger.runs import Run
from logger.shipped import vehicle_file
from logger.simulation.virtual_drive import SimulatedRuns
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose

Array = npt.NDArray[np.float64]
Residual = Callable[[Run, Array, np.random.Generator], Array]

CAR = read_vehicle(vehicle_file("rav4-2009"))
RATE_HZ = 100.0
SPEEDS_MPS = (8.0, 14.0, 20.0)


def rough_track(length_m: float, seed: int, slope_rms: float = 0.012, spacing_m: float = 0.1) -> Track:
    """A road whose slope is white noise, that does not wander off (first-order high-pass of 20 m)."""
    slope = np.random.default_rng(seed).normal(0, slope_rms, round(length_m / spacing_m))
    height = np.zeros(len(slope))
    for i in range(1, len(slope)):
        height[i] = height[i - 1] * (1 - spacing_m / 20.0) + slope[i] * spacing_m**0.5 * 0.316
    return Track(spacing_m, height)


def a_run(name: str, speed_mps: float, lasts_s: float, seed: int, swing: float = 0.1) -> Run:
    """A drive whose speed swings by a share; nothing measured yet."""
    time_s = np.arange(round(lasts_s * RATE_HZ)) / RATE_HZ
    speed = speed_mps * (1 + swing * np.sin(2 * np.pi * time_s / 17.0))
    distance = np.concatenate([[0.0], np.cumsum(speed[:-1])]) / RATE_HZ
    return Run(name, RATE_HZ, np.zeros(len(time_s)), distance, speed, rough_track(distance[-1] + 20.0, seed))


@cache
def _driven(lasts_s: float) -> tuple[SimulatedRuns, tuple[Array, ...], ModelResiduals]:
    runs = SimulatedRuns([a_run(f"runs/run{i + 1}", speed, lasts_s, i) for i, speed in enumerate(SPEEDS_MPS)])
    car = compose(CAR)
    predictions = tuple(runs.predict(car))
    return runs, predictions, ModelResiduals(runs.runs, car, predictions, runs.respond(car))


def measuring(run: Run, measured: Array) -> Run:
    """The run with another measurement."""
    return Run(run.name, run.rate_hz, measured, run.distance_m, run.speed_mps, run.track)


def beside_with(residual: Residual, seed: int = 0, lasts_s: float = 40.0) -> ModelResiduals:
    """The model of the car beside measurements that differ from it by what ``residual`` gives for each run."""
    runs, predictions, nothing = _driven(lasts_s)
    rng = np.random.default_rng(seed)
    measured = [measuring(run, one + residual(run, one, rng)) for run, one in zip(runs.runs, predictions, strict=True)]
    return ModelResiduals(measured, nothing.car, predictions, nothing.responses)


def runs_of(residuals: ModelResiduals) -> SimulatedRuns:
    """The runs of a comparison, to predict."""
    return SimulatedRuns(list(residuals.runs))


def recorded_by(effects: Sequence[tuple[str, dict[str, float]]], noise_mps2: float) -> Residual:
    """What a car with effects would have recorded beyond the plain one, and noise."""
    from logger.store.formats.effect_file import shipped_effects
    from logger.vehicle.effect import chosen

    car = compose(CAR, [chosen(shipped_effects()[name], values) for name, values in effects])

    def residual(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
        return SimulatedRuns([run]).predict(car)[0] - prediction + rng.normal(0, noise_mps2, len(prediction))

    return residual
