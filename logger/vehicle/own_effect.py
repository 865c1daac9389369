"""Whether a user's own effect keeps to what effects are, before anything relies on it.

Problem: an effect that a user writes is met first in the middle of a simulation or a fit, where a forgotten word or a
law that answers with one number for a thousand travels ends in a complaint about something else. Solution: it is
looked through when it is read, and tried once on the user's car.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import numpy.typing as npt

from logger.vehicle.effect import (
    BodyEffect,
    DriveEffect,
    Effect,
    ForceEffect,
    Parameter,
    Scale,
    SensorEffect,
    VehicleEffect,
)
from logger.vehicle.laws import CornerLaws, linear
from logger.vehicle.models import structure_of
from logger.vehicle.vehicle import Vehicle

KINDS = (DriveEffect, VehicleEffect, BodyEffect, ForceEffect, SensorEffect)
WORDS = ("name", "title", "source", "signature", "shown_by")
# What a vehicle's file says of an effect beside its parameters.
KEYS = ("name", "file", "standard_errors")
# What a trial asks of laws: as far as simulations tabulate them.
_TRAVEL_M, _RATE_MPS = np.linspace(-0.4, 0.4, 17), np.linspace(-8.0, 8.0, 33)


def look_through(effect: object) -> Effect:
    """The effect. ValueError that says what it lacks."""
    if not isinstance(effect, Effect) or not isinstance(effect, KINDS):
        kinds = ", ".join(kind.__name__ for kind in KINDS)
        raise ValueError(f"expected EFFECT to be an object of a class made from one of {kinds}, "
                         f"found {type(effect).__name__}")
    for word in WORDS:
        text = getattr(effect, word, None)
        if not isinstance(text, str) or not text.strip():
            raise ValueError(f"expected EFFECT to have a text {word!r}")
    if not effect.name.isidentifier():
        raise ValueError(f"expected a name of letters, digits and _, found {effect.name!r}")
    if not isinstance(effect.parameters, tuple) or not all(isinstance(one, Parameter) for one in effect.parameters):
        raise ValueError("expected parameters to be a tuple of Parameter, as in (Parameter(...),)")
    names = [one.name for one in effect.parameters]
    if len(set(names)) < len(names):
        raise ValueError(f"expected each parameter once, found {', '.join(names)}")
    for one in effect.parameters:
        _look_through(one)
    return effect


def _look_through(one: Parameter) -> None:
    if not one.name.isidentifier() or one.name in KEYS:
        raise ValueError(f"expected a parameter's name of letters, digits and _, none of {', '.join(KEYS)}; "
                         f"found {one.name!r}")
    if not (np.isfinite([one.low, one.high]).all() and one.low <= one.start <= one.high):
        raise ValueError(f"{one.name}: expected finite low <= start <= high, found {one.low}, {one.start}, {one.high}")
    if one.scale is not Scale.LINEAR and one.low <= 0:
        raise ValueError(f"{one.name}: expected low above 0 for a scale that is {one.scale.value}, found {one.low}")
    if not one.trials:
        raise ValueError(f"{one.name}: expected trials, the values that a search begins at, as in ({one.start},)")
    default = () if one.default is None else (one.default,)
    for value in (*one.trials, *one.choices, *default):
        if not one.low <= value <= one.high:
            raise ValueError(f"{one.name}: expected trials, choices and default within {one.low} to {one.high}, "
                             f"found {value}")


def try_out(effect: Effect, p: SimpleNamespace, vehicle: Vehicle) -> None:
    """Call its function once on a car. ValueError for an answer that is no answer; what the function raises passes."""
    if isinstance(effect, DriveEffect):
        distance_m = np.linspace(0.0, 1000.0, 11)
        _expect_numbers("driven", effect.driven(p, distance_m.copy()), distance_m)
    elif isinstance(effect, VehicleEffect):
        _expect("vehicle", effect.vehicle(p, vehicle), Vehicle)
    elif isinstance(effect, BodyEffect):
        structure = structure_of(vehicle)
        _expect("structure", effect.structure(p, structure), type(structure))
    elif isinstance(effect, ForceEffect):
        laws = effect.laws(p, linear(vehicle.front.suspension_damping_n_s_per_m))
        _expect("laws", laws, CornerLaws)
        _try_laws(laws)
    elif isinstance(effect, SensorEffect):
        s = np.asarray(2j * np.pi * np.arange(0.0, 50.0), dtype=np.complex128)
        _expect_numbers("factor", effect.factor(p, s.copy()), s)


def _try_laws(laws: CornerLaws) -> None:
    _expect_numbers("the damper", laws.damper(_RATE_MPS.copy()), _RATE_MPS)
    for name, some in (("a spring", laws.springs), ("a tire", laws.tires)):
        for law in some:
            _expect_numbers(name, law(_TRAVEL_M.copy()), _TRAVEL_M)
    travel, rate = np.meshgrid(_TRAVEL_M, _RATE_MPS, indexing="ij")
    for force in laws.others:
        _expect_numbers("a force", force(travel.copy(), rate.copy()), travel)


def _expect(name: str, found: object, kind: type) -> None:
    if not isinstance(found, kind):
        raise ValueError(f"expected {name} to answer with a {kind.__name__}, found {type(found).__name__}")


def _expect_numbers(name: str, found: npt.ArrayLike, like: npt.ArrayLike) -> None:
    numbers, shape = np.asarray(found), np.shape(like)
    if numbers.shape != shape:
        raise ValueError(f"expected {name} to answer with an array of shape {shape}, as it was asked, found one of "
                         f"shape {numbers.shape}")
    if not np.isfinite(numbers).all():
        raise ValueError(f"expected {name} to answer with finite numbers")
