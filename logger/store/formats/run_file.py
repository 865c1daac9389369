"""``run.yaml``: what the record of a run is, beside the run.

Problem: a model is compared with readings that a sensor rounded, at places that a receiver gave; to do so one has to
know how coarse the one is and how far off the other. Solution: a small file says it; what it does not say is not known.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import yaml

from logger import bounds
from logger.errors import BadInput
from logger.files import write_text
from logger.runs import BY_RECEIVER, BY_ROAD, UNKNOWN, RecordFacts, Signal
from logger.store.formats.yaml_nodes import Node, load_mapping

RUN = "run.yaml"
DRIVE_NAME = "drive.csv"


_SENSOR = ("step_mps2", "range_mps2", "noise_mps2", "taken_hz")
_RECEIVER = ("delay_s", "delay_std_s", "speed_scale", "speed_scale_std")
_KEYS = ("sensor", "place_std_m", "pass_band_hz", "source", "receiver", "places", "signals")
# What signals measure: the unit that their columns end in, and the parts that they are of.
_CORNERS = ("front", "rear", "front_left", "front_right", "rear_left", "rear_right")
_MEASURES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "acceleration": ("_mps2", ("body", *(f"{one}_wheel" for one in _CORNERS))),
    "travel": ("_m", tuple(f"{one}_suspension" for one in _CORNERS)),
    "pitch_rate": ("_rad_per_s", ("body",)),
    "roll_rate": ("_rad_per_s", ("body",)),
}
_PLACE = ("ahead_m", "left_m")
_FARTHEST_M = 20.0


def write_run_facts(folder: Path, facts: RecordFacts) -> None:
    """Write ``run.yaml`` into a run's folder. OSError if that fails."""
    places = {"by": facts.places_by, "vehicle": facts.vehicle}
    said: dict[str, Any] = {"sensor": _some(facts, _SENSOR), "place_std_m": facts.place_std_m,
                            "pass_band_hz": list(facts.pass_band_hz or ()) or None, "source": facts.source,
                            "receiver": _some(facts, _RECEIVER), "places": places if facts.places_by else None,
                            "signals": {one.name: _signal_keys(one) for one in facts.signals}}
    write_text(folder / RUN, yaml.safe_dump({key: value for key, value in said.items() if value not in (None, {})},
                                            sort_keys=False, allow_unicode=True))


def read_run_facts(folder: Path) -> RecordFacts:
    """What the ``run.yaml`` of a run's folder says; nothing where there is none.

    Raises BadInput ("file:line: expected ..., found ...") for a key that is not known or a value that cannot be.
    """
    path = folder / RUN
    if not path.exists():
        return UNKNOWN
    said = load_mapping(path).mapping(optional=_KEYS)
    sensor, receiver = (said[key].mapping(optional=names) if key in said else {}
                        for key, names in (("sensor", _SENSOR), ("receiver", _RECEIVER)))
    places = said["places"].mapping(("by",), ("vehicle",)) if "places" in said else {}
    numbers = {**{name: _within(node, bounds.ACCELERATION) for name, node in sensor.items()},
               **{name: _of_receiver(name, node) for name, node in receiver.items()}}
    return replace(
        UNKNOWN, **numbers,
        place_std_m=said["place_std_m"].number(0, bounds.DISTANCE.largest) if "place_std_m" in said else None,
        pass_band_hz=_band(said["pass_band_hz"]) if "pass_band_hz" in said else None,
        places_by=places["by"].choice(BY_ROAD, BY_RECEIVER) if places else None,
        vehicle=places["vehicle"].text() if "vehicle" in places else None,
        source=said["source"].text() if "source" in said else None,
        signals=tuple(_signal(name, node) for name, node in said["signals"].mapping().items()
                      ) if "signals" in said else ())


def facts_beside(drive: Path | str) -> RecordFacts:
    """What the ``run.yaml`` in the folder of a ``drive.csv``, or in a run's folder, says of that drive; of its signals,
    which are columns of their own, nothing. Nothing of a file of another name. Errors as ``read_run_facts``."""
    place = Path(drive)
    folder = place if place.is_dir() else place.parent if place.name == DRIVE_NAME else None
    return UNKNOWN if folder is None else replace(read_run_facts(folder), signals=())


def _of_receiver(name: str, node: Node) -> float:
    """A delay may have either sign, as the recorder may be the late one; a factor is above 0, an error not below."""
    if name == "speed_scale":
        return _within(node, bounds.SCALE)
    most = bounds.SCALE.largest if name == "speed_scale_std" else bounds.DELAY.largest
    return node.number(-most if name == "delay_s" else 0.0, most)


def _within(node: Node, quantity: bounds.Quantity) -> float:
    """A number above 0 as large as such a quantity can be."""
    return node.number(quantity.least, quantity.largest)


def check_columns(folder: Path, columns: Collection[str], taken: Collection[str]) -> None:
    """Raise BadInput, with the line, for a signal in a run's ``run.yaml`` that is no column of its drive, or one of
    those that are ``taken`` for something else."""
    path = folder / RUN
    said = load_mapping(path).mapping(optional=_KEYS) if path.exists() else {}
    for name, node in said["signals"].mapping().items() if "signals" in said else ():
        if name in taken:
            raise BadInput(f"{node.file}:{node.line}: expected a signal beside the columns {', '.join(taken)}, found "
                           f"{name}")
        if name not in columns:
            raise BadInput(f"{node.file}:{node.line}: expected a signal that is a column of the drive.csv beside it, "
                           f"found {name}, which is none")


def _signal(name: str, node: Node) -> Signal:
    keys = node.mapping(("measures",), ("of", *_PLACE))
    measures = keys["measures"].choice(*_MEASURES)
    unit, parts = _MEASURES[measures]
    if not name.endswith(unit):
        raise BadInput(f"{node.file}:{node.line}: expected a column of {measures.replace('_', ' ')} whose name ends in "
                       f"{unit}, its unit, found {name}")
    if "of" not in keys and parts[0] != "body":
        raise BadInput(f"{node.file}:{node.line}: expected the key 'of' with one of {', '.join(parts)}")
    of = keys["of"].choice(*parts) if "of" in keys else "body"
    place = {key: keys[key].number(-_FARTHEST_M, _FARTHEST_M) for key in _PLACE if key in keys}
    if place and (measures, of) != ("acceleration", "body"):
        raise keys[next(iter(place))].wrong("no place: only an acceleration of the body has one")
    return Signal(name, measures, of, **place)


def _signal_keys(one: Signal) -> dict[str, object]:
    place = {key: float(f"{getattr(one, key):.6g}") for key in _PLACE if getattr(one, key)}
    return {"measures": one.measures, "of": one.of, **place}


def _band(node: Node) -> tuple[float, float]:
    ends = node.items()
    if len(ends) != 2 or not (low := ends[0].number(0)) < (high := ends[1].number(high=bounds.FASTEST_HZ)):
        raise node.wrong("two frequencies, the lower one first [Hz]")
    return low, high


def _some(facts: RecordFacts, names: tuple[str, ...]) -> Mapping[str, float]:
    known = {one.name: getattr(facts, one.name) for one in fields(facts)}
    return {name: float(f"{known[name]:.6g}") for name in names if known[name] is not None}
