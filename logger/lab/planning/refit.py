"""What an effect leaves when the car without it is refitted to the drives.

Problem: an effect that stands out by ten deviations or more moves the car's numbers and the distances farther than
their slopes hold: what first order leaves of a soft mount or a slow sensor is half as much again as a fit leaves, and a
likelihood whose levels are free gains less than the square of the deviations where these lie in few bands. Solution:
the record with the effect is taken for the measurement (an Asimov data set: G. Cowan et al., European Physical Journal
C 71, 2011), and the car without it is fitted to that: Gauss and Newton's steps by the slopes that are known (the chord
method: J. M. Ortega and W. C. Rheinboldt, Iterative Solution of Nonlinear Equations, 1970, section 7.1), each judged by
a true prediction and by the likelihood of a search; where the slopes do not hold, they are taken anew.
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
"""Steps by the same slopes, and how often slopes are taken."""
_SMALL = 0.01
"""A step that gains a smaller share of what is left is the last."""
_KEPT = 1.1
"""Slopes hold where no more than this of what they promise is left."""


@dataclass(frozen=True, eq=False)
class LinearisedDrives:
    """Drives, of runs or planned ones, beside whose predictions effects are looked at.

    linear         a normal prior of the car's numbers, levels that are expected
    levels         of the noise, in each band (b,), per run
    predictions    rough ones (n,) of its state, per run
    """

    linear: LinearModel
    levels: list[Array]
    predictions: list[Array]

    def relinearise(self, logs: Array, moved: Sequence[Array]) -> LinearisedDrives:
        """The same with slopes beside a car with other numbers (p,) that is so much farther on (k,), per run."""
        linear, posterior = self.linear, self.linear.posterior
        record = [k + more for k, more in zip(linear.state.record, moved, strict=True)]
        predictions = posterior.predict(linear.state.effects, logs, record, rough=True)
        state = replace(linear.state, logs=logs, record=record, predictions=predictions)
        fresh = LinearModel(posterior, state, posterior.number_slopes(state, posterior.prior.steps), linear.whiteners)
        return replace(self, linear=fresh.without_soft_bounds())

    def with_size(self, factors: tuple[float, float, float]) -> LinearisedDrives:
        """The same with distance errors so many times as large."""
        return replace(self, linear=self.linear.with_size(with_larger_errors(self.linear.size, factors)))


@dataclass(frozen=True, eq=False)
class _Fit:
    """The car without the effect, as it was fitted.

    logs     (p,) its numbers
    moved    by how much the numbers of the records' errors (k,) moved, per run of each of the drives
    left     what it leaves (n,), likewise
    gain     what the effect gains over it
    """

    logs: Array
    moved: list[list[Array]]
    left: list[list[Array]]
    gain: float


def refitted_gain(there: Sequence[LinearisedDrives], changes: Sequence[Sequence[Array]], precision: Array) -> float:
    """What a search gains by an effect that changes the predictions so (n,), per run of each: in minus twice the
    log-likelihood, over the car without it that is fitted as well as it goes.

    precision    (p,) of the prior of the car's numbers
    """
    start = there[0].linear.state.logs
    now = _Fit(start, [[np.zeros_like(k) for k in one.linear.state.record] for one in there],
               [list(some) for some in changes], np.inf)
    slopes = list(there)
    for _ in range(_MOST_SLOPES):
        found, hold = _fitted(there, slopes, changes, precision, now)
        if not found.gain < (1 - _SMALL) * now.gain:
            return min(found.gain, now.gain)
        now = found
        if hold:
            break
        slopes = [one.relinearise(now.logs, k) for one, k in zip(there, now.moved, strict=True)]
    return now.gain


def _fitted(there: Sequence[LinearisedDrives], slopes: Sequence[LinearisedDrives], changes: Sequence[Sequence[Array]],
            precision: Array, now: _Fit) -> tuple[_Fit, bool]:
    """The best of some steps by the same slopes, and whether these hold."""
    models, start = [one.linear for one in slopes], there[0].linear.state.logs
    information = np.diag(precision) + sum(
        one.information(now.logs) - np.diag(one.prior.curvature(now.logs)) for one in models)
    best, promised = now, np.inf
    for _ in range(_MOST_STEPS):
        squares, pull = _squares(models, now, precision, start)
        step = np.asarray(np.linalg.solve(information, pull), float)
        promised = min(promised, squares - float(pull @ step))
        moved = [one.fit_record_errors_to(_after_step(some, one, step), k).record for one, some, k in zip(
            models, now.left, now.moved, strict=True)]
        logs = now.logs + step
        left = [_residuals(one, some, logs, k) for one, some, k in zip(there, changes, moved, strict=True)]
        now = _Fit(logs, moved, left, float(precision @ (logs - start) ** 2) + sum(
            _deviance(one, some, k) for one, some, k in zip(there, left, moved, strict=True)))
        if not now.gain < (1 - _SMALL) * best.gain:
            best = min(now, best, key=lambda one: one.gain)
            break
        best = now
    return best, _squares(models, best, precision, start)[0] < _KEPT * promised


def _squares(models: Sequence[LinearModel], now: _Fit, precision: Array, start: Array) -> tuple[float, Array]:
    """Of what is left and of what is off, and which way that falls (p,)."""
    squares, pull = float(precision @ (now.logs - start) ** 2), -precision * (now.logs - start)
    for one, left, moved in zip(models, now.left, now.moved, strict=True):
        found = one.fit_record_errors_to(left, moved)
        squares += found.squares
        pull = pull + sum(white @ residual for white, residual in zip(one.white, found.residuals, strict=True))
    return squares, pull


def _after_step(left: Sequence[Array], linear: LinearModel, step: Array) -> list[Array]:
    """What is left after a step of the car's numbers, to first order."""
    assert linear.numbers is not None
    return [one - step @ numbers for one, numbers in zip(left, linear.numbers, strict=True)]


def _residuals(there: LinearisedDrives, changes: Sequence[Array], logs: Array, moved: Sequence[Array]) -> list[Array]:
    """What the car without the effect, with these numbers and so much farther on, leaves of what it does (n,)."""
    posterior, state = there.linear.posterior, there.linear.state
    record = [k + more for k, more in zip(state.record, moved, strict=True)]
    now = posterior.predict(state.effects, logs, record, rough=True)
    return [change + before - after for change, before, after in zip(changes, there.predictions, now, strict=True)]


def _deviance(there: LinearisedDrives, left: Sequence[Array], moved: Sequence[Array]) -> float:
    """Minus twice the log-likelihood over that of the noise alone, its levels free in each band, and what moves of the
    records cost."""
    linear, found = there.linear, 0.0
    for bands, levels, residual, error, k in zip(linear.posterior.bands, there.levels, left,
                                                 linear.posterior.record_errors, moved, strict=True):
        found += float(bands.freedom @ np.log1p(bands.power(residual) / levels)) + float(
            k @ error.precision(linear.size) @ k)
    return found
