"""Detectability and isolability of effects in some drives, by their information.

Problem: an effect with an expected significance of twenty standard deviations is not named if another one, at a
strength of its own, does the same; and what another one does depends on its shape (a frequency, a knee). Solution: each
effect is tried with its usual values and with some that a search begins at. All changes are whitened, and the car's
numbers and the records' errors are projected out (a Schur complement with their priors). What then remains of one
change after another one, at any strength, is fitted to it is the significance by which a search distinguishes the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.distance_error import USUAL
from logger.lab.planning.planned_drive import SIZES, Information, with_larger_errors
from logger.lab.selection.detectability import DETECTABLE_SIGMA, is_uninformative_at_usual
from logger.lab.selection.evidence import INDISTINGUISHABLE
from logger.vehicle.effect import Chosen, Effect, chosen

Array = npt.NDArray[np.float64]
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


def representatives(settings: EffectGrid, information: Information, precision: Array) -> Indices:
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


def outlook(settings: EffectGrid, information: Information, precision: Array, columns: Indices) -> Outlook:
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


def most_likely_sizes(information: Information, precision: Array, columns: Indices) -> tuple[Indices, Array]:
    """The most likely of ``SIZES`` of the distance errors with each effect (e,), and its cost (e,) [minus twice a
    log-likelihood]; arguments as of ``outlook``."""
    marginal, costs = _marginal(information, precision)
    which = (np.einsum("sii->si", marginal)[:, columns] + costs[:, None]).argmin(axis=0)
    return which, costs[which]


def _marginal(information: Information, precision: Array) -> tuple[Array, Array]:
    """Information on the effects' columns (s, m, m), the car's numbers integrated out, and the cost of distance errors
    of each size over that of the expected size (s,)."""
    count = len(precision)
    mixed = information.products[:, :count, count:]
    known = information.products[:, :count, :count] + np.diag(precision)
    found = information.products[:, count:, count:] - mixed.transpose(0, 2, 1) @ np.linalg.solve(known, mixed)
    costs = information.costs + [with_larger_errors(USUAL, size).cost for size in SIZES[: len(information.costs)]]
    return np.asarray(found), np.asarray(costs - costs[0])
