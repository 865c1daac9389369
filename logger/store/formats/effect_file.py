"""Effects by name, those that come with ridelog and those that users write, and as they stand in vehicle files.

An effect in a vehicle's file is ``{name: tire_damping, tire_damping_n_s_per_m: 150}``, with ``standard_errors`` of what
was fitted and, for a user's own, ``file``: the Python file that offers it as ``EFFECT``, counted from the vehicle's
file.
"""

import os
import sys
from collections.abc import Mapping
from functools import cache, partial
from pathlib import Path

import numpy as np

from logger.errors import BadInput, did_you_mean
from logger.plugins import blamed_on, catalogue, offered_by
from logger.store.formats.yaml_nodes import Node
from logger.vehicle.effect import Chosen, Effect, Parameter, VehicleEffect, chosen
from logger.vehicle.own_effect import look_through, try_out, watched
from logger.vehicle.uncertain import sized
from logger.vehicle.vehicle import Vehicle


@cache
def shipped_effects() -> Mapping[str, Effect]:
    """The effects that come with ridelog and with other installed packages, by name; those of others are looked
    through and watched, as users' own are."""
    return {name: effect if type(effect).__module__.startswith("logger.") else
            _looked_through(effect, Path(str(sys.modules[type(effect).__module__].__file__)))
            for name, effect in catalogue("logger.vehicle.effects", "EFFECT").items()}


def own_effect(path: Path) -> Effect:
    """The effect that a user's own Python file offers. Raises BadInput that names the file and what it lacks; so does
    the effect, whenever it is asked and fails or gives no answer."""
    effect = _looked_through(offered_by(path, "EFFECT"), path)
    if effect.name in shipped_effects():
        raise BadInput(f"{path}: expected a name that no effect of ridelog has, found {effect.name!r}; rename yours, "
                       "or name ridelog's own without a file")
    return effect


def _looked_through(effect: object, path: Path) -> Effect:
    with blamed_on(path):
        return watched(look_through(effect), partial(blamed_on, path))


def effect_named(text: str) -> tuple[Effect, str | None]:
    """An effect by name, or a user's own by the path of its file (with a / or .py), and that path.

    Raises BadInput for a name that is not known.
    """
    if "/" in text or text.endswith(".py"):
        return own_effect(Path(text)), text
    if text not in shipped_effects():
        raise BadInput(f"no effect {text!r}: expected one of {', '.join(shipped_effects())}, or a file of your own "
                       f"(with a / or .py in its name){did_you_mean(text, shipped_effects())}")
    return shipped_effects()[text], None


def check_on(vehicle: Vehicle, one: Chosen, two_tracks: bool, timed: bool = False, pushed: bool = True) -> None:
    """Raise BadInput if the effect cannot be there in this car on this road, or rig (``timed``, ``pushed``
    by forces), or makes a car of it that would tip over an axle; a user's own is tried on the car."""
    obstacle = one.effect.obstacle_on(vehicle, two_tracks, timed, pushed)
    if obstacle is not None:
        raise BadInput(f"{one.effect.name}: {obstacle}")
    if vehicle.rear is None and one.where:
        raise BadInput(f"{one.effect.name}: expected axle 0, as a {vehicle.model.replace('_', ' ')} has only one")
    if one.file is not None:
        try_out(one.effect, one.p, vehicle)
    if isinstance(one.effect, VehicleEffect):
        made = one.effect.vehicle(one.p, vehicle)
        for name, axle in (("front", made.front), ("rear", made.rear)):
            if axle is not None and axle.cg_distance_m < 0:
                raise BadInput(f"{one.effect.name}: expected the centre of gravity between the axles, found it "
                               f"{-axle.cg_distance_m:.3g} m beyond the {name} axle")


# --- in a vehicle's file ---


def read_effects(node: Node, vehicle: Vehicle) -> tuple[Chosen, ...]:
    """The effects in a vehicle's file. Raises BadInput (``file:line: expected ...``) for what is wrong with them."""
    found: list[Chosen] = []
    for item in node.items():
        one = _read_effect(item, vehicle)
        if one.effect.name in [other.effect.name for other in found]:
            raise item.mapping()["name"].wrong("each effect once")
        try:
            check_on(vehicle, one, two_tracks=True)
        except BadInput as error:
            raise BadInput(f"{item.file}:{item.line}: {error}") from None
        found.append(one)
    return tuple(found)


def _read_effect(node: Node, vehicle: Vehicle) -> Chosen:
    said = node.mapping()
    if "name" not in said:
        raise BadInput(f"{node.file}:{node.line}: expected the key 'name' here, it is missing")
    name, file = said["name"], None
    if "file" in said:
        file = os.path.normpath(Path(node.file).parent / said["file"].text())
        try:
            effect = own_effect(Path(file))
        except BadInput as error:
            raise BadInput(f"{node.file}:{said['file'].line}: {error}") from None
        if effect.name != name.text():
            raise name.wrong(f"{effect.name!r}, as EFFECT in {file} is named")
    elif name.text() in shipped_effects():
        effect = sized(shipped_effects()[name.text()], vehicle)
    else:
        raise name.wrong(f"one of {', '.join(shipped_effects())}, or your own with file: my_effect.py beside it")
    parameters = {one.name: one for one in effect.parameters}
    needed = {one.name for one in effect.parameters if one.default is None}
    keys = node.mapping(required=[key for key in ("name", *parameters) if key in ("name", *needed)],
                        optional=[key for key in (*parameters, "file", "standard_errors") if key not in needed])
    values = {key: _value(keys[key], one) for key, one in parameters.items() if key in keys}
    errors = keys["standard_errors"].mapping() if "standard_errors" in keys else {}
    for key, value in errors.items():
        if key not in parameters:
            raise BadInput(f"{value.file}:{value.line}: expected one of the parameters "
                           f"{', '.join(parameters) or '(there are none)'}, found {key!r}"
                           f"{did_you_mean(key, parameters)}")
    return chosen(effect, values, file=file,
                  standard_errors={key: value.number(low=0.0) for key, value in errors.items()})


def _value(node: Node, parameter: Parameter) -> float:
    value = node.number(low=parameter.low, high=parameter.high)
    if parameter.choices and value not in parameter.choices:
        raise node.wrong(parameter.allowed)
    return value


def effect_keys(one: Chosen, folder: Path) -> dict[str, object]:
    """What a vehicle's file in ``folder`` says of an effect. Standard errors that are not finite are left out."""
    keys: dict[str, object] = {"name": one.effect.name}
    if one.file is not None:
        keys["file"] = os.path.relpath(one.file, folder)
    keys |= {name: float(value) for name, value in one.values.items()}
    known = {name: float(error) for name, error in one.standard_errors.items() if np.isfinite(error)}
    return keys | ({"standard_errors": known} if known else {})
