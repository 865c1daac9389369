"""What was recorded into runs, as the lab reads them: cut where a drive ends, laid on a profile, written.

It does not matter what recorded it: a dump of the box, which is decoded here, and the files of a phone or of another
logger (``csv_recording``) end here.
"""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from drivers.dump import open_dump
from drivers.errors import SettingsError
from drivers.readings import folder_name
from logger.arrays import Array, Bools, Rows
from logger.bounds import CONFLICT_SIGMA
from logger.dsp.resample import GRID_RATE_HZ
from logger.errors import BadInput, as_bad_input
from logger.estimation.drive_alignment import DriveAlignment
from logger.estimation.receiver_delay import CarriedDelay, combined
from logger.extraction import along_track
from logger.extraction.along_track import registered
from logger.extraction.recorded_columns import fix_times_s, stretches
from logger.files import make_folder, remove_file, together
from logger.left_out import LeftOut, counting
from logger.printable import Notify, silent
from logger.runs import BY_RECEIVER, BY_ROAD, CLIPPED, LEAST_S, NO_READING, READING, RecordFacts, Run
from logger.service import wiring
from logger.service.config import Config
from logger.service.drive_readings import DriveReadings, GridReadings
from logger.service.event_core import EventCore, KeptRows
from logger.service.main_loop import Player
from logger.service.signal_chain import Axis
from logger.service.wiring import Instrument, check_recorded_rate
from logger.simulation.virtual_drive import SimulatedRuns
from logger.store.formats import drive_file
from logger.store.formats.drive_file import RUN, read_run_facts, write_run_facts
from logger.store.formats.profile_file import Wheelpaths, read_places, read_profile
from logger.store.formats.vehicle_file import CarModel, read_model
from logger.units import STANDARD_GRAVITY_MPS2, US_PER_S
from logger.vehicle.compose import compose

RATE_HZ = float(GRID_RATE_HZ)
LEAST_M = 30.0
"""A run over less road is of no use to the lab (as one of less than ``LEAST_S``)."""
_LINE_SCALE_STD = 0.001
"""Of lengths along a line (a judgement: odometers of profilers are checked to one or two thousandths; a receiver's
speeds, by the Doppler shift, have no scale error to speak of)."""
_AROUND_M = 150.0  # of the profile, kept before and after what was driven: a model comes to the first sample over it


@dataclass(frozen=True)
class ExtractedRun:
    """A run that was written.

    run             its folder
    seconds, metres how long it lasts, and how far it goes
    on_profile_m    how much of that lies on the profile; None: none was given
    place_std_m     standard error of a place on the profile; None likewise
    by_road         the road was recognised; False: its places are the receiver's; None likewise
    delay_s, delay_std_s    of the receiver, taken out, and its standard error
    speed_scale     of its speeds over those on the profile, taken out, and its standard error; None: the road was not
                    recognised
    gaps            holes between readings, each too short to end the run
    """

    run: Path
    seconds: float
    metres: float
    on_profile_m: float | None
    place_std_m: float | None
    by_road: bool | None
    delay_s: float
    delay_std_s: float
    speed_scale: tuple[float, float] | None
    gaps: int

    def as_json(self) -> dict[str, Any]:
        """For a program."""
        scale = zip(("speed_scale", "speed_scale_std"), self.speed_scale or (None, None), strict=True)
        return asdict(self) | {"run": str(self.run), **dict(scale)}

    @property
    def unusual_speed_scale(self) -> tuple[float, float] | None:
        """The scale of the speeds where a receiver and a careful measurement of the profile do not differ by as much;
        else None."""
        scale, std = self.speed_scale or (1.0, 0.0)
        return self.speed_scale if abs(scale - 1) > CONFLICT_SIGMA * float(np.hypot(std, _LINE_SCALE_STD)) else None


@dataclass(frozen=True)
class Extracted:
    """What became of a recording: its runs; what was left out of it; whether the recording was cut short; and what was
    recognised and repaired in it, a line each."""

    runs: tuple[ExtractedRun, ...]
    left_out: tuple[LeftOut, ...]
    torn_tail: bool
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class MeasuredProfile:
    """A profile that lies somewhere on the ground."""

    path: Path
    profile: Wheelpaths
    line: along_track.MeasuredLine


def read_measured_profile(path: Path) -> MeasuredProfile:
    """A profile with ``lat_deg,lon_deg``. Raises BadInput for one that is not what it should be."""
    profile, places = read_profile(path, judged=True), read_places(path)
    with as_bad_input(path):
        return MeasuredProfile(path, profile, along_track.MeasuredLine.of(*places))


# --- what was recorded ---


@dataclass(frozen=True, eq=False)
class Fixes(Rows):
    """Fixes (k,) with a speed and a place, at the instants at which they were true [s]; places NaN: not recorded."""

    time_s: Array
    speed_mps: Array
    lat_deg: Array
    lon_deg: Array

    @property
    def have_places(self) -> bool:
        """Whether places were recorded."""
        return bool(np.isfinite(self.lat_deg).any())


@dataclass(eq=False)
class Recorded:
    """All of a recording, decoded.

    facts    what is known of the sensor
    notes    what was recognised and repaired, a line each
    hint     why nothing lies on the profile
    left_out    before it was decoded
    """

    readings: GridReadings
    fixes: Fixes
    config: Config
    model: CarModel
    facts: RecordFacts
    receiver: CarriedDelay
    torn_tail: bool = False
    notes: tuple[str, ...] = ()
    hint: str = ""
    left_out: tuple[LeftOut, ...] = ()


def apart(time_s: Array) -> Bools:
    """Which fixes (k,) come after those that are taken before them by as much as fixes do."""
    taken, last_s = np.zeros(len(time_s), dtype=np.bool_), -np.inf
    for index, fix_s in enumerate(time_s.tolist()):
        if fix_s > last_s + along_track.NEAREST_FIXES_S:
            taken[index], last_s = True, fix_s
    return taken


def folder_of(source: Path, word: str) -> str:
    """What a recording is called, as the name of its run's folder. BadInput where it can be none."""
    with as_bad_input(source, SettingsError):
        return folder_name(word)


def write_runs(recorded: Recorded, source: Path, name: str, out: Path, measured: MeasuredProfile | None, tell: Notify
               ) -> Extracted:
    """Write the runs of a recording into ``out/NAME``, ``out/NAME-2``, ... in place of those that were made of it.

    Raises BadInput where there are none, with the reason, and for a folder that holds the run of something else.
    """
    tell("cutting it into runs")
    drives, left_out = _drives(recorded, measured)
    if not drives:
        why = "on the profile" if measured is not None and left_out else "with fixes and readings"
        also = f" ({'; '.join(one.words for one in left_out)})" if left_out and not recorded.hint else ""
        raise BadInput(f"{source}: expected {LEAST_S:g} s and {LEAST_M:g} m of driving {why}, found none"
                       f"{recorded.hint}{also}")
    folders = [out / (name + (f"-{number}" if number > 1 else "")) for number in range(1, len(drives) + 1)]
    runs = []
    with together():
        _make_room(folders, source, out)
        for folder, drive in zip(folders, drives, strict=True):
            tell(f"writing {folder.name}")
            runs.append(_written(folder, drive, recorded, measured, source.name))
    return Extracted(tuple(runs), left_out, recorded.torn_tail, recorded.notes)


def _make_room(folders: list[Path], source: Path, out: Path) -> None:
    """Take away the runs that were made of a recording of this name; BadInput where a folder holds anything else."""
    earlier = [one.parent for one in out.glob(f"*/{RUN}")
               if not one.parent.is_symlink() and read_run_facts(one.parent).source == source.name]
    for folder in folders:
        if folder.is_symlink():
            raise BadInput(f"{folder}: expected a folder for a run of {source}, found a symbolic link: remove the link")
        if folder not in earlier and folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise BadInput(f"{folder}: expected an empty folder for a run of {source}, found a run of another "
                           "recording")
    for folder in earlier:
        for name in (drive_file.DRIVE, drive_file.PROFILE, RUN):
            remove_file(folder / name)


# --- runs of it ---


@dataclass(frozen=True, eq=False)
class _Drive:
    """A stretch of readings (n,) with its motion: of the front tires, on the profile where there is one."""

    time_s: Array
    accel_mps2: Array
    usable: Array
    speed_mps: Array
    distance_m: Array
    lat_deg: Array
    lon_deg: Array
    registered: along_track.Registered | None


def even_drives(recorded: Recorded, source: Path) -> list[drive_file.Drive]:
    """The runs of a recording as records, without a profile."""
    facts = replace(recorded.facts, source=source.name)
    return [drive_file.Drive(source, RATE_HZ, one.time_s, one.accel_mps2, one.speed_mps, one.distance_m, one.lat_deg,
                             one.lon_deg, usable=one.usable, facts=facts) for one in _drives(recorded, None)[0]]


def _drives(recorded: Recorded, measured: MeasuredProfile | None) -> tuple[list[_Drive], tuple[LeftOut, ...]]:
    """The runs of a dump, and what was left out of it."""
    config, fixes, readings = recorded.config, recorded.fixes, recorded.readings
    found: list[_Drive] = []
    seconds = dict.fromkeys(("driven", "unknown", "parked"), 0.0)
    outside = readings.present.copy()
    for begin_s, end_s in stretches(readings.time_s, readings.present, fixes.time_s, fixes.speed_mps,
                                    config.gps.bridge_s, config.pipeline.drive_end_s, config.pipeline.stationary_mps):
        inside = fixes.of((fixes.time_s >= begin_s) & (fixes.time_s <= end_s))
        if len(inside.time_s) < 2:
            continue
        seconds["driven"] += inside.time_s[-1] - inside.time_s[0]
        outside &= (readings.time_s < inside.time_s[0]) | (readings.time_s > inside.time_s[-1])
        found += _along(recorded, inside, measured)
    if len(fixes.time_s):
        near = np.clip(np.searchsorted(fixes.time_s, readings.time_s), 0, len(fixes.time_s) - 1)
        parked = outside & (fixes.speed_mps[near] < config.pipeline.stationary_mps)
        seconds["parked"] = np.count_nonzero(parked) / RATE_HZ
    seconds["unknown"] = np.count_nonzero(outside) / RATE_HZ - seconds["parked"]
    long = [one for one in found if len(one.time_s) > LEAST_S * RATE_HZ and np.ptp(one.distance_m) > LEAST_M]
    kept = [one for one in long if np.count_nonzero(one.usable == READING) > LEAST_S * RATE_HZ]
    laid_s, long_s, kept_s = (sum(len(one.time_s) for one in some) / RATE_HZ for some in (found, long, kept))
    return kept, counting((
        *recorded.left_out,
        LeftOut(max(0.0, seconds["unknown"]), "s",
                f"without a fix for more than {config.gps.bridge_s:g} s, or at an end"),
        LeftOut(seconds["parked"], "s", "parked"),
        LeftOut(max(0.0, seconds["driven"] - laid_s), "s", "off the profile" if measured else "between two runs"),
        LeftOut(laid_s - long_s, "s", f"in stretches of less than {LEAST_S:g} s or {LEAST_M:g} m"),
        LeftOut(long_s - kept_s, "s", "without a good reading: the sensor gave none, or clipped")))


def _off_the_line(line: along_track.MeasuredLine, driven_m: Array, along_m: Array, aside_m: Array) -> str:
    """Why a drive, by fixes (k,), has no pass over a line."""
    if along_track.passes(driven_m, -along_m, aside_m):
        return ": the drive goes along the profile from its end to its beginning"
    near = aside_m <= along_track.SEARCH_M
    if not near.any():
        return f": the nearest fix is {aside_m.min():.0f} m from it"
    near_m = np.diff(driven_m)[near[1:] & near[:-1]].sum()
    return (f": only {near_m:.0f} m of the drive are within {along_track.SEARCH_M:g} m of its "
            f"{np.ptp(line.distance_m):.0f} m")


def _along(recorded: Recorded, fixes: Fixes, measured: MeasuredProfile | None) -> list[_Drive]:
    """The runs of a stretch without a break: one, or one for each pass over the profile."""
    speeds = _speeds(fixes, recorded.config)
    motion = along_track.motion_of(speeds)
    if measured is None:
        return [_drive(_readings(recorded, fixes), fixes, motion, recorded.config.gps.antenna_behind_front_axle_m)]
    driven_m = motion.state[:, 0]
    along_m, aside_m = measured.line.passed(fixes.lat_deg, fixes.lon_deg)
    found = along_track.passes(driven_m, along_m, aside_m)
    if not found:
        recorded.hint = _off_the_line(measured.line, driven_m, along_m, aside_m)
    return [one for each in found if (one := _on_profile(recorded, fixes, along_m, each, measured)) is not None]


def _speeds(fixes: Fixes, config: Config) -> along_track.Observations:
    speed_mps = np.where(fixes.speed_mps < config.pipeline.stationary_mps, 0.0, fixes.speed_mps)
    return along_track.Observations(fixes.time_s, speed_mps, np.ones(len(speed_mps)))


def _on_profile(recorded: Recorded, fixes: Fixes, along_m: Array, one: along_track.Pass, measured: MeasuredProfile
                ) -> _Drive | None:
    """A pass, laid on the profile's distance and cut to it; None for one that is too short."""
    part = slice(one.first, one.last)
    fixes, along_m = fixes.of(part), along_m[part]
    ahead_m = recorded.config.gps.antenna_behind_front_axle_m
    places = along_track.Observations(fixes.time_s, along_m + ahead_m, np.full(len(along_m), along_track.GPS_PLACE_M))
    grid, accel, usable = readings = _readings(recorded, fixes)
    if len(accel) < 2:
        return None
    track = drive_file.track_of(measured.profile)
    found = registered(_speeds(fixes, recorded.config), places, grid.taken_s, np.where(usable > 0, accel, 0.0), RATE_HZ,
                       track, _predictor(recorded, grid.taken_s, track))
    drive = _drive(readings, fixes, found.motion, registered=found)
    on = np.flatnonzero((drive.distance_m >= track.start_m) & (drive.distance_m <= track.end_m))
    inside = slice(on[0], on[-1] + 1) if len(on) else slice(0)
    names = ("time_s", "accel_mps2", "usable", "speed_mps", "distance_m", "lat_deg", "lon_deg")
    return replace(drive, **{name: getattr(drive, name)[inside] for name in names})


def _predictor(recorded: Recorded, time_s: Array, track: Any) -> along_track.Predict:
    car = compose(recorded.model.vehicle, recorded.model.effects)
    nothing = np.zeros(len(time_s))

    def predict(distance_m: Array) -> Array:
        run = Run("", RATE_HZ, nothing, distance_m, nothing, track, skip_s=0.0)
        return SimulatedRuns([run]).predict(car)[0]

    return predict


def _drive(readings: tuple[along_track.RunGrid, Array, Array], fixes: Fixes, motion: along_track.TrackMotion,
           ahead_m: float = 0.0, registered: along_track.Registered | None = None) -> _Drive:
    """Readings as ``_readings`` gives them, with their motion; the front tires are so far ahead of it [m]."""
    grid, accel, usable = readings
    at_s = grid.taken_s
    lon_deg = np.interp(at_s, fixes.time_s, np.unwrap(fixes.lon_deg, period=360.0))
    return _Drive(grid.time_s, accel, usable, motion.speed_mps(at_s), motion.distance_m(at_s) + ahead_m,
                  np.interp(at_s, fixes.time_s, fixes.lat_deg), (lon_deg + 180.0) % 360.0 - 180.0, registered)


def _readings(recorded: Recorded, fixes: Fixes) -> tuple[along_track.RunGrid, Array, Array]:
    """Samples on the grid of a run, within the fixes: accelerations without gravity and offset, and how usable they
    are, (n,) each."""
    readings = recorded.readings
    inside = (readings.time_s >= fixes.time_s[0]) & (readings.time_s <= fixes.time_s[-1])
    present, clipped = readings.present[inside], readings.clipped[inside]
    accel = readings.accel_mps2[inside]
    whole = present & ~clipped
    usable = np.where(present, np.where(clipped, CLIPPED, READING), NO_READING)
    accel = accel - (accel[whole].mean() if whole.any() else 0.0)
    grid = along_track.run_grid(readings.time_s[inside], RATE_HZ)
    return grid, grid.laid(accel), np.where(grid.row >= 0, usable[grid.row], NO_READING)


# --- files ---


def _written(folder: Path, drive: _Drive, recorded: Recorded, measured: MeasuredProfile | None, source: str
             ) -> ExtractedRun:
    make_folder(folder)
    columns = {drive_file.TIME: drive.time_s, drive_file.VERTICAL: drive.accel_mps2, drive_file.SPEED: drive.speed_mps,
               drive_file.DISTANCE: drive.distance_m}
    if recorded.fixes.have_places:
        columns |= dict(zip(drive_file.PLACE, (drive.lat_deg, drive.lon_deg), strict=True))
    columns[drive_file.USABLE] = drive.usable
    drive_file.write_drive(folder / drive_file.DRIVE, columns)
    if measured is not None:
        drive_file.write_profile(folder / drive_file.PROFILE, _around(measured.profile, drive.distance_m))
    receiver, found = recorded.receiver, drive.registered
    place_std_m = None if found is None else float(f"{_place_std_m(found, drive, receiver):.3g}")
    by_road = None if found is None else found.by_road
    scale = None if found is None else found.speed_scale
    write_run_facts(folder, replace(
        recorded.facts, place_std_m=place_std_m, delay_s=receiver.delay_s, delay_std_s=receiver.std_s,
        speed_scale=scale[0] if scale else None, speed_scale_std=scale[1] if scale else None,
        places_by={None: None, True: BY_ROAD, False: BY_RECEIVER}[by_road],
        vehicle=recorded.model.vehicle.name if by_road else None, source=source))
    metres = float(np.ptp(drive.distance_m))
    gaps = int(np.count_nonzero(np.diff((drive.usable == NO_READING).astype(int)) == 1))
    return ExtractedRun(folder, len(drive.time_s) / RATE_HZ, metres, None if found is None else metres, place_std_m,
                        by_road, receiver.delay_s, receiver.std_s, scale, gaps)


def _place_std_m(found: along_track.Registered, drive: _Drive, receiver: CarriedDelay) -> float:
    """By the receiver alone, what it is late by is a length as well."""
    late_m = 0.0 if found.by_road else receiver.std_s * float(np.sqrt(np.mean(drive.speed_mps**2)))
    return float(np.hypot(found.place_std_m, late_m))


def _around(profile: Wheelpaths, distance_m: Array) -> Any:
    """The part of a profile that a drive needs."""
    track = drive_file.track_of(profile)
    first, last = np.clip(np.round([
        (distance_m.min() - _AROUND_M - track.start_m) / track.spacing_m,
        (distance_m.max() + _AROUND_M - track.start_m) / track.spacing_m + 1]), 0, len(track.elevation_m)).astype(int)
    return replace(track, elevation_m=track.elevation_m[first:last], start_m=track.start_m + first * track.spacing_m)


# --- a dump of the box ---


def name_of(dump: Path) -> str:
    """What the first run of a dump is called."""
    return folder_of(dump, dump.name.removesuffix(".gz").removesuffix(".dump"))


def extract_dump(dump: Path, out: Path, given: Config | None, measured: MeasuredProfile | None = None,
                 tell: Notify = silent, vehicle: str | None = None) -> Extracted:
    """Write the runs of a recorded dump into ``out/NAME``, ``out/NAME-2``, ...

    given       settings of that drive; None: the defaults, with what the recording's header says
    measured    the profile that was driven on; None: the runs have no profile
    vehicle     name or file of the car, instead of the one that settings or recording name

    Runs that were made of a dump of this name before are replaced.

    Raises BadInput for a dump of which nothing can be used, with the reason, and for a folder that holds the run of
    something else; DumpError for a dump that is damaged.
    """
    if out.exists() and not out.is_dir():
        raise BadInput(f"{out}: expected a folder")
    return write_runs(recorded_dump(dump, given, vehicle, tell), dump, name_of(dump), out, measured, tell)


def recorded_dump(dump: Path, given: Config | None, vehicle: str | None, tell: Notify) -> Recorded:
    """All of a dump. BadInput and DumpError as ``extract_dump``."""
    with open_dump(dump) as reader:
        config = wiring.config_for_dump(reader.header, given, vehicle, place=f"{dump}:1")
        sensor = wiring.instrument(config.accelerometer, wiring.noise_for_dump(reader.header, config, f"{dump}:1"))
        check_recorded_rate(dump, sensor)
        known = wiring.receiver_for_dump(reader.header, config, place=f"{dump}:1")
        axis = Axis.from_word(config.accelerometer.vertical_axis)
        kept = DriveReadings(wiring.signal_chain(config, sensor), DriveAlignment(axis.column, axis.sign), known.delay_s)
        core = EventCore(sensor.decoder, wiring.gps_decoder(config), kept, KeptRows())
        player = Player(core, 0.0, lambda played_s: tell(f"reading: {played_s / 60:.0f} min"))
        player.play(reader)
    receiver = known if known.std_s == 0.0 else combined(known, kept.alignment.estimate())
    receiver = replace(receiver, delay_s=max(0.0, receiver.delay_s))
    fixes = _fixes_of_dump(kept, receiver.delay_s - known.delay_s)
    recorded = Recorded(kept.readings(), fixes, config, wiring.car_of(config, read_model), _facts(sensor, config),
                        receiver, reader.torn_tail)
    if not len(recorded.readings.time_s) or not recorded.readings.present.any():
        raise BadInput(f"{dump}: expected readings of the accelerometer, found none")
    if len(fixes.time_s) < 2:
        raise BadInput(f"{dump}: expected fixes with a speed and a position, found {len(kept.fixes)} fixes, of which "
                       f"{len(fixes.time_s)} have both")
    return recorded


def _facts(sensor: Instrument, config: Config) -> RecordFacts:
    range_g, reading = sensor.description.get("range_g"), sensor.on_grid(sensor.sensor.noise_rms_mps2)
    is_said = isinstance(config.accelerometer.noise_mps2, float)  # else whoever reads the run learns it
    return RecordFacts(step_mps2=reading.step_mps2 or None, range_mps2=range_g and range_g * STANDARD_GRAVITY_MPS2,
                       noise_mps2=reading.noise_rms_mps2 if is_said else None)


def _fixes_of_dump(kept: Any, later_s: float) -> Fixes:
    """Fixes of a drive, ``later_s`` earlier than they were placed on the way [s]."""
    whole = [timed for timed in kept.fixes if timed.fix.valid and timed.fix.speed_mps is not None
             and timed.fix.lat_deg is not None and timed.fix.lon_deg is not None]
    placed_s, named_s, speed_mps, lat_deg, lon_deg = np.array([
        (timed.t_us / US_PER_S, np.nan if timed.fix.time_of_day_us is None else timed.fix.time_of_day_us / US_PER_S,
         timed.fix.speed_mps, timed.fix.lat_deg, timed.fix.lon_deg) for timed in whole], dtype=float).reshape(-1, 5).T
    time_s = fix_times_s(placed_s, named_s) - later_s
    return Fixes(time_s, speed_mps, lat_deg, lon_deg).of(apart(time_s))
