"""Many drives over the streets of a town, as rows: for what has to hold with many of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from logger.comfort.iso2631 import comfort_word
from logger.geodesy import EARTH_RADIUS_M
from logger.records import WindowRecord
from logger.roads.iso8608 import iri_class

from .logged_rows import ROW

WINDOW_M = 7.62
BLOCK_WINDOWS = 26  # 200 m
_DAY_US = 86_400_000_000


def rows_of_town(drives: int, windows: int, lat_deg: float = 46.5, lon_deg: float = 6.5, seed: int = 1
                 ) -> list[WindowRecord]:
    """Drives of so many windows each through a grid of streets, a day apart: places with a receiver's slow error,
    roughness by street with bumps on it, and figures that scatter as a log's do."""
    rng = np.random.default_rng(seed)
    rows: list[WindowRecord] = []
    for drive in range(drives):
        turns = np.repeat(rng.choice([-1, 0, 0, 1], windows // BLOCK_WINDOWS + 1), BLOCK_WINDOWS)[:windows]
        heading = np.cumsum(np.where(np.arange(windows) % BLOCK_WINDOWS == 0, turns, 0)) * np.pi / 2
        wander = np.cumsum(rng.normal(0.0, 0.08, (2, windows)), axis=1)
        east_m = np.cumsum(WINDOW_M * np.sin(heading)) + wander[0]
        north_m = np.cumsum(WINDOW_M * np.cos(heading)) + wander[1]
        lat = lat_deg + np.degrees(north_m / EARTH_RADIUS_M)
        lon = lon_deg + np.degrees(east_m / EARTH_RADIUS_M) / np.cos(np.radians(lat_deg))
        speed = 11.0 + 3.0 * np.sin(np.arange(windows) / 90.0) + rng.normal(0.0, 0.2, windows)
        iri = 3.0 * np.exp(rng.normal(0.0, 0.35, windows) + 0.4 * np.sin(np.arange(windows) / 300.0))
        iri = np.where(rng.random(windows) < 0.004, iri * 4.0, iri)
        a_w = 0.09 * iri * np.exp(rng.normal(0.0, 0.2, windows))
        lasts_s = WINDOW_M / speed
        begins_s = np.concatenate([[0.0], np.cumsum(lasts_s)[:-1]])
        for i in range(windows):
            flags = ("gps_lost",) if 40 < i % 1200 < 50 else ("clipped",) if iri[i] > 15 else ()
            rows.append(replace(
                ROW, segment=i + 1, drive=drive + 1, t_us=int(begins_s[i] * 1e6),
                utc_us=1_747_490_520_000_000 + drive * _DAY_US + int(begins_s[i] * 1e6), duration_s=float(lasts_s[i]),
                distance_start_m=WINDOW_M * i, distance_end_m=WINDOW_M * (i + 1), lat_deg=float(lat[i]),
                lon_deg=(float(lon[i]) + 180.0) % 360.0 - 180.0, speed_mps=float(speed[i]),
                iri_m_per_km=float(iri[i]), iri_std_m_per_km=float(0.2 * iri[i]), a_w_mps2=float(a_w[i]),
                a_w_std_mps2=float(0.03 * a_w[i]), mtvv_mps2=float(1.2 * a_w[i]), vdv_mps175=float(1.3 * a_w[i]),
                crest_factor=float(3.0 + rng.random()), comfort=comfort_word(float(a_w[i])),
                iri_class=iri_class(float(iri[i])), flags=flags))
    return rows
