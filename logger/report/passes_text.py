"""Repeated drives in words, and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import Any

import numpy as np

from logger.comfort.iso2631 import comfort_word
from logger.printable import counted
from logger.report.combined_drives import CombinedDrives
from logger.report.quantities import known
from logger.report.terminal import comfort_words
from logger.roads.repeated_drives import Changes, PlaceToVisit
from logger.store.log.log_reader import iso_utc
from logger.units import US_PER_S

SIGNIFICANT = 0.05
"""Share of false finds among the cells that are said to have changed."""
MOST_VISITS, MOST_CHANGES = 20, 20


def lines(found: CombinedDrives) -> list[str]:
    """For a person."""
    cells = len(found.iri.key)
    if not cells:
        return ["No row has a place and an IRI with its standard error, so drives cannot be combined."]
    changes = change_lines(found)
    return [*_summary(found), *_visits(found), *([""] if changes else []), *changes]


def _summary(found: CombinedDrives) -> Iterator[str]:
    drives, cells = found.iri.drives, len(found.iri.key)
    several = int((drives > 1).sum())
    yield (f"{counted(found.drives, 'drive')}, {found.placed:,} of {counted(found.windows, 'window')} with a place, in "
           f"{counted(cells, 'cell')} of {found.length_m:g} m by place and direction")
    yield (f"Passed by more than one drive: {several / cells:.0%} of the cells; median {np.median(drives):g}, "
           f"{drives.max()} at most")
    mean, std = (float(np.mean(one)) for one in (found.iri.iri_m_per_km, found.iri.iri_std_m_per_km))
    yield f"IRI of the cells {mean:.2f} m/km on the mean, standard error of one cell {std:.2f}"
    if isfinite(found.scatter.drive):
        yield (f"Beyond their own errors drives differ by {found.scatter.drive:.1%} of the IRI as a whole, and single "
               f"passes by {found.scatter.passes:.1%}: both are in the standard errors")
        if found.scatter.alike > 0:
            yield (f"Of the variance of their own errors {found.scatter.alike:.0%} is alike in all drives over a "
                   "place: more drives do not make that part smaller")
    else:
        yield ("No cell was passed by two drives: how far a drive differs as a whole (tires, load, temperature) is not "
               "known, and not in the standard errors")


def _visits(found: CombinedDrives) -> Iterator[str]:
    yield ""
    if not found.visits:
        yield "No place lies above a limit with enough confidence: nothing to visit."
        return
    yield f"Places to visit: {len(found.visits)}"
    yield (f"{'#':>3} {'coordinates':>21} {'towards':7} {'length':>7}  {'what':13} {'IRI m/km':>12} {'a_w m/s2':>8}  "
           f"{'perception':25} {'sure':>4} drives")
    for number, one in enumerate(found.visits[:MOST_VISITS], start=1):
        values = visit_values(found, one)
        iri = f"{values['iri_m_per_km']:.2f} ± {values['iri_std_m_per_km']:.2f}"
        a_w = values["a_w_mps2"]
        yield (f"{number:3} {values['lat_deg']:10.5f},{values['lon_deg']:10.5f} {compass(values['heading_deg']):7} "
               f"{one.length_m:5.0f} m  {one.kind:13} {iri:>12} {'-' if a_w is None else f'{a_w:.2f}':>8}  "
               f"{comfort_words(values['comfort'] or '') if a_w is not None else '-':25} {one.confidence:4.0%} "
               f"{one.drives:6}")
    if len(found.visits) > MOST_VISITS:
        yield f"... and {len(found.visits) - MOST_VISITS} more: --visit FILE writes all of them"


def change_lines(found: CombinedDrives) -> list[str]:
    """What changed between two periods: how much of the road, and the largest changes, a line each."""
    return [] if found.change is None else list(_changes(found, found.change))


def _changes(found: CombinedDrives, change: Changes) -> Iterator[str]:
    if not len(change.key):
        yield "No cell was passed in both periods: no change can be measured."
        return
    words = [changed(change, one) for one in range(len(change.key))]
    worse, better = words.count("worse"), words.count("better")
    yield (f"Changed between the two periods: {worse} of {counted(len(change.key), 'cell')} got worse, {better} better "
           f"(at most {SIGNIFICANT:.0%} of them by chance; Benjamini & Hochberg)")
    cell = np.searchsorted(found.iri.key, change.key)
    for one in largest_changes(change):
        at = int(cell[one])
        yield (f"{place_number(found, at):>3} {changed(change, one):6} {found.lat_deg[at]:10.5f},"
               f"{found.lon_deg[at]:10.5f} {compass(found.heading_deg[at]):2}  {change.change_m_per_km[one]:+6.2f} ± "
               f"{change.change_std_m_per_km[one]:.2f} m/km, p {change.p_value[one]:.1e}, "
               f"{counted(int(change.before[one]), 'drive')} before, {int(change.after[one])} after")


def changed(change: Changes, one: int) -> str:
    """``worse`` or ``better``; nothing where no change is sure."""
    if not change.false_share[one] <= SIGNIFICANT:
        return ""
    return "worse" if change.change_m_per_km[one] > 0 else "better"


def largest_changes(change: Changes) -> list[int]:
    """The largest of those that are sure, worse or better."""
    sure = np.flatnonzero(change.false_share <= SIGNIFICANT)
    order = sure[np.argsort(-np.abs(change.change_m_per_km[sure]), kind="stable")]
    return list(map(int, order[:MOST_CHANGES]))


def place_number(found: CombinedDrives, cell: int) -> str:
    """The number of the place to visit that a cell belongs to; nothing where there is none."""
    return next((str(number) for number, one in enumerate(found.visits, start=1) if cell in one.cells), "")


def compass(heading_deg: float) -> str:
    """A heading clockwise from north in one of eight words."""
    return ("N", "NE", "E", "SE", "S", "SW", "W", "NW")[round(heading_deg / 45.0) % 8]


# --- for programs ---


def as_json(found: CombinedDrives) -> dict[str, Any]:
    """The figures; null where nothing is known."""
    return {"drives": found.drives, "windows": found.windows, "placed": found.placed, "length_m": found.length_m,
            "scatter_drive": known(found.scatter.drive), "scatter_pass": known(found.scatter.passes),
            "errors_alike": found.scatter.alike,
            "cells": [cell_values(found, index) for index in range(len(found.iri.key))],
            "visits": [visit_values(found, one) for one in found.visits]}


def cell_values(found: CombinedDrives, index: int) -> dict[str, Any]:
    """A cell by the names of its columns."""
    key = found.iri.key[index]
    change, trend = found.change, found.trend
    values = {
        "cell": int(key), "drives": int(found.iri.drives[index]), "iri_m_per_km": float(found.iri.iri_m_per_km[index]),
        "iri_std_m_per_km": float(found.iri.iri_std_m_per_km[index]), "a_w_mps2": known(found.a_w_mps2[index]),
        "lat_deg": float(found.lat_deg[index]), "lon_deg": float(found.lon_deg[index]),
        "heading_deg": float(found.heading_deg[index]), "first_utc": _utc(found.iri.first_s[index]),
        "last_utc": _utc(found.iri.last_s[index])}
    row = np.searchsorted(trend.key, key)
    there = row < len(trend.key) and trend.key[row] == key
    for name, column in (("trend_m_per_km_year", trend.per_year_m_per_km),
                         ("trend_std_m_per_km_year", trend.per_year_std_m_per_km), ("trend_p_value", trend.p_value)):
        values[name] = float(column[row]) if there else None
    row = 0 if change is None else int(np.searchsorted(change.key, key))
    there = change is not None and row < len(change.key) and change.key[row] == key
    for name in ("change_m_per_km", "change_std_m_per_km", "p_value", "false_share"):
        values[name if name.startswith("change") else f"change_{name}"] = (
            float(getattr(change, name)[row]) if there else None)
    values["changed"] = changed(change, row) or None if change is not None and there else None
    return values


def visit_values(found: CombinedDrives, one: PlaceToVisit) -> dict[str, Any]:
    """A place to visit by the names of its columns: where its worst cell is, and the figures of that."""
    values = cell_values(found, one.worst)
    a_w = values["a_w_mps2"]
    return {"what": one.kind, "length_m": one.length_m, "confidence": one.confidence,
            "comfort": None if a_w is None else comfort_word(a_w),
            **{name: values[name] for name in ("drives", "iri_m_per_km", "iri_std_m_per_km", "a_w_mps2", "lat_deg",
                                               "lon_deg", "heading_deg", "first_utc", "last_utc")}}


def _utc(time_s: float) -> str | None:
    return iso_utc(round(time_s * US_PER_S)) if isfinite(time_s) else None
