"""Expected gain of an effect over a refit of the car without it.

Problem: an effect of ten standard deviations or more moves the car's numbers and the distances beyond first order: what
first order leaves of a soft mount or a slow sensor is half as much again as a fit leaves, and a likelihood whose levels
are free gains less than the square of the standard deviations where these lie in few bands. Solution: the record with
the effect is taken for the measurement (an Asimov data set: G. Cowan et al., European Physical Journal C 71, 2011), and
the car without it is fitted to that: Gauss-Newton steps with known derivatives (the chord method: J. M. Ortega and W.
C. Rheinboldt, Iterative Solution of Nonlinear Equations, 1970, section 7.1), each judged by a full prediction and by
the likelihood of a search; where it is not as linear as they say, derivatives are computed again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.planning.planned_drive import with_larger_errors

Array = npt.NDArray[np.float64]

_MOST_STEPS, _MOST_SLOPES = 6, 3
"""Steps with the same derivatives, and how often these are computed."""
_SMALL = 0.01
"""A step that gains a smaller share of the remaining objective is the last."""
_KEPT = 1.1
"""Derivatives hold where the objective is at most so many times what they predicted."""


@dataclass(frozen=True, eq=False)
class LinearisedDrives:
    """Linearised drives, of runs or planned ones.

    linear         with a normal prior of the car's numbers
    levels         of the noise, in each band (b,), per run
    predictions    by rough simulations of its state (n,), per run
    """

    linear: LinearModel
    levels: list[Array]
    predictions: list[Array]

    def relinearise(self, logs: Array, moved: Sequence[Array]) -> LinearisedDrives:
        """The drives linearised at other numbers of the car (p,) and record errors changed by these (k,), per run."""
        linear, posterior = self.linear, self.linear.posterior
        record = [k + more for k, more in zip(linear.state.record, moved, strict=True)]
        predictions = posterior.predict(linear.state.effects, logs, record, rough=True)
        state = replace(linear.state, logs=logs, record=record, predictions=predictions)
        fresh = LinearModel(posterior, state, posterior.number_slopes(state, posterior.prior.steps), linear.whiteners)
        return replace(self, linear=fresh)

    def with_size(self, factors: tuple[float, float, float]) -> LinearisedDrives:
        """The drives with distance errors so many times as large."""
        return replace(self, linear=self.linear.with_size(with_larger_errors(self.linear.size, factors)))


@dataclass(frozen=True, eq=False)
class _Fit:
    """The fitted car without the effect.

    logs         logarithms of its numbers (p,)
    moved        changes of the numbers of the records' errors (k,), per run of each of the drives
    residuals    (n,), likewise
    gain         of the effect over it
    """

    logs: Array
    moved: list[list[Array]]
    residuals: list[list[Array]]
    gain: float


def refitted_gain(there: Sequence[LinearisedDrives], changes: Sequence[Sequence[Array]], precision: Array) -> float:
    """Gain of an effect that changes the predictions by these (n,), per run of each of the drives, in minus twice the
    log-likelihood over the best fit of the car without it.

    precision    of the prior of the car's numbers (p,)
    """
    start, still = there[0].linear.state.logs, [[np.zeros_like(k) for k in one.linear.state.record] for one in there]
    unmoved = sum(_deviance(one, some, k) for one, some, k in zip(there, changes, still, strict=True))
    return min(unmoved, _moved_gain(there, changes, precision, _Fit(start, still, list(map(list, changes)), np.inf)))


def _moved_gain(there: Sequence[LinearisedDrives], changes: Sequence[Sequence[Array]], precision: Array,
                now: _Fit) -> float:
    """Gain over the best fit that Gauss-Newton steps come to: they minimise squares by the levels of the noise, and
    where a change is far above these a car that did not move may be more likely."""
    slopes = list(there)
    for _ in range(_MOST_SLOPES):
        found, hold = _fit_chord(there, slopes, changes, precision, now)
        if not found.gain < (1 - _SMALL) * now.gain:
            return min(found.gain, now.gain)
        now = found
        if hold:
            break
        slopes = [one.relinearise(now.logs, k) for one, k in zip(there, now.moved, strict=True)]
    return now.gain


def _fit_chord(there: Sequence[LinearisedDrives], slopes: Sequence[LinearisedDrives],
               changes: Sequence[Sequence[Array]], precision: Array, now: _Fit) -> tuple[_Fit, bool]:
    """The best of some steps with the same derivatives, and whether these hold."""
    models, start = [one.linear for one in slopes], there[0].linear.state.logs
    information = np.diag(precision) + sum(
        one.information() - np.diag(one.prior.precision) for one in models)
    best, predicted = now, np.inf
    for _ in range(_MOST_STEPS):
        squares, gradient = _squares(models, now, precision, start)
        step = np.asarray(np.linalg.solve(information, gradient), float)
        predicted = min(predicted, squares - float(gradient @ step))
        moved = [one.fit_record_errors_to(_after_step(some, one, step), k).record for one, some, k in zip(
            models, now.residuals, now.moved, strict=True)]
        logs = now.logs + step
        residuals = [_residuals(one, some, logs, k) for one, some, k in zip(there, changes, moved, strict=True)]
        now = _Fit(logs, moved, residuals, float(precision @ (logs - start) ** 2) + sum(
            _deviance(one, some, k) for one, some, k in zip(there, residuals, moved, strict=True)))
        if not now.gain < (1 - _SMALL) * best.gain:
            best = min(now, best, key=lambda one: one.gain)
            break
        best = now
    return best, _squares(models, best, precision, start)[0] < _KEPT * predicted


def _squares(models: Sequence[LinearModel], now: _Fit, precision: Array, start: Array) -> tuple[float, Array]:
    """Sum of squares of the residuals and of the prior, and half of its negative gradient (p,)."""
    squares, gradient = float(precision @ (now.logs - start) ** 2), -precision * (now.logs - start)
    for one, residuals, moved in zip(models, now.residuals, now.moved, strict=True):
        found = one.fit_record_errors_to(residuals, moved)
        squares += found.squares
        gradient = gradient + sum(white @ residual for white, residual in zip(one.white, found.residuals, strict=True))
    return squares, gradient


def _after_step(residuals: Sequence[Array], linear: LinearModel, step: Array) -> list[Array]:
    """Residuals after a step of the car's numbers, to first order."""
    assert linear.numbers is not None
    return [one - step @ numbers for one, numbers in zip(residuals, linear.numbers, strict=True)]


def _residuals(there: LinearisedDrives, changes: Sequence[Array], logs: Array, moved: Sequence[Array]) -> list[Array]:
    """Residuals (n,) of the car without the effect, with these numbers and changes of the record errors."""
    posterior, state = there.linear.posterior, there.linear.state
    record = [k + more for k, more in zip(state.record, moved, strict=True)]
    now = posterior.predict(state.effects, logs, record, rough=True)
    return [change + before - after for change, before, after in zip(changes, there.predictions, now, strict=True)]


def _deviance(there: LinearisedDrives, residuals: Sequence[Array], moved: Sequence[Array]) -> float:
    """Minus twice the log-likelihood over that of the noise alone, with free levels in each band, and the cost of the
    record errors' changes."""
    linear, found = there.linear, 0.0
    for bands, levels, residual, error, k in zip(linear.posterior.bands, there.levels, residuals,
                                                 linear.posterior.record_errors, moved, strict=True):
        found += float(bands.freedom @ np.log1p(bands.power(residual) / levels)) + float(
            k @ error.precision(linear.size) @ k)
    return found
