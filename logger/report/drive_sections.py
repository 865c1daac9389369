"""Drives of logs in sections of one length, and their places as a layer for other programs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from logger.chart_data import Array
from logger.records import WindowRecord
from logger.report.summary import counts, expected_square
from logger.roads.roughness_words import federal_condition
from logger.roads.sections import Sections, Windows, even_edges, sections
from logger.store.log.log_reader import LoggedFile, split_drives

_NONE = float("nan")


@dataclass(frozen=True, eq=False)
class DriveSections:
    """The sections of one drive.

    log, number    the file, and which drive of it, from 1
    records        its rows with a distance
    origin_m       the distance of the first of them: sections begin there
    figures        of the k sections
    condition      by the federal limits; empty: not known
    ends_m         (k,) of the sections, the last one where the drive ends [m]
    """

    log: str
    number: int
    records: tuple[WindowRecord, ...]
    origin_m: float
    figures: Sections
    condition: tuple[str, ...]
    ends_m: Array


def drive_sections(files: Sequence[LoggedFile], length_m: float) -> Iterator[DriveSections]:
    """Drives of logs, those that have a distance, in sections."""
    for file in files:
        for number, drive in enumerate(split_drives(file.records), start=1):
            records = tuple(one for one in drive
                            if one.distance_start_m is not None and one.distance_end_m is not None
                            and one.distance_end_m > one.distance_start_m)
            if records:
                yield _of_drive(file.name, number, records, length_m)


def windows_of(records: Sequence[WindowRecord]) -> tuple[Windows, float]:
    """Rows with a distance as arrays, from the first one's beginning on, and that [m]."""
    origin_m = records[0].distance_start_m or 0.0

    def column(of: Callable[[WindowRecord], float | None]) -> Array:
        return np.array([_NONE if (value := of(one)) is None else value for one in records], dtype=np.float64)

    return Windows(
        column(lambda one: one.distance_start_m) - origin_m, column(lambda one: one.distance_end_m) - origin_m,
        column(lambda one: one.duration_s), column(lambda one: one.iri_m_per_km if counts(one) else None),
        column(lambda one: one.iri_std_m_per_km),
        column(lambda one: expected_square(one) if counts(one) else None)), origin_m


def _of_drive(log: str, number: int, records: tuple[WindowRecord, ...], length_m: float) -> DriveSections:
    windows, origin_m = windows_of(records)
    edges_m = even_edges(float(windows.end_m[-1]), length_m)
    found = sections(windows, edges_m)
    condition = tuple(federal_condition(value) if isfinite(value) else "" for value in found.iri_m_per_km.tolist())
    return DriveSections(log, number, records, origin_m, found, condition,
                         np.minimum(edges_m[1:], windows.end_m[-1]))
