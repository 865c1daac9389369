"""Effects that a user wrote: how they are read, and what they may do.

A user's own effect, watched wherever it is asked.

Problem: whatever a user's effect answers is used far from it, in the middle of a fit that asks at values nobody tried:
an exception, an array of another shape or one number that is none end there in a complaint about something else.
Solution: an effect that asks the user's own and looks at every answer, those of the laws that it gives too. What is
wrong is raised where the user's file can be blamed for it.

Whether a user's own effect keeps to what effects are, before anything relies on it.

Problem: an effect that a user writes is met first in the middle of a simulation or a fit, where a forgotten word or a
law that answers with one number for a thousand travels ends in a complaint about something else. Solution: it is
looked through when it is read, and tried once on the user's car.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import fields, is_dataclass, replace
from numbers import Real
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.vehicle.effect import (
    ActuatorEffect,
    BodyEffect,
    DriveEffect,
    Effect,
    ForceEffect,
    Misalignment,
    Parameter,
    RecordEffect,
    Recording,
    RoadEffect,
    Scale,
    SensorEffect,
    Sought,
    VehicleEffect,
)
from logger.vehicle.laws import MOST_MEMORY, Between, CornerLaws, MotionLaw, Seen, linear
from logger.vehicle.models import structure_of
from logger.vehicle.structure import Structure
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Blame = Callable[[], AbstractContextManager[object]]
"""Something to ask the effect in, which turns what is raised there into a complaint about its file."""


def watched(effect: Effect, blame: Blame) -> Effect:
    """The effect, every answer of which is looked at. ValueError, raised in ``blame``, for one that is no answer; what
    the effect itself raises is raised there too."""
    kind = next(watched for kind, watched in _WATCHED.items() if isinstance(effect, kind))
    return kind(effect, blame)


class _Watched(Effect):
    """What all kinds are asked."""

    def __init__(self, own: Any, blame: Blame) -> None:
        self._own, self._blame = own, blame
        self.name, self.title, self.parameters = own.name, own.title, own.parameters
        self.source, self.signature, self.shown_by = own.source, own.signature, own.shown_by
        self.realigns, self.reshapes, self.replaces = own.realigns, own.reshapes, own.replaces
        self.sought, self.needs_road, self.stage = own.sought, own.needs_road, own.stage

    def obstacle(self, vehicle: Vehicle, two_tracks: bool) -> str | None:
        with self._blame():
            why = self._own.obstacle(vehicle, two_tracks)
            if why is not None and not (isinstance(why, str) and why.strip()):
                raise ValueError(f"expected obstacle to answer with words or None, found {why!r}")
        return why

    def trials(self, seen: Misalignment | None = None) -> list[dict[str, float]]:
        with self._blame():
            found = self._own.trials(seen)
            if not isinstance(found, list) or not found or not all(isinstance(one, Mapping) for one in found):
                raise ValueError("expected trials to answer with a list of values by the names of the parameters, as "
                                 f"in [{{...}}], found {found!r}")
            for name, value in (pair for one in found for pair in one.items()):
                if not isinstance(value, Real):
                    raise ValueError(f"expected trials to answer with a number as {name}, found {value!r}")
            return [self.checked(one) for one in found]


class _WatchedRoad(_Watched, RoadEffect):
    def road(self, p: SimpleNamespace, spacing_m: float, elevation_m: Array) -> Array:
        with self._blame(), np.errstate(all="ignore"):
            return _numbers("road", self._own.road(p, spacing_m, elevation_m.copy()), elevation_m)


class _WatchedActuator(_Watched, ActuatorEffect):
    def force(self, p: SimpleNamespace, rate_hz: float, force_n: Array) -> Array:
        with self._blame(), np.errstate(all="ignore"):
            return _numbers("force", self._own.force(p, rate_hz, force_n.copy()), force_n)


class _WatchedDrive(_Watched, DriveEffect):
    def driven(self, p: SimpleNamespace, distance_m: Array) -> Array:
        with self._blame(), np.errstate(all="ignore"):
            return _numbers("driven", self._own.driven(p, distance_m.copy()), distance_m)


class _WatchedVehicle(_Watched, VehicleEffect):
    def vehicle(self, p: SimpleNamespace, vehicle: Vehicle) -> Vehicle:
        with self._blame():
            found: Vehicle = _kept("vehicle", self._own.vehicle(p, vehicle), Vehicle)
            for name, value in _plain_numbers(found):
                if not np.isfinite(value):
                    raise ValueError(f"expected vehicle to answer with finite numbers, found {name} {value}")
            _check_stands(structure_of(found), "vehicle")
        return found


class _WatchedBody(_Watched, BodyEffect):
    def structure(self, p: SimpleNamespace, structure: Structure) -> Structure:
        with self._blame():
            found: Structure = _kept("structure", self._own.structure(p, structure), Structure)
            n, w = len(found.mass), len(structure.wheels)
            shapes = {"mass": (n, n), "damping": (n, n), "stiffness": (n, n), "road": (n, w), "behind_m": (w,),
                      "left_m": (w,), "contact_patch_m": (), "body": (n, 3), "wheels": (w, n), "travel": (w, n),
                      "springs": (w,), "dampers": (w,), "tires": (w,)}
            for name, shape in shapes.items():
                _numbers(f"structure, in {name},", getattr(found, name), np.zeros(shape))
            _check_stands(found, "structure")
        return found


class _WatchedForce(_Watched, ForceEffect):
    def laws(self, p: SimpleNamespace, laws: CornerLaws) -> CornerLaws:
        with self._blame():
            found: CornerLaws = _kept("laws", self._own.laws(p, laws), CornerLaws)
            _check_numbers(found, laws)
            for one in found.motions:
                if one not in laws.motions:
                    _check_motion(one)
        known = {id(law) for law in (laws.damper, *laws.springs, *laws.others, *laws.tires)}

        def own(name: str, law: Callable[..., Array]) -> Callable[..., Array]:
            return law if id(law) in known else self._watched_law(name, law)

        return replace(
            found, damper=own("the damper", found.damper), springs=tuple(own("a spring", law) for law in found.springs),
            others=tuple(own("a force", law) for law in found.others),
            tires=tuple(own("a tire", law) for law in found.tires),
        )

    def _watched_law(self, name: str, law: Callable[..., Array]) -> Callable[..., Array]:
        def asked(*at: Array) -> Array:
            with self._blame(), np.errstate(all="ignore"):
                return _numbers(name, law(*(one.copy() for one in at)), at[0])

        return asked


class _WatchedSensor(_Watched, SensorEffect):
    def factor(self, p: SimpleNamespace, s: Complex) -> Complex:
        with self._blame(), np.errstate(all="ignore"):
            return _numbers("factor", self._own.factor(p, s.copy()), s)


class _WatchedRecord(_Watched, RecordEffect):
    def record(self, p: SimpleNamespace, recording: Recording) -> Array:
        with self._blame(), np.errstate(all="ignore"):
            own = Recording(recording.time_s.copy(), recording.distance_m.copy(), recording.speed_mps.copy(),
                            recording.accel_z_mps2.copy(), recording.run)
            return _numbers("record", self._own.record(p, own), recording.accel_z_mps2)


_WATCHED: dict[type[Effect], type[_Watched]] = {
    RoadEffect: _WatchedRoad, ActuatorEffect: _WatchedActuator, DriveEffect: _WatchedDrive,
    VehicleEffect: _WatchedVehicle, BodyEffect: _WatchedBody, ForceEffect: _WatchedForce,
    SensorEffect: _WatchedSensor, RecordEffect: _WatchedRecord,
}


# --- what an answer has to be ---


def _kept(name: str, found: Any, kind: type) -> Any:
    if not isinstance(found, kind):
        raise ValueError(f"expected {name} to answer with a {kind.__name__}, found {type(found).__name__}")
    return found


def _numbers(name: str, found: npt.ArrayLike, like: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """An answer as numbers of the kind and shape of ``like``."""
    numbers = np.asarray(found)
    if numbers.shape != like.shape:
        raise ValueError(f"expected {name} to answer with an array of shape {like.shape}, as it was asked, found one "
                         f"of shape {numbers.shape}")
    if not np.can_cast(numbers.dtype, like.dtype, "same_kind"):
        raise ValueError(f"expected {name} to answer with {like.dtype} numbers, found {numbers.dtype}")
    if not np.isfinite(numbers).all():
        raise ValueError(f"expected {name} to answer with finite numbers")
    return np.asarray(numbers, like.dtype)


def _plain_numbers(vehicle: Any) -> Iterator[tuple[str, float]]:
    """All numbers of a vehicle, with those of its axles and its sensor."""
    for field in fields(vehicle):
        value = getattr(vehicle, field.name)
        if is_dataclass(value):
            yield from ((f"{field.name}.{name}", number) for name, number in _plain_numbers(value))
        elif value is not None and not isinstance(value, str):
            yield field.name, value


def _check_stands(structure: Structure, name: str) -> None:
    """ValueError for a car that has no weight, or does not stand on its springs."""
    for what, matrix in (("masses", structure.mass), ("springs", structure.stiffness)):
        if not np.linalg.eigvalsh(matrix)[0] > 0:
            raise ValueError(f"expected {name} to answer with a car whose {what} are all above 0")


def _check_numbers(laws: CornerLaws, before: CornerLaws) -> None:
    """ValueError for numbers that no corner has."""
    for name in ("dry_friction_n", "friction_transition_mps", "wheel_friction_n", "body_friction_n",
                 "guide_transition_mps", "tire_damping_n_s_per_m", "mount_n_per_m"):
        value = getattr(laws, name)
        infinite = name == "mount_n_per_m" and value == np.inf
        if not (infinite or (np.ndim(value) == 0 and np.isfinite(value) and value >= 0)):
            raise ValueError(f"expected laws to answer with {name} of 0 or more, found {value}")
    for name, other in (("damping_n_s_per_m", "another damper is replace(laws, damper=...)"),
                        ("stiffness_n_per_m", "another spring is laws.with_spring(...)")):
        if getattr(laws, name) != getattr(before, name):
            raise ValueError(f"expected laws to leave {name} as it was: {other}")
    if laws.rear is not before.rear:
        raise ValueError("expected laws to leave rear as it was: it says at which axle they are")
    for name in ("springs", "others", "tires"):
        some = getattr(laws, name)
        if not isinstance(some, tuple) or not all(map(callable, some)):
            raise ValueError(f"expected laws to answer with a tuple of functions as {name}, found {some!r}")
    if not isinstance(laws.motions, tuple) or not all(isinstance(one, MotionLaw) for one in laws.motions):
        raise ValueError(f"expected laws to answer with a tuple of MotionLaw as motions, found {laws.motions!r}")
    if not callable(laws.damper):
        raise ValueError(f"expected laws to answer with a function as damper, found {laws.damper!r}")


# Motions that a law is tried at: up to what tables of other laws reach to, each as far as it usually goes, and rest.
_TRIED = np.vstack([np.zeros(10), np.random.default_rng(1).uniform(-1, 1, (30, 10))]) * [
    0.4, 8.0, 0.1, 8.0, 8.0, 8.0, 1000.0, 100.0, 40.0, 0.0]


def _check_motion(law: MotionLaw) -> None:
    """ValueError for a law by all that moves that gives no numbers, or that a simulation could not ask."""
    from logger.vehicle.stepping_loop import address_of, functions_of  # loads the compiler, if there is one

    if not isinstance(law.between, Between):
        raise ValueError(f"expected with_law to get one of {', '.join(map(str, Between))}, found {law.between!r}")
    functions_of(law)
    memory = law.memory
    if not (isinstance(memory, tuple) and len(memory) <= MOST_MEMORY
            and all(_is_number(one) for one in memory)):
        raise ValueError(f"expected memory to be a tuple of at most {MOST_MEMORY} finite numbers, found {memory!r}")
    if (law.rates is None) == bool(memory):
        raise ValueError("expected rates and memory both, or neither: how fast each state grows, and where it is at "
                         "rest")
    for name, value in vars(law.p).items():
        if not _is_number(value):
            raise ValueError(f"expected p of a law to hold finite numbers, found {name} {value!r}")
    for now in _TRIED:
        seen = Seen._make([*map(float, now), tuple(map(float, memory))])
        with np.errstate(all="ignore"):
            _numbers("force", law.force(law.p, seen), np.zeros(()))
            if law.rates is not None:
                found = law.rates(law.p, seen)
                if not isinstance(found, tuple) or len(found) != len(memory):
                    raise ValueError(f"expected rates to answer with a tuple of {len(memory)}, one number for each "
                                     f"state, as in (rate,), found {found!r}")
                for one in found:
                    _numbers("rates", one, np.zeros(()))
    address_of(law)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and bool(np.isfinite(float(value)))


KINDS = tuple(_WATCHED)
WORDS = ("name", "title", "source", "signature", "shown_by")
# What a vehicle's file says of an effect beside its parameters.
KEYS = ("name", "file", "standard_errors")
# What a trial asks of laws: as far as simulations tabulate them.
_TRAVEL_M, _RATE_MPS = np.linspace(-0.4, 0.4, 17), np.linspace(-8.0, 8.0, 33)


def look_through(effect: object) -> Effect:
    """The effect. ValueError that says what it lacks."""
    if not isinstance(effect, Effect) or sum(isinstance(effect, kind) for kind in KINDS) != 1:
        kinds = ", ".join(kind.__name__ for kind in KINDS)
        raise ValueError(f"expected EFFECT to be an object of a class made from one of {kinds}, "
                         f"found {type(effect).__name__}")
    for word in WORDS:
        text = getattr(effect, word, None)
        if not isinstance(text, str) or not text.strip():
            raise ValueError(f"expected EFFECT to have a text {word!r}")
    if not effect.name.isidentifier():
        raise ValueError(f"expected a name of letters, digits and _, found {effect.name!r}")
    if not isinstance(effect.stage, int):
        raise ValueError(f"expected a whole number as stage, found {effect.stage!r}")
    _look_at_words(effect)
    if not isinstance(effect.parameters, tuple) or not all(isinstance(one, Parameter) for one in effect.parameters):
        raise ValueError("expected parameters to be a tuple of Parameter, as in (Parameter(...),)")
    names = [one.name for one in effect.parameters]
    if len(set(names)) < len(names):
        raise ValueError(f"expected each parameter once, found {', '.join(names)}")
    if not isinstance(effect.replaces, tuple) or not set(effect.replaces) <= set(names):
        raise ValueError(f"expected replaces to be a tuple of names of parameters, found {effect.replaces!r}")
    for one in effect.parameters:
        _look_through(one)
    return effect


def _look_at_words(effect: Effect) -> None:
    for word in ("realigns", "reshapes", "needs_road"):
        if not isinstance(getattr(effect, word), bool):
            raise ValueError(f"expected True or False as {word}, found {getattr(effect, word)!r}")
    if not isinstance(effect.sought, Sought):
        raise ValueError(f"expected one of {', '.join(map(str, Sought))} as sought, found {effect.sought!r}")


def _look_through(one: Parameter) -> None:
    if not one.name.isidentifier() or one.name in KEYS:
        raise ValueError(f"expected a parameter's name of letters, digits and _, none of {', '.join(KEYS)}; "
                         f"found {one.name!r}")
    if not (np.isfinite([one.low, one.high]).all() and one.low <= one.start <= one.high):
        raise ValueError(f"{one.name}: expected finite low <= start <= high, found {one.low}, {one.start}, {one.high}")
    if one.scale is not Scale.LINEAR and one.low <= 0:
        raise ValueError(f"{one.name}: expected low above 0 for a scale that is {one.scale.value}, found {one.low}")
    if one.step is not None and not 0 < one.step < float("inf"):
        raise ValueError(f"{one.name}: expected a step above 0, found {one.step}")
    if not one.trials:
        raise ValueError(f"{one.name}: expected trials, the values that a search begins at, as in ({one.start},)")
    if one.is_free and all(value == one.null for value in one.trials):
        raise ValueError(f"{one.name}: expected trials away from {one.null}, where the effect does nothing")
    default = () if one.default is None else (one.default,)
    for value in (*one.trials, *one.choices, *default):
        if not one.low <= value <= one.high:
            raise ValueError(f"{one.name}: expected trials, choices and default within {one.low} to {one.high}, "
                             f"found {value}")


def try_out(effect: Effect, p: SimpleNamespace, vehicle: Vehicle) -> None:
    """Ask a watched effect once on a car, as far as a simulation does."""
    if isinstance(effect, RoadEffect):
        effect.road(p, 0.1, 0.01 * np.sin(np.arange(0.0, 100.0, 0.1)))
    elif isinstance(effect, ActuatorEffect):
        effect.force(p, 100.0, 10.0 * np.sin(np.arange(0.0, 10.0, 0.01)))
    elif isinstance(effect, DriveEffect):
        effect.driven(p, np.linspace(0.0, 1000.0, 11))
    elif isinstance(effect, VehicleEffect):
        effect.vehicle(p, vehicle)
    elif isinstance(effect, BodyEffect):
        effect.structure(p, structure_of(vehicle))
    elif isinstance(effect, ForceEffect):
        for rear in (False, True)[: 1 + (vehicle.rear is not None)]:
            axle = vehicle.front
            laws = effect.laws(p, linear(axle.suspension_damping_n_s_per_m, rear, axle.suspension_stiffness_n_per_m))
            laws.damper(_RATE_MPS)
            for law in (*laws.springs, *laws.tires):
                law(_TRAVEL_M)
            for force in laws.others:
                force(*np.meshgrid(_TRAVEL_M, _RATE_MPS, indexing="ij"))
    elif isinstance(effect, SensorEffect):
        effect.factor(p, np.asarray(2j * np.pi * np.arange(0.0, 50.0), dtype=np.complex128))
    elif isinstance(effect, RecordEffect):
        time_s = np.arange(0.0, 60.0, 0.1)
        effect.record(p, Recording(time_s, 10.0 * time_s, np.full_like(time_s, 10.0), np.sin(time_s)))
