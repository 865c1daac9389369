"""Repeated drives as layers for other programs: the means of cells as lines, places to visit as points."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from logger.exchange.geometry import cut, half_way
from logger.exchange.layer import Feature, Field, Kind, Layer
from logger.exchange.windows import iri_title
from logger.report.combined_drives import CombinedDrives, chains
from logger.report.passes_text import cell_values, compass, visit_values
from logger.roads.iso8608 import iri_class
from logger.roads.repeated_drives import way_and_cell

_KINDS = {"cell": Kind.COUNT, "drives": Kind.COUNT, "first_utc": Kind.TIME, "last_utc": Kind.TIME, "what": Kind.WORDS,
          "comfort": Kind.WORDS, "changed": Kind.WORDS}
_CELL = ("cell", "drives", "iri_m_per_km", "iri_std_m_per_km", "a_w_mps2", "lat_deg", "lon_deg", "heading_deg",
         "first_utc", "last_utc", "trend_m_per_km_year", "trend_std_m_per_km_year", "trend_p_value", "change_m_per_km",
         "change_std_m_per_km", "change_p_value", "change_false_share", "changed")
_VISIT = ("what", "length_m", "confidence", "comfort", "drives", "iri_m_per_km", "iri_std_m_per_km", "a_w_mps2",
          "lat_deg", "lon_deg", "heading_deg", "first_utc", "last_utc")


def _fields(names: tuple[str, ...]) -> tuple[Field, ...]:
    return tuple(Field(name, _KINDS.get(name, Kind.NUMBER)) for name in names)


def cells_layer(found: CombinedDrives) -> Layer:
    """The cells way by way: each a line half-way to its neighbours."""
    return Layer("passes", _fields(_CELL), tuple(_cells(found)))


def _cells(found: CombinedDrives) -> Iterator[Feature]:
    ways, _ = way_and_cell(found.iri.key)
    for chain in chains(found):
        places = [(float(found.lon_deg[cell]), float(found.lat_deg[cell])) for cell in chain]
        ends = [half_way(one, other) for one, other in pairwise(places)]
        for index, cell in enumerate(chain.tolist()):
            values = cell_values(found, cell)
            geometry = cut((*ends[max(index - 1, 0):index], places[index], *ends[index:index + 1]))
            yield Feature(f"way {ways[cell] + 1}", iri_title(values["iri_m_per_km"]),
                          tuple(values[name] for name in _CELL), geometry, places[index], values["last_utc"], index > 0,
                          iri_class(values["iri_m_per_km"]))


def visits_layer(found: CombinedDrives) -> Layer:
    """The places to visit, the most urgent first."""
    return Layer("visits", _fields(_VISIT), tuple(_visits(found)), points=True)


def _visits(found: CombinedDrives) -> Iterator[Feature]:
    for number, one in enumerate(found.visits, start=1):
        values = visit_values(found, one)
        place = (values["lon_deg"], values["lat_deg"])
        title = (f"{number} {one.kind}, {one.length_m:.0f} m towards {compass(values['heading_deg'])}, "
                 f"{iri_title(values['iri_m_per_km'])}")
        yield Feature("places to visit", title, tuple(values[name] for name in _VISIT), ((place,),), place,
                      values["last_utc"], False, iri_class(values["iri_m_per_km"]))
