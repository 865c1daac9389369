"""``run.yaml``: what the record of a run is, beside the run.

Problem: a model is compared with readings that a sensor rounded, at places that a receiver told; who does so has to
know how coarse the one is and how far off the other. Solution: a small file says it; what it does not say is not known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import yaml

from logger.files import write_text
from logger.runs import UNKNOWN, RecordFacts
from logger.store.formats.yaml_nodes import Node, load_mapping

RUN = "run.yaml"


_SENSOR = ("step_mps2", "range_mps2", "noise_mps2")
_RECEIVER = ("delay_s", "delay_std_s")
_KEYS = ("sensor", "place_std_m", "pass_band_hz", "source", "receiver", "places")


def write_run_facts(folder: Path, facts: RecordFacts) -> None:
    """Write ``run.yaml`` into a run's folder. OSError if that fails."""
    places = {"by": facts.places_by, "vehicle": facts.vehicle}
    said: dict[str, Any] = {"sensor": _some(facts, _SENSOR), "place_std_m": facts.place_std_m,
                            "pass_band_hz": list(facts.pass_band_hz or ()) or None, "source": facts.source,
                            "receiver": _some(facts, _RECEIVER), "places": places if facts.places_by else None}
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
    return RecordFacts(
        **{name: node.number(above=0) for name, node in sensor.items()},
        **{name: node.number() for name, node in receiver.items()},
        place_std_m=said["place_std_m"].number(0) if "place_std_m" in said else None,
        pass_band_hz=_band(said["pass_band_hz"]) if "pass_band_hz" in said else None,
        places_by=places["by"].choice("road", "receiver") if places else None,
        vehicle=places["vehicle"].text() if "vehicle" in places else None,
        source=said["source"].text() if "source" in said else None)


def _band(node: Node) -> tuple[float, float]:
    ends = node.items()
    if len(ends) != 2 or not (low := ends[0].number(0)) < (high := ends[1].number()):
        raise node.wrong("two frequencies, the lower one first [Hz]")
    return low, high


def _some(facts: RecordFacts, names: tuple[str, ...]) -> Mapping[str, float]:
    known = {one.name: getattr(facts, one.name) for one in fields(facts)}
    return {name: float(f"{known[name]:.6g}") for name in names if known[name] is not None}
