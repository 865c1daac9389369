"""The numbers of a car and of its effects by name: how a fit moves them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from logger.arrays import Array
from logger.errors import did_you_mean
from logger.vehicle.effect import Chosen, Parameter, Scale
from logger.vehicle.vehicle import OWN_NAMES, Axle, Vehicle

BOTH, AXLES, SENSOR = "both", ("front", "rear"), "sensor"
PRELOAD = "preload_n"
"""The one number of a vehicle's part that may have either sign."""
_BODY = ("sprung_mass_kg", "pitch_inertia_kg_m2", "roll_inertia_kg_m2", "track_width_m", "contact_patch_m")
_AXLE = ("cg_distance_m", "unsprung_mass_kg", "suspension_stiffness_n_per_m", "suspension_damping_n_s_per_m",
         "tire_stiffness_n_per_m", "anti_roll_stiffness_n_m_per_rad")
_OF_ROLL = ("track_width_m", "roll_inertia_kg_m2", "anti_roll_stiffness_n_m_per_rad")
_DAMPING = "damping_n_s_per_m"
_PLACE = {"half_car": ("ahead_m",), "full_car": ("ahead_m", "left_m")}
WEAKEST = 0.5
"""A number whose standard error is larger than this share of it has not been measured."""
# How far from its start a number may go when nothing else is said: a factor, and limits for places on the car [m].
FACTOR = 20.0
_LENGTHS, _LENGTH_FACTOR = ("cg_distance_m", "track_width_m", "contact_patch_m"), 3.0
_FARTHEST_M = 3.0
_PRELOAD_N = 50.0  # where a search for one begins that is not known
_LONGEST_PATCH_M = 1.0


@dataclass(frozen=True)
class Free:
    """A number that a fit may change.

    Problem: a vehicle is a frozen record with parts in it, a fit moves a list of numbers, and a person names some of
    them. Solution: a name is the path to a number in the vehicle's file, with dots: ``sprung_mass_kg``,
    ``front.suspension_damping_n_s_per_m``. ``both.`` in place of ``front.`` or ``rear.`` stands for the two axles,
    which then get the same value.

    start       where it starts
    low, high   the bounds it stays between
    place       it is one, whatever its bounds
    weakest     the largest standard error of what is still an estimate, as a share of its size or, of a place, of half
                the width of its bounds
    usual       of a strength that may be 0, as that of an effect: how large it usually is; it moves by differences
    known       its value and the standard deviation of that value's logarithm, before any run; None: nothing is known
    may_be_0    of a size that moves by factors: there may be none of it

    ValueError unless low < high and the start lies between them.
    """

    name: str
    start: float
    low: float
    high: float
    place: bool = False
    weakest: float = WEAKEST
    usual: float | None = None
    known: tuple[float, float] | None = None
    may_be_0: bool = False

    def __post_init__(self) -> None:
        if not self.low <= self.start <= self.high or not self.low < self.high:
            raise ValueError(f"{self.name}: expected a start between its bounds, found {self.start:g} and "
                             f"{self.low:g} to {self.high:g}")

    @property
    def by_factors(self) -> bool:
        """Whether it is a size, which keeps its sign and moves by factors, and not a place, which moves by
        differences."""
        return not self.place and self.usual is None and self.low * self.high > 0

    @property
    def unit(self) -> float:
        """What a fit counts it in: its sign where it moves by factors, which are counted by their logarithm, or else
        how large it usually is, or half the width of its bounds."""
        if self.by_factors:
            return 1.0 if self.start > 0 else -1.0
        return (self.high - self.low) / 2 if self.usual is None else self.usual

    def weakest_at(self, value: float) -> float:
        """The largest standard error of what is still an estimate there, as a share of its size or in units. What was
        known before is one."""
        if self.known is not None:
            return float("inf")
        return self.weakest if self.usual is None else self.weakest * max(1.0, abs(value) / self.usual)


    def as_strength(self) -> "Free":
        """The same number down to 0, which moves by differences; an error within its bounds is an estimate."""
        return replace(self, low=0.0, usual=self.start, weakest=self.weakest * self.high / self.start)


class Coordinates:
    """Where a fit has its free numbers: the logarithm of the size of one that moves by factors, any other in its unit.

    low, high    (p,) bounds
    """

    def __init__(self, free: Sequence[Free]) -> None:
        self.free = list(free)
        self._by_factors = np.array([one.by_factors for one in free], dtype=bool)
        self._unit = np.array([one.unit for one in free])
        low, high = (self.of(np.array([getattr(one, end) for one in free])) for end in ("low", "high"))
        self.low, self.high = np.minimum(low, high), np.maximum(low, high)

    def of(self, values: Array) -> Array:
        """Coordinates (p,) of values (p,)."""
        size = np.abs(np.where(self._by_factors, values, 1.0))
        return np.where(self._by_factors, np.log(size), values / self._unit)

    def values(self, x: Array) -> Array:
        """The reverse."""
        return self._unit * np.where(self._by_factors, np.exp(np.where(self._by_factors, x, 0.0)), x)

    def slopes(self, values: Array) -> Array:
        """Derivatives (p,) of the numbers by their coordinates, at values (p,)."""
        return np.where(self._by_factors, values, self._unit)


def names(vehicle: Vehicle) -> list[str]:
    """Every name that this vehicle's model has a use for; the joint ones last."""
    return list(_names_of(vehicle))


def _names_of(vehicle: Vehicle) -> tuple[str, ...]:
    body = tuple([name for name in _BODY if getattr(vehicle, name) is not None])
    return _names(vehicle.model, body, vehicle.rear is not None)


@cache
def _names(model: str, body: tuple[str, ...], has_rear: bool) -> tuple[str, ...]:
    """Of a model, by what it has of a body and axles: a fit asks for them once for each number of each car it tries."""
    if model in OWN_NAMES:
        return tuple(OWN_NAMES[model])
    axle = [name for name in _AXLE if (has_rear if name == "cg_distance_m" else
                                       model == "full_car" or name != "anti_roll_stiffness_n_m_per_rad")]
    single = [f"{one}.{name}" for one in (AXLES if has_rear else AXLES[:1]) for name in axle]
    joint = [f"{BOTH}.{name}" for name in axle if has_rear]
    return (*body, *single, *(f"{SENSOR}.{name}" for name in _PLACE.get(model, ())), *joint)


def sized(vehicle: Vehicle) -> tuple[str, ...]:
    """The numbers that are never quite as a file says, but for those that only a roll shows: masses, inertias, springs,
    dampers and lengths, as far as the vehicle has them."""
    known = [name for name in names(vehicle) if not name.startswith((BOTH, SENSOR, PRELOAD))]
    return tuple(name for name in known if name.rpartition(".")[2] not in _OF_ROLL and read(vehicle, name) > 0)


def read(vehicle: Vehicle, name: str) -> float:
    """The number of that name; of a joint one the mean of the two axles.

    ValueError, which lists the names there are, for another name.
    """
    part, leaf = _place(vehicle, name)
    if part == BOTH:
        return sum(float(getattr(_axle(vehicle, axle), leaf)) for axle in AXLES) / len(AXLES)
    return float(getattr(getattr(vehicle, part) if part else vehicle, leaf))


def changed(vehicle: Vehicle, values: Mapping[str, float]) -> Vehicle:
    """The same vehicle with other numbers. ValueError as ``read``."""
    parts: dict[str, dict[str, float]] = {}
    for name, value in values.items():
        part, leaf = _place(vehicle, name)
        for one in AXLES if part == BOTH else (part,):
            parts.setdefault(one, {})[leaf] = value
    whole: dict[str, Any] = {**parts.pop("", {})}
    for part, some in parts.items():
        of: Any = vehicle.sensor if part == SENSOR else _axle(vehicle, part)
        whole[part] = replace(of, **some)
    return replace(vehicle, **whole)


def free(
    vehicle: Vehicle, name: str, start: float | None = None, bounds: tuple[float, float] | None = None,
    known: tuple[float, float] | None = None
) -> Free:
    """A free number of a vehicle: from its present value, within a factor of 20, unless something else is said.
    A damper may not be there, and nor may the spring of a part, which is then a damper.

    Lengths along the car stay within a factor of 3, the sensor within 3 m of the centre of gravity. ValueError as
    ``read`` and ``Free``, and for a size whose start or bounds are not above 0: what fits best may be none at all then.
    """
    value = read(vehicle, name) if start is None else start
    low, high = bounds_of(name, value) if bounds is None else bounds
    is_place = name == PRELOAD or name.startswith(f"{SENSOR}.")
    if not is_place and not (low > 0 and value > 0):
        raise ValueError(f"{name}: expected a start and bounds above 0, found {value:g} and {low:g} to {high:g}")
    may_be_0 = name.endswith(_DAMPING) or (vehicle.is_part and name in OWN_NAMES["single_mass"])
    return Free(name, value, low, high, is_place, known=known, may_be_0=bounds is None and may_be_0)


def bounds_of(name: str, value: float) -> tuple[float, float]:
    """Bounds of a vehicle's number, the lower and the upper, where nothing else is said of it."""
    if name.startswith(f"{SENSOR}."):
        return -_FARTHEST_M, _FARTHEST_M
    if name == PRELOAD:
        return -FACTOR * max(abs(value), _PRELOAD_N), FACTOR * max(abs(value), _PRELOAD_N)
    factor = _LENGTH_FACTOR if name.rpartition(".")[2] in _LENGTHS else FACTOR
    high = value * factor
    return value / factor, min(high, _LONGEST_PATCH_M) if name == "contact_patch_m" else high


def _axle(vehicle: Vehicle, name: str) -> Axle:
    axle = vehicle.front if name == "front" else vehicle.rear
    assert axle is not None
    return axle


def _place(vehicle: Vehicle, name: str) -> tuple[str, str]:
    """The part of a vehicle that a number is of, and what it is called there."""
    if name not in (known := _names_of(vehicle)):
        raise ValueError(f"{vehicle.name} has no parameter {name!r}; expected one of {', '.join(known)}"
                         f"{did_you_mean(name, known)}")
    part, _, leaf = OWN_NAMES.get(vehicle.model, {}).get(name, name).rpartition(".")
    return part, leaf


_LOG_STEP = 0.01
_SHARE_STEP = 0.02
_LEAST_SHARE = 0.1


@dataclass(frozen=True)
class FreeParameter:
    """A free parameter: index of the effect in the model, and of the parameter in the effect.

    Problem: a fit varies a vector of coordinates, on suitable scales, and an effect is a frozen record with values by
    name. Solution: a ``FreeParameter`` is the index of a parameter of an effect; coordinates are those of
    ``Parameter.coordinate``. Nothing here knows of any data.
    """

    effect: int
    parameter: int


def free_parameters_of(effects: Sequence[Chosen], which: Sequence[int] | None = None) -> list[FreeParameter]:
    """Every parameter that a fit may vary, of all effects or of some."""
    chosen = range(len(effects)) if which is None else which
    return [FreeParameter(i, j) for i in chosen for j, one in enumerate(effects[i].effect.parameters)
            if one in effects[i].freed]


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
    free = {one.name: FreeParameter(index, at)
            for at, one in enumerate(effects[index].effect.parameters) if one.is_free}
    if leaf not in free:  # refinements are free where they are asked for
        known = ", ".join(f"{effect}.{one}" for one in free) or "none of it"
        raise ValueError(f"{effect} has no parameter {leaf!r} that a fit can change; expected {known}")
    return free[leaf]


def free_number(effects: Sequence[Chosen], free: FreeParameter, start: float | None = None) -> Free:
    """A free parameter as ``identification`` fits it: from its present value, unless another is given, within its
    range. ValueError as ``Free``."""
    one = effects[free.effect]
    parameter = one.effect.parameters[free.parameter]
    name = f"{one.effect.name}.{parameter.name}"
    value = one.values[parameter.name] if start is None else start
    usual = (abs(value) or parameter.usual_range()) if parameter.scale is Scale.LINEAR else None
    return Free(name, value, parameter.low, parameter.high, usual=usual)


def slope_of(parameter: Parameter, value: float) -> float:
    """Derivative of a number's coordinate by its value."""
    if parameter.scale is Scale.LOG:
        return 1.0 / value
    return -1.0 / value**2 if parameter.scale is Scale.RECIPROCAL else 1.0
