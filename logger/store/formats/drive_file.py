"""Drives as files: ``drive.csv``, and the folder (a run) that keeps it with the profile it was driven on.

Problem: a drive and its road belong together, and a model is compared with the one on the other; a column that is
missing, or a clock that skips, would end as a wrong vehicle. Solution: a run is read as one thing, checked line by line
as records and profiles are. Columns of other names are not read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
import numpy.typing as npt

from logger import bounds
from logger.errors import BadInput
from logger.files import file_in, read_bounded, write_text
from logger.profiles.excitation import Excitation
from logger.profiles.track import Track
from logger.runs import CLIPPED, NO_READING, READING, UNKNOWN, RecordFacts
from logger.store.formats.csv_table import find_table, parse_columns, place, taken
from logger.store.formats.excitation_file import COLUMNS as EXCITATION_COLUMNS
from logger.store.formats.excitation_file import read_excitation
from logger.store.formats.profile_file import COLUMNS as PROFILE_COLUMNS
from logger.store.formats.profile_file import PROFILE_NAME, Profile, read_profile
from logger.store.formats.record_file import MAX_BYTES, TIME, USABLE, VERTICAL, even_rate_hz
from logger.store.formats.run_file import DRIVE_NAME, check_columns, facts_beside, read_run_facts

Array = npt.NDArray[np.float64]

DRIVE, PROFILE, EXCITATION = DRIVE_NAME, PROFILE_NAME, "excitation.csv"
SPEED, DISTANCE = "speed_mps", "distance_m"
COLUMNS = (TIME, VERTICAL, SPEED, DISTANCE)
PLACE = ("lat_deg", "lon_deg")
_QUANTITIES = {TIME: bounds.TIME, VERTICAL: bounds.ACCELERATION, SPEED: bounds.SPEED, DISTANCE: bounds.DISTANCE,
               **dict(zip(PLACE, (bounds.LATITUDE, bounds.LONGITUDE), strict=True))}
_MAX_TIME_S = 1e5  # a day and more; of later times the ten digits of a drive do not distinguish samples
_LINES_AT_ONCE = 50_000
_TIME_FORM = "%.13g"  # hundredths of a second, also of a clock that has run since 1970
_HEADER = f"a header with {{}}[,{','.join(PLACE)}][,{USABLE}], each once"


@dataclass(frozen=True, eq=False)
class Drive:
    """What a recorder wrote down while it drove, arrays (n,).

    path           of the file, or of a run's folder
    rate_hz        samples a second
    time_s         evenly spaced [s]
    accel_z_mps2   of the sensor, up positive, gravity removed, band-limited by the recorder [m/s2]
    speed_mps      [m/s]; on a rig 0
    distance_m     where the front tires stand on the track [m]; on a rig 0
    lat_deg, lon_deg    None where they were not recorded
    usable         0 where there was no reading, 1 where there was, 2 where it was clipped; None: all are readings
    facts          what is known of the record
    more           columns (n,) of the signals that ``facts`` has, by name
    """

    path: Path
    rate_hz: float
    time_s: Array
    accel_z_mps2: Array
    speed_mps: Array
    distance_m: Array
    lat_deg: Array | None
    lon_deg: Array | None
    usable: Array | None = field(default=None, kw_only=True)
    facts: RecordFacts = field(default=UNKNOWN, kw_only=True)
    more: Mapping[str, Array] = field(default_factory=dict, kw_only=True)

    def marks(self, part: slice = slice(None)) -> Array | None:
        """``usable`` of a part; None where all of it are readings."""
        return None if self.usable is None or (self.usable[part] == READING).all() else self.usable[part]


@dataclass(frozen=True, eq=False)
class DriveOnRoad(Drive):
    """A drive over a known road, ``track``, or on a rig that is driven by time."""

    track: Track | Excitation


def read_run(folder: Path | str) -> DriveOnRoad:
    """Read a folder with ``drive.csv`` and ``profile.csv`` or, of a rig, ``excitation.csv``, and ``run.yaml`` if there
    is one.

    Times come back on the even grid that their digits are a rounding of.

    Raises BadInput ("file:line: expected ..., found ...") for a file that is missing or not what it should be.
    """
    path = Path(folder)
    if not path.is_dir():
        raise BadInput(f"{folder}: expected a folder with {DRIVE} and {PROFILE} (or {EXCITATION})")
    timed = driven_by_time(path)
    drive = drive_in(path, timed)
    track = excitation_beside(drive) if timed else track_of(read_profile(path / PROFILE, judged=True))
    return DriveOnRoad(**vars(drive), track=track)


def drive_in(folder: Path, timed: bool) -> Drive:
    """The drive of a run's folder, on a rig (``timed``) or over a road, with what its ``run.yaml`` says. BadInput as
    ``read_run``."""
    facts = read_run_facts(folder)
    names = tuple(one.name for one in facts.signals)
    if names:
        check_columns(folder, header_of(folder / DRIVE), (*COLUMNS, *PLACE, USABLE))
    return replace(read_drive(folder / DRIVE, timed, names), path=folder, facts=facts)


def header_of(path: Path) -> tuple[str, ...]:
    """The names of a table's columns. BadInput for a file that cannot be read."""
    path = file_in(path, DRIVE)
    return find_table(read_bounded(path, MAX_BYTES), str(path), lambda names: TIME in names and len(names) > 1).names


def driven_by_time(folder: Path) -> bool:
    """Whether a run's folder has an excitation. BadInput where it has a profile as well."""
    timed = (folder / EXCITATION).exists()
    if timed and (folder / PROFILE).exists():
        raise BadInput(f"{folder}: expected {PROFILE} or {EXCITATION}, found both: a run is driven over a road or by "
                       "time")
    return timed


def excitation_beside(drive: Drive) -> Excitation:
    """What drives a rig, out of the run's folder, on the drive's clock. BadInput as ``read_excitation``, and where it
    moves nothing while the drive lasts."""
    path = drive.path / EXCITATION
    found = read_excitation(path)
    first_s, last_s = float(drive.time_s[0]), float(drive.time_s[-1])
    if found.end_s < first_s or found.start_s > last_s:
        raise BadInput(f"{path}: expected times of the same clock as in {DRIVE}, {first_s:g} to {last_s:g} s, found "
                       f"{found.start_s:g} to {found.end_s:g} s")
    return replace(found, start_s=found.start_s - first_s)


def read_drive(path: Path | str, timed: bool = False, more: Sequence[str] = ()) -> Drive:
    """Read a ``drive.csv``, that of a rig (``timed``) without speed and distance, and ``more`` of its columns. Times
    and errors as in ``read_run``."""
    file, columns = read_columns(path, timed, more)
    return replace(drive_of(path, even_rate_hz(columns[TIME], file), columns), facts=facts_beside(path),
                   more={name: columns[name] for name in more})


def drive_of(path: Path | str, rate_hz: float, columns: Mapping[str, Array]) -> Drive:
    """A drive of columns (n,) by name, at an even rate; the first of ``t_s`` is where its times begin."""
    time_s = columns[TIME][0] + np.arange(len(columns[VERTICAL])) / rate_hz
    lat_deg, lon_deg = (columns.get(name) for name in PLACE)
    return Drive(Path(path), rate_hz, time_s, columns[VERTICAL], columns[SPEED], columns[DISTANCE], lat_deg, lon_deg,
                 usable=columns.get(USABLE))


def read_columns(path: Path | str, timed: bool = False, more: Sequence[str] = ()) -> tuple[str, dict[str, Array]]:
    """The file's name for ``place``, and the columns (n,) of a ``drive.csv`` by name, as they are written: their times
    may be uneven. Errors as in ``read_run``.

    timed    it is a rig's: speed and distance are 0, whatever it says of them
    more     columns that are read as well
    """
    needed = (COLUMNS[:2] if timed else COLUMNS) + tuple(more)
    path = file_in(path, DRIVE)
    names, table, file = parse_columns(read_bounded(path, MAX_BYTES), str(path), partial(_choose, needed=needed),
                                       _HEADER.format(",".join(needed)))
    if len(table) < 2:
        raise BadInput(f"{place(file, 1)}: expected at least two samples, found the end of the file")
    columns = {name: taken(_QUANTITIES.get(name, bounds.SIGNAL), name, column, file)
               for name, column in zip(names, table.T, strict=True)}
    columns |= {name: np.zeros(len(table)) for name in COLUMNS if name not in columns}
    if USABLE in columns and not (known := np.isin(columns[USABLE], (NO_READING, READING, CLIPPED))).all():
        row = int(np.argmin(known))
        raise BadInput(f"{place(file, row)}: expected {USABLE} 0, 1 or 2, found {columns[USABLE][row]:g}")
    return file, columns


def read_speeds(path: Path | str) -> tuple[Array, Array]:
    """Times [s], growing, and speeds [m/s] at them out of the columns ``t_s`` and ``speed_mps``.

    Raises BadInput ("file:line: expected ..., found ...") for anything else, for a speed below 0, and for times beyond
    1e5 s.
    """
    header, path = (TIME, SPEED), file_in(path, DRIVE)
    _, table, file = parse_columns(
        read_bounded(path, MAX_BYTES), str(path),
        lambda names: header if all(names.count(name) == 1 for name in header) else None,
        f"a header with {','.join(header)}, each once",
    )
    if len(table) < 2:
        raise BadInput(f"{place(file, 1)}: expected at least two times, found the end of the file")
    time_s = taken(replace(bounds.TIME, largest=_MAX_TIME_S), TIME, table[:, 0], file)
    speed_mps = taken(bounds.SPEED, SPEED, table[:, 1], file)
    if (back := np.diff(time_s) <= 0).any():
        row = int(np.argmax(back)) + 1
        raise BadInput(f"{place(file, row)}: expected a time after {time_s[row - 1]:.10g} s, found {time_s[row]:.10g}")
    if (speed_mps < 0).any():
        row = int(np.argmax(speed_mps < 0))
        raise BadInput(f"{place(file, row)}: expected a speed of 0 or more, found {speed_mps[row]:g}")
    return time_s, speed_mps


def track_of(profile: Profile) -> Track:
    """The road that a profile describes, with one or two tracks."""
    if profile.elevation_right_m is None:
        return Track(profile.spacing_m, profile.elevation_m, profile.start_m)
    both = np.stack([profile.elevation_m, profile.elevation_right_m], axis=1)
    return Track(profile.spacing_m, both, profile.start_m)


def write_drive(path: Path, columns: Mapping[str, Array]) -> None:
    """Write columns (n,) by name in the order given: those of ``COLUMNS``, then any others. OSError as ``open``."""
    write_table(path, tuple(columns), np.stack(list(columns.values()), axis=1), "%.10g")


def write_profile(path: Path, track: Track) -> None:
    """Write a road as a profile, to a tenth of a micrometre. OSError as ``open``."""
    elevations = track.elevation_m.reshape(len(track.elevation_m), -1)
    distance = track.start_m + track.spacing_m * np.arange(len(elevations))
    names = PROFILE_COLUMNS[: 1 + elevations.shape[1]]
    write_table(path, names, np.column_stack([distance, elevations]), "%.7f")


def write_excitation(path: Path, excitation: Excitation) -> None:
    """Write what drives a rig, with its own times, to ten digits. OSError if that fails."""
    columns = excitation.elevation_m.reshape(len(excitation.elevation_m), -1).T
    time_s = excitation.start_s + np.arange(len(columns[0])) / excitation.rate_hz
    write_drive(path, dict(zip(EXCITATION_COLUMNS, (time_s, *columns), strict=False)))


def write_table(path: Path, names: Sequence[str], table: Array, form: str) -> None:
    """Write rows (n, names) below their names, each number in a ``form``, times in their own. OSError if that fails."""
    line = ",".join(_TIME_FORM if name == TIME else form for name in names) + "\n"
    blocks = (table[first : first + _LINES_AT_ONCE] for first in range(0, len(table), _LINES_AT_ONCE))
    write_text(path, chain([",".join(names) + "\n"],
                           (line * len(block) % tuple(block.ravel().tolist()) for block in blocks)), "ascii")


def _choose(names: tuple[str, ...], needed: tuple[str, ...]) -> tuple[str, ...] | None:
    """The columns to read; None when one of them is missing or there twice."""
    wanted = needed + (PLACE if any(name in names for name in PLACE) else ())
    wanted += (USABLE,) if USABLE in names else ()
    return wanted if all(names.count(name) == 1 for name in wanted) else None
