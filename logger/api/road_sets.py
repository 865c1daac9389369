"""What the studies of public records of real roads share: what a folder has to hold, a pass through the program's own
path, and what is shown: the car beside the profiler, road by road, and what the best could reach.

Every file of ``logger/api/datasets`` knows one set and offers a study of it: it reads the folder that a person
downloaded and compares what ridelog says of the car's acceleration with what a profiler measured. Nothing of a set is
kept here.

Problem: a figure of a data set says something of the program only if the program's own path was gone: a reader that
filters, levels and aligns by itself measures itself. Solution: a pass is written as the CSV files that a phone would
have left, ``extract --csv`` makes its runs, ``estimate`` its windows; what is left here is where each window lies.

A factor, where one is fitted, is fitted on the other roads and judged on this one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

import numpy as np
from scipy.ndimage import uniform_filter1d

from logger.api.csv_extraction import CsvSettings, extract_csv
from logger.api.drives import Run, assessed, read_run, sensor_of
from logger.api.extraction import read_measured_profile
from logger.chart_data import Array, Curves, Line
from logger.errors import BadInput
from logger.extraction.along_track import MeasuredLine, passes
from logger.report.quantities import known as known_number
from logger.roads.repeated_drives import Agreement, agreement, factor_to
from logger.shipped import vehicle_path
from logger.store.formats.drive_file import write_table
from logger.store.formats.logger_csv import named_columns
from logger.store.formats.vehicle_file import CarModel, read_model
from logger.studies.study import Cell, Column, Result, Table, Workload

NOT_RUN = "Only a person can download the real files; ridelog's developers have not run them and make no claims."


def from_folder(called: str, download: str, read: Callable[[Path, Workload], Result]) -> Callable[[Workload], Result]:
    """A study's ``run`` that reads a folder: where that is not what it should be, it says where to download it.

    ``read`` raises FileNotFoundError for a file that is not there, and BadInput for one that is something else.
    """
    def run(effort: Workload) -> Result:
        if effort.folder is None or not effort.folder.is_dir():
            found = "a file" if effort.folder is not None and effort.folder.exists() else "nothing there"
            raise BadInput(f"{effort.folder}: expected a folder with {called}, found {found}: {download}")
        if effort.vehicle is not None:
            read_model(vehicle_path(effort.vehicle))  # refused now, not after an hour
        try:
            return read(effort.folder, effort)
        except FileNotFoundError as error:
            raise BadInput(f"{error}: {download}") from None

    return run


def expected_files(folder: Path, pattern: str, what: str) -> list[Path]:
    """Files of a pattern anywhere below a folder, in order of their names. FileNotFoundError with what was expected."""
    found = sorted(one for one in folder.rglob(pattern) if one.is_file())
    if not found:
        raise FileNotFoundError(f"{folder}: expected {what} ({pattern}), found none")
    return found


T = TypeVar("T")

WINDOWS_M = (10.0, 100.0)
"""What profilers report, and what roads are judged by."""
_FIX_S, _SMOOTH_FIXES = 1.0, 21
_BETWEEN_UNITS = 5.0  # gravity is 1 g or 9.8 m/s2


@dataclass(frozen=True, eq=False)
class RoadRecording:
    """What a device in a car wrote, each signal by one clock [s].

    name        of the pass
    time_s      (n,) of the accelerations; accel (n, 3), along the device's own axes, gravity in it
    unit        of the accelerations, as ``extract --columns`` names it
    fix_s       (k,) of speed [m/s] and place [degrees], (k,) each
    """

    name: str
    time_s: Array
    accel: Array
    unit: str
    fix_s: Array
    speed_mps: Array
    lat_deg: Array
    lon_deg: Array


@dataclass(frozen=True, eq=False)
class DrivenWindows:
    """Windows (w,) of one drive.

    begin_m, end_m      of the drive's distance, or of the line's where the pass was laid on one
    begin_deg, end_deg  (w, 2) latitude and longitude of the ends
    exact_m_per_km      IRI of the line's own profile there; NaN where none is known
    """

    window_m: float
    begin_m: Array
    end_m: Array
    begin_deg: Array
    end_deg: Array
    speed_mps: Array
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    exact_m_per_km: Array


def unit_by_gravity(accel: Array) -> str:
    """The unit of accelerations (n, 3) that hold gravity: ``g`` or ``m/s2``, by the middle of their lengths."""
    return "g" if float(np.median(np.linalg.norm(accel, axis=1))) < _BETWEEN_UNITS else "m/s2"


def driven_windows(recording: RoadRecording, vehicle: str, windows_m: tuple[float, ...] = WINDOWS_M,
                   profile: Path | None = None) -> list[DrivenWindows]:
    """The windows of a pass, for each length those of all its drives; the sensor's noise is learnt from each drive.

    profile    the measured line, with places, on which the pass is laid

    Raises BadInput for a recording of which nothing can be used.
    """
    model = read_model(vehicle_path(vehicle))
    return [one for run in runs_of(recording, vehicle, profile) for one in windows_of(run, model, windows_m)]


def runs_of(recording: RoadRecording, vehicle: str, profile: Path | None = None) -> list[Run]:
    """The drives of a pass, as ``extract --csv`` makes them. Raises BadInput."""
    with TemporaryDirectory() as scratch:
        return _runs(recording, Path(scratch), vehicle, profile)


def on_line(run: Run, line: MeasuredLine, from_m: float) -> list[Run]:
    """A drive on a line's own distance, less ``from_m``, by its places alone: a run for each pass over the line.

    Where the receiver puts the car along the line is averaged over ``_SMOOTH_FIXES`` fixes: between them the speed
    shows the way better.
    """
    if run.lat_deg is None or run.lon_deg is None:
        return []
    every = np.arange(0, len(run.time_s), round(run.rate_hz * _FIX_S))
    along_m, aside_m = line.passed(run.lat_deg[every], run.lon_deg[every])
    found = []
    for one in passes(run.distance_m[every], along_m, aside_m):
        at = every[one.first: one.last]
        offset_m = (along_m - run.distance_m[every])[one.first: one.last]
        smooth_m = uniform_filter1d(offset_m, min(_SMOOTH_FIXES, len(offset_m)), mode="nearest")
        part = slice(at[0], at[-1] + 1)
        shift_m = np.interp(run.time_s[part], run.time_s[at], smooth_m)
        found.append(replace(
            run, time_s=run.time_s[part], accel_z_mps2=run.accel_z_mps2[part], speed_mps=run.speed_mps[part],
            distance_m=run.distance_m[part] + shift_m - from_m, lat_deg=run.lat_deg[part], lon_deg=run.lon_deg[part],
            usable=None if run.usable is None else run.usable[part]))
    return found


def _runs(recording: RoadRecording, scratch: Path, vehicle: str, profile: Path | None) -> list[Run]:
    feeling, fixes = scratch / f"{recording.name}.csv", scratch / "fixes.csv"
    _write(feeling, "t_s,x,y,z", recording.time_s, *recording.accel.T)
    _write(fixes, "t_s,lat_deg,lon_deg,speed", recording.fix_s, recording.lat_deg, recording.lon_deg,
           recording.speed_mps)
    axes = ",".join(f"{axis}={axis}:{recording.unit}" for axis in "xyz")
    asked = CsvSettings(named_columns(f"t=t_s:s,{axes},lat=lat_deg,lon=lon_deg,speed=speed:m/s"), fixes,
                        vehicle=vehicle)
    measured = None if profile is None else read_measured_profile(profile)
    try:
        done = extract_csv(feeling, scratch / "runs", asked, measured=measured)
    except BadInput as error:  # in a folder that is gone when the line is read
        raise BadInput(str(error).replace(str(scratch) + "/", "")) from None
    return [read_run(one.run) for one in done.runs]


def _write(path: Path, header: str, *columns: Array) -> None:
    rows = np.column_stack(columns)
    write_table(path, header.split(","), rows[np.isfinite(rows).all(axis=1)], "%.12g")


def windows_of(run: Run, model: CarModel, windows_m: tuple[float, ...] = WINDOWS_M) -> list[DrivenWindows]:
    """The windows of a drive, for each length; noise is learnt once. Raises BadInput."""
    sensor, learns = sensor_of(run)
    found = []
    for window_m in windows_m:
        one = assessed(run, model, sensor, learns, window_m, anyway=True)
        sensor, learns = one.sensor, False  # learnt once
        edges_m = one.windows.edges_m
        if len(edges_m) < 2:
            continue
        at_s = np.interp(edges_m, run.distance_m, run.time_s)
        places = np.column_stack([np.interp(at_s, run.time_s, axis) for axis in (run.lat_deg, run.lon_deg)
                                  if axis is not None])
        found.append(DrivenWindows(window_m, edges_m[:-1], edges_m[1:], places[:-1], places[1:], one.windows.speed_mps,
                                   one.windows.iri_m_per_km, one.windows.iri_std_m_per_km, one.exact_m_per_km))
    return found


def each_pass(passes: list[RoadRecording], windows: Callable[[RoadRecording], list[T]],
              progress: Callable[[int, int], None]
              ) -> tuple[list[T], list[str]]:
    """The windows of every pass that can be used, and a line for each that cannot, with its name."""
    found: list[T] = []
    refused: list[str] = []
    for done, one in enumerate(passes):
        progress(done, len(passes))
        try:
            found += windows(one)
        except BadInput as error:
            refused.append(f"{one.name}: {error}")
    progress(len(passes), len(passes))
    return found, refused


REPEAT_R2 = {10.0: (0.60, 0.82), 100.0: (0.91, 0.97)}
"""R2 between passes of one profiler over 26 km, the lowest and the highest of three pairs that are laid together in two
ways: ``ridelog study lira-map`` on peacefulotter/LiRA-Map (MIT)."""
COLUMNS = (
    Column("road"), Column("compared"), Column("windows", ".0f"), Column("R2", ".3f"), Column("R2 of log IRI", ".3f"),
    Column("MAE [m/km]", ".3f"), Column("bias", "+.1%"), Column("within 1 std. error (68%)", ".0%"),
    Column("within 2 (95%)", ".0%"))
REPEAT_COLUMNS = (*COLUMNS[:7], Column("correlation squared", ".3f"), Column("r.m.s. difference [m/km]", ".3f"),
                  Column("moved by [m]", "+.0f"))


@dataclass(frozen=True, eq=False)
class Compared:
    """Windows (n,) of one length on one road: estimates, their standard errors, the reference, and where along."""

    road: str
    window_m: float
    at_m: Array
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    reference_m_per_km: Array
    what: str = "car"


def compared_table(parts: list[Compared], window_m: float) -> Table:
    """A row for each road, as it is and multiplied by the other roads' factor; then all roads together."""
    chosen = [one for one in parts if one.window_m == window_m]
    rows = []
    for one in chosen:
        rows.append(_row(one.road, one.what, agreement(one.iri_m_per_km, one.iri_std_m_per_km, one.reference_m_per_km)))
        others = [other for other in chosen if other.road != one.road and other.what == one.what]
        if others:
            factor = factor_to(*(np.concatenate([getattr(other, name) for other in others])
                                 for name in ("iri_m_per_km", "reference_m_per_km")))
            rows.append(_row(one.road, f"{one.what}, scaled by {factor:.3g} (from the other roads)", agreement(
                factor * one.iri_m_per_km, factor * one.iri_std_m_per_km, one.reference_m_per_km)))
    return Table(f"Windows of {window_m:g} m", COLUMNS, tuple(rows))


def repeat_row(road: str, what: str, mine: Array, theirs: Array, moved_m: float = 0.0) -> tuple[Cell, ...]:
    """A profiler beside itself or another, over windows (n,): a row of ``REPEAT_COLUMNS``."""
    found = _row(road, what, agreement(mine, None, theirs))
    known = np.isfinite(mine) & np.isfinite(theirs)
    if found[3] is None:
        return (*found[:7], None, None, moved_m)
    squared = float(np.corrcoef(mine[known], theirs[known])[0, 1] ** 2)
    return (*found[:7], squared, float(np.sqrt(np.mean((mine - theirs)[known] ** 2))), moved_m)


def _row(road: str, what: str, found: Agreement | None) -> tuple[Cell, ...]:
    if found is None:
        return (road, what, 0.0, None, None, None, None, None, None)
    numbers = (found.r2, found.r2_log, found.mae_m_per_km, found.bias, found.within_one, found.within_two)
    return (road, what, float(found.windows), *map(known_number, numbers))


def along(part: Compared) -> Curves:
    """The road as the profiler and as the car have it; of several passes over a place, their mean."""
    at_m, passes = np.unique(np.round(part.at_m, 1), return_inverse=True)
    lines = []
    for name, values in (("profiler", part.reference_m_per_km), ("car", part.iri_m_per_km)):
        known = np.isfinite(values)
        count = np.bincount(passes[known], minlength=len(at_m))
        mean = np.bincount(passes[known], values[known], len(at_m)) / np.maximum(count, 1)
        lines.append(Line(name, at_m[count > 0], mean[count > 0], dots=name == "profiler"))
    return Curves(f"{part.road}: IRI over {part.window_m:g} m", "along the road [m]", "IRI [m/km]", tuple(lines))


def verdict_of(parts: list[Compared], refused: list[str], repeat: str) -> str:
    """How well all roads together agree, in sentences."""
    words = []
    for window_m in sorted({one.window_m for one in parts}):
        chosen = [one for one in parts if one.window_m == window_m and one.what == "car"]
        found = agreement(*(np.concatenate([getattr(one, name) for one in chosen]) for name in (
            "iri_m_per_km", "iri_std_m_per_km", "reference_m_per_km")))
        if found is not None:
            words.append(f"All roads, {window_m:g} m: R2 {found.r2:.2f}, off by {found.mae_m_per_km:.2f} m/km on "
                         f"average, bias {found.bias:+.0%}, {found.within_two:.0%} within two standard errors.")
    if not words:
        words.append("Too few windows lie on the profiled roads for a figure.")
    words.append(repeat)
    if refused:
        words.append(f"Not used: {len(refused)}, the first {refused[0]}".rstrip(".") + ".")
    return " ".join(words)
