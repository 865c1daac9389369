"""A drive with a serial sensor of any rate, on a line that loses some of what it sends."""

from __future__ import annotations

from collections.abc import Set
from functools import cache

import numpy as np

from drivers.dump import Event
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle

from .replay import Rows, rows_of
from .simulated_drive import DemoDrive, DrivePlan, RoadStretch, simulate_drive

BEGIN_S, SECONDS = 10, 110
SPEED_MPS = 15.0


@cache
def drive_at(rate_hz: int) -> DemoDrive:
    """A class B road at 15 m/s; noise in proportion to the root of the rate, as one and the same sensor has it."""
    knots = ((0, 0), (BEGIN_S, 0), (BEGIN_S + 10, SPEED_MPS), (SECONDS, SPEED_MPS))
    plan = DrivePlan(knots, (RoadStretch(5000, 64),), sensor="lines", rate_hz=rate_hz, seed=7,
                     noise_mps2=0.05 * (rate_hz / 100) ** 0.5)
    return simulate_drive(plan, read_vehicle(vehicle_file("rav4-2009")))


def without_lines(events: list[Event], lost: Set[int]) -> list[Event]:
    """The events as if some lines, counted from 0, had not been sent."""
    number = 0
    kept = []
    for event in events:
        if event.source == "nmea":
            kept.append(event)
            continue
        data = b""
        for piece in event.data.splitlines(keepends=True):
            data += b"" if number in lost else piece
            number += piece.endswith(b"\n")
        if data:
            kept.append(event._replace(data=data))
    return kept


def randomly_lost(rate_hz: int, share: float, seed: int = 1, begin_s: float = 0.0) -> set[int]:
    """Numbers of lines that are lost by chance, from a time of the drive on."""
    drawn = np.random.default_rng(seed).random(rate_hz * SECONDS) < share
    return set(np.flatnonzero(drawn & (np.arange(rate_hz * SECONDS) >= begin_s * rate_hz)).tolist())


def evenly_lost(rate_hz: int, every: int, count: int = 1) -> set[int]:
    """Numbers of lines that are lost at even intervals: the first ``count`` of each ``every``."""
    return {number for number in range(rate_hz * SECONDS) if number % every < count}


@cache
def rows_at(rate_hz: int, share: float = 0.0) -> tuple[DemoDrive, Rows]:
    """The drive and its rows."""
    return drive_at(rate_hz), rows_without(rate_hz, frozenset(randomly_lost(rate_hz, share)))


def rows_without(rate_hz: int, lost: Set[int]) -> Rows:
    """The drive's rows when these lines are lost."""
    drive = drive_at(rate_hz)
    return rows_of(drive.header, without_lines(drive.events, lost))


def mean_iri(rows: Rows) -> tuple[float, int]:
    """Mean IRI of the rows without a flag, and how many they are."""
    iri = [row.iri_m_per_km for row in rows.records if not row.flags and row.iri_m_per_km is not None]
    return (float(np.mean(iri)) if iri else float("nan")), len(iri)


def same_rows(rows: Rows, others: Rows) -> list[tuple[float, float]]:
    """IRI of the rows without a flag, each with that of the row of the same place in the other."""
    known = {round(row.distance_start_m or 0.0, 1): row.iri_m_per_km for row in others.records if not row.flags}
    pairs = [(row.iri_m_per_km, known.get(round(row.distance_start_m or 0.0, 1))) for row in rows.records
             if not row.flags]
    return [(found, other) for found, other in pairs if found is not None and other is not None]
