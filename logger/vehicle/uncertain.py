"""How far a vehicle's numbers may be off, and the cars that it may be instead.

Problem: numbers that were fitted come with standard errors, but they hang together: more mass and a stiffer spring make
the same car as far as the fit can show, so that errors one by one make a car look less certain than it is. Solution:
the errors with their correlations, cut into directions that have nothing to do with one another (the eigenvectors of
the correlation matrix); for each there is the car a standard error away.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp

import numpy as np
import numpy.typing as npt

from logger.vehicle.effect import Chosen
from logger.vehicle.effect_parameters import slope_of
from logger.vehicle.linearise import KnownCar, known_vehicle
from logger.vehicle.named_parameters import changed, read
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

# Directions with less of the numbers' variance than this are rounding.
_LEAST_VARIANCE = 1e-6
_FARTHEST = 1.0  # a size that may be off by more than a factor e is not known at all


@dataclass(frozen=True)
class NumberErrors:
    """Standard errors of a model's numbers, and how they hang together.

    standard_errors    by name: ``sprung_mass_kg``, ``front.unsprung_mass_kg``, ``dry_friction.friction_force_n``
    correlations       for each of them, in their order, those with the ones before it: a triangle; empty: none
    """

    standard_errors: Mapping[str, float]
    correlations: tuple[tuple[float, ...], ...] = ()

    @classmethod
    def of_covariance(cls, names: Sequence[str], covariance: Array) -> NumberErrors:
        """From a covariance (p, p); numbers whose variance is not known are left out."""
        kept = [i for i in range(len(names)) if np.isfinite(covariance[i]).all() and covariance[i, i] > 0]
        errors = np.sqrt(np.diag(covariance)[kept])
        correlation = covariance[np.ix_(kept, kept)] / np.outer(errors, errors)
        return cls({names[i]: float(error) for i, error in zip(kept, errors, strict=True)},
                   tuple(tuple(map(float, row[:i])) for i, row in enumerate(correlation)))

    def matrix(self) -> Array:
        """The correlation matrix (p, p)."""
        whole = np.eye(len(self.standard_errors))
        for i, row in enumerate(self.correlations):
            whole[i, :i] = whole[:i, i] = row
        return whole


def cars_off(vehicle: Vehicle, effects: Sequence[Chosen], errors: NumberErrors | None) -> tuple[KnownCar, ...]:
    """The cars a standard error away, one for each independent direction.

    errors    of the model's numbers; the effects' own standard errors count for those of their numbers that it lacks

    ValueError for an error of a number that the model does not have.
    """
    known = errors or NumberErrors({})
    alone = {f"{one.effect.name}.{name}": error for one in effects for name, error in one.standard_errors.items()
             if f"{one.effect.name}.{name}" not in known.standard_errors and error > 0}
    deviations = np.array([*known.standard_errors.values(), *alone.values()])
    names = [*known.standard_errors, *alone]
    correlation = np.eye(len(names))
    correlation[:len(known.standard_errors), :len(known.standard_errors)] = known.matrix()
    variances, directions = np.linalg.eigh(correlation)
    steps = (deviations[:, None] * directions * np.sqrt(np.maximum(variances, 0.0))).T
    return tuple(_moved(vehicle, effects, dict(zip(names, map(float, step), strict=True)))
                 for step, variance in zip(steps, variances, strict=True) if variance > _LEAST_VARIANCE)


def _moved(vehicle: Vehicle, effects: Sequence[Chosen], steps: Mapping[str, float]) -> KnownCar:
    """The car with its numbers moved by as much; sizes by factors, so that they stay sizes."""
    numbers, others = {}, list(effects)
    places = {one.effect.name: place for place, one in enumerate(effects)}
    for name, step in steps.items():
        effect, _, leaf = name.partition(".")
        if effect in places:
            one = others[places[effect]]
            parameter = next((each for each in one.effect.parameters if each.name == leaf), None)
            if parameter is None:
                raise ValueError(f"{effect} has no number {leaf!r}")
            value = one.values[leaf]
            moved = parameter.value(parameter.coordinate(value) + slope_of(parameter, value) * step)
            others[places[effect]] = replace(one, values={**one.values, leaf: moved})
        else:
            value = read(vehicle, name)
            numbers[name] = value * exp(max(-_FARTHEST, min(step / value, _FARTHEST))) if value > 0 else value + step
    return known_vehicle(changed(vehicle, numbers), others)
