"""A grey-box fit to records with quantised readings and uncertain places.

Problem: a prediction-error fit takes every reading for an acceleration with noise, at the place recorded with it. Of a
coarse sensor more is known, the step that it was in; and where places are some decimetres off, the misfit is taken for
noise at best, for other numbers of the car at worst, with standard errors that are far too small.

Solution: as in the lab's searches. Given the fitted model, rounded readings are taken for bounds
(``likelihood.readings``), and the fit is repeated with these. Where a run states a standard error of its places, its
distance error is a spline with that prior (``likelihood.distance_error``). A Gauss-Newton step for this and the free
numbers together shifts the run, and the fit is repeated there; both, until nothing changes. The resulting covariance of
the free numbers has the distance errors integrated out (D. J. C. MacKay, Neural Computation 4, 1992).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from logger.arrays import Array
from logger.identification.drive_model import DriveModel
from logger.identification.prediction_error_fit import Fit, FitOptions
from logger.identification.session import fit_down_to_0, upright_fit
from logger.lab.likelihood.distance_error import USUAL, RecordError
from logger.lab.likelihood.lag import offset_by_lag_m
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.readings import Readings
from logger.runs import Run, normalised_rms

ModelOf = Callable[[list[Run]], DriveModel]


@dataclass(frozen=True, eq=False)
class ReadingsFit:
    """A fit, and the model of the records at the distances found; ``rounded``: readings were taken for bounds;
    ``moved_m``: the largest distance error [m]."""

    fit: Fit
    model: DriveModel
    rounded: bool = False
    moved_m: float = 0.0


def fit_to_readings(model_of: ModelOf, records: list[Run], options: Callable[[DriveModel], FitOptions]
                    ) -> ReadingsFit:
    """The fit of a model to records (``session.upright_fit``), with quantised readings and uncertain places.

    NotIdentifiable and ValueError as ``upright_fit``.
    """
    errors = [_distance_error(record) for record in records]
    rounded, moves = False, any(one is not None for one in errors)
    at = _from_lags(model_of(records), errors) if moves else [None] * len(records)
    there = [_at(record, error, k) for record, error, k in zip(records, errors, at, strict=True)]
    first = upright_fit(model_of, there, options)
    found, model = first, model_of(there)
    if not moves and not any(record.facts.step_mps2 for record in records):
        return ReadingsFit(first, model)
    for turn in range(8):
        if moves:
            at = _shift(model, found, errors, at).at
        there = [_at(record, error, k) for record, error, k in zip(records, errors, at, strict=True)]
        predictions = _whole_predictions(model_of(there), _values(found))
        readings = [Readings.of(one).given(prediction) for one, prediction in zip(there, predictions, strict=True)]
        rounded = not all(one.rounding_is_noise for one in readings)
        if not (rounded or moves):
            return ReadingsFit(found, model)
        before = found
        model = model_of([replace(one, measured_mps2=reading.mps2)
                          for one, reading in zip(there, readings, strict=True)])
        found = _refit(model, before, options)
        if turn and _has_converged(before, found):
            break
    if moves:
        found = _with_covariance(found, _shift(model, found, errors, at))
    off_m = max((float(np.abs(error.distance_error_m(k)).max()) for error, k in zip(errors, at, strict=True)
                 if error is not None and k is not None), default=0.0)
    return ReadingsFit(_with_rounding_noise(found, first, model, records), model, rounded, off_m)


def _distance_error(record: Run) -> RecordError | None:
    """The distance error of a run; None where it states no standard error of its places."""
    if record.timed or not record.facts.place_std_m:
        return None
    return RecordError.of(record, Tolerance())


def _at(record: Run, error: RecordError | None, k: Array | None) -> Run:
    if error is None or k is None:
        return record
    return replace(record, distance_m=record.distance_m + error.distance_error_m(k))


def _values(found: Fit) -> Array:
    return np.array(list(found.parameters.values()))


def _whole_predictions(model: DriveModel, values: Array) -> list[Array]:
    """Predictions (n,) of whole records with these values (p,), 0 before the samples that count."""
    return [np.concatenate([np.zeros(record.first), one])
            for record, one in zip(model.records, model.predict(values), strict=True)]


def _from_lags(model: DriveModel, errors: Sequence[RecordError | None]) -> list[Array | None]:
    """Numbers of the distance errors that the lags behind a car with the starting values amount to."""
    predictions = _whole_predictions(model, np.array([one.start for one in model.parameters]))
    return [None if error is None else error.coefficients_of(offset_by_lag_m(record, prediction))
            for record, error, prediction in zip(model.records, errors, predictions, strict=True)]


@dataclass(frozen=True, eq=False)
class _Shift:
    """Numbers of the distance errors after a Gauss-Newton step; the information (p, p) that the free numbers lose when
    these errors are integrated out; and the effective number of parameters of these errors."""

    at: list[Array | None]
    lost: Array
    freedom: float


def _shift(model: DriveModel, found: Fit, errors: Sequence[RecordError | None], at: Sequence[Array | None]) -> _Shift:
    """The distance errors after a fit, by one Gauss-Newton step together with the free numbers."""
    predictions, white = _whole_predictions(model, _values(found)), found.white
    parts = np.split(found.sensitivities, np.cumsum([len(one) for one in white])[:-1])
    information, pull = found.information, found.prior[1].copy()
    lost = np.zeros_like(information)
    freedom = 0.0
    solved: list[Array | None] = []
    for run, (error, k) in enumerate(zip(errors, at, strict=True)):
        slopes, left = parts[run], white[run]
        pull += slopes.T @ left
        if error is None or k is None:
            solved.append(None)
            continue
        record, places = model.records[run], error.places
        by_place = (error.slopes(predictions[run])[:places].toarray() * record.read)[:, record.first:]
        columns = found.noise.whiteners[run](found.low_pass.apply(by_place.T))
        prior = error.precision(USUAL)[:places, :places]
        whole = columns.T @ columns + prior
        crossed, gradient = columns.T @ slopes, columns.T @ left - prior @ k[:places]
        both = np.linalg.solve(whole, np.column_stack([crossed, gradient]))
        freedom += places - float(np.trace(np.linalg.solve(whole, prior)))
        lost += crossed.T @ both[:, :-1]
        pull -= crossed.T @ both[:, -1]
        solved.append(np.asarray(both, float))
    step = np.linalg.lstsq(information - lost, pull, rcond=None)[0]
    moved: list[Array | None] = []
    for error, k, own in zip(errors, at, solved, strict=True):
        if error is None or k is None or own is None:
            moved.append(None)
            continue
        there = k.copy()
        there[: error.places] += own[:, -1] - own[:, :-1] @ step
        moved.append(there)
    return _Shift(moved, lost, freedom)


def _refit(model: DriveModel, before: Fit, options: Callable[[DriveModel], FitOptions]) -> Fit:
    """The fit started from the values of another one."""
    model.parameters = [replace(one, start=min(max(before.parameters[one.name], one.low), one.high))
                        for one in model.parameters]
    return fit_down_to_0(model, replace(options(model), starts=()))


def _has_converged(before: Fit, found: Fit) -> bool:
    """Whether no number changed by more than a tenth of its standard error."""
    return all(abs(found.parameters[name] - before.parameters[name]) <= 0.1 * error
               for name, error in found.standard_errors.items())


def _with_covariance(found: Fit, places: _Shift) -> Fit:
    """A fit with its covariance after the distance errors are integrated out."""
    information = found.information
    alone = np.linalg.pinv(information, rcond=1e-15, hermitian=True)
    count = len(found.sensitivities)
    own = found.covariance * count / max(count - places.freedom, 1.0)  # what was fitted to places leaves less
    scale = np.sqrt(np.diag(own) / np.maximum(np.diag(alone), 1e-300))
    covariance = np.linalg.pinv(information - places.lost, rcond=1e-15, hermitian=True) * np.outer(scale, scale)
    np.fill_diagonal(covariance, np.maximum(np.diag(covariance), np.diag(own)))
    return replace(found, covariance=covariance)


def _with_rounding_noise(found: Fit, first: Fit, model: DriveModel, records: Sequence[Run]) -> Fit:
    """A fit with errors that take rounding as noise, and with its first starting values."""
    predictions = model.predict(_values(found))
    read = [record.residual(np.concatenate([np.zeros(record.first), one]))[record.first:]
            for record, one in zip(records, predictions, strict=True)]
    return replace(found, free=first.free, residuals=read, error_before=first.error_before,
                   error_after=normalised_rms(read, [record.kept_mps2 for record in records]))
