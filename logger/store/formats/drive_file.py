"""Runs as folders: ``drive.csv``, the profile it was driven on, and what is known of the recorder, ``run.yaml``.

A model is compared with readings that a sensor rounded, at places that a receiver gave; to do so one has to know how
coarse the one is and how far off the other: ``run.yaml`` says it, and what it does not say is not known.

Problem: a drive and its road belong together, and a model is compared with the one on the other; a column that is
missing, or a clock that skips, would end as a wrong vehicle. Solution: a run is read as one thing, checked line by line
as records and profiles are. Columns of other names are not read.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from logger import bounds
from logger.arrays import Array
from logger.dsp.channel_faults import at_ends
from logger.errors import BadInput
from logger.files import file_in, read_bounded, write_text
from logger.profiles.excitation import FEWEST, AppliedForce, Excitation
from logger.profiles.track import Track
from logger.runs import ACCELERATION, BY_RECEIVER, BY_ROAD, CLIPPED, NO_READING, READING, UNKNOWN, RecordFacts, Signal
from logger.store.formats.csv_table import find_table, parse_columns, place, taken
from logger.store.formats.profile_file import COLUMNS as PROFILE_COLUMNS
from logger.store.formats.profile_file import (
    EXCITATION_COLUMNS,
    PART_COLUMNS,
    PROFILE_NAME,
    Wheelpaths,
    read_excitation,
)
from logger.store.formats.record_file import (
    DRIVE_NAME,
    MAX_BYTES,
    TIME,
    USABLE,
    VERTICAL,
    check_grows,
    even_rate_hz,
    laid_evenly,
)
from logger.store.formats.yaml_nodes import Node, load_mapping

RUN = "run.yaml"


_SENSOR = ("step_mps2", "range_mps2", "noise_mps2", "taken_hz")
_RECEIVER = ("delay_s", "delay_std_s", "speed_scale", "speed_scale_std")
_KEYS = ("sensor", "place_std_m", "pass_band_hz", "source", "receiver", "places", "signals", "forces")
# What signals measure: the unit that their columns end in, and the parts that they are of.
_CORNERS = ("front", "rear", "front_left", "front_right", "rear_left", "rear_right")
_WHEELS, _SUSPENSIONS = ((kind, *(f"{one}_{kind}" for one in _CORNERS)) for kind in ("wheel", "suspension"))
_MEASURES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "acceleration": ("_mps2", ("body", *_WHEELS)),
    "velocity": ("_mps", ("body", *_WHEELS, *_SUSPENSIONS)),
    "displacement": ("_m", ("body", *_WHEELS)),
    "travel": ("_m", _SUSPENSIONS),
    "force": ("_n", ("body",)),
    "pitch_rate": ("_rad_per_s", ("body",)),
    "roll_rate": ("_rad_per_s", ("body",)),
}
_PLACE = ("ahead_m", "left_m")
_KINDS = ("accelerometer", "encoder", "potentiometer", "laser", "load_cell")
# Columns of a rig's record that need no word in run.yaml.
_OWN_SIGNALS = {one.name: one for one in (
    Signal("displacement_m", "displacement"), Signal("travel_m", "travel", "suspension"),
    Signal("velocity_mps", "velocity"), Signal("force_n", "force"))}


def write_run_facts(folder: Path, facts: RecordFacts, forces: Sequence[AppliedForce] = ()) -> None:
    """Write ``run.yaml`` into a run's folder, with what ``forces`` act on. OSError if that fails."""
    own = facts.main.name == VERTICAL
    every = facts.signals if own else (facts.main, *facts.signals)
    sensor = {**_some(facts, _SENSOR), **({"kind": facts.main.kind} if own and facts.main.kind else {})}
    places = {"by": facts.places_by, "vehicle": facts.vehicle}
    said: dict[str, Any] = {"sensor": sensor, "place_std_m": facts.place_std_m,
                            "pass_band_hz": list(facts.pass_band_hz or ()) or None, "source": facts.source,
                            "receiver": _some(facts, _RECEIVER), "places": places if facts.places_by else None,
                            "signals": {one.name: _signal_keys(one) for one in every},
                            "forces": {one.name: {"on": one.parts[0]} if len(one.parts) == 1
                                       else {"between": list(one.parts)} for one in forces}}
    write_text(folder / RUN, yaml.safe_dump({key: value for key, value in said.items() if value not in (None, {})},
                                            sort_keys=False, allow_unicode=True))


def read_run_facts(folder: Path) -> RecordFacts:
    """What the ``run.yaml`` of a run's folder says; nothing where there is none.

    Raises BadInput ("file:line: expected ..., found ...") for a key that is not known or a value that cannot be.
    """
    path = folder / RUN
    if not path.exists():
        return UNKNOWN
    said = load_mapping(path).mapping(optional=_KEYS)
    sensor, receiver = (said[key].mapping(optional=names) if key in said else {}
                        for key, names in (("sensor", (*_SENSOR, "kind")), ("receiver", _RECEIVER)))
    kind = sensor["kind"].choice(*_KINDS) if "kind" in sensor else None
    places = said["places"].mapping(("by",), ("vehicle",)) if "places" in said else {}
    numbers = {**{name: _within(node, bounds.ACCELERATION) for name, node in sensor.items() if name != "kind"},
               **{name: _of_receiver(name, node) for name, node in receiver.items()}}
    return replace(
        UNKNOWN, **numbers,
        place_std_m=said["place_std_m"].number(0, bounds.DISTANCE.largest) if "place_std_m" in said else None,
        pass_band_hz=_band(said["pass_band_hz"]) if "pass_band_hz" in said else None,
        places_by=places["by"].choice(BY_ROAD, BY_RECEIVER) if places else None,
        vehicle=places["vehicle"].text() if "vehicle" in places else None,
        source=said["source"].text() if "source" in said else None,
        signals=tuple(_signal(name, node) for name, node in said["signals"].mapping().items()
                      ) if "signals" in said else (),
        main=replace(ACCELERATION, kind=kind))


def read_forces(folder: Path) -> tuple[AppliedForce, ...]:
    """What the forces of a rig act on, by the ``run.yaml`` of its folder, if any. BadInput as ``read_run_facts``."""
    return tuple(_force(name, node) for name, node in _said(folder, "forces").items())


def _said(folder: Path, key: str) -> Mapping[str, Node]:
    """What a key of ``run.yaml`` holds; nothing where it is not there."""
    said = load_mapping(folder / RUN).mapping(optional=_KEYS) if (folder / RUN).exists() else {}
    return said[key].mapping() if key in said else {}


def _force(name: str, node: Node) -> AppliedForce:
    keys = node.mapping(optional=("on", "between"))
    if len(keys) != 1:
        raise node.wrong("on: a part, or between: two parts")
    if "on" in keys:
        return AppliedForce(name, (keys["on"].choice("body", *_WHEELS, *_SUSPENSIONS),))
    parts = tuple(one.choice("body", "ground", "base", *_WHEELS) for one in keys["between"].items())
    if len(parts) != 2 or parts[0] == parts[1] or not {"ground", "base"}.isdisjoint(parts[:1]):
        raise keys["between"].wrong("two parts, as [body, wheel], the ground or the base last")
    return AppliedForce(name, parts)


def facts_beside(drive: Path | str) -> RecordFacts:
    """What the ``run.yaml`` in the folder of a ``drive.csv``, or in a run's folder, says of that drive; of its signals,
    which are columns of their own, nothing. Nothing of a file of another name. Errors as ``read_run_facts``."""
    place = Path(drive)
    folder = place if place.is_dir() else place.parent if place.name == DRIVE_NAME else None
    return UNKNOWN if folder is None else replace(read_run_facts(folder), signals=())


def _of_receiver(name: str, node: Node) -> float:
    """A delay may have either sign, as the recorder may be the late one; a factor is above 0, an error not below."""
    if name == "speed_scale":
        return _within(node, bounds.SCALE)
    most = bounds.SCALE.largest if name == "speed_scale_std" else bounds.DELAY.largest
    return node.number(-most if name == "delay_s" else 0.0, most)


def _within(node: Node, quantity: bounds.Quantity) -> float:
    """A number above 0 as large as such a quantity can be."""
    return node.number(quantity.least, quantity.largest)


def check_columns(folder: Path, columns: Collection[str], taken: Collection[str]) -> None:
    """Raise BadInput, with the line, for a signal in a run's ``run.yaml`` that is no column of its drive, or one of
    those that are ``taken`` for something else."""
    for name, node in _said(folder, "signals").items():
        if name in taken:
            raise BadInput(f"{node.file}:{node.line}: expected a signal beside the columns {', '.join(taken)}, found "
                           f"{name}")
        if name not in columns:
            raise BadInput(f"{node.file}:{node.line}: expected a signal that is a column of the drive.csv beside it, "
                           f"found {name}, which is none")


def _signal(name: str, node: Node) -> Signal:
    farthest_m = 20.0
    keys = node.mapping(("measures",), ("of", "kind", *_PLACE))
    measures = keys["measures"].choice(*_MEASURES)
    unit, parts = _MEASURES[measures]
    if not name.endswith(unit):
        raise BadInput(f"{node.file}:{node.line}: expected a column of {measures.replace('_', ' ')} whose name ends in "
                       f"{unit}, its unit, found {name}")
    of = keys["of"].choice(*parts) if "of" in keys else parts[0]
    kind = keys["kind"].choice(*_KINDS) if "kind" in keys else None
    place = {key: keys[key].number(-farthest_m, farthest_m) for key in _PLACE if key in keys}
    if place and (measures, of) != ("acceleration", "body"):
        raise keys[next(iter(place))].wrong("no place: only an acceleration of the body has one")
    return Signal(name, measures, of, **place, kind=kind)


def _signal_keys(one: Signal) -> dict[str, object]:
    place = {key: float(f"{getattr(one, key):.6g}") for key in _PLACE if getattr(one, key)}
    return {"measures": one.measures, "of": one.of, **place, **({"kind": one.kind} if one.kind else {})}


def _band(node: Node) -> tuple[float, float]:
    ends = node.items()
    if len(ends) != 2 or not (low := ends[0].number(0)) < (high := ends[1].number(high=bounds.FASTEST_HZ)):
        raise node.wrong("two frequencies, the lower one first [Hz]")
    return low, high


def _some(facts: RecordFacts, names: tuple[str, ...]) -> Mapping[str, float]:
    known = {one.name: getattr(facts, one.name) for one in fields(facts)}
    return {name: float(f"{known[name]:.6g}") for name in names if known[name] is not None}


DRIVE, PROFILE, EXCITATION = DRIVE_NAME, PROFILE_NAME, "excitation.csv"
SPEED, DISTANCE = "speed_mps", "distance_m"
COLUMNS = (TIME, VERTICAL, SPEED, DISTANCE)
PLACE = ("lat_deg", "lon_deg")
_QUANTITIES = {TIME: bounds.TIME, VERTICAL: bounds.ACCELERATION, SPEED: bounds.SPEED, DISTANCE: bounds.DISTANCE,
               **dict(zip(PLACE, (bounds.LATITUDE, bounds.LONGITUDE), strict=True))}
_TIME_FORM = "%.13g"  # hundredths of a second, also of a clock that has run since 1970
_HEADER = f"a header with {{}}[,{','.join(PLACE)}][,{USABLE}], each once"


@dataclass(frozen=True, eq=False)
class Drive:
    """What was recorded during a drive, as arrays (n,).

    path           of the file, or of a run's folder; of a simulated drive its name
    rate_hz        samples a second
    time_s         evenly spaced [s]
    accel_z_mps2   of the sensor, up positive, gravity removed, band-limited by the recorder [m/s2]; on a rig whose
                   facts say so another signal
    speed_mps      [m/s]; on a rig 0
    distance_m     where the front tires stand on the track [m]; on a rig 0
    lat_deg, lon_deg    None where they were not recorded
    usable         0 where there was no reading, 1 where there was, 2 where it was clipped; None: all are readings
    guessed        whether that was found, as its file says nothing of it
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
    guessed: bool = field(default=False, kw_only=True)
    facts: RecordFacts = field(default=UNKNOWN, kw_only=True)
    more: Mapping[str, Array] = field(default_factory=dict, kw_only=True)

    @property
    def track(self) -> Track | Excitation | None:
        """The road, or the excitation of a rig; None: not known."""
        return None

    @property
    def file(self) -> Path:
        """Of its samples."""
        return self.path / DRIVE if self.path.is_dir() else self.path

    def marks(self, part: slice = slice(None)) -> Array | None:
        """``usable`` of a part; None where all of it are readings."""
        return None if self.usable is None or (self.usable[part] == READING).all() else self.usable[part]


def drive_in(folder: Path, timed: bool) -> Drive:
    """The drive of a run's folder, on a rig (``timed``) or over a road, with what its ``run.yaml`` says.
    Times come back on the even grid that their digits are a rounding of. BadInput ("file:line: expected ..., found
    ...") for a file that is missing or not what it should be."""
    facts = read_run_facts(folder)
    if facts.signals or timed:
        columns = header_of(folder / DRIVE)
        check_columns(folder, columns, (*COLUMNS, *PLACE, USABLE))
        facts = _measured(facts, columns) if timed else facts
    names = tuple(one.name for one in facts.signals)
    return replace(read_drive(folder / DRIVE, timed, names, facts.main), path=folder, facts=facts)


def _measured(facts: RecordFacts, columns: Sequence[str]) -> RecordFacts:
    """The facts of a rig's record with the columns whose names say what they are; the first one of all is its main
    signal where there is no acceleration of the sensor."""
    said = {one.name: one for one in facts.signals}
    every = [{**_OWN_SIGNALS, **said}[name] for name in columns if name in {**_OWN_SIGNALS, **said}]
    if VERTICAL in columns or not every:
        return replace(facts, signals=tuple(every))
    main = every[0] if every[0].kind or not facts.main.kind else replace(every[0], kind=facts.main.kind)
    return replace(facts, main=main, signals=tuple(every[1:]))


def header_of(path: Path) -> tuple[str, ...]:
    """The names of a table's columns. BadInput for a file that cannot be read."""
    path = file_in(path, DRIVE)
    return find_table(read_bounded(path, MAX_BYTES), str(path), lambda names: TIME in names and len(names) > 1).names


def driven_by_time(folder: Path) -> bool:
    """Whether a run's folder has an excitation, or a drive that went nowhere and nothing that drove it: a rig that was
    pulled and let go. BadInput where it has a profile as well."""
    timed, on_road = (folder / EXCITATION).exists(), (folder / PROFILE).exists()
    if timed and on_road:
        raise BadInput(f"{folder}: expected {PROFILE} or {EXCITATION}, found both: a run is driven over a road or by "
                       "time")
    return timed or (not on_road and (folder / DRIVE).exists()
                     and {SPEED, DISTANCE}.isdisjoint(header_of(folder / DRIVE)))


def excitation_beside(drive: Drive) -> Excitation:
    """What drives a rig, out of the run's folder, on the drive's clock; nothing where there is none. BadInput as
    ``read_excitation``, and where it moves nothing while the drive lasts."""
    path = drive.path / EXCITATION
    if not path.exists():
        return Excitation(drive.rate_hz, np.zeros(max(len(drive.time_s), FEWEST)))
    found = read_excitation(path, read_forces(drive.path))
    first_s, last_s = float(drive.time_s[0]), float(drive.time_s[-1])
    if found.end_s < first_s or found.start_s > last_s:
        raise BadInput(f"{path}: expected times of the same clock as in {DRIVE}, {first_s:g} to {last_s:g} s, found "
                       f"{found.start_s:g} to {found.end_s:g} s")
    return replace(found, start_s=found.start_s - first_s)


def read_drive(path: Path | str, timed: bool = False, more: Sequence[str] = (), main: Signal = ACCELERATION) -> Drive:
    """Read a ``drive.csv``, that of a rig (``timed``) without speed and distance, and ``more`` of its columns; ``main``
    in place of the sensor's acceleration. Rows that a rig's leaves out are no readings, and what is at an end of the
    sensor's range is clipped, if the file does not say what is usable. Times and errors as in ``read_run``."""
    file, columns = read_columns(path, timed, more, main.name)
    guessed = timed and USABLE not in columns
    if timed:
        usable = _marks(columns[VERTICAL], main) if guessed else columns.pop(USABLE)
        rate_hz, laid, usable = laid_evenly(columns[TIME], np.stack(list(columns.values()), axis=1), usable, file)
        columns = dict(zip(columns, laid.T.copy(), strict=True))
        if not guessed or (usable != READING).any():
            columns[USABLE] = usable
    else:
        rate_hz = even_rate_hz(columns[TIME], file)
    return replace(drive_of(path, rate_hz, columns), guessed=guessed, facts=facts_beside(path),
                   more={name: columns[name] for name in more})


def _marks(samples: Array, main: Signal) -> Array:
    """What samples (n,) are, clipped or readings; where most of them would be clipped, or others may well stay where
    they are, as places and the force of friction do, they are readings."""
    if main.measures not in ("acceleration", "velocity"):
        return np.full(len(samples), READING)
    clipped = at_ends(samples)
    return np.where(clipped & (2 * np.count_nonzero(clipped) < len(clipped)), CLIPPED, READING)


def drive_of(path: Path | str, rate_hz: float, columns: Mapping[str, Array]) -> Drive:
    """A drive of columns (n,) by name, at an even rate; the first of ``t_s`` is where its times begin."""
    time_s = columns[TIME][0] + np.arange(len(columns[VERTICAL])) / rate_hz
    lat_deg, lon_deg = (columns.get(name) for name in PLACE)
    return Drive(Path(path), rate_hz, time_s, columns[VERTICAL], columns[SPEED], columns[DISTANCE], lat_deg, lon_deg,
                 usable=columns.get(USABLE))


def read_columns(path: Path | str, timed: bool = False, more: Sequence[str] = (), main: str = VERTICAL
                 ) -> tuple[str, dict[str, Array]]:
    """The file's name for ``place``, and the columns (n,) of a ``drive.csv`` by name, as they are written: their times
    may be uneven. Errors as in ``read_run``.

    timed    it is a rig's: speed and distance are 0, whatever it says of them
    more     columns that are read as well
    main     the column that is read in place of the sensor's acceleration
    """
    needed = ((TIME, main) if timed else COLUMNS) + tuple(more)
    path = file_in(path, DRIVE)
    names, table, file = parse_columns(read_bounded(path, MAX_BYTES), str(path), partial(_choose, needed=needed),
                                       _HEADER.format(",".join(needed)), of_samples=True)
    columns = {name: taken(_QUANTITIES.get(name, bounds.SIGNAL), name, column, file)
               for name, column in zip(names, table.T, strict=True)}
    columns[VERTICAL] = columns.pop(main)
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
    max_time_s = 1e5  # a day and more; of later times the ten digits of a drive do not distinguish samples
    header, path = (TIME, SPEED), file_in(path, DRIVE)
    _, table, file = parse_columns(read_bounded(path, MAX_BYTES), str(path),
                                   lambda names: header if all(names.count(name) == 1 for name in header) else None,
                                   f"a header with {','.join(header)}, each once", of_samples=True)
    time_s = taken(replace(bounds.TIME, largest=max_time_s), TIME, table[:, 0], file)
    speed_mps = taken(bounds.SPEED, SPEED, table[:, 1], file)
    check_grows(time_s, file)
    if (speed_mps < 0).any():
        row = int(np.argmax(speed_mps < 0))
        raise BadInput(f"{place(file, row)}: expected a speed of 0 or more, found {speed_mps[row]:g}")
    return time_s, speed_mps


def track_of(profile: Wheelpaths) -> Track:
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
    """Write what drives a rig, with its own times, to ten digits; elevations that are all 0 beside forces are not. An
    OSError if that fails."""
    heights = excitation.elevation_m.reshape(len(excitation.elevation_m), -1).T
    time_s = excitation.start_s + np.arange(heights.shape[1]) / excitation.rate_hz
    pushes = {} if excitation.force_n is None else {
        one.name: column for one, column in zip(excitation.forces, excitation.force_n.T, strict=True)}
    kept = (time_s, *heights) if heights.any() or not pushes else (time_s,)
    names = PART_COLUMNS if excitation.moves_part else EXCITATION_COLUMNS
    write_drive(path, {**dict(zip(names, kept, strict=False)), **pushes})


def write_table(path: Path, names: Sequence[str], table: Array, form: str) -> None:
    """Write rows (n, names) below their names, each number in a ``form``, times in their own. OSError if that fails."""
    lines_at_once = 50_000
    line = ",".join(_TIME_FORM if name == TIME else form for name in names) + "\n"
    blocks = (table[first : first + lines_at_once] for first in range(0, len(table), lines_at_once))
    write_text(path, chain([",".join(names) + "\n"],
                           (line * len(block) % tuple(block.ravel().tolist()) for block in blocks)), "ascii")


def _choose(names: tuple[str, ...], needed: tuple[str, ...]) -> tuple[str, ...] | None:
    """The columns to read; None when one of them is missing or there twice."""
    wanted = needed + (PLACE if any(name in names for name in PLACE) else ())
    wanted += (USABLE,) if USABLE in names else ()
    return wanted if all(names.count(name) == 1 for name in wanted) else None
