"""Effects that a user wrote: whether they keep to what effects are, and what they answer wherever they are asked.

Problem: an effect that a user writes is met first in the middle of a simulation or a fit that asks at values nobody
tried, where a forgotten word, an exception, an array of another shape or one number that is none end in a complaint
about something else. Solution: it is looked through when it is read, and tried once on the user's car; and every answer
of its, those of the laws that it gives too, is looked at. What is wrong is raised where the user's file can be blamed.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from copy import copy
from dataclasses import fields, is_dataclass, replace
from numbers import Real
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.arrays import Array
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
    Values,
    VehicleEffect,
)
from logger.vehicle.laws import MOST_MEMORY, Between, CornerLaws, MotionLaw, Seen, linear
from logger.vehicle.models import structure_of
from logger.vehicle.structure import Structure
from logger.vehicle.vehicle import Vehicle

Blame = Callable[[], AbstractContextManager[object]]
"""Something to ask the effect in, which turns what is raised there into a complaint about its file."""


KINDS: dict[type[Effect], str] = {
    RoadEffect: "road", ActuatorEffect: "force", DriveEffect: "driven", VehicleEffect: "vehicle",
    BodyEffect: "structure", ForceEffect: "laws", SensorEffect: "factor", RecordEffect: "record"}
"""The one function of each kind of effect."""


def watched(effect: Effect, blame: Blame) -> Effect:
    """The effect, every answer of which is looked at. ValueError, raised in ``blame``, for one that is no answer; what
    the effect itself raises is raised there too."""
    name = next(name for kind, name in KINDS.items() if isinstance(effect, kind))
    found, own = copy(effect), getattr(effect, name)

    def asked(p: Values, *given: Any) -> Any:
        with blame(), np.errstate(all="ignore"):
            return _looked_at(name, own(p, *map(_copied, given)), given[-1], blame)

    def obstacle(vehicle: Vehicle, two_tracks: bool) -> str | None:
        with blame():
            why = effect.obstacle(vehicle, two_tracks)
            if why is not None and not (isinstance(why, str) and why.strip()):
                raise ValueError(f"expected obstacle to return words or None, found {why!r}")
        return why

    def trials(seen: Misalignment | None = None) -> list[dict[str, float]]:
        with blame():
            some: object = effect.trials(seen)
            if not isinstance(some, list) or not some or not all(isinstance(one, Mapping) for one in some):
                raise ValueError("expected trials to return a list of values by the names of the parameters, as "
                                 f"in [{{...}}], found {some!r}")
            for number, value in (pair for one in some for pair in one.items()):
                if not isinstance(value, Real):
                    raise ValueError(f"expected trials to return a number as {number}, found {value!r}")
            return [effect.checked(one) for one in some]

    vars(found).update({name: asked, "obstacle": obstacle, "trials": trials})
    return found


def _copied(given: Any) -> Any:
    """What an effect may write into without harm."""
    if isinstance(given, Recording):
        return Recording(*(_copied(getattr(given, one.name)) for one in fields(given)))
    return given.copy() if isinstance(given, np.ndarray) else given


def _looked_at(name: str, found: Any, given: Any, blame: Blame) -> Any:
    """An answer of the function of this name, to what was given last."""
    if isinstance(given, Vehicle):
        for number, value in _plain_numbers(_kept(name, found, Vehicle)):
            if not np.isfinite(value):
                raise ValueError(f"expected {name} to return finite numbers, found {number} {value}")
        _check_stands(structure_of(found), name)
        return found
    if isinstance(given, Structure):
        n, w = len(_kept(name, found, Structure).mass), len(given.wheels)
        shapes = {"mass": (n, n), "damping": (n, n), "stiffness": (n, n), "road": (n, w), "behind_m": (w,),
                  "left_m": (w,), "contact_patch_m": (), "body": (n, 3), "wheels": (w, n), "travel": (w, n),
                  "springs": (w,), "dampers": (w,), "tires": (w,)}
        for part, shape in shapes.items():
            _numbers(f"{name}, in {part},", getattr(found, part), np.zeros(shape))
        _check_stands(found, name)
        return found
    if isinstance(given, CornerLaws):
        return _watched_laws(_kept(name, found, CornerLaws), given, blame)
    return _numbers(name, found, given.accel_z_mps2 if isinstance(given, Recording) else given)


def _watched_laws(found: CornerLaws, before: CornerLaws, blame: Blame) -> CornerLaws:
    """Laws, those of which that were not there before are watched."""
    _check_numbers(found, before)
    for one in found.motions:
        if one not in before.motions:
            _check_motion(one)
    known = {id(law) for law in (before.damper, *before.springs, *before.others, *before.tires)}

    def own(name: str, law: Callable[..., Array]) -> Callable[..., Array]:
        def asked(*at: Array) -> Array:
            with blame(), np.errstate(all="ignore"):
                return _numbers(name, law(*map(_copied, at)), at[0])

        return law if id(law) in known else asked

    return replace(
        found, damper=own("the damper", found.damper), springs=tuple(own("a spring", law) for law in found.springs),
        others=tuple(own("a force", law) for law in found.others),
        tires=tuple(own("a tire", law) for law in found.tires))


# --- what an answer has to be ---


def _kept(name: str, found: Any, kind: type) -> Any:
    if not isinstance(found, kind):
        raise ValueError(f"expected {name} to return a {kind.__name__}, found {type(found).__name__}")
    return found


def _numbers(name: str, found: npt.ArrayLike, like: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """An answer as numbers of the kind and shape of ``like``."""
    numbers = np.asarray(found)
    if numbers.shape != like.shape:
        raise ValueError(f"expected {name} to return an array of shape {like.shape}, like its input, found one "
                         f"of shape {numbers.shape}")
    if not np.can_cast(numbers.dtype, like.dtype, "same_kind"):
        raise ValueError(f"expected {name} to return {like.dtype} numbers, found {numbers.dtype}")
    if not np.isfinite(numbers).all():
        raise ValueError(f"expected {name} to return finite numbers")
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
            raise ValueError(f"expected {name} to return a car whose {what} are all above 0")


def _check_numbers(laws: CornerLaws, before: CornerLaws) -> None:
    """ValueError for numbers that no corner has."""
    for name in ("dry_friction_n", "friction_transition_mps", "wheel_friction_n", "body_friction_n",
                 "guide_transition_mps", "tire_damping_n_s_per_m", "mount_n_per_m", "mount_play_m"):
        value = getattr(laws, name)
        infinite = name == "mount_n_per_m" and value == np.inf
        if not (infinite or (np.ndim(value) == 0 and np.isfinite(value) and value >= 0)):
            raise ValueError(f"expected laws to return {name} of 0 or more, found {value}")
    for name, other in (("damping_n_s_per_m", "another damper is replace(laws, damper=...)"),
                        ("stiffness_n_per_m", "another spring is laws.with_spring(...)")):
        if getattr(laws, name) != getattr(before, name):
            raise ValueError(f"expected laws to leave {name} as it was: {other}")
    if laws.rear is not before.rear:
        raise ValueError("expected laws to leave rear as it was: it says at which axle they are")
    for name in ("springs", "others", "tires"):
        some = getattr(laws, name)
        if not isinstance(some, tuple) or not all(map(callable, some)):
            raise ValueError(f"expected laws to return a tuple of functions as {name}, found {some!r}")
    if not isinstance(laws.motions, tuple) or not all(isinstance(one, MotionLaw) for one in laws.motions):
        raise ValueError(f"expected laws to return a tuple of MotionLaw as motions, found {laws.motions!r}")
    if not callable(laws.damper):
        raise ValueError(f"expected laws to return a function as damper, found {laws.damper!r}")


# Motions that a law is tried at: up to what tables of other laws reach to, each as far as it usually goes, and rest.
_TRIED = np.vstack([np.zeros(10), np.random.default_rng(1).uniform(-1, 1, (30, 10))]) * [
    0.4, 8.0, 0.1, 8.0, 8.0, 8.0, 1000.0, 100.0, 40.0, 0.0]


def _check_motion(law: MotionLaw) -> None:
    """ValueError for a law by all that moves that gives no numbers, or that a simulation could not ask."""
    from logger.vehicle.stepping_loop import addresses_of, functions_of  # loads the compiler, if there is one

    if not isinstance(law.between, Between):
        raise ValueError(f"expected with_law to get one of {', '.join(map(str, Between))}, found {law.between!r}")
    functions_of(law)
    memory = law.memory
    if not (isinstance(memory, tuple) and len(memory) <= MOST_MEMORY and all(_is_number(one) for one in memory)):
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
                    raise ValueError(f"expected rates to return a tuple of {len(memory)}, one number for each "
                                     f"state, as in (rate,), found {found!r}")
                for one in found:
                    _numbers("rates", one, np.zeros(()))
    addresses_of(law)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and bool(np.isfinite(float(value)))


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
    refined = [one for one in effect.parameters if one.name in effect.refinements]
    if refined and all({*one.trials} == {effect.usual[one.name]} for one in refined):
        raise ValueError(f"{refined[0].name}: expected trials away from its usual value, which refinements begin at")
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
    if not isinstance(one.scale, Scale):
        raise ValueError(f"{one.name}: expected one of {', '.join(map(str, Scale))} as scale, found {one.scale!r}")
    if not all(isinstance(value, Real) for value in (one.low, one.start, one.high)):
        raise ValueError(f"{one.name}: expected numbers as low, start and high, found {one.low!r}, {one.start!r}, "
                         f"{one.high!r}")
    if not (np.isfinite([one.low, one.high]).all() and one.low <= one.start <= one.high):
        raise ValueError(f"{one.name}: expected finite low <= start <= high, found {one.low}, {one.start}, {one.high}")
    if one.scale is not Scale.LINEAR and one.low <= 0:
        raise ValueError(f"{one.name}: expected low above 0 for a scale that is {one.scale.value}, found {one.low}")
    null: object = one.null
    if null is not None and not (isinstance(null, Real) and (
            one.low <= float(null) <= one.high or np.isinf(float(null)))):
        raise ValueError(f"{one.name}: expected null to be None, infinite, or within {one.low} to {one.high}, "
                         f"found {null!r}")
    if one.step is not None and not 0 < one.step < float("inf"):
        raise ValueError(f"{one.name}: expected a step above 0, found {one.step}")
    if not isinstance(one.trials, tuple) or not one.trials:
        raise ValueError(f"{one.name}: expected trials, the values that a search begins at, as in ({one.start},)")
    if one.is_free and all(value == one.null for value in one.trials):
        raise ValueError(f"{one.name}: expected trials away from {one.null}, where the effect does nothing")
    default = () if one.default is None else (one.default,)
    for value in (*one.trials, *one.choices, *default):
        if not one.low <= value <= one.high:
            raise ValueError(f"{one.name}: expected trials, choices and default within {one.low} to {one.high}, "
                             f"found {value}")


def try_out(effect: Effect, p: Values, vehicle: Vehicle) -> None:
    """Ask a watched effect once on a car, as far as a simulation does."""
    name = next(name for kind, name in KINDS.items() if isinstance(effect, kind))
    time_s = np.arange(0.0, 60.0, 0.1)
    wave = np.sin(time_s)
    asked = {"road": (0.1, 0.01 * wave), "force": (100.0, 10.0 * wave), "driven": (10.0 * time_s,),
             "vehicle": (vehicle,), "structure": (structure_of(vehicle),),
             "factor": (np.asarray(2j * np.pi * np.arange(0.0, 50.0), np.complex128),),
             "record": (Recording(time_s, 10.0 * time_s, np.full_like(time_s, 10.0), wave),)}
    if name in asked:
        getattr(effect, name)(p, *asked[name])
        return
    assert isinstance(effect, ForceEffect)
    for rear in (False, True)[: 1 + (vehicle.rear is not None)]:
        axle = vehicle.front
        laws = effect.laws(p, linear(axle.suspension_damping_n_s_per_m, rear, axle.suspension_stiffness_n_per_m))
        laws.damper(_RATE_MPS)
        for law in (*laws.springs, *laws.tires):
            law(_TRAVEL_M)
        for force in laws.others:
            force(*np.meshgrid(_TRAVEL_M, _RATE_MPS, indexing="ij"))
