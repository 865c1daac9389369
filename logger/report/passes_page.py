"""Repeated drives as a page: the report's map and curves of the means, and the places to visit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from logger.comfort.iso2631 import comfort_word
from logger.printable import counted
from logger.records import WindowRecord
from logger.report.combined_drives import CombinedDrives, chains
from logger.report.document import grid, hint, map_links, paragraphs, section
from logger.report.html import EMPTY, Html, html
from logger.report.page import number_button, page
from logger.report.passes_text import (
    MOST_VISITS,
    change_lines,
    changed,
    compass,
    largest_changes,
    lines,
    place_number,
    visit_values,
)
from logger.report.terminal import comfort_words
from logger.roads.iso8608 import iri_class
from logger.store.log.log_reader import LoggedFile, utc
from logger.units import US_PER_S

_GAP_M = 1.0


def passes_page(found: CombinedDrives) -> Html:
    """The page. Ways follow each other as if they had been driven in one go, with a gap between."""
    title = f"Road roughness, mean of {counted(found.drives, 'drive')}", _days(found)
    order = [cell for chain in chains(found) for cell in chain.tolist()]
    rows = [order.index(one.worst) for one in found.visits[:MOST_VISITS]]
    return page([LoggedFile("means of drives", tuple(_rows(found)), 0, {})], title=title, marked=rows or None, first=(
        section("Repeated drives combined", paragraphs(lines(found)[:4]) + hint(
            "What follows shows each cell of road once, with the mean of all drives over it: its time is that of the "
            "last drive, its speed their mean.")), section("Places to visit", _visits(found, rows)),
        section("What changed between the two periods", _changes(found))))


def _days(found: CombinedDrives) -> str:
    if not np.isfinite(found.iri.first_s).any():
        return "dates not known"
    first, last = (utc(round(one * US_PER_S)) for one in (np.nanmin(found.iri.first_s), np.nanmax(found.iri.last_s)))
    return f"{first:%Y-%m-%d}" if first.date() == last.date() else f"{first:%Y-%m-%d} to {last:%Y-%m-%d}"


def _changes(found: CombinedDrives) -> Html:
    if found.change is None:
        return EMPTY
    change, cells = found.change, np.searchsorted(found.iri.key, found.change.key)
    rows = []
    for one in largest_changes(change):
        cell = int(cells[one])
        lat_deg, lon_deg = float(found.lat_deg[cell]), float(found.lon_deg[cell])
        rows.append((
            place_number(found, cell), changed(change, one), _link(lat_deg, lon_deg),
            compass(float(found.heading_deg[cell])),
            f"{change.change_m_per_km[one]:+.2f} ± {change.change_std_m_per_km[one]:.2f}", f"{change.p_value[one]:.1g}",
            str(change.before[one]), str(change.after[one])))
    heads = ("#", "It got", "Coordinates", "Towards", "Change of the IRI [m/km]", "p", "Drives before", "after")
    return paragraphs(change_lines(found)[:1]) + (grid(heads, rows, words=(0, 1, 2, 3)) if rows else EMPTY)


def _visits(found: CombinedDrives, marked: list[int]) -> Html:
    if not found.visits:
        return paragraphs(["No place lies above a limit with enough confidence."])
    rows = []
    for number, one in enumerate(found.visits, start=1):
        values = visit_values(found, one)
        lat_deg, lon_deg = values["lat_deg"], values["lon_deg"]
        a_w = values["a_w_mps2"]
        rows.append((
            number_button(marked[number - 1], number) if number <= len(marked) else str(number), one.kind,
            _link(lat_deg, lon_deg),
            compass(values["heading_deg"]), f"{one.length_m:.0f}",
            f"{values['iri_m_per_km']:.2f} ± {values['iri_std_m_per_km']:.2f}", "" if a_w is None else f"{a_w:.2f}",
            "" if a_w is None else comfort_words(values["comfort"]), f"{one.confidence:.0%}", str(one.drives)))
    heads = ("#", "What", "Coordinates of the worst cell", "Towards", "Length [m]", "IRI [m/km]", "a_w [m/s²]",
             "Perception", "Sure", "Drives")
    return html('<div id="places">{}</div>', grid(heads, rows, words=(0, 1, 2, 3, 7))) + hint(
        f"Rough: above {found.above_m_per_km:.2f} m/km. A place has its number in all tables, on the map and in the "
        "curves.")


def _link(lat_deg: float, lon_deg: float) -> Html:
    return map_links(lat_deg, lon_deg, f"{lat_deg:.6f}, {lon_deg:.6f}")


def _rows(found: CombinedDrives) -> Iterator[WindowRecord]:
    """Cells as rows of a log, for the views that show those."""
    length_m, at_m, segment = found.length_m, 0.0, 0
    for chain in chains(found):
        for cell in chain.tolist():
            segment += 1
            a_w = found.a_w_mps2[cell]
            known = bool(np.isfinite(a_w))
            last_s = found.iri.last_s[cell]
            iri, speed_mps = float(found.iri.iri_m_per_km[cell]), float(found.speed_mps[cell])
            drives = speed_mps > 0
            yield WindowRecord(
                segment, 1, segment * US_PER_S, round(last_s * US_PER_S) if np.isfinite(last_s) else None,
                length_m / speed_mps if drives else 0.0, at_m, at_m + length_m, float(found.lat_deg[cell]),
                float(found.lon_deg[cell]), speed_mps if drives else None, iri,
                float(found.iri.iri_std_m_per_km[cell]), None, float(a_w) if known else None, None, None, None,
                comfort_word(float(a_w)) if known else "", iri_class(iri), None, 0, 0, (),
                float(found.a_w_std_mps2[cell]) if known else None)
            at_m += length_m
        at_m += _GAP_M
