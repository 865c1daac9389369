"""Free parameters of effects: which there are, their coordinates, and effects with other coordinates.

Problem: a fit varies a vector of coordinates, on suitable scales, and an effect is a frozen record with values by name.
Solution: a ``FreeParameter`` is the index of a parameter of an effect; coordinates are those of
``Parameter.coordinate``.
Nothing here knows of any data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from logger.vehicle.effect import Chosen, Parameter, Scale
from logger.vehicle.named_parameters import Free

Array = npt.NDArray[np.float64]

_LOG_STEP = 0.01
_SHARE_STEP = 0.02
_LEAST_SHARE = 0.1


@dataclass(frozen=True)
class FreeParameter:
    """A free parameter: index of the effect in the model, and of the parameter in the effect."""

    effect: int
    parameter: int


def free_parameters_of(effects: Sequence[Chosen], which: Sequence[int] | None = None) -> list[FreeParameter]:
    """Every parameter that a fit may vary, of all effects or of some."""
    chosen = range(len(effects)) if which is None else which
    return [FreeParameter(i, j) for i in chosen for j, one in enumerate(effects[i].effect.parameters) if one.is_free]


def with_coordinates(effects: Sequence[Chosen], free_parameters: Sequence[FreeParameter], coordinates: Array
                     ) -> tuple[Chosen, ...]:
    """The effects with other coordinates (m,), on the scales of their parameters."""
    found = list(effects)
    for free, coordinate in zip(free_parameters, coordinates, strict=True):
        one = found[free.effect]
        parameter = one.effect.parameters[free.parameter]
        found[free.effect] = replace(one, values={**one.values, parameter.name: parameter.value(float(coordinate))})
    return tuple(found)


def coordinates_of(effects: Sequence[Chosen], free_parameters: Sequence[FreeParameter]) -> Array:
    """Coordinates (m,) of free parameters, on their scales."""
    places = []
    for free in free_parameters:
        one = effects[free.effect]
        parameter = one.effect.parameters[free.parameter]
        places.append(parameter.coordinate(one.values[parameter.name]))
    return np.array(places)


def steps_of(effects: Sequence[Chosen], free_parameters: Sequence[FreeParameter], log_step: float = _LOG_STEP,
             share_step: float = _SHARE_STEP) -> Array:
    """Difference steps (m,) for derivatives, on the scales of the parameters; away from a bound.

    log_step      on logarithmic scales
    share_step    on others, as a share; both where a parameter has no step of its own
    """
    steps = []
    for free, here in zip(free_parameters, coordinates_of(effects, free_parameters), strict=True):
        parameter = effects[free.effect].effect.parameters[free.parameter]
        step = parameter.step
        if step is None:
            size = max(abs(here), _LEAST_SHARE * parameter.usual_range())
            step = log_step if parameter.scale is Scale.LOG else share_step * size
        forward, back = (parameter.coordinate(parameter.value(here + way)) - here for way in (step, -step))
        steps.append(forward if abs(forward) > 0.5 * step else max(forward, back, key=abs))
    return np.array(steps)


def free_parameter_named(effects: Sequence[Chosen], name: str) -> FreeParameter | None:
    """The free parameter of that name; None for one that is of none of these effects.

    ValueError, which lists those there are, for a number that the effect lacks or that no fit may move.
    """
    effect, _, leaf = name.partition(".")
    names = [one.effect.name for one in effects]
    if effect not in names:
        return None
    index = names.index(effect)
    numbers = [one.name for one in effects[index].effect.parameters]
    free_parameters = free_parameters_of(effects, [index])
    if leaf not in numbers or FreeParameter(index, numbers.index(leaf)) not in free_parameters:
        known = ", ".join(f"{effect}.{numbers[free.parameter]}" for free in free_parameters) or "none of it"
        raise ValueError(f"{effect} has no number {leaf!r} that a fit can move; expected {known}")
    return FreeParameter(index, numbers.index(leaf))


def free_number(effects: Sequence[Chosen], free: FreeParameter, start: float | None = None,
                bounds: tuple[float, float] | None = None) -> Free:
    """A free parameter as ``identification`` fits it: from its present value, within its range, unless others are
    given. ValueError as ``Free``, and for bounds beyond its range."""
    one = effects[free.effect]
    parameter = one.effect.parameters[free.parameter]
    name = f"{one.effect.name}.{parameter.name}"
    value = one.values[parameter.name] if start is None else start
    low, high = bounds or (parameter.low, parameter.high)
    if not parameter.low <= low < high <= parameter.high:
        raise ValueError(f"{name}: expected bounds within {parameter.low:g} to {parameter.high:g}, found {low:g} to "
                         f"{high:g}")
    return Free(name, value, low, high, usual=_usual(parameter, value) if parameter.scale is Scale.LINEAR else None)


def _usual(parameter: Parameter, value: float) -> float:
    return max(abs(value), parameter.usual_range())


def slope_of(parameter: Parameter, value: float) -> float:
    """Derivative of a number's coordinate by its value."""
    if parameter.scale is Scale.LOG:
        return 1.0 / value
    return -1.0 / value**2 if parameter.scale is Scale.RECIPROCAL else 1.0
