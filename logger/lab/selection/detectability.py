"""Which effects some runs could not show, were they there.

Problem: that an effect was not found means little when these runs would hide it: a spring that hardens is straight on a
smooth road. Solution: each effect is simulated at its usual strength; what the car's own numbers and the distance
errors could do as well is projected out, and what remains is measured in standard deviations of the noise: the expected
significance (G. Cowan et al., European Physical Journal C 71, 2011: an Asimov data set).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.lab.likelihood.linear_model import LinearModel
from logger.vehicle.effect import Chosen, Effect, VehicleEffect, chosen

DETECTABLE_SIGMA = 6.0
"""An effect that stands out by fewer standard deviations would hardly be found among twenty: as much evidence as they
give is what the search asks for."""
_NOTHING = 0.1  # deviations


@dataclass(frozen=True)
class Undetectable:
    """An effect that would stand out by so many standard deviations at its usual strength, which are too few."""

    effect: Effect
    deviations: float


def undetectable_effects(found: LinearModel, effects: Sequence[Effect]) -> tuple[Undetectable, ...]:
    """Those of the effects that the runs could not show beside a fitted model, the most hidden first."""
    sensitivity = _Sensitivity(found)
    all_of_them = [Undetectable(effect, sensitivity.of(effect)) for effect in effects]
    return tuple(sorted((one for one in all_of_them if one.deviations < DETECTABLE_SIGMA),
                        key=lambda one: one.deviations))


def usual_says_little(effect: Effect, deviations: float) -> bool:
    """Whether an effect that stands out by so much at its usual values has to be looked at elsewhere: it has no
    strength, or the vehicle has just that."""
    strengthless = all(one.null is None for one in effect.parameters)
    return isinstance(effect, VehicleEffect) and (strengthless or deviations < _NOTHING)


class _Sensitivity:
    """By how much effects would stand out beside a fitted model."""

    def __init__(self, found: LinearModel) -> None:
        self._linear, self._state = found.without_wall(), found.state
        self._covariance = np.linalg.inv(self._linear.information(self._state.logs))
        self._here = self._predicted(self._state.effects)

    def of(self, effect: Effect) -> float:
        """At its usual strength; where it has none, or the vehicle has just that, at the most telling values that a
        search begins at."""
        found = self._deviations(chosen(effect, effect.usual))
        if usual_says_little(effect, found):
            found = max(self._deviations(chosen(effect, values)) for values in effect.trials())
        return found

    def _deviations(self, one: Chosen) -> float:
        there = self._predicted((*self._state.effects, one))
        white = self._linear.whitened([new - old for new, old in zip(there, self._here, strict=True)])
        mixed, own = self._linear.mixed(white)
        return float(np.sqrt(max(own - float(mixed @ self._covariance @ mixed), 0.0)))

    def _predicted(self, effects: tuple[Chosen, ...]) -> list[np.ndarray]:
        state = self._state
        return self._linear.posterior.predict(effects, state.logs, state.record, rough=True)
