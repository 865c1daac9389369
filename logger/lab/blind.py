"""Which effects some runs could not show, were they there.

Problem: that an effect was not found means little when these runs would hide it: a spring that hardens is straight on a
smooth road. Solution: each effect is simulated at its usual strength; what the car's own numbers and the wander of the
distance could do as well is taken out, and what remains is measured in standard deviations of the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.lab.candidates import Base
from logger.lab.fitting import Problem, State
from logger.vehicle.effect import Chosen, Effect, VehicleEffect, chosen

SEEN = 6.0
"""An effect that stands out by fewer standard deviations would hardly be found among twenty."""
_NOTHING = 0.1


@dataclass(frozen=True)
class Blind:
    """An effect that would stand out by so many standard deviations at its usual strength, which are too few."""

    effect: Effect
    deviations: float


def blind(problem: Problem, state: State, effects: Sequence[Effect]) -> tuple[Blind, ...]:
    """Those of the effects that the runs could not show beside a fitted model, the most hidden first."""
    base = Base.of(problem, state, problem.slopes(state))
    found = [Blind(effect, _stands_out(problem, base, effect)) for effect in effects]
    return tuple(sorted((one for one in found if one.deviations < SEEN), key=lambda one: one.deviations))


def _stands_out(problem: Problem, base: Base, effect: Effect) -> float:
    usual = {one.name: one.start if one.default is None else one.default for one in effect.parameters}
    found = _deviations(problem, base, chosen(effect, usual))
    if found < _NOTHING and isinstance(effect, VehicleEffect):  # what is usual may be what this vehicle has
        found = max(_deviations(problem, base, chosen(effect, values)) for values in effect.trials())
    return found


def _deviations(problem: Problem, base: Base, one: Chosen) -> float:
    weighed, state = base.weighed, base.state
    there = problem.predicted((*state.effects, one), state.logs, state.wander, base.slopes)
    here = problem.predicted(state.effects, state.logs, state.wander, base.slopes)
    change = [whitener((new - old)[None]) for whitener, new, old in zip(
        weighed.whiteners, there.predictions, here.predictions, strict=True)]
    mixed = weighed.against(change)[:, 0]
    own = sum(float(one[0] @ one[0]) for one in change) - float(mixed @ base.uncertainty @ mixed)
    return float(np.sqrt(max(own, 0.0)))
