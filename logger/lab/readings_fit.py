"""A grey-box fit to records with quantised readings and uncertain places.

Problem: a prediction-error fit takes every reading for an acceleration with noise, at the place recorded with it. Of a
coarse sensor more is known, the step that it was in; and where places are some decimetres off, the misfit is taken for
noise at best, for other numbers of the car at worst, with standard errors that are far too small.

Solution: as in the lab's searches. Given the fitted model, rounded readings are taken for bounds
(``likelihood.signals``), and the fit is repeated with these. Where a run states a standard error of its places, its
distance error is a spline with that prior (``likelihood.distance_error``). A Gauss-Newton step for this and the free
numbers together shifts the run, and the fit is repeated there; both, until nothing changes. The resulting covariance of
the free numbers has the distance errors integrated out (D. J. C. MacKay, Neural Computation 4, 1992).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from logger.arrays import Array
from logger.fitting.fisher_scoring import inverse_with_prior
from logger.identification.drive_model import DriveModel
from logger.identification.prediction_error_fit import Fit, FitOptions
from logger.identification.session import fit_down_to_0, upright_fit
from logger.lab.likelihood.distance_error import USUAL, RecordError, RigRecordError, record_error
from logger.lab.likelihood.lag import offset_by_lag_m
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.signals import Readings
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


def fit_to_readings(model_of: ModelOf, records: list[Run], options: Callable[[DriveModel], FitOptions]) -> ReadingsFit:
    """The fit of a model to records (``session.upright_fit``), with quantised readings and uncertain places.

    NotIdentifiable and ValueError as ``upright_fit``.
    """
    errors = [_distance_error(record) for record in records]
    rounded, moves = False, any(error.places for error in errors)
    at = _from_lags(model_of(records), errors) if moves else [np.zeros(error.count) for error in errors]
    first = upright_fit(model_of, _moved(records, errors, at), options)
    found, model = first, model_of(_moved(records, errors, at))
    if not moves and not any(record.facts.step_mps2 for record in records):
        return ReadingsFit(first, model)
    for turn in range(8):
        if moves:
            at = _with_places(model, found, errors, at).at
        there = _moved(records, errors, at)
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
        found = replace(found, covariance=_with_places(model, found, errors, at).covariance)
    off_m = max(float(np.abs(error.distance_error_m(k)).max()) for error, k in zip(errors, at, strict=True))
    return ReadingsFit(_with_rounding_noise(found, first, model, records), model, rounded, off_m)


def _distance_error(record: Run) -> RecordError:
    """The distance error of a run; without numbers of places where it states no standard error of them."""
    from scipy.sparse import csr_array

    if record.facts.place_std_m:
        return record_error(record, Tolerance())
    return RigRecordError(record, csr_array((0, record.count)), Tolerance(), 1.0)


def _moved(records: Sequence[Run], errors: Sequence[RecordError], at: Sequence[Array]) -> list[Run]:
    """Records at the distances that they were driven at."""
    return [replace(record, distance_m=record.distance_m + error.distance_error_m(k))
            for record, error, k in zip(records, errors, at, strict=True)]


def _values(found: Fit) -> Array:
    return np.array(list(found.parameters.values()))


def _whole_predictions(model: DriveModel, values: Array) -> list[Array]:
    """Predictions (n,) of whole records with these values (p,), 0 before the samples that count."""
    return [np.concatenate([np.zeros(record.first), one])
            for record, one in zip(model.records, model.predict(values), strict=True)]


def _from_lags(model: DriveModel, errors: Sequence[RecordError]) -> list[Array]:
    """Numbers of the distance errors that the lags behind a car with the starting values amount to."""
    predictions = _whole_predictions(model, np.array([one.start for one in model.parameters]))
    return [error.coefficients_of(offset_by_lag_m(record, prediction))
            for record, error, prediction in zip(model.records, errors, predictions, strict=True)]


@dataclass(frozen=True, eq=False)
class _WithPlaces:
    """Numbers (k,) of the distance errors per run after a Gauss-Newton step together with the free numbers, and the
    covariance (p, p) of these with the distance errors integrated out."""

    at: list[Array]
    covariance: Array


def _with_places(model: DriveModel, found: Fit, errors: Sequence[RecordError], at: Sequence[Array]) -> _WithPlaces:
    """A fit and its distance errors together, linearised: those of each run are eliminated (Schur complement)."""
    predictions, white = _whole_predictions(model, _values(found)), found.white
    parts = np.split(found.sensitivities, np.cumsum([len(one) for one in white])[:-1])
    left, pull, freedom, solved = found.information, found.prior[1].copy(), 0.0, []
    for run, (error, k) in enumerate(zip(errors, at, strict=True)):
        record, places, slopes = model.records[run], error.places, parts[run]
        by_place = (error.slopes(predictions[run])[:places].toarray() * record.read)[:, record.first:]
        columns = found.noise.whiteners[run](found.low_pass.apply(by_place.T))
        prior = error.precision(USUAL)[:places, :places]
        crossed, gradient = columns.T @ slopes, columns.T @ white[run] - prior @ k[:places]
        own = np.linalg.solve(columns.T @ columns + prior, np.column_stack([crossed, gradient, prior]))
        pull += slopes.T @ white[run] - crossed.T @ own[:, len(pull)]
        left = left - crossed.T @ own[:, : len(pull)]
        freedom += places - float(np.trace(own[:, len(pull) + 1:]))
        solved.append(own)
    step = inverse_with_prior(left) @ pull
    moved = [np.append(k[:places] + own[:, len(step)] - own[:, : len(step)] @ step, k[places:])
             for k, own, places in zip(at, solved, (error.places for error in errors), strict=True)]
    count = len(found.sensitivities)
    alone = found.covariance * count / max(count - freedom, 1.0)  # what was fitted to places leaves less
    scale = np.sqrt(np.diag(alone) / np.maximum(np.diag(inverse_with_prior(found.information)), 1e-300))
    covariance = inverse_with_prior(left) * np.outer(scale, scale)
    np.fill_diagonal(covariance, np.maximum(np.diag(covariance), np.diag(alone)))
    return _WithPlaces(moved, covariance)


def _refit(model: DriveModel, before: Fit, options: Callable[[DriveModel], FitOptions]) -> Fit:
    """The fit started from the values of another one."""
    model.parameters = [replace(one, start=min(max(before.parameters[one.name], one.low), one.high))
                        for one in model.parameters]
    return fit_down_to_0(model, replace(options(model), starts=()))


def _has_converged(before: Fit, found: Fit) -> bool:
    """Whether no number changed by more than a tenth of its standard error."""
    return all(abs(found.parameters[name] - before.parameters[name]) <= 0.1 * error
               for name, error in found.standard_errors.items())


def _with_rounding_noise(found: Fit, first: Fit, model: DriveModel, records: Sequence[Run]) -> Fit:
    """A fit with errors that take rounding as noise, and with its first starting values."""
    predictions = model.predict(_values(found))
    read = [record.residual(np.concatenate([np.zeros(record.first), one]))[record.first:]
            for record, one in zip(records, predictions, strict=True)]
    return replace(found, free=first.free, residuals=read, error_before=first.error_before,
                   error_after=normalised_rms(read, [record.kept_mps2 for record in records]))
