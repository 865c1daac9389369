"""Sections of drives as a layer for other programs: a line each, of the windows whose middles lie in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from logger.exchange.geometry import chained
from logger.exchange.layer import Feature, Field, Kind, Layer
from logger.exchange.windows import geometries, group_name, iri_title
from logger.report.drive_sections import DriveSections
from logger.report.sections_text import section_values
from logger.roads.iso8608 import iri_class
from logger.store.log.log_reader import iso_utc

_KINDS = {"distance_start_m": Kind.NUMBER, "distance_end_m": Kind.NUMBER, "known_m": Kind.NUMBER,
          "iri_m_per_km": Kind.NUMBER, "iri_std_m_per_km": Kind.NUMBER, "a_w_mps2": Kind.NUMBER,
          "speed_mps": Kind.NUMBER, "worst_m_per_km": Kind.NUMBER, "worst_at_m": Kind.NUMBER,
          "condition": Kind.WORDS, "comfort": Kind.WORDS}
FIELDS = (Field("log", Kind.WORDS), Field("drive", Kind.COUNT), Field("t_utc", Kind.TIME),
          Field("direction", Kind.WORDS),
          *(Field(name, kind) for name, kind in _KINDS.items()))


def sections_layer(drives: Sequence[DriveSections]) -> Layer:
    """The sections of all drives; ``t_utc`` is when the first window of each began."""
    return Layer("sections", FIELDS, tuple(feature for one in drives for feature in _features(one)))


def _features(drive: DriveSections) -> Iterator[Feature]:
    lines = geometries(drive.records)
    section = np.searchsorted(drive.figures.edges_m, drive.middle_m, side="right") - 1
    for index, values in enumerate(section_values(drive)):
        inside = np.flatnonzero(section == index).tolist()
        geometry = chained([lines[row][0] for row in inside])
        began = iso_utc(drive.records[inside[0]].utc_us) if inside else None
        places = [place for line in geometry for place in line]
        yield Feature(
            group_name(drive.log, drive.number), iri_title(values["iri_m_per_km"]),
            (drive.log, drive.number, began, drive.direction or None, *(values[name] for name in _KINDS)), geometry,
            places[len(places) // 2] if places else None, began,
            bool(inside) and index > 0 and lines[inside[0]][1],
            "" if values["iri_m_per_km"] is None else iri_class(values["iri_m_per_km"]))
