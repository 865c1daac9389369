"""What the studies of public records share. Of real roads: what a folder has to hold, a pass through the program's own
path, and what is shown: the car beside the profiler, road by road, and what the best could reach.

Every file of ``logger/api/datasets`` knows one set and offers a study of it: it reads the folder that a person
downloaded and compares what ridelog says of the car's acceleration with what a profiler measured. Nothing of a set is
kept here.

Problem: a figure of a data set says something of the program only if the program's own path was gone: a reader that
filters, levels and aligns by itself measures itself. Solution: a pass is written as the CSV files that a phone would
have left, ``extract --csv`` makes its runs, ``estimate`` its windows; what is left here is where each window lies.

A factor, where one is fitted, is fitted on the other roads and judged on this one.

Of test rigs: files, runs, the lab's own path, and pictures. The record is written as the run folders and the vehicle's
file that a user would write; ``diagnose`` names what is missing, ``add_effect`` adds that, one after the other, and
what is left here is the picture and the published figures beside.
"""

import gzip
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

import numpy as np
from scipy.ndimage import uniform_filter1d

from logger.api.csv_recording import CsvSettings, extract_csv
from logger.api.drives import assessed, sensor_of
from logger.api.extraction import read_measured_profile
from logger.api.inputs import Model, Run, read_run, read_vehicle
from logger.api.lab.bench import bench_with
from logger.api.lab.compare import AddedEffect, add_effect
from logger.api.lab.diagnose import Diagnosis, diagnose
from logger.api.lab.question import CompareQuestion
from logger.chart_data import Array, Curves, Line, line
from logger.errors import BadInput
from logger.extraction.along_track import MeasuredLine, passes
from logger.files import make_folder, read_bounded, write_text, written_files
from logger.report.quantities import known as known_number
from logger.roads.repeated_drives import Agreement, agreement, factor_to
from logger.shipped import vehicle_path
from logger.store.formats.csv_table import columns_of
from logger.store.formats.drive_file import write_table
from logger.store.formats.logger_csv import named_columns
from logger.store.formats.mat_file import read_arrays
from logger.store.formats.record_file import MAX_BYTES
from logger.store.formats.vehicle_file import CarModel, read_model
from logger.studies.study import Cell, Item, Picture, Result, Study, Table, Workload
from logger.vehicle.compose import compose

NOT_RUN = "Only a person can download the real files; ridelog's developers have not run them and make no claims."


def study_of(called: str, download: str, title: str, where: str, how: str, *items: Item, source: str,
             is_rig: bool = False) -> Callable[[Callable[[Path, Workload], Result]], Study]:
    """Makes what reads a folder the study of its name: where that is not what it should be, it says where to download
    it. A rig has a vehicle's file of its own.

    The function raises FileNotFoundError for a file that is not there, and BadInput for one that is something else.
    """
    def of(read: Callable[[Path, Workload], Result]) -> Study:
        def run(effort: Workload) -> Result:
            if is_rig and effort.vehicle is not None:
                raise BadInput(f"study: expected no --vehicle, as the rig is known, found {effort.vehicle}")
            if effort.folder is None or not effort.folder.is_dir():
                found = "a file" if effort.folder is not None and effort.folder.exists() else "nothing there"
                raise BadInput(f"{effort.folder}: expected a folder with {called}, found {found}: {download}")
            if effort.vehicle is not None:
                read_model(vehicle_path(effort.vehicle))  # refused now, not after an hour
            try:
                return read(effort.folder, effort)
            except FileNotFoundError as error:
                raise BadInput(f"{error}: {download}") from None

        return Study(read.__name__, title, where, how, run, items, source, f"{called} ({download})")

    return of


def expected_files(folder: Path, pattern: str, what: str) -> list[Path]:
    """Files of a pattern anywhere below a folder, in order of their names. FileNotFoundError with what was expected."""
    found = sorted(one for one in folder.rglob(pattern) if one.is_file())
    if not found:
        raise FileNotFoundError(f"{folder}: expected {what} ({pattern}), found none")
    return found


T = TypeVar("T")

WINDOWS_M = (10.0, 100.0)
"""What profilers report, and what roads are judged by."""
FIX_S, _SMOOTH_FIXES = 1.0, 21  # receivers of phones have a place a second
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
    """The windows of a pass, for each length those of all its drives; the sensor's noise is learned from each drive.

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
    every = np.arange(0, len(run.time_s), round(run.rate_hz * FIX_S))
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
    """The windows of a drive, for each length; noise is learned once. Raises BadInput."""
    sensor, learns = sensor_of(run)
    found = []
    for window_m in windows_m:
        one = assessed(run, model, sensor, learns, window_m, anyway=True)
        sensor, learns = one.sensor, False  # learned once
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
    "road", "compared", "windows .0f", "R2 .3f", "R2 of log IRI .3f", "MAE [m/km] .3f", "bias +.1%",
    "within 1 std. error (68%) .0%", "within 2 (95%) .0%")
REPEAT_COLUMNS = (*COLUMNS[:7], "correlation squared .3f", "r.m.s. difference [m/km] .3f", "moved by [m] +.0f")


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
        words.append("Too few windows lie on the profiled roads to give a figure.")
    words.append(repeat)
    if refused:
        words.append(f"Not used: {len(refused)}, the first {refused[0]}".rstrip(".") + ".")
    return " ".join(words)


_BLOCKS = 16  # of a spectrum: its levels are known to a quarter


def columns_in(folder: Path, pattern: str, what: str, names: Mapping[str, Sequence[str]]) -> list[Array]:
    """Columns (n,) of the first file of a pattern anywhere below a folder, by its ending (``mat``, else a table, which
    may be packed) with these names. FileNotFoundError where there is none, BadInput for one that is something else."""
    path = expected_files(folder, pattern, what)[0]
    if path.suffix == ".mat":
        found = read_arrays(path, tuple(names["mat"]))
    else:
        data = read_bounded(path, MAX_BYTES)
        if path.suffix == ".gz":
            try:
                data = gzip.decompress(data)
            except (OSError, EOFError, zlib.error) as error:
                raise BadInput(f"{path}: expected a file packed by gzip, found {error}") from None
        found = columns_of(data, str(path), tuple(names["csv"]))
    if len({len(one) for one in found}) > 1:
        raise BadInput(f"{path}: expected columns of one length, found {', '.join(str(len(one)) for one in found)}")
    if not all(np.isfinite(one).all() for one in found):
        raise BadInput(f"{path}: expected a number in every row, found empty cells")
    return found


@contextmanager
def scratch() -> Iterator[Path]:
    """A folder for files that are no results."""
    with written_files(), TemporaryDirectory() as place:
        yield Path(place)


def write_rig_run(folder: Path, rate_hz: float, drives: Mapping[str, Array], measured: Mapping[str, Array],
                  facts: str = "") -> Path:
    """A run's folder: columns (n,) that drive the rig, those that were measured, and its ``run.yaml``."""
    make_folder(folder)
    for name, columns in (("excitation.csv", drives), ("drive.csv", measured)):
        table = np.column_stack(list(columns.values()))
        write_table(folder / name, ("t_s", *columns), np.column_stack([np.arange(len(table)) / rate_hz, table]),
                    "%.10g")
    if facts:
        write_text(folder / "run.yaml", facts)
    return folder


@dataclass(frozen=True, eq=False)
class Improved:
    """A rig as it was described, refitted, and with what ``diagnose`` named.

    added      effects that were named, one after the other, those that help; empty: none
    refitted   the rig without them, its numbers fitted to the same runs
    """

    diagnosis: Diagnosis
    added: tuple[AddedEffect, ...]
    refitted: Model
    best: Model

    @property
    def effects(self) -> Table:
        """What was named, with the numbers that were found."""
        rows = [(one.effect, name, one.parameters[name], error)
                for one in self.added for name, error in one.standard_errors.items()]
        return Table("What diagnose named and add-effect found", (
            "effect", "number", "found .5g", "its standard error .2g"),
            tuple(rows) or (("nothing", "", None, None),))


def improved(vehicle: Path, runs: Sequence[Path]) -> Improved:
    """What the lab makes of a rig: ``diagnose`` once, then ``add-effect`` for each that it names, kept if it helps."""
    diagnosis = diagnose(vehicle, runs)
    model, refitted, added = read_vehicle(vehicle), None, list[AddedEffect]()
    for missing in diagnosis.found.missing:
        found = add_effect(missing.effect.name, model, runs, start=missing.refined)
        refitted = refitted or model.with_numbers({one.name: one.without for one in found.numbers})
        if found.helps:
            model = found.model
            added.append(found)
    return Improved(diagnosis, tuple(added), refitted or model, model)


@dataclass(frozen=True, eq=False)
class Simulated:
    """What a rig measured and what models of it say, all (n,), in the band that is compared."""

    rate_hz: float
    measured: Array
    linear: Array
    better: Array

    def rms(self, model: Array, skip: int) -> float:
        """R.m.s. of what a model leaves, without the first samples."""
        return float(np.sqrt(np.mean((self.measured - model)[skip:] ** 2)))


def simulated(found: Improved, run: Path, measured: Array | None = None, thin: bool = False) -> Simulated:
    """Simulations of a run by the refitted rig and by that with its effects, at the recorded times; ``measured`` (n,)
    in place of the run's own, whose mean is left out where its zero is not known; ``thin``: at as few samples a second
    as the lab compares, which leave out the noise above."""
    def output(model: Model) -> tuple[float, Array, Array]:
        bench = bench_with(CompareQuestion(model, run), thin=thin)
        one = bench.runs.runs[0]
        return one.rate_hz, one.measured_mps2, one.main(bench.runs.predict(compose(model.vehicle, model.effects))[0])

    rate_hz, own, linear = output(found.refitted)
    return Simulated(rate_hz, own if measured is None else measured, linear, output(found.best)[2])


def pictures(title: str, found: Simulated, unit: str, seconds: float, skip: int) -> tuple[Picture, ...]:
    """What was measured, what both models say and what they leave: where it moves most, over all the time, and by
    frequency."""
    left: dict[str, Array] = {"as a linear rig": found.measured - found.linear,
                              "with the named effects": found.measured - found.better}
    whole: Array = np.arange(len(found.measured)) / found.rate_hz
    most = min(max(skip, int(np.argmax(np.abs(found.measured[skip:]))) + skip - round(seconds * found.rate_hz / 2)),
               max(skip, len(whole) - round(seconds * found.rate_hz)))
    part = slice(most, most + round(seconds * found.rate_hz))
    closely = Curves(f"{title}: where it moves most", "time [s]", unit, (
        Line("measured", whole[part], found.measured[part], dots=True),
        Line("as a linear rig", whole[part], found.linear[part]),
        Line("with the named effects", whole[part], found.better[part]),
        Line("residual with it", whole[part], left["with the named effects"][part])))
    over = Curves(f"{title}: residual", "time [s]", unit, tuple(
        line(name, whole[skip:], np.asarray(one[skip:])) for name, one in left.items()))
    size = (len(whole) - skip) // _BLOCKS
    taper = np.hanning(size)

    def spectrum(samples: Array) -> Array:
        blocks = samples[skip:skip + _BLOCKS * size].reshape(_BLOCKS, size)
        power = np.mean(np.abs(np.fft.rfft(taper * (blocks - blocks.mean(axis=1, keepdims=True)))) ** 2, axis=0)
        return np.asarray(10 * np.log10(np.maximum(2 * power / (found.rate_hz * (taper**2).sum()), 1e-30)))

    f_hz = np.fft.rfftfreq(size, 1 / found.rate_hz)
    by_hz = Curves(f"{title}: spectra", "frequency [Hz]", f"power spectral density [dB re 1 {unit}2/Hz]", tuple(
        line(name, np.asarray(f_hz[1:], np.float64), spectrum(one)[1:])
        for name, one in {"measured": found.measured, **left}.items()))
    return tuple(map(Picture, (closely, over, by_hz)))
