"""Whether a user's own effect keeps to what effects are, before anything relies on it.

Problem: an effect that a user writes is met first in the middle of a simulation or a fit, where a forgotten word or a
law that answers with one number for a thousand travels ends in a complaint about something else. Solution: it is
looked through when it is read, and tried once on the user's car.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from logger.vehicle.effect import (
    BodyEffect,
    DriveEffect,
    Effect,
    ForceEffect,
    Parameter,
    RecordEffect,
    Recording,
    RoadEffect,
    Scale,
    SensorEffect,
    Sought,
    VehicleEffect,
)
from logger.vehicle.laws import linear
from logger.vehicle.models import structure_of
from logger.vehicle.vehicle import Vehicle

KINDS = (RoadEffect, DriveEffect, VehicleEffect, BodyEffect, ForceEffect, SensorEffect, RecordEffect)
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
    elif isinstance(effect, DriveEffect):
        effect.driven(p, np.linspace(0.0, 1000.0, 11))
    elif isinstance(effect, VehicleEffect):
        effect.vehicle(p, vehicle)
    elif isinstance(effect, BodyEffect):
        effect.structure(p, structure_of(vehicle))
    elif isinstance(effect, ForceEffect):
        for rear in (False, True)[: 1 + (vehicle.rear is not None)]:
            laws = effect.laws(p, linear(vehicle.front.suspension_damping_n_s_per_m, rear))
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
