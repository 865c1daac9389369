"""Detectability: which effects some runs could not show, were they there.

Problem: that an effect was not found means little when these runs would hide it: a spring that hardens is linear on a
smooth road. Solution: each effect is simulated at its usual strength; what the car's own numbers and the distance
errors could do as well is projected out, and the rest is measured in standard deviations of the noise: the expected
significance (G. Cowan et al., European Physical Journal C 71, 2011: an Asimov data set).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.lab.likelihood.linear_model import LinearModel
from logger.vehicle.effect import Chosen, Effect, VehicleEffect, chosen

DETECTABLE_SIGMA = 6.0
"""An effect of a smaller expected significance would hardly be found among twenty. Derived: a search asks for 20 (2 ln
of twenty over ``FALSE_ALARM``) and each of two numbers costs the logarithm of some 4000 degrees of freedom: 36,
rounded."""
_NO_CHANGE = 0.1  # standard deviations, a sixtieth of what is detectable: the vehicle has these values already


@dataclass(frozen=True)
class Undetectable:
    """An effect whose expected significance at its usual strength, in standard deviations, is too small."""

    effect: Effect
    deviations: float


def undetectable_effects(found: LinearModel, effects: Sequence[Effect]) -> tuple[Undetectable, ...]:
    """Effects that the runs of a fitted model could not show in addition to it, the least significant first."""
    sensitivity = _Sensitivity(found)
    all_of_them = [Undetectable(effect, sensitivity.of(effect)) for effect in effects]
    return tuple(sorted((one for one in all_of_them if one.deviations < DETECTABLE_SIGMA),
                        key=lambda one: one.deviations))


def is_uninformative_at_usual(effect: Effect, deviations: float) -> bool:
    """Whether an effect with this expected significance at its usual values has to be tried at others: it has no
    strength, or the vehicle has these values already."""
    strengthless = all(one.null is None for one in effect.parameters)
    return isinstance(effect, VehicleEffect) and (strengthless or deviations < _NO_CHANGE)


class _Sensitivity:
    """Expected significance of effects added to a fitted model."""

    def __init__(self, found: LinearModel) -> None:
        self._linear, self._state = found.without_soft_bounds(), found.state
        self._covariance = np.linalg.inv(self._linear.information(self._state.logs))
        self._here = self._predictions(self._state.effects)

    def of(self, effect: Effect) -> float:
        """Expected significance at the usual strength; where there is none, or the vehicle has it already, the largest
        of the values that a search begins at."""
        found = self._deviations(chosen(effect, effect.usual))
        if is_uninformative_at_usual(effect, found):
            found = max(self._deviations(chosen(effect, values)) for values in effect.trials())
        return found

    def _deviations(self, one: Chosen) -> float:
        there = self._predictions((*self._state.effects, one))
        white = self._linear.whitened([new - old for new, old in zip(there, self._here, strict=True)])
        mixed, own = self._linear.cross_products(white)
        return float(np.sqrt(max(own - float(mixed @ self._covariance @ mixed), 0.0)))

    def _predictions(self, effects: tuple[Chosen, ...]) -> list[np.ndarray]:
        state = self._state
        return self._linear.posterior.predict(effects, state.logs, state.record, rough=True)
