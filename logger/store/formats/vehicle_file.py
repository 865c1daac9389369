"""Vehicle files (YAML) to vehicles and back, with complaints that name the line.

What knows the plain car only must not take a car with effects for one without: ``read_vehicle`` refuses it. Commands
read a ``CarModel``: the car, its effects, how certain its numbers are, and how it came to them. A user's own effect is
Python that reading it runs, which the service on board never does: ``read_on_board`` refuses it unread.
"""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from logger.errors import BadInput
from logger.files import write_text
from logger.printable import LONGEST_COMPLAINT, LONGEST_WORD, word
from logger.store.formats.yaml_nodes import Node, load_mapping
from logger.vehicle.effect import Chosen
from logger.vehicle.models import GOLDEN_CAR
from logger.vehicle.named_parameters import PRELOAD, changed, names, read, sized
from logger.vehicle.uncertain import UNKNOWN, Known, NumberErrors
from logger.vehicle.vehicle import AT_CENTRE_OF_GRAVITY, OWN_NAMES, Axle, SensorPlace, Vehicle

_CAR_KEYS = ("sprung_mass_kg", "front", "contact_patch_m")
# What moves of a component may be too light to matter.
_OPTIONAL = (("component", "mass_kg"), ("component", "preload_n"))
# What each model needs beyond its name.
_MODEL_KEYS: Mapping[str, tuple[str, ...]] = {
    **{model: tuple(name for name in own if (model, name) not in _OPTIONAL) for model, own in OWN_NAMES.items()},
    "quarter_car": _CAR_KEYS,
    "half_car": (*_CAR_KEYS, "pitch_inertia_kg_m2", "rear"),
    "full_car": (*_CAR_KEYS, "pitch_inertia_kg_m2", "rear", "roll_inertia_kg_m2", "track_width_m"),
}
_COMMON_KEYS = ("name", "model")
_AXLE_KEYS = ("unsprung_mass_kg", "suspension_stiffness_n_per_m", "suspension_damping_n_s_per_m",
              "tire_stiffness_n_per_m")
_ANTI_ROLL_KEY = "anti_roll_stiffness_n_m_per_rad"
# What a number may be. Most scale with the body, so that they are limited per kilogram of sprung mass: a car, a lorry
# and the Golden Car, whose numbers are given for 1 kg, fit; the same numbers in g, t, mm, kN/m or kN s/m do not.
_LIMITS: Mapping[str, tuple[float, float]] = {"sprung_mass_kg": (1.0, 1e5), "track_width_m": (0.01, 5.0),
                                              "cg_distance_m": (0.0, 20.0), "contact_patch_m": (0.0, 1.0)}
# What stands on a bench may have any size: masses from a microgram (or what stands for one, in a circuit) to a thousand
# tonnes, which swing at 0.01 Hz to 5 kHz. What is as large as a car, by its tires or its wheelbase, is one.
_ON_BENCH: Mapping[str, tuple[float, float]] = {"sprung_mass_kg": (1e-9, 1e6), "mass_kg": (1e-9, 1e6)}
_ON_BENCH_PER_KG = {"inertia": (1e-9, 1e3), "mass": (1e-6, 1e3), "stiffness": (4e-3, 1e9), "damping": (0.0, 1e6)}
_CAR_PATCH_M, _CAR_WHEELBASE_M = 0.1, 1.0
_LIMITS_PER_KG: Mapping[str, tuple[float, float]] = {
    "pitch_inertia_kg_m2": (0.01, 100.0), "roll_inertia_kg_m2": (0.01, 100.0), "unsprung_mass_kg": (0.001, 5.0),
    "suspension_stiffness_n_per_m": (0.5, 5000.0), "suspension_damping_n_s_per_m": (0.01, 1000.0),
    "tire_stiffness_n_per_m": (5.0, 50_000.0), _ANTI_ROLL_KEY: (0.01, 10_000.0)}
# 0 stands for none: without a spring a single mass moves freely.
_MAY_BE_MISSING = ("suspension_damping_n_s_per_m", _ANTI_ROLL_KEY, "stiffness_n_per_m", "damping_n_s_per_m")
# Where a search for an unknown number begins, of a car of the middle class.
_USUAL = {"sprung_mass_kg": 350.0, "mass_kg": 10.0, "cg_distance_m": 1.35, "track_width_m": 1.5,
          "contact_patch_m": 0.15, _ANTI_ROLL_KEY: 1e4}
_NUMBERS = {*_LIMITS, *_LIMITS_PER_KG, *(name for own in OWN_NAMES.values() for name in own)}
_MAY_BE_NOTHING = {name for name in OWN_NAMES["single_mass"] if name != "mass_kg"}
_SPREAD = re.compile(r"(.+?)\s*(?:\+-|\+/-|±)\s*(.+?)\s*(%?)")  # 875 +- 5%, 875 ± 40


@dataclass(frozen=True)
class ModelStep:
    """A step in the making of a model: what was done, and the error that it left.

    noise_floor_error    below which no model can come; None: not known
    """

    step: str
    error: float
    noise_floor_error: float | None = None


@dataclass(frozen=True)
class CarModel:
    """A vehicle with its effects, and the steps that led to them, the first one first.

    given    the vehicle as it was before any of its numbers was refitted; None: none was
    errors   of the numbers of vehicle and effects that were fitted; None: none are known
    known    how well numbers were known before that, by name, where the file says it
    """

    vehicle: Vehicle
    effects: tuple[Chosen, ...] = ()
    history: tuple[ModelStep, ...] = ()
    given: Vehicle | None = None
    errors: NumberErrors | None = None
    known: Mapping[str, Known] = field(default_factory=dict)

    @property
    def is_guessed(self) -> bool:
        """Whether numbers of the vehicle are none of its file's, but where a search for them begins."""
        return self.given is None and any(one.words == UNKNOWN for one in self.known.values())


def read_vehicle(path: Path | str) -> Vehicle:
    """Read the file of a plain vehicle. Raises BadInput (``file:line: expected ...``) for whatever is missing, unknown
    or wrong, and for a vehicle that has effects.

    A single mass has ``mass_kg``, ``stiffness_n_per_m`` and ``damping_n_s_per_m``. A half car needs every key of the
    format; a quarter car stands on ``front`` alone, without ``cg_distance_m``, and
    has neither ``rear`` nor ``pitch_inertia_kg_m2``. A full car adds ``roll_inertia_kg_m2``, ``track_width_m`` and, in
    an axle that has an anti-roll bar, ``anti_roll_stiffness_n_m_per_rad``. Any car may say where its accelerometer
    sits: ``sensor: {ahead_m: 0.3, left_m: 0.1}``, as far as it makes a difference to its model. Numbers that no car
    has, such as those in other units, are wrong too.
    """
    vehicle, keys, _ = _read(path)
    if "effects" in keys and keys["effects"].items():
        raise keys["effects"].wrong("no effects, as this takes only a car without them")
    return vehicle


def read_model(path: Path | str) -> CarModel:
    """Read a vehicle file with its effects, those in files of the user's own too, which are run.

    Raises BadInput as ``read_vehicle``, and for an effect, a parameter or a step of the history that is not what it
    should be, or an effect that cannot be there in this vehicle.
    """
    from logger.store.formats.effect_file import read_effects

    vehicle, keys, known = _read(path)
    effects = read_effects(keys["effects"], vehicle) if "effects" in keys else ()
    given = _read_given(keys["given"], vehicle, known) if "given" in keys else None
    return CarModel(vehicle, effects, tuple(map(_read_step, keys["history"].items())) if "history" in keys else (),
                    given, _read_errors(keys, vehicle, effects) if "standard_errors" in keys else None, known)


def check_on_road(vehicle: Vehicle) -> None:
    """Raise BadInput for a vehicle that no road moves, a part on a test bench."""
    if vehicle.model in OWN_NAMES:
        raise BadInput(f"{vehicle.name}: expected a car, found model: {vehicle.model}, which stands on a test bench")


def check_moves_itself(vehicle: Vehicle) -> None:
    """Raise BadInput for a part alone, which its bench moves: what it answers with is a force."""
    if vehicle.is_part:
        raise BadInput(f"{vehicle.name}: expected a mass that moves, found model: component, which its bench moves")


def read_on_board(path: Path | str) -> CarModel:
    """Read a vehicle file as ``read_model``, but for effects of a user's own: they are not run but refused (BadInput),
    and so are parts on a test bench."""
    vehicle, keys, known = _read(path)
    check_on_road(vehicle)
    for name, one in known.items():
        if one.words == UNKNOWN and "given" not in keys:
            raise BadInput(f"{path}: expected a number for {name}, found unknown: nothing is fitted on board "
                           "(ridelog identify finds it from runs)")
    for item in keys["effects"].items() if "effects" in keys else ():
        if "file" in (said := item.mapping()):
            raise said["file"].wrong("an effect that comes with ridelog, as the service runs no effect files of users")
    return read_model(path)


def _read_errors(keys: Mapping[str, Node], vehicle: Vehicle, effects: Sequence[Chosen]) -> NumberErrors:
    """Standard errors of numbers, and how they hang together."""
    known = [*names(vehicle), *(f"{one.effect.name}.{name}" for one in effects for name in one.values)]
    said = keys["standard_errors"].mapping(optional=known)
    errors = {name: node.number(above=0.0) for name, node in said.items()}
    rows = [[node.number(low=-1.0, high=1.0) for node in row.items()] for row in keys["correlations"].items()
            ] if "correlations" in keys else []
    if rows and [len(row) for row in rows] != list(range(len(errors))):
        raise keys["correlations"].wrong(f"a row for each standard error ({len(errors)}), the first without values "
                                         "and each with one value more than the row above it")
    return NumberErrors(errors, tuple(map(tuple, rows)))


def _read_given(node: Node, vehicle: Vehicle, known: dict[str, Known]) -> Vehicle:
    """The vehicle with its numbers as they were given, ``front.unsprung_mass_kg: 40 +- 5%``; how well they were known
    is added to ``known``. Of one that was not known the number that was found stands in its place."""
    keys = dict(node.mapping(optional=(*sized(vehicle), PRELOAD)))
    if PRELOAD in keys:
        _plain_preload(keys.pop(PRELOAD), known)
    for name, one in keys.items():
        if _is_unknown(one):
            known[name] = Known.unknown(name, read(vehicle, name))
            keys[name] = replace(one, content=repr(read(vehicle, name)))
        else:
            keys[name] = _plain_number(one, name, known)
    mass_kg = 0.0 if vehicle.is_part else vehicle.sprung_mass_kg
    wheelbase_m = 0.0 if vehicle.rear is None else vehicle.front.cg_distance_m + vehicle.rear.cg_distance_m
    is_car = _is_car_sized(wheelbase_m, vehicle.contact_patch_m)
    values = {name: _number_of({name.rpartition(".")[2]: one}, name.rpartition(".")[2], mass_kg, is_car)
              for name, one in keys.items()}
    for name, value in values.items():
        if not value > 0:
            raise keys[name].wrong("a number above 0")
    return changed(vehicle, values)


def _plain_number(node: Node, name: str, known: dict[str, Known]) -> Node:
    """The number of a node without how well it is known, which goes to ``known``. BadInput for neither."""
    if name == PRELOAD:
        return _plain_preload(node, known)
    if isinstance(node.content, tuple):
        one = Known.within(*_ends(node, [end.number(above=0.0) for end in node.content]))
    elif isinstance(node.content, str) and (said := _SPREAD.fullmatch(node.content)):
        number, deviation = (replace(node, content=text, plain=True) for text in said.groups()[:2])
        value, spread, percent = number.number(low=0.0), deviation.number(above=0.0), bool(said[3])
        if value == 0 and name not in _MAY_BE_NOTHING:
            raise node.wrong("a number above 0 before +-")
        if value == 0 and percent:
            raise node.wrong("a standard deviation in the unit of the number, as a share of 0 is 0")
        one = Known.about(value, spread, percent)
        if value > 0 and one.deviation > 1:
            raise node.wrong(f"a standard deviation up to the number itself, or {UNKNOWN}")
    else:
        return node
    known[name] = one
    return replace(node, content=repr(one.value), plain=True)


def _plain_preload(node: Node, known: dict[str, Known]) -> Node:
    """A preload without how well it is known, which is added to ``known``. It has either sign."""
    if isinstance(node.content, tuple):
        low, high = _ends(node, [end.number() for end in node.content])
        value, words = (low + high) / 2, f"[{low!r}, {high!r}]"
    elif isinstance(node.content, str) and (said := _SPREAD.fullmatch(node.content)):
        replace(node, content=said[2], plain=True).number(above=0.0)
        value, words = replace(node, content=said[1], plain=True).number(), node.content
    elif _is_unknown(node):
        value, words = 0.0, UNKNOWN
    else:
        return node
    known[PRELOAD] = Known(value, float("inf"), words)
    return replace(node, content=repr(value), plain=True)


def _ends(node: Node, ends: Sequence[float]) -> Sequence[float]:
    """The ends of a range. BadInput for what is none."""
    if len(ends) != 2 or not ends[0] < ends[1]:
        raise node.wrong("a range, [low, high]")
    return ends


def _is_unknown(node: Node) -> bool:
    return node.content == UNKNOWN


def _with_plain_numbers(top: Node) -> tuple[Node, dict[str, Known]]:
    """A vehicle's file with plain numbers, and how well those are known of which it says it, by name. In the place of
    one that is unknown stands that of the Golden Car, for as much mass."""
    known: dict[str, Known] = {}
    unknown: list[str] = []

    def plain(key: str, name: str, one: Node) -> Node:
        one = _plain_number(one, name, known)
        unknown.extend([name] * _is_unknown(one))
        return one

    def filled(key: str, name: str, one: Node) -> Node:
        if name not in unknown:
            return one
        value = _usual_number(key, mass_kg)
        known[name] = Known.unknown(name, value)
        return replace(one, content=repr(value), plain=True)

    found = _with_numbers(top, plain)
    if not unknown:
        return found, known
    is_part = "model" in found.mapping() and found.mapping()["model"].content == "component"
    # A part alone is one of a car, however little of it moves.
    mass = "mass_kg" if "mass_kg" in found.mapping() and not is_part else "sprung_mass_kg"
    mass_kg = _usual_number(mass, 1.0)
    if mass in found.mapping() and mass not in unknown:
        mass_kg = found.mapping()[mass].number(above=0.0)
    return _with_numbers(found, filled), known


def _with_numbers(node: Node, made: Callable[[str, str, Node], Node], part: str = "") -> Node:
    """A vehicle's file with what is ``made`` of each of its numbers, by its key and its whole name."""
    content = dict(node.mapping())
    for key, one in content.items():
        if key in _NUMBERS:
            content[key] = made(key, part + key, one)
        elif key in ("front", "rear") and isinstance(one.content, Mapping):
            content[key] = _with_numbers(one, made, f"{key}.")
    return replace(node, content=content)


def _usual_number(key: str, sprung_mass_kg: float) -> float:
    """A number of the Golden Car with so much sprung mass; of a car of the middle class where it has none."""
    if key in _USUAL:
        return _USUAL[key]
    if key in ("pitch_inertia_kg_m2", "roll_inertia_kg_m2"):  # dynamic index 1; a body as wide as its track
        return sprung_mass_kg * (_USUAL["cg_distance_m"]**2 if key[0] == "p" else _USUAL["track_width_m"]**2 / 12)
    own = OWN_NAMES["single_mass"].get(key, key).rpartition(".")[2]
    return float(f"{sprung_mass_kg * getattr(GOLDEN_CAR.front, own):.6g}")


def _read(path: Path | str) -> tuple[Vehicle, Mapping[str, Node], dict[str, Known]]:
    """The vehicle of a file, the nodes of all its keys, and how well its numbers are known where they say it."""
    shortest_wheelbase_m = 0.01
    top, known = _with_plain_numbers(load_mapping(path))
    model_node = top.mapping().get("model")
    if model_node is None:
        raise BadInput(f"{top.file}:{top.line}: expected the key 'model' here, it is missing")
    model = model_node.choice(*_MODEL_KEYS)
    keys = top.mapping(required=_COMMON_KEYS + _MODEL_KEYS[model], optional=(
        *(name for one, name in _OPTIONAL if one == model),
        "sensor", "effects", "standard_errors", "correlations", "given", "history"))
    name = keys["name"].text()
    if word(name) != name:
        raise keys["name"].wrong(f"a name of at most {LONGEST_WORD} printable characters")
    if model in OWN_NAMES:
        bench = Vehicle(name, model, 0.0, None, Axle(0.0, 0.0, 0.0, 0.0, 0.0), None, 0.0)
        own = [key for key in OWN_NAMES[model] if key in keys]
        if model == "component":
            return changed(bench, {key: _of_component(keys[key], key) for key in own}), keys, known
        mass_kg = _number_of(keys, "mass_kg", 1.0, False)
        return changed(bench, {key: _number_of(keys, key, mass_kg, False) for key in own}), keys, known
    is_car = _looks_car_sized(keys)
    mass_kg = _number_of(keys, "sprung_mass_kg", 1.0, is_car)
    front = _read_axle(keys["front"], model, mass_kg, is_car)
    rear = _read_axle(keys["rear"], model, mass_kg, is_car) if "rear" in keys else None
    if rear is not None and front.cg_distance_m + rear.cg_distance_m < shortest_wheelbase_m:
        distance = keys["rear"].mapping()["cg_distance_m"]
        raise distance.wrong(f"axles at least {shortest_wheelbase_m:g} m apart")
    body = {key: _number_of(keys, key, mass_kg, is_car)
            for key in ("pitch_inertia_kg_m2", "roll_inertia_kg_m2", "track_width_m", "contact_patch_m") if key in keys}
    sensor = _read_sensor(keys["sensor"], model) if "sensor" in keys else AT_CENTRE_OF_GRAVITY
    vehicle = Vehicle(name, model, mass_kg, body.get("pitch_inertia_kg_m2"), front, rear, body["contact_patch_m"],
                      roll_inertia_kg_m2=body.get("roll_inertia_kg_m2"), track_width_m=body.get("track_width_m"),
                      sensor=sensor)
    return vehicle, keys, known


def _of_component(node: Node, key: str) -> float:
    """A number of a part, none of which need be there, and of which its preload may have either sign."""
    most_of_component = 1e12
    return node.number(low=-most_of_component if key == "preload_n" else 0.0, high=most_of_component)


def _looks_car_sized(keys: Mapping[str, Node]) -> bool:
    """``_is_car_sized`` of keys, none of which may be right."""
    places = [keys[axle].mapping().get("cg_distance_m") for axle in ("front", "rear") if axle in keys]
    return _is_car_sized(sum(one.number() for one in places if one is not None), keys["contact_patch_m"].number())


def _is_car_sized(wheelbase_m: float, contact_patch_m: float) -> bool:
    """Whether its tires or its wheelbase are those of a car."""
    return wheelbase_m >= _CAR_WHEELBASE_M or contact_patch_m >= _CAR_PATCH_M


def _number_of(keys: Mapping[str, Node], key: str, sprung_mass_kg: float, is_car: bool) -> float:
    """The number of a key, within its limits: those of cars, or of anything on a bench."""
    rounding = 1e-12
    node = keys[key]
    if not sprung_mass_kg:  # of a part that need not have one
        return _of_component(node, key)
    limits = _LIMITS if is_car else {**_LIMITS, **_ON_BENCH}
    if key in limits:
        low, high = limits[key]
        return node.number(low=low, high=high)
    value = node.number(low=0)
    per_kg = _LIMITS_PER_KG[key] if is_car else next(one for word, one in _ON_BENCH_PER_KG.items() if word in key)
    low, high = (limit * sprung_mass_kg for limit in per_kg)
    none = key in _MAY_BE_MISSING
    if low * (1 - rounding) <= value <= high * (1 + rounding) or (none and value == 0):
        return value
    raise node.wrong(f"a number from {low:g} to {high:g}{' or 0' if none else ''}, for {sprung_mass_kg:g} kg on the "
                     "springs")


def _read_axle(node: Node, model: str, sprung_mass_kg: float, is_car: bool) -> Axle:
    keys = node.mapping(required=_AXLE_KEYS if model == "quarter_car" else ("cg_distance_m", *_AXLE_KEYS),
                        optional=(_ANTI_ROLL_KEY,) if model == "full_car" else ())
    return Axle(**{"cg_distance_m": 0.0} | {key: _number_of(keys, key, sprung_mass_kg, is_car) for key in keys})


def _read_sensor(node: Node, model: str) -> SensorPlace:
    farthest_m = 10.0  # no sensor is bolted farther from its car's centre of gravity
    keys = node.mapping(optional=("ahead_m", "left_m"))
    place = {key: value.number(low=-farthest_m, high=farthest_m) for key, value in keys.items()}
    for key, motion, models in (("ahead_m", "pitch", ("half_car", "full_car")), ("left_m", "roll", ("full_car",))):
        if place.get(key) and model not in models:
            raise keys[key].wrong(f"0, because a {model} does not {motion}")
    return SensorPlace(**place)


def _read_step(node: Node) -> ModelStep:
    keys = node.mapping(required=("step", "error"), optional=("noise_floor_error",))
    floor = keys.get("noise_floor_error")
    return ModelStep(word(keys["step"].text(), LONGEST_COMPLAINT), keys["error"].number(low=0),
                     None if floor is None or floor.is_null() else floor.number(low=0))


def write_model(path: Path | str, model: CarModel, comments: str = "") -> None:
    """Write a model as a file that ``read_model`` reads back equal, to the last bit. OSError if that fails.

    comments    lines that begin with #, to stand before it

    The file of a user's own effect is named by its way from the new file's folder. A standard error that is not finite
    is not known, and left out.
    """
    from logger.store.formats.effect_file import effect_keys

    keys = _vehicle_keys(model.vehicle)
    if model.given is None:
        for name, known in model.known.items():
            part, _, leaf = name.rpartition(".")
            (keys[part] if part else keys)[leaf] = _known_words(known)
    keys["effects"] = [_OneLine(effect_keys(one, Path(path).parent)) for one in model.effects]
    if model.errors is not None and model.errors.standard_errors:
        keys["standard_errors"] = {name: float(error) for name, error in model.errors.standard_errors.items()}
        if model.errors.correlations:
            keys["correlations"] = [_OneLineList(map(float, row)) for row in model.errors.correlations]
    if model.given is not None:
        moved = {name: float(read(model.given, name)) for name in sized(model.given)
                 if read(model.given, name) != read(model.vehicle, name)}
        keys["given"] = moved | {name: _known_words(one) for name, one in model.known.items()}
    if model.history:
        keys["history"] = [_OneLine(step=one.step, error=float(one.error), noise_floor_error=None
                                    if one.noise_floor_error is None else float(one.noise_floor_error))
                           for one in model.history]
    text = yaml.dump(keys, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=float("inf"))
    write_text(path, comments + text)


def _known_words(known: Known) -> object:
    """How well a number was known, as YAML writes it."""
    return _OneLineList(json.loads(known.words)) if known.words.startswith("[") else known.words


class _OneLine(dict[str, object]):
    """A mapping that is written on one line."""


class _OneLineList(list[float]):
    """A list that is written on one line."""


class _Dumper(yaml.SafeDumper):
    """Writes plain values, as YAML's safe dumper does."""


_Dumper.add_representer(_OneLine, lambda dumper, keys: dumper.represent_mapping("tag:yaml.org,2002:map", keys.items(),
                                                                                flow_style=True))
_Dumper.add_representer(_OneLineList,
                        lambda dumper, row: dumper.represent_sequence("tag:yaml.org,2002:seq", row, flow_style=True))


def _vehicle_keys(vehicle: Vehicle) -> dict[str, Any]:
    keys: dict[str, Any] = {"name": vehicle.name, "model": vehicle.model}
    if vehicle.model in OWN_NAMES:
        return {**keys, **{name: _number(read(vehicle, name)) for name in OWN_NAMES[vehicle.model]}}
    for key in ("sprung_mass_kg", "pitch_inertia_kg_m2", "roll_inertia_kg_m2", "track_width_m"):
        value = getattr(vehicle, key)
        if value is not None:
            keys[key] = _number(value)
    keys["front"] = _axle_keys(vehicle.front, vehicle.model)
    if vehicle.rear is not None:
        keys["rear"] = _axle_keys(vehicle.rear, vehicle.model)
    keys["contact_patch_m"] = _number(vehicle.contact_patch_m)
    if vehicle.sensor != AT_CENTRE_OF_GRAVITY:
        keys["sensor"] = {"ahead_m": _number(vehicle.sensor.ahead_m), "left_m": _number(vehicle.sensor.left_m)}
    return keys


def _axle_keys(axle: Axle, model: str) -> dict[str, float]:
    names = _AXLE_KEYS if model == "quarter_car" else ("cg_distance_m", *_AXLE_KEYS)
    if axle.anti_roll_stiffness_n_m_per_rad:
        names = (*names, _ANTI_ROLL_KEY)
    return {name: _number(getattr(axle, name)) for name in names}


def _number(value: float) -> float:
    """The same number, whole where it can be: 875, not 875.0."""
    plain = float(value)
    return int(plain) if plain.is_integer() else plain
