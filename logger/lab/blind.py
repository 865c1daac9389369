"""Which effects some runs could not show, were they there.

Problem: that an effect was not found means little when these runs would hide it: a spring that hardens is straight on a
smooth road. Solution: each effect is simulated at its usual strength; what the car's own numbers and the wander of the
distance could do as well is taken out, and what remains is measured in standard deviations of the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.fitting import Problem, Slopes, State, Weighed
from logger.vehicle.effect import Chosen, Effect, VehicleEffect, chosen

Array = npt.NDArray[np.float64]

SEEN = 6.0
"""An effect that stands out by fewer standard deviations would hardly be found among twenty."""
_NOTHING = 0.1


@dataclass(frozen=True)
class Blind:
    """An effect that would stand out by so many standard deviations at its usual strength, which are too few."""

    effect: Effect
    deviations: float


def blind(problem: Problem, state: State, slopes: Slopes, effects: Sequence[Effect]) -> tuple[Blind, ...]:
    """Those of the effects that the runs could not show beside a fitted model, by slopes that were taken near it; the
    most hidden first."""
    sight = _Sight(problem, state, slopes)
    found = [Blind(effect, sight.of(effect)) for effect in effects]
    return tuple(sorted((one for one in found if one.deviations < SEEN), key=lambda one: one.deviations))


class _Sight:
    """By how much effects would stand out beside a model that was laid out."""

    def __init__(self, problem: Problem, state: State, slopes: Slopes) -> None:
        self._problem, self._state, self._slopes = problem, state, slopes.around(state)
        self._weighed = Weighed(problem, self._slopes, problem.whiteners(state))
        self._uncertainty = np.linalg.inv(self._weighed.information)
        self._here = self._predicted(state.effects)

    def of(self, effect: Effect) -> float:
        """At its usual strength; where it has none, or the vehicle has just that, at the most telling values that a
        search begins at."""
        found = self._deviations(chosen(effect, effect.usual))
        strengthless = all(one.null is None for one in effect.parameters)
        if isinstance(effect, VehicleEffect) and (strengthless or found < _NOTHING):
            found = max(self._deviations(chosen(effect, values)) for values in effect.trials())
        return found

    def _deviations(self, one: Chosen) -> float:
        weighed = self._weighed
        there = self._predicted((*self._state.effects, one))
        change = [whitener((new - old)[None]) for whitener, new, old in zip(
            weighed.whiteners, there, self._here, strict=True)]
        mixed = weighed.against(change)[:, 0]
        own = sum(float(part[0] @ part[0]) for part in change) - float(mixed @ self._uncertainty @ mixed)
        return float(np.sqrt(max(own, 0.0)))

    def _predicted(self, effects: tuple[Chosen, ...]) -> list[Array]:
        state = self._state
        return self._problem.predicted(effects, state.logs, state.wander, self._slopes, rough=True).predictions
