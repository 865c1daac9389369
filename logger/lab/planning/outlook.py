"""Detectability and isolability of effects in some drives, by their information and by refits.

Problem: an effect with an expected significance of twenty standard deviations is not named if another one, at a
strength of its own, does the same; and what another one does depends on its shape (a frequency, a knee). Solution: each
effect is tried with its usual values and with some that a search begins at. All changes are whitened, and the car's
numbers and the records' errors are projected out (a Schur complement with their priors). What then remains of one
change after another one, at any strength, is fitted to it is the significance by which a search distinguishes the two.

Where effects are large, the gain over a refit of the car without one is computed. Problem: an effect of ten standard
deviations or more moves the car's numbers and the distances beyond first order: what first order leaves of a soft mount
or a slow sensor is half as much again as a fit leaves, and a likelihood whose levels are free gains less than the
square of the standard deviations where these lie in few bands. Solution: the record with the effect is taken for the
measurement (an Asimov data set: G. Cowan et al., European Physical Journal C 71, 2011), and the car without it is
fitted to that: Gauss-Newton steps with known derivatives (the chord method: J. M. Ortega and W. C. Rheinboldt,
Iterative Solution of Nonlinear Equations, 1970, section 7.1), each judged by a full prediction and by the likelihood of
a search; where it is not as linear as they say, derivatives are computed again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from logger.arrays import Array
from logger.lab.likelihood.distance_error import USUAL
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.planning.planned_drive import SIZES, FisherInformation, with_larger_errors
from logger.lab.selection.detectability import DETECTABLE_SIGMA, is_uninformative_at_usual
from logger.lab.selection.evidence import INDISTINGUISHABLE
from logger.vehicle.effect import Chosen, Effect, chosen

Indices = npt.NDArray[np.intp]

ISOLABLE_SIGMA = float(np.sqrt(INDISTINGUISHABLE))
"""Two effects are distinguishable where so many standard deviations of the one remain after the other is fitted: their
square is the difference of the two scores."""
_MOST_TRIALS = 4
"""Trials of an effect besides its usual values, spread over those that a search begins at: they distinguish another
shape of it from another effect; all of them would take three times as long."""
_TINY = 1e-9


@dataclass(frozen=True, eq=False)
class EffectGrid:
    """Effects at the values that are tried: the columns of one effect in a row, its usual values first.

    first    index of each effect's first column (e,)
    """

    effects: tuple[Effect, ...]
    columns: tuple[Chosen, ...]
    first: Indices

    @staticmethod
    def of(effects: Sequence[Effect]) -> EffectGrid:
        """The grid of some effects."""
        each = [_values_of(one) for one in effects]
        columns = tuple(chosen(effect, values) for effect, some in zip(effects, each, strict=True) for values in some)
        return EffectGrid(tuple(effects), columns, np.cumsum([0, *map(len, each[:-1])]))

    def columns_of(self, index: int) -> range:
        """Columns of an effect."""
        ends = [*self.first[1:], len(self.columns)]
        return range(int(self.first[index]), int(ends[index]))


def _values_of(effect: Effect) -> list[dict[str, float]]:
    trials = [one for one in effect.trials() if one != effect.usual]
    places = np.unique(np.linspace(0, len(trials) - 1, min(len(trials), _MOST_TRIALS)).round().astype(int))
    return [effect.usual, *(trials[one] for one in places)]


@dataclass(frozen=True, eq=False)
class Outlook:
    """Detectability and isolability of effects in some drives, in standard deviations.

    detectability    expected significance of each effect (e,)
    pairwise         what remains of it after another one is fitted (e, e); its detectability on the diagonal
    """

    detectability: Array
    pairwise: Array

    def scaled_to(self, detectability: Array) -> Outlook:
        """The outlook with other detectabilities (e,); what remains of each is scaled in proportion."""
        share = detectability / np.maximum(self.detectability, _TINY)
        return Outlook(detectability, self.pairwise * share[:, None])

    @property
    def isolability(self) -> Array:
        """What remains of each effect after the one most like it is fitted (e,)."""
        return np.asarray(self.pairwise.min(axis=1))

    @property
    def nearest(self) -> Indices:
        """Index of the effect that is most like each (e,); its own, where none is."""
        return np.asarray(self.pairwise.argmin(axis=1))

    @property
    def chances(self) -> Array:
        """Probability that a search names each effect, were it the only one (e,): its significance is normal around the
        expected one with unit variance, and has to make it detectable and distinguishable from all others."""
        from scipy.special import ndtr

        return np.minimum(ndtr(self.detectability - DETECTABLE_SIGMA), ndtr(self.isolability - ISOLABLE_SIGMA))


def representatives(settings: EffectGrid, information: FisherInformation, precision: Array) -> Indices:
    """The column (e,) that represents each effect: its usual values or, where these say little, those of the largest
    expected significance.

    information    of some drives
    precision      (p,) of the prior of the car's numbers
    """
    marginal, costs = _marginal(information, precision)
    alone = np.sqrt(np.maximum((np.einsum("sii->si", marginal) + costs[:, None]).min(axis=0), 0.0))
    found = settings.first.copy()
    for index, effect in enumerate(settings.effects):
        if is_uninformative_at_usual(effect, float(alone[found[index]])):
            found[index] = max(settings.columns_of(index), key=lambda column: alone[column])
    return found


def outlook(settings: EffectGrid, information: FisherInformation, precision: Array, columns: Indices) -> Outlook:
    """Detectability and isolability by the information of drives; arguments as of ``representatives``, whose result is
    ``columns``."""
    marginal, costs = _marginal(information, precision)
    own = np.maximum(np.einsum("sii->si", marginal), 0.0)
    explained = marginal[:, columns] ** 2 / np.maximum(own, _TINY)[:, None]
    most = np.maximum.reduceat(explained, settings.first, axis=2)
    np.einsum("sii->si", most)[:] = 0.0
    pairwise = (own[:, columns, None] - most + costs[:, None, None]).min(axis=0)
    found = np.sqrt(np.maximum(pairwise, 0.0))
    return Outlook(np.diag(found).copy(), found)


def most_likely_sizes(information: FisherInformation, precision: Array, columns: Indices) -> tuple[Indices, Array]:
    """The most likely of ``SIZES`` of the distance errors with each effect (e,), and its cost (e,) [minus twice a
    log-likelihood]; arguments as of ``outlook``."""
    marginal, costs = _marginal(information, precision)
    which = (np.einsum("sii->si", marginal)[:, columns] + costs[:, None]).argmin(axis=0)
    return which, costs[which]


def _marginal(information: FisherInformation, precision: Array) -> tuple[Array, Array]:
    """Information on the effects' columns (s, m, m), the car's numbers integrated out, and the cost of distance errors
    of each size over that of the expected size (s,)."""
    count = len(precision)
    mixed = information.products[:, :count, count:]
    known = information.products[:, :count, :count] + np.diag(precision)
    found = information.products[:, count:, count:] - mixed.transpose(0, 2, 1) @ np.linalg.solve(known, mixed)
    costs = information.costs + [with_larger_errors(USUAL, size).cost for size in SIZES[: len(information.costs)]]
    return np.asarray(found), np.asarray(costs - costs[0])


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
