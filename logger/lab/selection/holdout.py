"""Approximate cross-validation: errors on held-out stretches, without a fit for each.

Problem: an error is honest on data that the fit did not see, and twenty models cannot be fitted three times over.
Solution: three sets of stretches are held out in turn, and one Gauss-Newton step from the fit of all data gives the fit
without them (A. Beirami et al., Advances in Neural Information Processing Systems 30, 2017). Where the car was is not
judged: distance errors stay as fitted to all data. Nor is a number that is estimated from one stretch alone, as of
a stop that is hit by one pothole, or the damping of a mode that a sweep passes once: one step without that stretch
would extrapolate without limit. It stays as fitted too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np

from logger.arrays import Array, Indices
from logger.lab.likelihood.map_fit import own_slopes
from logger.lab.likelihood.noise_floor import signals_with_noise
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.signals import deviance, error_with_rounding_noise
from logger.runs import Run

JUDGED_ON = "held-out stretches"
"""What the errors of steps and candidates are errors of."""
AS_FILED, REFITTED = "the vehicle's file unchanged", "its parameters refitted"
AS_GUESSED = "guesses for what the vehicle's file leaves unknown"
# A relative difference below it is a rounding: errors are printed to two digits or three.
AS_PRINTED = 0.005
_STRETCH_S, _FOLDS = 6.0, 3
"""Stretches are longer than a car remembers its road, some seconds, and each run of 20 s or more has one of every
set."""
_ONCE = 0.1
"""A number of which the other stretches hold a smaller share of the information is estimated from one: of one that acts
throughout they hold two thirds."""


@dataclass(frozen=True)
class HoldOut:
    """A model on held-out stretches, all of them in turn: its normalised r.m.s. error, and minus twice the
    log-likelihood of its residuals.

    signals    where more was measured than the sensor's acceleration (whose name is empty): the error of each signal,
               and the error that its noise makes, by name
    """

    error: float
    deviance: float
    signals: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def largest(self) -> float:
        """The largest error of a signal, of the further ones beyond its noise."""
        return max([self.error, *(max(error**2 - noise**2, 0.0)**0.5 for name, (error, noise) in self.signals.items()
                                  if name)])

    def explains_most_beyond(self, without: HoldOut) -> bool:
        """Whether more than half of the power that a smaller model leaves is explained."""
        return self._left_of(without) < most_of(1.0)

    def is_worse_than(self, without: HoldOut) -> bool:
        """Whether the error, which is of the first signal, or what is left of all is larger than that of a smaller
        model by more than a rounding."""
        return max(self.error / without.error if without.error else 1.0,
                   self._left_of(without)**0.5) > 1 + AS_PRINTED

    def _left_of(self, without: HoldOut) -> float:
        """Share that is left of the power that a smaller model leaves: the mean of the signals, by what that leaves of
        each beyond its noise."""
        explicable = {name: max(error**2 - noise**2, 0.0) for name, (error, noise) in without.signals.items()}
        if not sum(explicable.values()) > 0:
            return (self.error / without.error)**2 if without.error else 1.0
        return sum(weight * (self.signals[name][0] / without.signals[name][0])**2
                   for name, weight in explicable.items() if weight) / sum(explicable.values())


def most_of(power: float) -> float:
    """What explains most of a residual of some power leaves less than this."""
    return 0.5 * power


def folds(run: Run) -> Indices:
    """Number of the set that each sample that counts is held out with (n,), of each signal after the other."""
    time_s = np.arange(run.count - run.first) / run.rate_hz
    stretch_s = min(_STRETCH_S, (run.count - run.first) / run.rate_hz / _FOLDS)
    return np.tile((time_s / stretch_s).astype(np.intp) % _FOLDS, 1 + len(run.signals))


class FittedState(Protocol):
    """A fitted model, with derivatives by the car's numbers (p, n) per run."""

    @property
    def posterior(self) -> Posterior: ...

    @property
    def state(self) -> State: ...

    @property
    def numbers(self) -> Sequence[Array] | None: ...


def cross_validate(fitted: FittedState, own: Sequence[Array] | None = None) -> HoldOut:
    """Cross-validate a fitted model, with columns (m, n) per run whose coefficients are fitted too; None: those of its
    effects' numbers."""
    posterior, state = fitted.posterior, fitted.state
    residuals = posterior.residuals(state)
    whiteners = [one.whitener(residual) for one, residual in zip(posterior.bands, residuals, strict=True)]
    own = own_slopes(posterior, state, whiteners) if own is None else own
    columns = fitted.numbers or [np.empty((0, len(one))) for one in residuals]
    count = len(columns[0])
    if own is not None:
        columns = [np.vstack([first, more]) for first, more in zip(columns, own, strict=True)]
    columns = posterior.without_insensitive_samples(columns, state.predictions)
    white, ones = ([whitener.in_time(one) for whitener, one in zip(whiteners, some, strict=True)]
                   for some in (columns, residuals))
    sets = [folds(run) for run in posterior.runs.runs]
    own_count = len(columns[0]) - count
    prior = np.concatenate([posterior.prior.precision[:count], np.zeros(own_count)])
    prior_gradient = np.concatenate([posterior.prior.gradient(state.logs)[:count], np.zeros(own_count)])
    unseen = [one.copy() for one in residuals]
    everything = sum(np.einsum("ij,ij->i", part, part) for part in white)
    for fold in range(_FOLDS):
        information, gradient = np.diag(prior), -prior_gradient
        for part, residual, which in zip(white, ones, sets, strict=True):
            seen = which != fold
            information = information + part[:, seen] @ part[:, seen].T
            gradient = gradient + part[:, seen] @ residual[seen]
        once = np.diag(information) < prior + _ONCE * everything
        information[once], information[:, once], gradient[once] = 0.0, 0.0, 0.0
        step = _solve_scaled(information, gradient)
        for run, residual, part, which, kept in zip(posterior.runs.runs, residuals, columns, sets, unseen, strict=True):
            held = np.flatnonzero(run.counted)[which == fold]
            kept[held] = (residual - step @ part)[held]
    return HoldOut(error_with_rounding_noise(posterior.readings, unseen), deviance(posterior.bands, unseen),
                   signals_with_noise(posterior, unseen))


def _solve_scaled(information: Array, gradient: Array) -> Array:
    """Newton step of a scaled system; numbers that nothing depends on stay."""
    size = np.sqrt(np.diag(information))
    scale = np.where(size > 0, size, 1.0)
    scaled = information / np.outer(scale, scale) + 1e-9 * np.eye(len(scale))
    return np.asarray(np.linalg.solve(scaled, gradient / scale) / scale)


def fit_percent(error: float) -> float:
    """The fit per cent of a normalised r.m.s. error (L. Ljung, System Identification, 1999: "best fit")."""
    return 100 * (1 - error)


class ErrorStep(NamedTuple):
    """A model: what was done, its error on what no fit saw, and the sum of the squares of those of other signals."""

    words: str
    error: float
    others: float = 0.0

    @staticmethod
    def of(words: str, found: HoldOut) -> ErrorStep:
        """A model by its errors."""
        return ErrorStep(words, found.error, sum(error**2 for name, (error, _) in found.signals.items() if name))

    @property
    def power(self) -> float:
        """Sum of the squares of the errors of all signals."""
        return self.error**2 + self.others


def as_filed(tolerance: Tolerance) -> str:
    """What is said of the model before any fit."""
    return AS_GUESSED if tolerance.guessed else AS_FILED


def rising(steps: Sequence[ErrorStep]) -> list[str]:
    """What was done in those steps that raise the error by more than a rounding, and as it is printed."""
    return [now.words for before, now in pairwise(steps)
            if round(now.error, 3) > round((1 + AS_PRINTED) * before.error, 3)]
