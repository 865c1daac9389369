"""How certain the numbers of a car are, and how large its effects usually are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from math import exp

import numpy as np

from logger.arrays import Array
from logger.vehicle.effect import Chosen, Effect, ForceEffect, Parameter
from logger.vehicle.linearise import KnownCar, known_vehicle
from logger.vehicle.models import structure_of
from logger.vehicle.modes import undamped_frequencies_hz
from logger.vehicle.named_parameters import bounds_of, changed, read, slope_of
from logger.vehicle.vehicle import Vehicle

# Directions with less of the numbers' variance than this are rounding.
_LEAST_VARIANCE = 1e-6
_HALF_NORMAL = (-float(np.euler_gamma + np.log(2)) / 2, float(np.pi / np.sqrt(8)))
"""Mean and standard deviation of ln |z| of a standard normal z."""
# Powers of mass, length and time in units.
_DIMENSIONS = {"kg": (1, 0, 0), "n": (1, 1, -2), "m": (0, 1, 0), "m2": (0, 2, 0), "m3": (0, 3, 0), "s": (0, 0, 1),
               "s2": (0, 0, 2)}
_FARTHEST = 1.0  # a size that may be off by more than a factor e is not known at all


@dataclass(frozen=True)
class Known:
    """How well a number of a vehicle was known before any run.

    value        the number: its best guess, or of a range the middle by factors
    deviation    standard deviation of its logarithm; infinite of a preload, which has either sign
    words        as a file says it: ``875 +- 5%``, ``[700, 1000]``, ``unknown``
    """

    value: float
    deviation: float
    words: str

    @classmethod
    def about(cls, value: float, deviation: float, percent: bool) -> Known:
        """A value and its standard deviation, in its unit or in ``percent`` of it. Of a size that is 0 within its
        deviation the logarithm has the mean and deviation of a half-normal variable's."""
        words = f"{value!r} +- {deviation:g}{'%' * percent}"
        if value == 0:
            return cls(deviation * exp(_HALF_NORMAL[0]), _HALF_NORMAL[1], words)
        share = deviation / (100.0 if percent else value)
        return cls(value, share, words)

    @classmethod
    def within(cls, low: float, high: float) -> Known:
        """A range within which nothing is known: uniform by factors."""
        return cls(float(np.sqrt(low * high)), float(np.log(high / low) / np.sqrt(12)), f"[{low!r}, {high!r}]")

    @classmethod
    def unknown(cls, name: str, value: float) -> Known:
        """Nothing is known; the value is where a search begins. A fit stays within the same factor of it either way as
        where no bounds are said."""
        return replace(cls.within(*bounds_of(name, value)), value=value, words=UNKNOWN)

    @property
    def is_guess(self) -> bool:
        """Whether it is a size with a standard deviation."""
        return "+-" in self.words and self.deviation <= 1

    @property
    def ends(self) -> tuple[float, float] | None:
        """Of a range."""
        low, _, high = self.words.strip("[]").partition(", ")
        return (float(low), float(high)) if high else None


UNKNOWN = "unknown"


@dataclass(frozen=True)
class NumberErrors:
    """Standard errors of a model's numbers, and how they hang together.

    Problem: numbers that were fitted come with standard errors, but they hang together: more mass and a stiffer spring
    make the same car as far as the fit can show, so that errors one by one make a car look less certain than it is.
    Solution: the errors with their correlations, cut into directions that have nothing to do with one another (the
    eigenvectors of the correlation matrix); for each there is the car a standard error away.

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
    """The cars a standard error away, as ``models_off`` has them."""
    return tuple(known_vehicle(*one) for one in models_off(vehicle, effects, errors))


def models_off(vehicle: Vehicle, effects: Sequence[Chosen], errors: NumberErrors | None
               ) -> tuple[tuple[Vehicle, Sequence[Chosen]], ...]:
    """A vehicle with its effects a standard error away, one for each independent direction.

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


def _moved(vehicle: Vehicle, effects: Sequence[Chosen], steps: Mapping[str, float]
           ) -> tuple[Vehicle, Sequence[Chosen]]:
    """The vehicle with its numbers moved by as much; sizes by factors, so that they stay sizes."""
    numbers, others = {}, list(effects)
    places = {one.effect.name: place for place, one in enumerate(effects)}
    for name, step in steps.items():
        effect, _, leaf = name.partition(".")
        if effect in places:
            one = others[places[effect]]
            parameter = next((each for each in one.effect.parameters if each.name == leaf), None)
            if parameter is None:
                raise ValueError(f"{effect} has no parameter {leaf!r}")
            value = one.values[leaf]
            moved = parameter.value(parameter.coordinate(value) + slope_of(parameter, value) * step)
            others[places[effect]] = replace(one, values={**one.values, leaf: moved})
        else:
            value = read(vehicle, name)
            numbers[name] = value * exp(max(-_FARTHEST, min(step / value, _FARTHEST))) if value > 0 else value + step
    return changed(vehicle, numbers), others


def not_known(iri_share_std: float) -> str:
    """What a person is to know and do where nobody knows the car, and the IRI may be off by such a share of it."""
    return (f"the car is not known: the IRI can be {iri_share_std:.0%} off. Drive at different speeds, run ridelog "
            "learn-car, and name its file in the settings (vehicle).")


# Of a car of the middle class: sprung mass on each wheel, frequency of its bounce, wheelbase.
_MASS_KG, _BOUNCE_HZ, _WHEELBASE_M = 350.0, 1.4, 2.7
_TRAVEL_M = 0.02
@dataclass(frozen=True)
class Scales:
    """How large what happens on a bench is, over what happens in a car: powers of ten of forces, ways and times."""

    force: float
    way: float
    time: float

    @classmethod
    def of(cls, force_n: float, travel_m: float, rate_mps: float) -> Scales:
        """Of r.m.s. values. Those of a car are its bounce with a travel of 2 cm."""
        omega = 2 * np.pi * _BOUNCE_HZ
        return cls(_power_of_ten(force_n / (_MASS_KG * omega**2 * _TRAVEL_M), parts=2),
                   _power_of_ten(travel_m / _TRAVEL_M, parts=2), _power_of_ten(travel_m / rate_mps * omega, parts=2))


def sized(effect: Effect, vehicle: Vehicle, scales: Scales | None = None) -> Effect:
    """An effect with starts, trials and bounds in the sizes of a vehicle; of a car itself.

    Problem: the values that a search begins at, and what may be asked for, are those of cars: a friction of 60 N holds
    a rig of 25 N still. Solution: a vehicle that is lighter or quicker than cars by a factor has forces, springs,
    dampers and travels that follow by their dimensions (E. Buckingham, Physical Review 4, 1914), gravity being the same
    for all: with masses as m and times as t, travels go as t2, forces as m, springs as m / t2, dampers as m / t. Where
    ``scales`` are known of a bench, on which gravity drives nothing, forces, travels and times go by them. Of a part
    without them, which may be a bushing's or a bridge's, no size is known: its bounds hold no number back. Places
    on the car go with its wheelbase. Factors of masses and places are powers of ten, those of times half ones, as
    trials are that far apart: of every car they are 1. It has the parameters that the vehicle has parts for.
    """
    effect = effect.on(vehicle)
    if scales is not None:
        found = tuple(_times(one, _factor(effect, one.name, scales, 1.0)) for one in effect.parameters)
    elif structure_of(vehicle).held:
        found = tuple(_of_any_size(one, _factor(effect, one.name, Scales(2.0, 3.0, 5.0), 1.0) != 1.0)
                      for one in effect.parameters)
    else:
        mass, time, wheelbase = _factors(vehicle)
        scales = Scales(mass, time**2, time)
        found = tuple(_times(one, _factor(effect, one.name, scales, wheelbase)) for one in effect.parameters)
    if found == effect.parameters:
        return effect
    made = copy(effect)
    made.parameters = found
    return made


def dimensions_of(name: str) -> tuple[int, int, int]:
    """The powers of mass, length and time in the unit of a number of a car or an effect."""
    above, _, below = name.partition("_per_")
    powers = [(sign, _DIMENSIONS[unit]) for units, sign in ((above.split("_")[1:], 1), (below.split("_"), -1))
              for unit in units if unit in _DIMENSIONS]
    mass, length, time = (sum(sign * of_unit[at] for sign, of_unit in powers) for at in range(3))
    return mass, length, time


def grows_with_mass(name: str) -> bool:
    """Whether a number of a car or an effect, by its unit, grows by the same factor as all masses and forces do where a
    vehicle moves alike."""
    return dimensions_of(name)[0] > 0


def _factors(vehicle: Vehicle) -> tuple[float, float, float]:
    """Of masses, times and places on the vehicle, over those of a car."""
    structure = structure_of(vehicle)
    mass_kg = vehicle.sprung_mass_kg / len(structure.wheels) or _MASS_KG
    bounce_hz = float(undamped_frequencies_hz(structure)[0])
    wheelbase_m = float(structure.behind_m.max()) or _WHEELBASE_M
    return (_power_of_ten(mass_kg / _MASS_KG), _power_of_ten(_BOUNCE_HZ / bounce_hz, parts=2) if bounce_hz else 1.0,
            _power_of_ten(wheelbase_m / _WHEELBASE_M))


def _power_of_ten(ratio: float, parts: int = 1) -> float:
    """The nearest one, or the nearest root of one."""
    return float(10.0 ** (np.round(parts * np.log10(ratio)) / parts))


def _factor(effect: Effect, name: str, scales: Scales, wheelbase: float) -> float:
    mass, length, time = dimensions_of(name)
    if (mass, length, time) == (0, 1, 0):
        return scales.way if isinstance(effect, ForceEffect) else wheelbase
    if mass or length:
        return scales.force**mass * scales.way**(length - mass) * scales.time**(time + 2 * mass)
    if name.endswith("_hz") and any(one.name.endswith("_kg") for one in effect.parameters):
        return 1 / scales.time  # of a mass that swings by itself
    return 1.0  # frequencies that resonate are looked for everywhere between bounce and what the recorder keeps


def _of_any_size(one: Parameter, has_size: bool) -> Parameter:
    """With bounds that rounding sets, if it ``has_size`` (a force, a length, a rate), and its sign."""
    if not has_size:
        return one
    smallest, largest = np.finfo(float).eps, 1 / np.finfo(float).eps
    return replace(one, low=one.low * (smallest if one.low > 0 else largest), high=one.high * largest)


def _times(one: Parameter, factor: float) -> Parameter:
    """Its usual values times a factor, within bounds that reach as far as before at least."""
    if factor == 1.0:
        return one
    return replace(one, start=one.start * factor, low=min(one.low, one.low * factor),
                   high=max(one.high, one.high * factor), trials=tuple(value * factor for value in one.trials),
                   step=None if one.step is None else one.step * factor)
