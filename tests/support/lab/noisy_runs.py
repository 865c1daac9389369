"""Runs of a known car with known effects, noise and distance errors, for the tests of the lab's likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.distance_error import ErrorSize
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.priors import Tolerance
from logger.runs import Run
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.effect import Chosen

from .runs_with_residual import CAR, a_run, measuring
from .secret_runs import FINE_HZ, NOISE_MPS2, hidden

Array = npt.NDArray[np.float64]



def tire_damping(value: float) -> Chosen:
    """A linear effect, quick to simulate."""
    return hidden("tire_damping", tire_damping_n_s_per_m=value)


def posterior_of(runs: Sequence[Run]) -> Posterior:
    """With the usual tolerance."""
    return Posterior(SimulatedRuns(runs, FINE_HZ), CAR, Tolerance(numbers=0.025))


def still_runs(lasts_s: float = 16.0, speeds_mps: Sequence[float] = (8.0, 14.0)) -> list[Run]:
    """Drives with nothing measured but a constant."""
    plain = [a_run(f"run{i}", speed, lasts_s, i) for i, speed in enumerate(speeds_mps)]
    return [measuring(run, np.ones(run.count)) for run in plain]


def noisy_runs(effects: Sequence[Chosen] = (), seed: int = 5, lasts_s: float = 16.0,
               noise_mps2: float = NOISE_MPS2, speeds_mps: Sequence[float] = (8.0, 14.0)) -> list[Run]:
    """Drives of the car with these effects, with white noise, where they truly were."""
    runs, rng = still_runs(lasts_s, speeds_mps), np.random.default_rng(seed)
    truth = posterior_of(runs).start(effects)
    return [measuring(run, one + rng.normal(0, noise_mps2, run.count))
            for run, one in zip(runs, truth.predictions, strict=True)]


@dataclass(frozen=True, eq=False)
class Drawn:
    """Runs drawn from a posterior's own priors: logarithms (p,) of the car's numbers, and by how much the car was
    farther than its distance says (n,) per run."""

    posterior: Posterior
    logs: Array
    moved_m: list[Array]


def drawn(effects: Sequence[Chosen], seed: int, size: ErrorSize, lasts_s: float = 15.0) -> Drawn:
    """A car and distance errors as they come by chance, and what was recorded with them."""
    blank, rng = posterior_of(still_runs(lasts_s)), np.random.default_rng(seed)
    deviations = blank.prior.deviations
    logs = np.clip(rng.normal(0, 1, len(deviations)), -2, 2) * deviations
    record = [np.linalg.solve(np.linalg.cholesky(one.precision(size)).T, rng.normal(0, 1, one.count))
              for one in blank.record_errors]
    runs = [measuring(run, one + rng.normal(0, NOISE_MPS2, run.count))
            for run, one in zip(blank.runs.runs, blank.predict(effects, logs, record), strict=True)]
    return Drawn(posterior_of(runs), logs, blank.distance_error_m(record))


def with_wrong_speed(run: Run, deviation_mps: float, lasts_s: float, seed: int) -> Run:
    """The run with the integral of a speed that is off by coloured noise, which forgets itself in so long."""
    rng = np.random.default_rng(seed)
    kept = np.exp(-1 / run.rate_hz / lasts_s)
    off = np.empty(run.count)
    off[0] = rng.normal(0, deviation_mps)
    for i in range(1, run.count):
        off[i] = kept * off[i - 1] + rng.normal(0, deviation_mps * np.sqrt(1 - kept**2))
    wrong_m = np.concatenate([[0.0], np.cumsum(off[:-1])]) / run.rate_hz
    return replace(run, distance_m=run.distance_m + wrong_m, speed_mps=run.speed_mps + off)


def off_m(runs: Sequence[Run], truth: Sequence[Run]) -> list[Array]:
    """By how much a car was farther than these runs say (n,), where others say it was."""
    return [there.distance_m - run.distance_m for run, there in zip(runs, truth, strict=True)]


def worst_rms(errors: Sequence[Array], runs: Sequence[Run]) -> float:
    """The largest r.m.s. of arrays (n,) over the samples that count."""
    return max(float(np.sqrt((one[run.first:] ** 2).mean())) for one, run in zip(errors, runs, strict=True))
