"""Detectability: which effects some runs could not show, were they there.

Problem: that an effect was not found means little when these runs would hide it: a spring that hardens is linear on a
smooth road. Solution: each effect is simulated at its usual strength; what the car's own numbers and the distance
errors could do as well is projected out, and the rest is measured in standard deviations of the noise: the expected
significance (G. Cowan et al., European Physical Journal C 71, 2011: an Asimov data set).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.selection.evidence import IMITATION
from logger.lab.selection.screening import scale_strength
from logger.vehicle.effect import Chosen, Effect, VehicleEffect, chosen

DETECTABLE_SIGMA = 6.0
"""An effect of a smaller expected significance may be missed among twenty. Derived: where noise alone looks like one of
them in one search of a thousand, an effect of one number has to gain 16.4 in minus twice the log-likelihood
(chi-squared with one degree of freedom), one of three numbers with six starts 26.5: 4.1 to 5.1 deviations. What is
found scatters by one deviation around what is expected."""
_NO_CHANGE = 0.1  # standard deviations, a sixtieth of what is detectable: the vehicle has these values already


@dataclass(frozen=True)
class Undetectable:
    """An effect whose expected significance at its usual strength, in standard deviations, is too small.

    alike    the number of the car that hides it, doing nearly the same within its tolerance; None: it is faint itself
    """

    effect: Effect
    deviations: float
    alike: str | None = None


def undetectable_effects(found: LinearModel, effects: Sequence[Effect]) -> tuple[Undetectable, ...]:
    """Effects that the runs of a fitted model could not show in addition to it, the least significant first."""
    sensitivity = _Sensitivity(found)
    all_of_them = [sensitivity.judge(effect) for effect in effects]
    return tuple(sorted((one for one in all_of_them if one.deviations < DETECTABLE_SIGMA),
                        key=lambda one: one.deviations))


def effect_as_moved(found: LinearModel, effects: Sequence[Effect], left_open: Collection[str] = ()) -> Chosen | None:
    """The effect that changes the records as the refit of the car's numbers does, with its strength: one that is a
    combination of numbers in the file. Those that the file leaves open are as fitted before the refit as well: their
    move says nothing. None: none explains all of that
    change but the share that imitations may have, or it is within the noise. A load of 100 kg and a centre of gravity
    0.1 m ahead, which the numbers of a car of 875 kg absorb, explain 0.98 of it, others 0.79 at most."""
    sensitivity = _Sensitivity(found)
    filed = np.where(np.isin(found.prior.names, list(left_open)), found.state.logs, 0.0)
    alike = [sensitivity.as_moved(chosen(effect, effect.usual), filed) for effect in effects
             if isinstance(effect, VehicleEffect) and any(one.null is not None for one in effect.parameters)]
    share, best = max(alike, key=lambda pair: pair[0], default=(0.0, None))
    return best if share > 1 - IMITATION else None


def is_uninformative_at_usual(effect: Effect, deviations: float) -> bool:
    """Whether an effect with this expected significance at its usual values has to be tried at others: it has no
    strength, or the vehicle has these values already."""
    strengthless = all(one.null is None for one in effect.parameters)
    return isinstance(effect, VehicleEffect) and (strengthless or deviations < _NO_CHANGE)


class _Sensitivity:
    """Expected significance of effects added to a fitted model."""

    def __init__(self, found: LinearModel) -> None:
        self._linear, self._state = found, found.state
        self._covariance = np.linalg.inv(self._linear.information())
        self._here = self._predictions(self._state.effects, self._state.logs)

    def judge(self, effect: Effect) -> Undetectable:
        """Expected significance at the usual strength; where there is none, or the vehicle has it already, the largest
        of the values that a search begins at."""
        found, alike = self._deviations(chosen(effect, effect.usual))
        if is_uninformative_at_usual(effect, found):
            found, alike = max((self._deviations(chosen(effect, values)) for values in effect.trials()),
                               key=lambda one: one[0])
        return Undetectable(effect, found, alike)

    def as_moved(self, one: Chosen, filed: Array) -> tuple[float, Chosen | None]:
        """Share of the squared change of the records by the car's refit from the logarithms ``filed`` (p,) that an
        effect explains at its best strength, and the effect with that; 0 where it cannot have it, or where the noise
        does as much."""
        before = self._predictions(self._state.effects, filed)
        p, there = self._linear.count, one
        for _ in range(5):  # where a resonance moves by its width, a record is not proportional to the strength
            moved, changed = ([new - old for new, old in zip(predicted, before, strict=True)] for predicted in (
                self._here, self._predictions((*self._state.effects, there), filed)))
            (refit, along), (_, own) = self._linear.information(
                self._linear.whitened([np.stack(both) for both in zip(moved, changed, strict=True)]))[p:, p:]
            scaled = scale_strength(there, along / own) if own > 0 else None
            if scaled is None or scaled.at_bound or along**2 < DETECTABLE_SIGMA**2 * own:
                return 0.0, None
            there = scaled
            if abs(along / own - 1) < IMITATION:
                break
        return float(along**2 / (own * refit)), there

    def _deviations(self, one: Chosen) -> tuple[float, str | None]:
        """Expected significance of an effect at its values, and the number of the car that hides it, if one does."""
        there = self._predictions((*self._state.effects, one), self._state.logs)
        white = self._linear.whitened([new - old for new, old in zip(there, self._here, strict=True)])
        (mixed,), ((own,),) = self._linear.cross_products([one[None] for one in white])
        absorbed = mixed * (self._covariance @ mixed)
        left = float(np.sqrt(max(own - float(absorbed.sum()), 0.0)))
        hidden = left < DETECTABLE_SIGMA <= np.sqrt(max(own, 0.0)) and absorbed.max(initial=0.0) > 0.5 * absorbed.sum()
        return left, self._linear.prior.names[int(absorbed.argmax())] if hidden else None

    def _predictions(self, effects: tuple[Chosen, ...], logs: np.ndarray) -> list[np.ndarray]:
        return self._linear.posterior.predict(effects, logs, self._state.record, rough=True)
