"""What a physical effect is to the programs that simulate, fit, diagnose and explain it.

Problem: a car does more than its linear model, in some twenty ways that come alone and together; and users bring ways
of their own. Simulation, fits, diagnosis and reports must not know any of them by name. Solution: an effect is one file
that offers ``EFFECT``: a name, its parameters with units and bounds, a source, words on what it leaves in a
measurement, and one function. There are eight kinds of function, one for each place between road and record:

    RoadEffect      the road under the wheels            profile written -> profile of the road
    ActuatorEffect  what pushes a rig                    force recorded -> force that acts
    DriveEffect     where the car was                    distance recorded -> distance driven
    VehicleEffect   the numbers of the car               vehicle -> vehicle
    BodyEffect      what hangs on the body               structure -> structure
    ForceEffect     springs, dampers and tires           the laws of a corner -> the laws of a corner
    SensorEffect    between the body and the record      s -> transfer factor
    RecordEffect    the record in time                   what a recorder knows -> the record

They are applied in this order, and within a kind in the order of ``stage``, so that the order in which a vehicle's file
names them does not matter. An effect changes nothing in place.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from itertools import product
from math import ceil, log, log1p
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np

from logger.arrays import Array, Complex
from logger.vehicle.laws import CornerLaws
from logger.vehicle.structure import Structure
from logger.vehicle.vehicle import OWN_NAMES, Vehicle

Values = SimpleNamespace
"""Values of an effect's parameters, by attribute."""
_AT_BOUND = 1e-3
ON_A_RIG = "it needs a road and a speed, and the run is driven by time"
"""Why some effects cannot be tried on a rig."""
_RESONANCE = "frequency_hz"  # what effects that resonate call it


class Scale(Enum):
    """The coordinate in which a parameter is moved by a fit."""

    LINEAR = "linear"
    LOG = "log"
    RECIPROCAL = "reciprocal"


class Sought(Enum):
    """Where a search tries an effect that nobody asked for by name."""

    ALWAYS = "always"
    ON_RIGS = "on rigs"
    ON_PARTS = "on parts"
    NEVER = "never"


@dataclass(frozen=True)
class Parameter:
    """A number of an effect.

    name       ends in its unit
    start      a sensible value
    low, high  what it may be
    null       where the effect vanishes, which may be infinite; None: this number alone cannot make it vanish
    scale      how fits move it: LOG needs low > 0, RECIPROCAL too (for a null at infinity)
    trials     values that a search begins at
    meaning    in words
    choices    if not empty, the only values there are; a fit tries each
    default    what it is when nothing is said; None: it must be said
    step       slopes are taken over so much of it, on its scale; None: a small share of it
    given      it is what it was given, or what a search begins at: no fit moves it
    may_end    a fit may end at an end of its range: what it shapes is a part of the effect that may not be there
    """

    name: str
    start: float
    low: float
    high: float
    null: float | None
    scale: Scale
    trials: tuple[float, ...]
    meaning: str
    choices: tuple[float, ...] = ()
    default: float | None = None
    step: float | None = None
    given: bool = False
    may_end: bool = False

    @property
    def allowed(self) -> str:
        """What it may be, in words: "1 or 2", "0.2 to 5"."""
        if len(self.choices) > 2:
            return "one of " + ", ".join(f"{choice:g}" for choice in self.choices)
        return " or ".join(f"{choice:g}" for choice in self.choices) or f"{self.low:g} to {self.high:g}".replace(
            "e+0", "e")

    def coordinate(self, value: float) -> float:
        """Where a value lies on the scale that fits move on."""
        if self.scale is Scale.LOG:
            return float(np.log(value))
        return 1.0 / value if self.scale is Scale.RECIPROCAL else value

    def value(self, coordinate: float) -> float:
        """The value at a coordinate, kept within the bounds."""
        if self.scale is Scale.LOG:
            found = float(np.exp(min(coordinate, 700.0)))
        elif self.scale is Scale.RECIPROCAL:
            found = 1.0 / max(coordinate, 1.0 / self.high)
        else:
            found = coordinate
        return float(min(max(found, self.low), self.high))

    @property
    def is_free(self) -> bool:
        """Whether a fit may move it."""
        return not (self.choices or self.given) and self.low < self.high

    def usual_range(self, origin: float = 0.0) -> float:
        """How far the values that it usually has lie from a coordinate: that of its start or, where that is there, the
        farthest that a search begins at, or the width of its range."""
        ways = [abs(self.coordinate(one) - origin) for one in (self.start, *self.trials)]
        return ways[0] or max(ways) or abs(self.coordinate(self.high) - self.coordinate(self.low))

    def is_at(self, end: float, value: float) -> bool:
        """Whether a value is at an end of what it may be: within a small share of the usual way from there, on the
        scale that fits move on."""
        there = self.coordinate(end)
        return abs(self.coordinate(value) - there) < _AT_BOUND * self.usual_range(origin=there)

    def at_bound(self, value: float) -> bool:
        """Whether a value is at either end."""
        return self.is_at(self.low, value) or self.is_at(self.high, value)

    def at_weakest_bound(self, value: float) -> bool:
        """Whether a strength is at the end beyond which lies the value at which it does nothing."""
        if self.null is None or self.low < self.null < self.high:
            return False
        return self.is_at(self.low if self.null <= self.low else self.high, value)


AXLE = Parameter("axle", 0.0, 0.0, 2.0, None, Scale.LINEAR, (0.0,), "where it acts: 1 at the front, 2 at the rear, "
                 "0 at both", choices=(0.0, 1.0, 2.0), default=0.0, given=True)
"""Of an effect of suspensions, which may sit in those of one axle alone. A search tries both, and then each."""

TRANSITION_VELOCITY = Parameter("transition_velocity_m_per_s", 0.02, 0.0, 0.1, None, Scale.LINEAR, (0.0, 0.003, 0.02),
                                "rate at which the friction reaches 76 % of its force, tanh(1); 0: at once",
                                default=0.0, step=0.0003)
STATIC_RATIO = Parameter("static_to_sliding_ratio", 1.5, 1.0, 10.0, None, Scale.LINEAR, (1.5,),
                         "friction at rest over friction in motion", default=1.0)
STRIBECK_VELOCITY = Parameter("stribeck_velocity_m_per_s", 0.05, 1e-5, 0.1, None, Scale.LOG, (0.05,),
                              "rate at which the excess of friction at rest has fallen to 1 / e", default=0.05)
"""Of a friction: how fast it grows, and whether it holds more than it rubs. Rates within which friction changes: B.
Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994); what changes over higher ones is a damper."""


@dataclass(frozen=True)
class Misalignment:
    """How position and acceleration of some runs seem to lie against each other.

    scale      distance recorded over distance driven, were that all
    delay_s    how late the acceleration is, were that all [s]
    low_pass   cut-off [Hz] and order of a filter that the record seems to have gone through; None: none
    rate_hz    samples a second of the record; 0: it does not matter
    thinned    whether it had more when it was recorded
    """

    scale: float
    delay_s: float
    low_pass: tuple[float, int] | None = None
    rate_hz: float = 0.0
    thinned: bool = False


def resonances_hz(low_hz: float, high_hz: float, damping_ratio: float) -> tuple[float, ...]:
    """Natural frequencies from one to at least another, each the half-power bandwidth of a resonance of that damping,
    2 z f, above the one before [Hz]: a resonance between two of them shares four fifths of its power with the nearer
    one (two Lorentz curves of half width z f, that far apart)."""
    steps = ceil(log(high_hz / low_hz) / log1p(2 * damping_ratio))
    return tuple(low_hz * (1 + 2 * damping_ratio) ** step for step in range(steps + 1))


class Effect(ABC):
    """What every effect offers.

    name         as users write it; of those that come with ridelog the file's
    title        in a few words
    parameters   its numbers, maybe none
    source       where the law is from
    signature    what it leaves in a measurement that a model without it is compared with
    shown_by     the drive that would show it best, as an instruction
    realigns     whether it moves the model against the measurement, so that a search looks at how they lie first
    reshapes     whether it does more than that
    imitates_any whether it changes all of a record, and so imitates a part of any force: it is evident only where it
                 explains most of what is left, or leaves nothing
    replaces     those of its parameters that are numbers of the car, which it sets, whatever they are
    sought       whether a search tries it where nobody asked for it by name
    sought_last  whether it does so anywhere else, too, where all others leave something unexplained
    needs_road   whether it asks for a road, a speed or a distance, which a rig does not have
    needs_wheel  whether it asks for a wheel, a tire or a car's body, which a mass on a base does not have
    needs_spring whether it asks for a suspension's, a part's or a mass's own spring
    needs_body   whether something hangs on what moves freely, which a part that its bench moves does not
    against_ground  whether it acts between what moves and the ground; where the base of a mass rests, it is what acts
                 between that and the base
    not_of       kinds of sensors, and what they measure, that cannot have it
    found_of     what sensors measure whose records have it in any model, to a per cent
    underlies    whether it is nearly always there and hides others: these are tried on top of it where none is seen
    also_by      those of its parameters that are strengths beside the one that has a null: it vanishes where all are at
                 their lows
    refinements  those of its parameters that say more of it than its plain form does, which it has while all of them
                 are at their defaults: no fit moves them then, and a search tries both
    terms        those refinements that add a term of their own, of which nothing is left at 0
    variants     by the vehicle's model: the effect that stands in its place, where that has fewer parts than the
                 parameters speak of, or its bench shows more of them
    """

    name: str
    title: str
    parameters: tuple[Parameter, ...] = ()
    source: str
    signature: str
    shown_by: str
    realigns: bool = False
    reshapes: bool = True
    imitates_any: bool = False
    replaces: tuple[str, ...] = ()
    sought: Sought = Sought.ALWAYS
    sought_last: bool = False
    needs_road: bool = False
    needs_wheel: bool = False
    needs_spring: bool = False
    needs_body: bool = False
    against_ground: bool = False
    not_of: tuple[str, ...] = ()
    found_of: tuple[str, ...] = ()
    underlies: bool = False
    also_by: tuple[str, ...] = ()
    stage: int = 0
    refinements: tuple[str, ...] = ()
    terms: tuple[str, ...] = ()
    variants: "Mapping[str, Effect]" = MappingProxyType({})

    def __init_subclass__(cls) -> None:
        folder, _, file = cls.__module__.rpartition(".")
        if folder == "logger.vehicle.effects" and "name" not in vars(cls):
            cls.name = file

    @property
    def usual(self) -> dict[str, float]:
        """All its parameters as they are when nothing is said of them: at their defaults, or else at their starts."""
        return {one.name: one.start if one.default is None else one.default for one in self.parameters}

    def on(self, vehicle: Vehicle) -> "Effect":
        """The effect as this vehicle can have it."""
        return self.variants.get(vehicle.model, self)

    def obstacle(self, vehicle: Vehicle, two_tracks: bool) -> str | None:
        """Why it cannot be there in this vehicle on this road; None if it can."""
        axles = (one for one in (vehicle.front, vehicle.rear) if one is not None)
        has_spring = any(one.suspension_stiffness_n_per_m for one in axles)
        return None if has_spring or not self.needs_spring else "it needs a spring"

    def obstacle_on(self, vehicle: Vehicle, two_tracks: bool, timed: bool, pushed: bool) -> str | None:
        """The same where runs may be driven by time (``timed``), or by forces (``pushed``)."""
        if isinstance(self, ActuatorEffect) and not pushed:
            return "it needs a rig that a measured force drives"
        if self.needs_wheel and vehicle.model in OWN_NAMES:
            return f"a {vehicle.model.replace('_', ' ')} has no wheel, no tire and no body that turns"
        if (self.needs_body or self.against_ground) and vehicle.is_part:
            return "its bench moves it, whatever hangs on it"
        return ON_A_RIG if timed and self.needs_road else self.obstacle(vehicle, two_tracks)

    def trials(self, seen: Misalignment | None = None) -> list[dict[str, float]]:
        """Values of all its parameters that a search begins at; some effects look at how the runs are misaligned."""
        names = [one.name for one in self.parameters]
        usual = self.usual
        ways = [[(usual[one.name],) if one.name in self.refinements else one.trials for one in self.parameters]]
        if self.refinements:
            ways.append([one.trials if one.name in self.refinements else
                         (usual[one.name] if one.given else one.start,) for one in self.parameters])
        return [dict(zip(names, values, strict=True)) for way in ways for values in product(*way)]

    def delaying_trials(self, seen: Misalignment) -> list[list[dict[str, float]]]:
        """Values that delay slow motions so much that distances which were fitted without it have absorbed the delay: a
        search tries them with its delay taken out of the distances. Of each kind, those that do more and more."""
        return []

    def is_seen(self, values: Mapping[str, float], seen: Misalignment) -> bool:
        """Whether something else than the model's error speaks for it at these values."""
        return False

    def is_trifle(self, values: Mapping[str, float], seen: Misalignment) -> bool:
        """Whether it is no more than what is uncertain of a filter that the record went through, and so no finding
        beside it."""
        return False

    def checked(self, values: Mapping[str, float]) -> dict[str, float]:
        """The values with defaults filled in. ValueError for an unknown or missing name, or a value out of bounds."""
        known = {one.name: one for one in self.parameters}
        for name in values:
            if name not in known:
                expected = ", ".join(known) or "no parameters"
                raise ValueError(f"{self.name} has no parameter {name!r}; expected {expected}")
        found = {}
        for name, one in known.items():
            value = values.get(name, one.default)
            if value is None:
                raise ValueError(f"{self.name}: expected a value of {name} ({one.meaning})")
            if not one.low <= value <= one.high or (one.choices and value not in one.choices):
                raise ValueError(f"{self.name}: expected {name} of {one.allowed}, found {value:g}")
            found[name] = float(value)
        return found


class DriveEffect(Effect):
    """The position signal."""

    needs_road = True

    @abstractmethod
    def driven(self, p: Values, distance_m: Array) -> Array:
        """Where the front tires truly were (n,) when these distances were recorded [m]."""


class RoadEffect(Effect):
    """The road, where the profile that was written of it differs from what the wheels met."""

    needs_road = True

    @abstractmethod
    def road(self, p: Values, spacing_m: float, elevation_m: Array) -> Array:
        """Elevations of the road itself (n,) along one track, of those in its profile (n,) at this spacing [m]."""


class ActuatorEffect(Effect):
    """A force that drives a rig, where another one acts than the one that was recorded."""

    @abstractmethod
    def force(self, p: Values, rate_hz: float, force_n: Array) -> Array:
        """The force that acts (n,), of the one that was recorded (n,) at this rate [N]."""


class VehicleEffect(Effect):
    """The numbers of the car."""

    @abstractmethod
    def vehicle(self, p: Values, vehicle: Vehicle) -> Vehicle:
        """The car as it is."""


class BodyEffect(Effect):
    """Other masses, springs and dampers in the car's matrices, or one more mass on the body (``structure.hung``)."""

    needs_body = True

    @abstractmethod
    def structure(self, p: Values, structure: Structure) -> Structure:
        """The structure with it."""


class ForceEffect(Effect):
    """A law of springs, dampers and tires: the same at every wheel, unless it asks which axle it is at (``laws.rear``),
    or has ``AXLE`` among its parameters."""

    @abstractmethod
    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        """The laws of a corner with it."""

    def laws_at_its_axle(self, p: Values, laws: CornerLaws) -> CornerLaws:
        """The same, where it may sit in one axle alone."""
        return self.laws(p, laws) if getattr(p, AXLE.name, 0) in (0, 1 + laws.rear) else laws


class SensorEffect(Effect):
    """Between the body's motion and the record; linear."""

    imitates_any = True

    @abstractmethod
    def factor(self, p: Values, s: Complex) -> Complex:
        """What an acceleration exp(s t) is multiplied by, s (...) [1/s]."""


@dataclass(frozen=True, eq=False)
class Recording:
    """What a recorder knows of a run of n samples.

    time_s          (n,) since the run began [s]
    distance_m      (n,) where the front tires truly stood [m]; on a rig 0
    speed_mps       (n,) how fast that changes [m/s]; on a rig 0
    accel_z_mps2    (n,) what the record would be without the effect [m/s2]
    run             which one it is of the runs that are looked at together, from 0 on
    """

    time_s: Array
    distance_m: Array
    speed_mps: Array
    accel_z_mps2: Array
    run: int = 0


class RecordEffect(Effect):
    """The record as it runs: what the road does not cause, and what changes with time or with strength. It acts on the
    samples, behind the recorder's filter."""

    @abstractmethod
    def record(self, p: Values, recording: Recording) -> Array:
        """What is recorded (n,) [m/s2]."""


@dataclass(frozen=True)
class Chosen:
    """An effect with values for its parameters.

    standard_errors    of those that were fitted, by name; empty if they were not
    file               path of the Python file that a user's own effect is written in; None: it comes with ridelog
    """

    effect: Effect
    values: Mapping[str, float]
    standard_errors: Mapping[str, float] = field(default_factory=dict)
    file: str | None = None

    @property
    def at_bound(self) -> bool:
        """Whether nothing of an effect that has a strength was measured, as all its numbers are at ends of their
        ranges, or it can be no weaker, or a shape is at an end of its range at which it is not by default (a frequency,
        a damping, the rate over which a friction grows): what looks like it is something else."""
        numbers = self.freed
        besides = [one for one in numbers if one.name in self.effect.also_by]
        if (any(one.at_weakest_bound(self.values[one.name]) for one in numbers)
                and all(one.is_at(one.low, self.values[one.name]) for one in besides)):
            return True
        if any(one.null is not None for one in numbers) and all(one.at_bound(self.values[one.name]) for one in numbers):
            return True
        shapes = [one for one in numbers if one.null is None and not one.may_end]
        return len(shapes) < len(numbers) and any(
            one.is_at(end, self.values[one.name])
            for one in shapes for end in (one.low, one.high) if end != one.default)

    @property
    def is_plain(self) -> bool:
        """Whether it is without its refinements."""
        usual = self.effect.usual
        return all(self.values.get(name, usual[name]) == usual[name] for name in self.effect.refinements)

    @property
    def refined(self) -> dict[str, float]:
        """Values of its refinements by name; empty: it is in its plain form."""
        return {} if self.is_plain else {name: self.values[name] for name in self.effect.refinements}

    @property
    def is_refined_too_far(self) -> bool:
        """Whether a refinement is at an end of its range, where nothing of it was measured."""
        usual = self.effect.usual
        return not self.is_plain and any(
            one.name in self.effect.refinements and self.values[one.name] != usual[one.name]
            and one.at_bound(self.values[one.name]) for one in self.effect.parameters)

    @property
    def freed(self) -> list[Parameter]:
        """Its parameters that a fit may move."""
        held = self.effect.refinements if self.is_plain else ()
        return [one for one in self.effect.parameters if one.is_free and one.name not in held]

    @property
    def where(self) -> str:
        """In words the one axle that it acts at; empty: at all that there are."""
        return ("", "front axle alone", "rear axle alone")[int(self.values.get(AXLE.name, 0))]

    def is_shaped_as(self, other: "Chosen") -> bool:
        """Whether another is the same effect with the same frequencies, knees and choices, whatever its strength."""
        return self.effect is other.effect and all(
            self.values[one.name] == other.values[one.name] for one in self.effect.parameters
            if one.null is None or not one.is_free)

    def resonates_above(self, high_hz: float, by_flank: bool = False) -> bool:
        """Whether it is a resonance at a higher frequency than this, of which a record up to there shows nothing.

        by_flank    one that does less the higher it lies, and nothing at last, is seen by what it does below
        """
        return any(one.name == _RESONANCE and self.values[one.name] > high_hz and not (by_flank and one.null == np.inf)
                   for one in self.effect.parameters)

    @property
    def p(self) -> Values:
        """The values by attribute; of refinements that it has not, what they are when nothing is said."""
        return Values(**{name: self.effect.usual[name] for name in self.effect.refinements} | dict(self.values))


def chosen(effect: Effect, values: Mapping[str, float], **more: Any) -> Chosen:
    """An effect with checked values. ValueError as ``Effect.checked``."""
    return Chosen(effect, effect.checked(values), **more)
