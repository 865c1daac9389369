"""``run.yaml``: what the record of a run is, beside the run.

Problem: a model is compared with readings that a sensor rounded, at places that a receiver told; who does so has to
know how coarse the one is and how far off the other. Solution: a small file says it; what it does not say is not known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import yaml

from logger.files import write_text
from logger.store.formats.yaml_nodes import load_mapping

RUN = "run.yaml"


@dataclass(frozen=True)
class RecordFacts:
    """What is known of a record; None: it is not.

    step_mps2, range_mps2    what readings are rounded to, and the greatest there can be [m/s2]
    noise_mps2               r.m.s. of the sensor's noise, before rounding [m/s2]
    place_std_m              standard error of a place on the profile [m]
    delay_s, delay_std_s     of the receiver, and its standard error; taken out [s]
    places_by                "road": places were found by the road as this vehicle's model feels it; "receiver"
    vehicle                  that vehicle
    source                   the name of the file that it was made of
    """

    step_mps2: float | None = None
    range_mps2: float | None = None
    noise_mps2: float | None = None
    place_std_m: float | None = None
    delay_s: float | None = None
    delay_std_s: float | None = None
    places_by: str | None = None
    vehicle: str | None = None
    source: str | None = None


_SENSOR = ("step_mps2", "range_mps2", "noise_mps2")
_RECEIVER = ("delay_s", "delay_std_s")


def write_run_facts(folder: Path, facts: RecordFacts) -> None:
    """Write ``run.yaml`` into a run's folder. OSError if that fails."""
    places = {"by": facts.places_by, "vehicle": facts.vehicle}
    said: dict[str, Any] = {"sensor": _some(facts, _SENSOR), "place_std_m": facts.place_std_m, "source": facts.source,
                            "receiver": _some(facts, _RECEIVER), "places": places if facts.places_by else None}
    write_text(folder / RUN, yaml.safe_dump({key: value for key, value in said.items() if value not in (None, {})},
                                            sort_keys=False, allow_unicode=True))


def source_of(folder: Path) -> str | None:
    """The name of the file that the run of a folder was made of, by its ``run.yaml``; None where it does not say.

    Raises BadInput ("file:line: expected ..., found ...").
    """
    path = folder / RUN
    if not path.exists():
        return None
    said = load_mapping(path).mapping().get("source")
    return said.text() if said is not None else None


def _some(facts: RecordFacts, names: tuple[str, ...]) -> Mapping[str, float]:
    known = {one.name: getattr(facts, one.name) for one in fields(facts)}
    return {name: float(f"{known[name]:.6g}") for name in names if known[name] is not None}
