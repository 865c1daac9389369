"""Sensor drift, distance error and filtering: what is removed from an error before it is judged, and its share of it.

Problem: three causes of error are no physics of the car: a sensor that drifts, a distance that is wrong, a record that
somebody filtered. The lab removes all three before it asks what is missing; an error that counts them, and a verdict
that does not name them, seem to contradict each other. Solution: each is reported with its share of the residual power
of the model as it stands, and the error without all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.distance_error import unusual_distance_error_m
from logger.lab.likelihood.noise_floor import sensor_noise_of
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.residual_tests.tests import LEAST_SHARE
from logger.lab.residuals.sensor_drift import Drift, drift_of
from logger.runs import Run


@dataclass(frozen=True, eq=False)
class Removed:
    """Sensor drift, distance error and filtering that were removed.

    drifts                                       of the runs' sensors, one each
    drift_share, distance_share, filter_share    of the residual power of the model as it stands, at all frequencies
    distance_error_m                             the largest distance error, if it is unusual; else 0
    error                                        normalised r.m.s. error of the fitted model without the drifts
    """

    drifts: tuple[Drift, ...]
    drift_share: float
    distance_share: float
    filter_share: float
    distance_error_m: float
    error: float

    @cached_property
    def drifting_sensors(self) -> tuple[Drift, ...]:
        """The drifts that were found."""
        return tuple(one for one in self.drifts if one.found)

    def with_drifts(self, predictions: Sequence[Array]) -> list[Array]:
        """Predictions (n,) per run plus the sensors' drifts; other signals that are joined are unchanged."""
        return [_with_drift(one, drift) for one, drift in zip(predictions, self.drifts, strict=True)]


def removed_from(posterior: Posterior, plain: Sequence[Array], state: State) -> Removed:
    """Sensor drift, distance error and filtering of a fitted state.

    plain    predictions (n,) per run of the model as it stands
    """
    runs = posterior.runs.runs
    outside = sum(run.outside_mps2**2 * (run.count - run.first) for run in runs)
    fitted, whole = _power(runs, state.predictions), _power(runs, plain) + outside
    record = [error.without_distance_error(k) for error, k in zip(posterior.record_errors, state.record, strict=True)]
    at_recorded_distances = _power(runs, posterior.predict(state.effects, state.logs, record))
    noise_mps2 = sensor_noise_of(posterior, state).deviation_mps2
    drifts = tuple(drift_of(run, run.main(one), noise_mps2)
                   for run, one in zip(runs, posterior.without_rounding().residuals(state), strict=True))
    without_drift = _power(runs, [_with_drift(one, drift)
                                  for one, drift in zip(state.predictions, drifts, strict=True)])
    if not fitted - without_drift > LEAST_SHARE * fitted:
        drifts, without_drift = tuple(one.nothing_found() for one in drifts), fitted

    def share(power: float) -> float:
        return float(min(max(power / whole, 0.0), 1.0)) if whole > 0 else 0.0

    measured = sum(float(run.kept_readings_mps2 @ run.kept_readings_mps2) for run in runs)
    return Removed(drifts, share(fitted - without_drift), share(at_recorded_distances - fitted), share(outside),
                   unusual_distance_error_m(posterior.record_errors, state.record),
                   float(np.sqrt(without_drift / measured)) if measured > 0 else float("nan"))


def _with_drift(prediction: Array, drift: Drift) -> Array:
    """A prediction (n,), or more signals joined to it, plus the drift of its sensor."""
    found = prediction.copy()
    found[: len(drift.curve_mps2)] += drift.curve_mps2
    return found


def _power(runs: Sequence[Run], predictions: Sequence[Array]) -> float:
    """Sum of squares of the residuals of predictions (n,) per run [m2/s4]."""
    return sum(float((run.residual(run.main(one))[run.first:] ** 2).sum())
               for run, one in zip(runs, predictions, strict=True))
