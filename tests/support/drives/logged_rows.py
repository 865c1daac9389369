"""Rows as a service logs them, without a file."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians
from typing import Any

from logger.records import WindowRecord

ROW = WindowRecord(
    segment=1, drive=1, t_us=100_000_000, utc_us=1_747_490_520_000_000, duration_s=0.5, distance_start_m=0.0,
    distance_end_m=10.0, lat_deg=46.5, lon_deg=6.5, speed_mps=20.0, iri_m_per_km=2.0, iri_std_m_per_km=0.5,
    iri_rms_m_per_km=2.0, a_w_mps2=0.3, mtvv_mps2=0.4, vdv_mps175=0.5, crest_factor=3.0, comfort="not_uncomfortable",
    iri_class="A", accel_rms_mps2=0.5, samples=50, clipped_samples=0, flags=())


def rows_of_drive(rows: int, changes: dict[int, dict[str, Any]] | None = None, number: int = 1) -> list[WindowRecord]:
    """A drive due north, one row per 10 m and 0.5 s; ``changes`` are given by the number of the row."""
    return [replace(ROW, **{
        "segment": 1 + index, "drive": number, "t_us": 100_000_000 + index * 500_000,
        "utc_us": 1_747_490_520_000_000 + index * 500_000, "distance_start_m": 10.0 * index,
        "distance_end_m": 10.0 * index + 10.0, "lat_deg": 46.5 + (10.0 * index + 5.0) / 111_195.08,
        **(changes or {}).get(index, {})}) for index in range(rows)]


def repeated_drives(drives: int, windows: int, iri: tuple[float, ...], lat_deg: float = 46.5, lon_deg: float = 6.5
                    ) -> list[WindowRecord]:
    """Drives a day apart to the east along one street, each 1.5 m north of the one before and of an IRI of its own."""
    rows = []
    for drive in range(drives):
        for index in range(windows):
            at_us = int(index * 7.62 / 10.0 * 1e6)
            rows.append(replace(
                ROW, segment=index + 1, drive=drive + 1, t_us=at_us, utc_us=1_747_490_520_000_000
                + drive * 86_400_000_000 + at_us, duration_s=0.762, distance_start_m=index * 7.62,
                distance_end_m=(index + 1) * 7.62, lat_deg=lat_deg + drive * 1.5 / 111_195,
                lon_deg=(lon_deg + index * 7.62 / 111_195 / cos(radians(lat_deg)) + 180.0) % 360.0 - 180.0, flags=(),
                speed_mps=10.0, iri_m_per_km=iri[drive], iri_std_m_per_km=0.1 * iri[drive]))
    return rows
