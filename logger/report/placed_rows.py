"""Rows of logs that have a place, as arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from logger.chart_data import Array
from logger.records import WindowRecord
from logger.roads.road_network import Trace
from logger.roads.window_errors import WindowErrors
from logger.units import US_PER_S

_NOT_PLACED = frozenset(("gps_lost", "gps_late"))


def placed(one: WindowRecord) -> bool:
    """Whether a row has a place that the receiver gave, and a length."""
    return (one.lat_deg is not None and one.lon_deg is not None and one.distance_start_m is not None
            and one.distance_end_m is not None and one.distance_end_m > one.distance_start_m
            and _NOT_PLACED.isdisjoint(one.flags))


def trace_of(drive: Sequence[WindowRecord]) -> Trace:
    """Rows of a drive as they are laid on roads."""
    return Trace(column(drive, lambda one: one.lat_deg), column(drive, lambda one: one.lon_deg),
                 column(drive, lambda one: ((one.distance_start_m or 0.0) + (one.distance_end_m or 0.0)) / 2),
                 column(drive, lambda one: one.t_us / US_PER_S))


def column(rows: Sequence[WindowRecord], of: Callable[[WindowRecord], float | None]) -> Array:
    """Of each row one number, NaN for None."""
    return np.array([np.nan if (value := of(one)) is None else value for one in rows], dtype=np.float64)


def iri_errors(rows: Sequence[WindowRecord]) -> WindowErrors:
    """Standard errors of their IRI."""
    return WindowErrors(
        column(rows, lambda one: one.iri_std_m_per_km), column(rows, lambda one: one.iri_level_std_m_per_km),
        column(rows, lambda one: one.iri_common_std_m_per_km), column(rows, lambda one: one.iri_place_std_m_per_km))
