"""The files of a phone or of another logger into runs.

Problem: a CSV recording has its own names, units and axes, an uneven clock, and was made by a phone that lay anyhow.
Solution: columns are recognised or named (``store.formats.logger_csv``), the time is repaired, and gravity shows up and
the unit (``extraction.recorded_columns``); what is left is cut, laid on a profile and written as a dump is. What cannot
be known is refused, with the option that says it.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from math import degrees
from pathlib import Path

import numpy as np

from logger.api.extraction import RATE_HZ, Extracted, Fixes, MeasuredProfile, Recorded, apart, folder_of, write_runs
from logger.arrays import Array
from logger.bounds import ACCELERATION, LONGEST_HOLE_S, MOVING_MPS, SPEED, samples_between
from logger.dsp.repeated_samples import find_holds, resolution, still_until_s
from logger.dsp.resample import PASS_HZ
from logger.dsp.whole_record import SEEN_OF_RATE
from logger.errors import BadInput, as_bad_input
from logger.estimation.drive_alignment import DriveAlignment
from logger.estimation.receiver_delay import CarriedDelay, combined
from logger.extraction.recorded_columns import (
    GRAVITY_WITHIN,
    NO_GRAVITY_MPS2,
    EvenSamples,
    even_samples,
    felt,
    hidden_m,
    new_rows,
    speeds_of_places,
    turns,
    upwards,
    way_over_speed,
)
from logger.left_out import LeftOut
from logger.printable import Notify, counted, silent, word
from logger.runs import RecordFacts
from logger.service import wiring
from logger.service.config import Config
from logger.service.drive_readings import GridReadings
from logger.service.learning import delay_at_start
from logger.shipped import vehicle_path
from logger.store.formats.logger_csv import (
    ACCELERATION_UNITS,
    AXES,
    GRAVITY,
    PLACE,
    SPEED_UNITS,
    Header,
    LoggerTable,
    Named,
    Recognised,
    advice,
    plain,
    read_header,
    read_table,
    recognised,
    seconds,
    units_of,
)
from logger.store.formats.record_checks import still_doubts
from logger.store.formats.vehicle_file import read_model

_CUT_S = 1.0  # to either side of a turn in the mount
_LATEST_S = 1e5  # of later times the ten digits of a drive do not distinguish samples
_DISORDER_S = 0.5


@dataclass(frozen=True)
class CsvSettings:
    """What is said of recordings.

    columns      by role; None: known layouts are recognised
    location     the file with speed and place, where it is another one
    up           the axis that points up, "z" or "-z", where gravity is not in the record
    speed_mps    all the way, where none was recorded [m/s]
    vehicle      name or file, instead of the one of the settings
    """

    columns: Named | None = None
    location: Path | None = None
    up: str | None = None
    speed_mps: float | None = None
    vehicle: str | None = None


def run_name(source: Path) -> str:
    """What the first run of a recording is called."""
    return folder_of(source, source.resolve().name if source.is_dir() else source.stem)


def extract_csv(source: Path, out: Path, asked: CsvSettings, given: Config | None = None,
                measured: MeasuredProfile | None = None, tell: Notify = silent) -> Extracted:
    """Write the runs of a recording, a CSV file or a folder of such files of one recording, as ``extract_dump``.

    given       settings: the car, the receiver's delay and antenna; None: the defaults
    measured    the profile that was driven on; None: the runs have no profile

    Raises BadInput with the reason, and with what to give, for a recording of which nothing can be used.
    """
    if out.exists() and not out.is_dir():
        raise BadInput(f"{out}: expected a folder")
    recorded = recorded_csv(source, asked, given or Config(), tell)
    if measured is not None and not recorded.fixes.have_places:
        raise BadInput(f"{source}: expected latitude and longitude, which --profile needs, found a speed alone")
    return write_runs(recorded, source, run_name(source), out, measured, tell)


def recorded_csv(source: Path, asked: CsvSettings, config: Config, tell: Notify) -> Recorded:
    """All of a recording. BadInput as ``extract_csv``."""
    if asked.vehicle is not None:
        config = replace(config, vehicle=vehicle_path(asked.vehicle))
    model = wiring.car_of(config, read_model)
    tell(f"reading {source.name}")
    notes: list[str] = []
    tables = _tables(source, asked, notes)
    notes += [("" if one.header.path == source else f"{word(one.header.path.name)}: ")
              + f"{one.known.name} ({_listed(one)})" for one in tables.all()]
    time_s, samples, has_gravity = _accelerations(tables, asked, notes)
    origin_s = float(time_s[0]) if abs(time_s[-1]) > _LATEST_S else 0.0
    tell("resampling it")
    with as_bad_input(tables.acceleration.header.path):
        even = even_samples(time_s - origin_s, samples, RATE_HZ)
    roles, held = AXES if samples.shape[1] > 1 else ("up",), find_holds(time_s, samples)
    notes += [doubt.words for doubt in still_doubts(roles, time_s, samples, held) if "axis" in doubt.numbers]
    notes += _repairs(even)
    raw = _fixes(tables, asked, config, origin_s, even)
    even, still_s = _without_standstill(even, raw, notes)
    receiver = receiver_of(config, even, raw, learns=has_gravity and samples.shape[1] == 3 and asked.speed_mps is None)
    if asked.speed_mps is not None:
        receiver = replace(receiver, delay_s=0.0, std_s=0.0)
    fixes = replace(raw, time_s=raw.time_s - receiver.delay_s)
    readings = _levelled(even, asked, has_gravity, notes)
    seen_hz = SEEN_OF_RATE * even.own_hz
    facts = RecordFacts(step_mps2=_step_mps2(samples), taken_hz=None if even.as_read else even.own_hz,
                        pass_band_hz=(0.0, seen_hz) if seen_hz < PASS_HZ else None)
    return Recorded(readings, fixes, config, model, facts, receiver, tables.acceleration.is_torn, tuple(notes),
                    left_out=_left_out(even, len(time_s), still_s))


# --- files of loggers ---


@dataclass(frozen=True, eq=False)
class _Tables:
    acceleration: LoggerTable
    gravity: LoggerTable | None
    location: LoggerTable | None

    def all(self) -> list[LoggerTable]:
        """Those that there are, each once."""
        found = [self.acceleration]
        return found + [one for one in (self.gravity, self.location) if one is not None and one not in found]


def _tables(source: Path, asked: CsvSettings, notes: list[str]) -> _Tables:
    files = sorted(one for one in source.iterdir() if one.suffix.lower() == ".csv" and not one.is_symlink()
                   ) if source.is_dir() else [source]
    if not files:
        raise BadInput(f"{source}: expected a folder with CSV files, found none")
    named = asked.columns
    headers = _headers(source, files, named, notes)
    known = [(header, found) for header in headers if (found := recognised(header, named)) is not None]
    beside = [] if asked.location is None else [read_header(asked.location, named)]
    _check_named(named or {}, [*headers, *beside])
    unknown = [one.path.name for one in headers if one not in [header for header, _ in known]]
    if source.is_dir() and unknown:
        notes.append(f"not used, as ridelog knows none of its columns: {', '.join(unknown)}")
    header, felt = _acceleration(source, headers, known)
    acceleration = read_table(header, felt)
    apart = [one for one in known if one[1].has_gravity and not one[1].has_acceleration]
    gravity = read_table(*apart[0]) if len(apart) == 1 and felt.is_linear else None
    return _Tables(acceleration, gravity, _location(beside, acceleration, known, named))


def _headers(source: Path, files: list[Path], named: Named | None, notes: list[str]) -> list[Header]:
    """Of each file; of a folder, which may hold anything, those that are tables."""
    if not source.is_dir():
        return [read_header(files[0], named)]
    found = []
    for file in files:
        try:
            found.append(read_header(file, named))
        except BadInput as error:
            notes.append(f"not used: {error}")
    if not found:
        raise BadInput(notes[0].removeprefix("not used: "))
    return found


def _check_named(named: Named, headers: list[Header]) -> None:
    """BadInput for a column that somebody named and no file has: none is taken in its place."""
    there = {plain(name) for header in headers for name in header.names}
    for role, choices in named.items() if there else ():
        if not any(plain(one.header) in there for one in choices):
            found = "; ".join(f"{','.join(header.names)[:160]} in {header.path.name}" for header in headers[:2])
            raise BadInput(f"--columns: expected {role}={choices[0].header} to name a column, found none of that name "
                           f"among {found}")


def _acceleration(source: Path, headers: list[Header], known: list[tuple[Header, Recognised]]
                  ) -> tuple[Header, Recognised]:
    able = [one for one in known if one[1].has_acceleration and "t" in one[1].columns]
    whole = [one for one in able if not one[1].is_linear] or able
    if len(whole) > 1:
        raise BadInput(f"{source}: expected one file with accelerations, found "
                       f"{' and '.join(one[0].path.name for one in whole)}: give one of them and --location FILE")
    if not whole:
        if len(headers) == 1 and not headers[0].names:
            raise _no_header(headers[0])
        names = headers[0].names if len(headers) == 1 else ()
        found = ",".join(names)[:160] if names else f"{len(headers)} files, none with columns that ridelog knows"
        where = f"{headers[0].path}:{headers[0].line}" if names else source
        raise BadInput(f"{where}: expected columns of a known program, or named ones, with "
                       f"time and three axes (or up), found {found}: give {advice(names)}")
    return whole[0]


def _no_header(header: Header) -> BadInput:
    """What to do with a file of which no line names the columns."""
    count = len(header.table.found.split(header.table.delimiter))
    names = ("time", "up") if count == 2 else ("time", "x", "y", "z", *(f"c{n}" for n in range(5, count + 1)))
    return header.table.no_header(f"a line with names of columns, such as {','.join(names[:count])}", advice(names))


def _location(beside: list[Header], acceleration: LoggerTable, known: list[tuple[Header, Recognised]],
              named: Named | None) -> LoggerTable | None:
    for header in beside:
        if not header.names:
            raise header.table.no_header("a line with names of columns, such as time,lat,lon,speed",
                                         advice(("time", "lat", "lon", "speed")))
        found = recognised(header, named)
        if found is None or not found.has_location or "t" not in found.columns:
            raise BadInput(f"{header.path}:{header.line}: expected columns with time and a speed, or latitude and "
                           f"longitude, found {','.join(header.names)[:160]}: give {advice(header.names)}")
        return read_table(header, found)
    if acceleration.known.has_location:
        return acceleration
    able = [one for one in known if one[1].has_location and "t" in one[1].columns]
    if len(able) > 1:
        raise BadInput(f"{able[0][0].path.parent}: expected one file with speed and position, found "
                       f"{' and '.join(one[0].path.name for one in able)}: give one of them as --location")
    return read_table(*able[0]) if able else None


def _listed(table: LoggerTable) -> str:
    words = (f"{role}={word(column.header)}" + (f":{column.unit}" if column.unit else "")
             for role, column in table.known.columns.items())
    return ", ".join(words)


# --- accelerations ---


def _accelerations(tables: _Tables, asked: CsvSettings, notes: list[str]) -> tuple[Array, Array, bool]:
    """Times (n,) [s], samples (n, axes) [m/s2], and whether gravity is in them."""
    table = tables.acceleration
    roles = AXES if "x" in table.columns else ("up",)
    time_s, samples = _ordered(table, seconds(table), roles, notes)
    if len(time_s) < 2:
        raise BadInput(f"{table.header.path}: expected rows with a time and an acceleration, found {len(time_s)}")
    unit = _one_unit(table, roles)
    is_said = asked.up is not None or table.known.is_linear
    apart = tables.gravity or (table if "gx" in table.columns else None)
    has_it = not is_said and felt(time_s, samples, ACCELERATION_UNITS.get(unit or "")).unit_mps2 is not None
    if apart is not None and not has_it and asked.up is None:
        gravity_s, gravity = _ordered(apart, seconds(apart, table), GRAVITY, [])
        gravity_unit = _one_unit(apart, GRAVITY) or unit
        if unit is None or gravity_unit is None:
            raise BadInput(f"{table.header.path}: expected units of accelerations and gravity, to add the two, found "
                           "none: name both in --columns, as in x=X:m/s2,gx=GX:m/s2")
        gravity = np.stack([np.interp(time_s, gravity_s, axis) for axis in gravity.T], axis=1)
        samples = ACCELERATION_UNITS[unit] * samples + ACCELERATION_UNITS[gravity_unit] * gravity
        unit, is_said = "m/s2", False
    return time_s, *_in_si(table, time_s, samples, unit, is_said, roles, asked, notes)


def _one_unit(table: LoggerTable, roles: tuple[str, ...]) -> str | None:
    units = sorted({unit for role in roles if (unit := table.unit(role)) is not None})
    if len(units) > 1:
        raise BadInput(f"{table.header.path}:{table.header.line}: expected one unit for {', '.join(roles)}, found "
                       f"{' and '.join(units)}")
    return units[0] if units else None


def _in_si(table: LoggerTable, time_s: Array, samples: Array, unit: str | None, is_linear: bool,
           roles: tuple[str, ...], asked: CsvSettings, notes: list[str]) -> tuple[Array, bool]:
    """Samples in m/s2, and whether gravity is in them. A unit that is said holds; the size of gravity shows one only
    where none is. ``is_linear``: gravity was taken out, as the layout or --up says."""
    path, of_g = table.header.path, ACCELERATION_UNITS["g"]
    named = f"{roles[0]}={table.known.columns[roles[0]].header}:UNIT"
    found = felt(time_s, samples, ACCELERATION_UNITS.get(unit or ""))
    if unit is None and (is_linear or found.unit_mps2 is None):
        raise BadInput(f"{path}: expected " + ("a unit or gravity to recognise it by, found neither" if is_linear else
                       f"gravity near 9.8 (m/s2) or 1 (g), by which to recognise the unit, found a mean of "
                       f"{found.size:.3g}") + f": name the unit in --columns, {named}, one of "
                       f"{', '.join(units_of(roles[0]))}")
    if unit is None:
        unit = next(one for one, scale in ACCELERATION_UNITS.items() if np.isclose(scale, found.unit_mps2 or 0.0))
        notes.append(f"unit recognised by the size of gravity: {unit}")
    samples, size_mps2 = samples * ACCELERATION_UNITS[unit], found.size * ACCELERATION_UNITS[unit]
    if found.unit_mps2 is not None:
        if asked.up is not None:
            raise BadInput(f"{path}: expected a record without gravity for --up, found gravity of {size_mps2:.3g} "
                           "m/s2, which shows which way is up: leave out --up")
        return samples, True
    if (asked.up is None if roles == AXES else not is_linear and size_mps2 >= NO_GRAVITY_MPS2):
        likely = next((one for one in ACCELERATION_UNITS if one != unit and abs(
            found.size * ACCELERATION_UNITS[one] / of_g - 1) < GRAVITY_WITHIN), None) if not is_linear else None
        also = f", or, if the unit {unit} is wrong, name it: {named.removesuffix('UNIT')}{likely}" if likely else ""
        raise BadInput(f"{path}: expected gravity in the accelerations, by which to level them, found a mean of "
                       f"{size_mps2:.3g} m/s2. Record with gravity (\"with g\", total or raw acceleration), or record "
                       f"gravity as well, or name the axis that points up: --up z (or -z, x, ...){also}")
    return samples, False


def _ordered(table: LoggerTable, times_s: Array, roles: tuple[str, ...], notes: list[str]) -> tuple[Array, Array]:
    """Times (n,) that do not decrease and the columns (n, r) of the rows in which all are there."""
    values = np.stack([table.columns[role] for role in roles], axis=1)
    rows = np.flatnonzero(np.isfinite(times_s) & np.isfinite(values).all(axis=1))
    time_s, values = times_s[rows], values[rows]
    for column, role in enumerate(roles):
        values[:, column] = ACCELERATION.taken(table.known.columns[role].header, values[:, column],
                                               lambda row: f"{table.header.path}:{table.lines[rows[row]]}")
    back_s = np.maximum.accumulate(time_s) - time_s if len(time_s) else time_s
    if (back_s > _DISORDER_S).any():
        row = int(np.argmax(back_s > _DISORDER_S))
        raise table.wrong(int(rows[row]), f"expected increasing times, found one {back_s[row]:.3g} s earlier than one "
                          "before: the clock was set back; cut the file there")
    if back_s.any():
        notes.append(f"{table.header.path.name}: {np.count_nonzero(back_s)} rows were out of order; sorted by time")
        order = np.argsort(time_s, kind="stable")
        time_s, values = time_s[order], values[order]
    twice = np.append(False, (np.diff(time_s) == 0) & (np.diff(values, axis=0) == 0).all(axis=1)) if len(
        time_s) else np.zeros(0, dtype=np.bool_)
    if twice.any():
        notes.append(f"{table.header.path.name}: {np.count_nonzero(twice)} duplicate rows were dropped")
    return time_s[~twice], values[~twice]


def _left_out(even: EvenSamples, count: int, still_s: float) -> tuple[LeftOut, ...]:
    """Of so many samples, and of as many seconds at the beginning in which nothing moved."""
    still = LeftOut(sum(even.holds_s) + still_s, "s", "in which the sensor was frozen on all axes")
    if even.holds_s:
        return (still,)
    return still, LeftOut(even.repeats * count, "sample", "that only repeated the one before")


def _repairs(even: EvenSamples) -> list[str]:
    notes = []
    if even.repeats > 0:
        notes.append(f"{even.repeats:.0%} of the samples only repeated the one before and were dropped: "
                     f"the sensor gave {even.own_hz:.4g} Hz")
    if even.holds_s and even.repeats > 0:
        places = counted(len(even.holds_s), "place")
        notes[-1:] = [f"the sensor was frozen on all axes for {sum(even.holds_s):.3g} s in {places}, the longest "
                      f"{max(even.holds_s):.3g} s; those samples are left out"]
    if not even.as_read:
        notes.append(f"{even.own_hz:.4g} samples a second, resampled to an even {RATE_HZ:g} Hz")
    if (seen_hz := SEEN_OF_RATE * even.own_hz) < PASS_HZ:
        notes.append(f"shows nothing above {seen_hz:.0f} Hz: the lab may name sensor_bandwidth for that")
    if even.clipped.any():
        notes.append(f"{np.count_nonzero(even.clipped)} samples at an end of the sensor's range, marked in the column "
                     "usable")
    if not even.present.all():
        notes.append(f"{np.count_nonzero(~even.present) / RATE_HZ:.2g} s in gaps between samples, marked in the "
                     "column usable")
    return notes


def _without_standstill(even: EvenSamples, fixes: Fixes, notes: list[str]) -> tuple[EvenSamples, float]:
    """Without what a sensor said that stood still from the beginning, while the car drove; and how long it did [s]."""
    still = even.time_s <= still_until_s(even.time_s, even.samples)
    still &= np.interp(even.time_s, fixes.time_s, fixes.speed_mps) >= MOVING_MPS if len(fixes.time_s) else False
    if (lasts_s := np.count_nonzero(still) / RATE_HZ) <= LONGEST_HOLE_S:
        return even, 0.0
    notes.append(f"the sensor was frozen on all axes for the first {lasts_s:.3g} s, while the car drove; left out")
    return replace(even, present=even.present & ~still), lasts_s


def _levelled(even: EvenSamples, asked: CsvSettings, has_gravity: bool, notes: list[str]) -> GridReadings:
    """What points up, part by part where the recorder turned in its mount."""
    time_s, present = even.time_s, even.present.copy()
    accel = np.zeros(len(time_s))
    if not has_gravity:
        column = 0 if asked.up is None or even.samples.shape[1] == 1 else "xyz".index(asked.up[-1])
        accel = even.samples[:, column] * (-1.0 if (asked.up or "").startswith("-") else 1.0)
        return GridReadings(time_s, accel, present, even.clipped)
    heard = np.flatnonzero(present)
    turned = turns(time_s[heard], even.samples[heard]) if even.samples.shape[1] == 3 else []
    for at_s, words in turned:
        notes.append(f"at {at_s:.0f} s {words} in its mount: extract cut the record there and levelled it again")
        present &= np.abs(time_s - at_s) > _CUT_S
    ends_s = [-np.inf, *(at_s for at_s, _ in turned), np.inf]
    tilts = []
    for begin_s, end_s in pairwise(ends_s):
        part = (time_s > begin_s) & (time_s <= end_s)
        known = part & present
        if not known.any():
            continue
        level, tilt_rad = upwards(time_s[known], even.samples[known])
        accel[part] = np.interp(time_s[part], time_s[known], level)
        tilts.append(f"{degrees(tilt_rad):.0f}")
    if even.samples.shape[1] == 3:
        notes.append(f"levelled by gravity, which is {' and '.join(tilts)} degrees off the nearest axis")
    return GridReadings(time_s, accel, present, even.clipped)


def _step_mps2(samples: Array) -> float | None:
    """What readings (n, axes) are rounded to, by the axis along which gravity is felt most; None: they are not."""
    axis = samples[:, int(np.argmax(np.abs(samples.mean(axis=0))))]
    return resolution(axis) or None if len(np.unique(axis)) < 0.5 * len(axis) else None


# --- speed and place ---


def _fixes(tables: _Tables, asked: CsvSettings, config: Config, origin_s: float, even: EvenSamples) -> Fixes:
    """Fixes as they are written, late as the receiver was."""
    path = tables.acceleration.header.path
    if asked.speed_mps is not None:
        samples_between(even.time_s[-1] - even.time_s[0], 1.0, str(path))
        time_s = np.arange(even.time_s[0], even.time_s[-1], 1.0)
        nowhere = np.full(len(time_s), np.nan)
        return Fixes(time_s, np.full(len(time_s), asked.speed_mps), nowhere, nowhere)
    table = tables.location
    if table is None:
        raise BadInput(f"{path}: expected a speed, or latitude and longitude, found neither: ridelog extract --csv "
                       "takes them from a file (--location FILE), named columns (--columns), or a steady speed "
                       "(--speed M/S)")
    found = fixes_of(table, origin_s, tables.acceleration, config.pipeline.stationary_mps)
    span_s = (even.time_s[0], even.time_s[-1])
    inside = (found.time_s >= span_s[0] - 1.0) & (found.time_s <= span_s[1] + 1.0)
    if np.count_nonzero(inside) < 2:
        said = "none" if not len(found.time_s) else (
            f"fixes from {found.time_s[0]:.6g} to {found.time_s[-1]:.6g} s and accelerations from {span_s[0]:.6g} "
            f"to {span_s[1]:.6g} s")
        raise BadInput(f"{table.header.path}: expected fixes by the clock of {path.name}, in the same period, found "
                       f"{said}")
    found = found.of(inside)
    check_speed(table, found)
    return found.of(apart(found.time_s))


_FEED_S = 10.0  # of readings at once, as they come in a car


def fixes_of(table: LoggerTable, origin_s: float, beside: LoggerTable, standing_mps: float) -> Fixes:
    """Fixes by a clock that begins at ``origin_s``, late as the receiver was.

    beside          the table of the accelerations, by the same clock
    standing_mps    a slower car stands

    Raises BadInput with the line for what cannot be, and for a speed of a unit that is not known.
    """
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
    found = Fixes(time_s, speed, lat, lon).of(rows)
    if len(rows) > 1 and has_places and not np.isfinite(found.speed_mps).all():
        by_places = speeds_of_places(found.time_s, found.lat_deg, found.lon_deg)
        found = replace(found, speed_mps=np.where(np.isfinite(found.speed_mps), found.speed_mps, by_places))
    return found.of(np.isfinite(found.speed_mps))


def _speed_scale(table: LoggerTable) -> float:
    unit = table.unit("speed")
    if unit is None:
        column = table.known.columns["speed"].header
        raise BadInput(f"{table.header.path}:{table.header.line}: expected a unit of the speed {column}, found none: "
                       f"give speed={column}:UNIT in --columns, one of {', '.join(SPEED_UNITS)}")
    return SPEED_UNITS[unit]


def check_speed(table: LoggerTable, fixes: Fixes) -> None:
    """BadInput where places belie the speed: its unit is another one."""
    if "speed" not in table.columns or not fixes.have_places:
        return
    ratio = way_over_speed(fixes.time_s, fixes.lat_deg, fixes.lon_deg, fixes.speed_mps)
    if ratio is not None:
        raise BadInput(f"{table.header.path}: expected a speed in {table.unit('speed')} that agrees with the positions"
                       f", found positions {ratio:.2g} times as far apart. Name its unit in --columns, speed="
                       f"{table.known.columns['speed'].header}:UNIT, one of {', '.join(SPEED_UNITS)}; or name t and "
                       "speed alone, to go without positions")


def receiver_of(config: Config, even: EvenSamples, fixes: Fixes, learns: bool) -> CarriedDelay:
    """How late fixes are: by the settings, else what is usual and what braking shows."""
    known = delay_at_start(config.gps, None)
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
