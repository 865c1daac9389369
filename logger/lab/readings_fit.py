"""A grey-box fit to records as they are: rounded to steps, at places that are only about known.

Problem: a prediction-error fit takes every reading for an acceleration with noise, at the place recorded with it. Of a
coarse sensor much more is known, the step that it was in; and at places that are some decimetres off a fit takes the
loss for noise at best, for other numbers of the car at worst, with standard errors that are far too small.

Solution: as the lab's searches do it. Beside the model that was fitted, a rounded reading says by its bounds what it
says (``likelihood.readings``), and the fit is repeated to that. Where a run says how far off its places are, its
distance error is a curve of numbers with that prior (``likelihood.distance_error``). One step of Gauss and Newton for
these and the free numbers together moves the run, and the fit is repeated there; both, until nothing moves. The
covariance that comes out is that of the free numbers with the distance errors integrated out (D. J. C. MacKay, Neural
Computation 4, 1992).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from logger.identification.drive_model import DriveModel
from logger.identification.prediction_error_fit import Fit, FitOptions, fit
from logger.identification.session import upright_fit
from logger.lab.likelihood.distance_error import USUAL, RecordError
from logger.lab.likelihood.lag import offset_by_lag_m
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.readings import Readings
from logger.runs import Run, normalised_rms

Array = npt.NDArray[np.float64]
ModelOf = Callable[[list[Run]], DriveModel]


@dataclass(frozen=True, eq=False)
class ReadingsFit:
    """A fit, and the model of the records as they then lie; ``rounded``: readings were taken for bounds; ``moved_m``
    by how much a run was moved at most."""

    fit: Fit
    model: DriveModel
    rounded: bool = False
    moved_m: float = 0.0


def fit_to_readings(model_of: ModelOf, records: list[Run], options: Callable[[DriveModel], FitOptions],
                    rounds: int = 8) -> ReadingsFit:
    """The fit of a model to records (``session.upright_fit``), with what they say of their steps and places.

    NotIdentifiable and ValueError as ``upright_fit``.
    """
    errors = [_places(record) for record in records]
    rounded, moves = False, any(one is not None for one in errors)
    at = _followed(model_of(records), errors) if moves else [None] * len(records)
    there = [_at(record, error, k) for record, error, k in zip(records, errors, at, strict=True)]
    first = upright_fit(model_of, there, options)
    found, model = first, model_of(there)
    if not moves and not any(record.facts.step_mps2 for record in records):
        return ReadingsFit(first, model)
    for turn in range(rounds):
        if moves:
            at = _moved(model, found, errors, at).at
        there = [_at(record, error, k) for record, error, k in zip(records, errors, at, strict=True)]
        predictions = _whole(model_of(there), _values(found))
        readings = [Readings.of(one).given(prediction) for one, prediction in zip(there, predictions, strict=True)]
        rounded = not all(one.rounding_is_noise for one in readings)
        if not (rounded or moves):
            return ReadingsFit(found, model)
        before = found
        model = model_of([replace(one, measured_mps2=reading.mps2)
                          for one, reading in zip(there, readings, strict=True)])
        found = _again(model, before, options)
        if turn and _rests(before, found):
            break
    if moves:
        found = _with_spread(found, _moved(model, found, errors, at))
    off_m = max((float(np.abs(error.distance_error_m(k)).max()) for error, k in zip(errors, at, strict=True)
                 if error is not None and k is not None), default=0.0)
    return ReadingsFit(_as_read(found, first, model, records), model, rounded, off_m)


def _places(record: Run) -> RecordError | None:
    """How a run's distance may be off; None where it says nothing of it."""
    if record.timed or not record.facts.place_std_m:
        return None
    return RecordError.of(record, Tolerance())


def _at(record: Run, error: RecordError | None, k: Array | None) -> Run:
    if error is None or k is None:
        return record
    return replace(record, distance_m=record.distance_m + error.distance_error_m(k))


def _values(found: Fit) -> Array:
    return np.array(list(found.parameters.values()))


def _whole(model: DriveModel, values: Array) -> list[Array]:
    """Predictions (n,) of whole records with these values (p,), zeros before what counts."""
    return [np.concatenate([np.zeros(record.first), one])
            for record, one in zip(model.records, model.predict(values), strict=True)]


def _followed(model: DriveModel, errors: Sequence[RecordError | None]) -> list[Array | None]:
    """Numbers of the distance errors with which runs lie where a car with the numbers that a fit starts from is like
    them."""
    predictions = _whole(model, np.array([one.start for one in model.parameters]))
    return [None if error is None else error.coefficients_of(offset_by_lag_m(record, prediction))
            for record, error, prediction in zip(model.records, errors, predictions, strict=True)]


@dataclass(frozen=True, eq=False)
class _Moved:
    """Numbers of the distance errors one step of Gauss and Newton farther; by which matrix (p, p) the information of
    the free numbers falls when these errors are integrated out; and how many numbers of them the records determine."""

    at: list[Array | None]
    lost: Array
    freedom: float


def _moved(model: DriveModel, found: Fit, errors: Sequence[RecordError | None], at: Sequence[Array | None]) -> _Moved:
    """How the distance errors follow a fit."""
    predictions, white = _whole(model, _values(found)), found.white
    parts = np.split(found.sensitivities, np.cumsum([len(one) for one in white])[:-1])
    information, pull = found.sensitivities.T @ found.sensitivities, np.zeros(found.sensitivities.shape[1])
    lost = np.zeros_like(information)
    freedom = 0.0
    solved: list[Array | None] = []
    for run, (error, k) in enumerate(zip(errors, at, strict=True)):
        slopes, left = parts[run], white[run]
        pull += slopes.T @ left
        if error is None or k is None:
            solved.append(None)
            continue
        record, places = model.records[run], len(error.basis)
        by_place = (error.slopes(predictions[run])[:places] * record.read)[:, record.first:]
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
        there[: len(error.basis)] += own[:, -1] - own[:, :-1] @ step
        moved.append(there)
    return _Moved(moved, lost, freedom)


def _again(model: DriveModel, before: Fit, options: Callable[[DriveModel], FitOptions]) -> Fit:
    """The fit from where another one ended."""
    model.parameters = [replace(one, start=min(max(before.parameters[one.name], one.low), one.high))
                        for one in model.parameters]
    return fit(model, model.measured, replace(options(model), starts=()))


def _rests(before: Fit, found: Fit, share: float = 0.1) -> bool:
    """Whether no number moved by more than this share of its standard error, which nobody would notice."""
    return all(abs(found.parameters[name] - before.parameters[name]) <= share * error
               for name, error in found.standard_errors.items())


def _with_spread(found: Fit, places: _Moved) -> Fit:
    """A fit with the covariance that it has with the distance errors integrated out."""
    information = found.sensitivities.T @ found.sensitivities
    alone = np.linalg.pinv(information, rcond=1e-15, hermitian=True)
    count = len(found.sensitivities)
    own = found.covariance * count / max(count - places.freedom, 1.0)  # what was fitted to places leaves less
    scale = np.sqrt(np.diag(own) / np.maximum(np.diag(alone), 1e-300))
    covariance = np.linalg.pinv(information - places.lost, rcond=1e-15, hermitian=True) * np.outer(scale, scale)
    errors = np.sqrt(np.maximum(np.diag(covariance), np.diag(own)))
    np.fill_diagonal(covariance, errors**2)
    return replace(found, covariance=covariance, correlation=covariance / np.outer(errors, errors),
                   standard_errors=dict(zip(found.parameters, errors.tolist(), strict=True)))


def _as_read(found: Fit, first: Fit, model: DriveModel, records: Sequence[Run]) -> Fit:
    """A fit with the errors of readings as they were read, and where its numbers started."""
    predictions = model.predict(_values(found))
    read = [record.residual(np.concatenate([np.zeros(record.first), one]))[record.first:]
            for record, one in zip(records, predictions, strict=True)]
    return replace(found, free=first.free, residuals=read, error_before=first.error_before,
                   error_after=normalised_rms(read, [record.kept_mps2 for record in records]))
