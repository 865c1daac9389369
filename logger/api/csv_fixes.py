"""Speed and place out of the CSV files of a logger: fixes, and how late they are."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from logger.api.extracted_runs import Fixes
from logger.bounds import SPEED
from logger.errors import BadInput
from logger.service.config import Config
from logger.store.formats.logger_csv import PLACE, SPEED_UNITS, LoggerTable, seconds

if TYPE_CHECKING:
    from logger.estimation.receiver_delay import Belief
    from logger.extraction.even_samples import EvenSamples

_FEED_S = 10.0  # of readings at once, as they come in a car


def fixes_of(table: LoggerTable, origin_s: float, beside: LoggerTable, standing_mps: float) -> Fixes:
    """Fixes by a clock that begins at ``origin_s``, late as the receiver was.

    beside          the table of the accelerations, by the same clock
    standing_mps    a slower car stands

    Raises BadInput with the line for what cannot be, and for a speed of a unit that is not known.
    """
    from logger.extraction.held_fixes import hidden_m, new_rows, speeds_of_places

    has_places = set(PLACE) <= set(table.columns)
    has_speed = "speed" in table.columns
    roles = (*(PLACE if has_places else ()), *(("speed",) if has_speed else ()))
    needed = PLACE if has_places else ("speed",)
    times_s = seconds(table, None if table is beside else beside) - origin_s
    there = np.isfinite(times_s) & np.all([np.isfinite(table.columns[role]) for role in needed], axis=0)
    order = np.flatnonzero(there)[np.argsort(times_s[there], kind="stable")]
    order = order[np.append(True, np.diff(times_s[order]) > 0)] if len(order) else order
    time_s = times_s[order]
    nowhere = np.full(len(order), np.nan)
    lat, lon = (table.columns[role][order] if has_places else nowhere for role in PLACE)
    if (wild := (np.abs(lat) > 90) | (np.abs(lon) > 360)).any():
        row = int(np.argmax(wild))
        raise table.wrong(int(order[row]), f"expected a latitude and a longitude in degrees, found {lat[row]:g} and "
                          f"{lon[row]:g}")
    speed = table.columns["speed"][order] * _speed_scale(table) if has_speed else nowhere
    speed = np.where(speed < 0, np.nan, speed)  # programs write -1 where it is not known
    if (fast := speed > SPEED.largest).any():
        row = int(np.argmax(fast))
        raise table.wrong(int(order[row]), f"expected a speed within {SPEED.largest:g} m/s, found {speed[row]:.4g}: is "
                          "its unit right?")
    said_mps = np.where(speed >= standing_mps, speed, 0.0) if has_speed else np.full(len(order), np.inf)
    rows = new_rows(time_s, np.nan_to_num(np.stack([table.columns[role][order] for role in roles], axis=1)), said_mps,
                    hidden_m(lat, lon) if has_places and len(order) else np.inf)
    found = Fixes(time_s, speed, lat, lon).part(rows)
    if len(rows) > 1 and has_places and not np.isfinite(found.speed_mps).all():
        by_places = speeds_of_places(found.time_s, found.lat_deg, found.lon_deg)
        found = replace(found, speed_mps=np.where(np.isfinite(found.speed_mps), found.speed_mps, by_places))
    return found.part(np.isfinite(found.speed_mps))


def _speed_scale(table: LoggerTable) -> float:
    unit = table.unit("speed")
    if unit is None:
        column = table.known.columns["speed"].header
        raise BadInput(f"{table.header.path}:{table.header.line}: expected to know the unit of the speed {column}: "
                       f"give speed={column}:UNIT in --columns, one of {', '.join(SPEED_UNITS)}")
    return SPEED_UNITS[unit]


def check_speed(table: LoggerTable, fixes: Fixes) -> None:
    """BadInput where places belie the speed: its unit is another one."""
    from logger.extraction.held_fixes import way_over_speed

    if "speed" not in table.columns or not fixes.have_places:
        return
    ratio = way_over_speed(fixes.time_s, fixes.lat_deg, fixes.lon_deg, fixes.speed_mps)
    if ratio is not None:
        raise BadInput(f"{table.header.path}: expected a speed in {table.unit('speed')} that agrees with the places, "
                       f"found places {ratio:.2g} times as far apart: name its unit in --columns, speed="
                       f"{table.known.columns['speed'].header}:UNIT, one of {', '.join(SPEED_UNITS)}; or name t and "
                       "speed alone, to go without the places")


def receiver_of(config: Config, even: EvenSamples, fixes: Fixes, learns: bool) -> Belief:
    """How late fixes are: by the settings, else what is usual and what braking shows."""
    from logger.estimation.drive_alignment import DriveAlignment
    from logger.estimation.receiver_delay import combined
    from logger.service.receiver_learning import at_start

    known = at_start(config.gps, None)
    if not learns or known.std_s == 0.0:
        return known
    alignment = DriveAlignment(2, 1.0)
    heard = even.present
    time_s, samples = even.time_s[heard], even.samples[heard]
    turn = np.floor((time_s - time_s[0]) / _FEED_S)
    first = np.flatnonzero(np.diff(turn)) + 1
    ends_s = [*(time_s[0] + _FEED_S * (1 + turn[first - 1])), np.inf]
    fix = 0
    for end_s, part in zip(ends_s, np.split(np.arange(len(time_s)), first), strict=True):
        while fix < len(fixes.time_s) and fixes.time_s[fix] < end_s:
            alignment.take_fix(float(fixes.time_s[fix]), float(fixes.speed_mps[fix]))
            fix += 1
        alignment.take_readings(time_s[part], samples[part])
    found = combined(known, alignment.estimate())
    return replace(found, delay_s=max(0.0, found.delay_s))
