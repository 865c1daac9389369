"""What was under the wheels, as files: road profiles (CSV of ours, ERD of the profilers) and excitations of rigs.

Problem: a profile is long (400,000 lines for 10 km at 25 mm), comes from many hands, and everything computed from it
assumes that its samples are evenly spaced. A hole or an uneven step changes the result without a trace.

Its unit is that of the columns' names: ``elevation_mm``, ``distance_ft``. What can be no road in that unit is refused
(``logger.roads.iri``).

Solution: distances must lie on an even grid, but for the rounding of their digits; anything else is refused with its
line. Straight lines between the samples are laid through an uneven profile only when ``resample_m`` asks for it, and
the profile says so.

ERD is the format of the Engineering Research Division of UMTRI ("The ERD File Specification"; Sayers and others,
"ERD data-processing software reference manual", version 2.00, 1987). A header of text lines:

    ERDFILEV2.00
    channels, samples, records, bytes per record, key, step[, ...]
    SHORTNAMLElev.  RElev.              names of the channels, 8 columns each
    UNITSNAMin      in                  units of the channels, 8 columns each
    XUNITS  ft                          unit of the step
    ...                                 more keywords of 8 columns; a line that starts with & carries on the one before
    END

then the numbers, all channels of the first sample, all of the second and so on. The key says how they are written:
0 as 2-byte integers (times GAIN plus OFFSET), 1 as 4-byte and 2 as 8-byte floating point, 5 as text. Text follows the
header. Binary numbers stand in a file of the same name with ``.bin`` added, or in place of the suffix, or, in the
oldest files, right behind the END line. The specification names no byte order; little-endian is read here, and numbers
that can be no elevations in it are refused. Units are never guessed: a file that does not name them is refused.
"""

import re
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite, nan
from pathlib import Path

import numpy as np

from logger.arrays import Array
from logger.bounds import DISTANCE, ELEVATION, FORCE, MOST_SAMPLES
from logger.errors import BadInput
from logger.files import file_in, read_bounded
from logger.profiles.excitation import AppliedForce, Excitation
from logger.roads.iri import UNITS_M, unit_complaint
from logger.store.formats.csv_table import HEAD_BYTES, LINE_BYTES, parse_columns, place, refuse_long_lines, shown, taken
from logger.store.formats.record_file import MAX_BYTES, TIME, even_rate_hz, laid_evenly
from logger.units import FOOT_M

MAX_CHANNELS = 1000
MAX_NUMBERS = 50_000_000
SHORTEST_STEP, LONGEST_STEP = 1e-6, 1e6

_FIELD_CHARS = 20
_BINARY = {0: "<i2", 1: "<f4", 2: "<f8"}
_TEXT = 5
_UNITS_M = {"m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0,
            "ft": FOOT_M, "feet": FOOT_M, "foot": FOOT_M, "in": FOOT_M / 12, "inch": FOOT_M / 12, "inches": FOOT_M / 12,
            "mil": FOOT_M / 12_000, "mils": FOOT_M / 12_000}
_LEFT = re.compile(r"\b(left|lft|lwp|l[ ._]*(elev|prof))", re.IGNORECASE)
_RIGHT = re.compile(r"\b(right|rgt|rwp|r[ ._]*(elev|prof))", re.IGNORECASE)


@dataclass(frozen=True)
class ErdFile:
    """A table with one row per sample.

    spacing_m   step between samples [m]
    values      (samples, channels) in the units of the file
    names, units                        of the channels, as written; names may be empty
    place       "file:line" of the line that says how many channels there are
    """

    spacing_m: float
    values: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    place: str

    def wheel_tracks(self) -> tuple[Array, ...]:
        """Elevations (samples,) [m] of one track, or of the left and the right one.

        One channel is one track. Of several, the left and the right one are recognised by their names (LElev., Right
        Profile ...); two channels without names are left and right in this order. BadInput otherwise.
        """
        chosen = self._sides()
        tracks = tuple(self.values[:, channel] * _metres(
            self.units[channel], f"{self.place}: expected elevations in", f" for channel {channel + 1} (UNITSNAM)")
            for channel in chosen)
        if any(np.abs(track).max(initial=0.0) > ELEVATION.largest for track in tracks):
            raise BadInput(f"{self.place}: expected elevations within {ELEVATION.largest:g} m, found "
                           f"{max(np.abs(track).max() for track in tracks):.3g} (another byte order?)")
        return tracks

    def _sides(self) -> tuple[int, ...]:
        left = [channel for channel, name in enumerate(self.names) if _LEFT.search(name)]
        right = [channel for channel, name in enumerate(self.names) if _RIGHT.search(name)]
        if len(self.names) == 1:
            return (0,)
        if len(left) == 1 and len(right) == 1:
            return (left[0], right[0])
        if len(self.names) == 2 and not any(self.names):
            return (0, 1)
        names = shown(", ".join(self.names))
        raise BadInput(f"{self.place}: expected one channel, or one named left and one named right, found {names}")


def _metres(unit: str, expected: str, where: str = "") -> float:
    """What one of a unit is [m]. BadInput for an unknown one."""
    if (unit_m := _UNITS_M.get(unit.lower().rstrip("."))) is None:
        raise BadInput(f"{expected} m, mm, ft or in, found {shown(unit)}{where}")
    return unit_m


def parse_erd(data: bytes, path: Path | str) -> ErdFile:
    """Read an ERD file from its bytes; ``path`` names it in complaints and leads to its binary numbers.

    Raises BadInput ("file:line: expected ...") for what is not such a file, or is not all there.
    """
    header = _Header(data, str(path))
    layout = header.layout()
    if layout.key == _TEXT:
        numbers = _text_numbers(data[header.size:], str(path), header.lines + 1)
    else:
        numbers = _binary_numbers(data[header.size:], Path(path), layout)
    values = _shaped(numbers, layout, str(path))
    if layout.key == 0:
        gain, offset = header.factors("GAIN", 1.0, layout.channels), header.factors("OFFSET", 0.0, layout.channels)
        with np.errstate(over="ignore"):  # numbers that are none are refused below
            values = values * gain + offset
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        raise BadInput(f"{path}: expected finite numbers, found none in sample {int(np.argmin(finite)) + 1}")
    names = header.labels("SHORTNAM", 8, layout.channels) or header.labels("LONGNAME", 32, layout.channels)
    return ErdFile(layout.step * header.step_unit_m(), values, names or ("",) * layout.channels,
                   header.labels("UNITSNAM", 8, layout.channels) or ("",) * layout.channels, f"{path}:2")


@dataclass(frozen=True)
class _Layout:
    channels: int
    samples: int | None
    stored_bytes: int
    key: int
    step: float


class _Header:
    """The text lines up to END."""

    def __init__(self, data: bytes, file: str) -> None:
        self._file = file
        self._texts: dict[str, tuple[int, str]] = {}
        self._second = ""
        self.size = 0
        self.lines = 0
        keyword = ""
        while True:
            end = data.find(b"\n", self.size)
            stop = end if end >= 0 else len(data)
            text = data[self.size: min(stop, self.size + LINE_BYTES)].decode("latin-1").rstrip()
            self.size = min(stop + 1, len(data))
            self.lines += 1
            if text.upper() == "END":
                return
            if end < 0 or self.size > HEAD_BYTES:
                raise BadInput(f"{file}:{self.lines}: expected a line END after the header")
            if self.lines == 2:
                self._second = text
            elif text.startswith("&") and keyword:
                line, before = self._texts[keyword]
                self._texts[keyword] = line, before.ljust(-(-len(before) // 8) * 8) + text[8:]
            elif self.lines > 2:
                keyword = text[:8].strip().upper()
                self._texts.setdefault(keyword, (self.lines, text[8:]))

    def layout(self) -> _Layout:
        fields = [field[:_FIELD_CHARS] for field in re.split(r"[,\s]+", self._second) if field]
        expected = f"{self._file}:2: expected channels, samples, records, bytes, key, step"
        try:
            channels, samples, records, record_bytes, key = map(int, fields[:5])
            step = float(fields[5])
        except (ValueError, IndexError):
            raise BadInput(f"{expected}, found {shown(self._second)}") from None
        if not 1 <= channels <= MAX_CHANNELS:
            raise BadInput(f"{expected}, found {channels} channels")
        if not (samples == -1 or 1 <= samples <= MOST_SAMPLES):
            raise BadInput(f"{expected}, found {samples} samples")
        if not SHORTEST_STEP <= step <= LONGEST_STEP:
            raise BadInput(f"{expected} above 0, found a step of {step:g}")
        if key not in _BINARY and key != _TEXT:
            raise BadInput(f"{expected} with key 0, 1, 2 (binary) or 5 (text), found key {key}")
        return _Layout(channels, None if samples == -1 else samples, max(records, 0) * max(record_bytes, 0), key, step)

    def step_unit_m(self) -> float:
        """Metres per unit of the step."""
        line, text = self._texts.get("XUNITS", (2, ""))
        return _metres(text.strip(), f"{self._file}:{line}: expected XUNITS")

    def labels(self, keyword: str, width: int, count: int) -> tuple[str, ...]:
        """One text per channel, in columns of this width or parted by blanks; () without the keyword."""
        if keyword not in self._texts:
            return ()
        line, text = self._texts[keyword]
        columns = tuple(text[start: start + width].strip() for start in range(0, width * count, width))
        fits = not text[width * count:].strip()
        words = tuple(text.replace(",", " ").split())
        if fits and (all(columns) or len(words) != count):
            return columns
        if count > 1 and len(words) != count:
            raise BadInput(f"{self._file}:{line}: expected {count} entries of {width} columns after {keyword}, "
                           f"found {shown(text.strip())}")
        return words if count > 1 else (text.strip(),)

    def factors(self, keyword: str, absent: float, count: int) -> Array:
        """One number per channel, or ``absent`` for each when the keyword is."""
        if keyword not in self._texts:
            return np.full(count, absent)
        line, text = self._texts[keyword]
        try:
            numbers = [float(word) for word in text.replace(",", " ").split()]
        except ValueError:
            numbers = []
        if len(numbers) != count or not all(map(isfinite, numbers)):
            raise BadInput(f"{self._file}:{line}: expected {count} numbers after {keyword}, "
                           f"found {shown(text.strip())}")
        return np.array(numbers)


def _text_numbers(body: bytes, file: str, first_line: int) -> Array:
    """The numbers of whole lines, a block at a time: as words they take many times the memory of the file."""
    block_bytes = 1024 * 1024
    refuse_long_lines(body, file, first_line=first_line)
    numbers = array("d")
    start = 0
    while start < len(body) and len(numbers) <= MAX_NUMBERS:
        end = body.find(b"\n", start + block_bytes) + 1 or len(body)
        block = body[start:end]
        try:
            values = array("d", map(float, block.replace(b",", b" ").split()))
        except ValueError:
            values = array("d", (nan,))
        if b"_" in block or not np.isfinite(values).all():
            raise _odd_word(block, file, first_line + body.count(b"\n", 0, start))
        numbers.extend(values)
        start = end
    return np.frombuffer(numbers)


def _odd_word(block: bytes, file: str, first_line: int) -> BadInput:
    for line, text in enumerate(block.split(b"\n"), start=first_line):
        for word in text.replace(b",", b" ").split():
            if not _is_number(word):
                return BadInput(f"{file}:{line}: expected numbers, found {shown(word.decode('latin-1'))}")
    raise AssertionError("a block of good numbers")


def _is_number(word: bytes) -> bool:
    try:
        return b"_" not in word and isfinite(float(word))
    except ValueError:
        return False


def _binary_numbers(body: bytes, path: Path, layout: _Layout) -> Array:
    source = path
    if not body.strip():
        beside = [path.with_name(path.name + ".bin"), path.with_suffix(".bin"), path.with_suffix(".BIN")]
        found = [candidate for candidate in beside if candidate.is_file()]
        if not found:
            raise BadInput(f"{path}: expected its binary numbers in {beside[0].name} or {beside[1].name} beside it")
        source = found[0]
        body = read_bounded(source, MAX_NUMBERS * 8)
    kind = np.dtype(_BINARY[layout.key])
    row_bytes = layout.channels * kind.itemsize
    rows = len(body) // row_bytes if layout.samples is None else layout.samples
    wanted = rows * row_bytes
    if rows * layout.channels > MAX_NUMBERS:
        raise BadInput(f"{source}: expected at most {MAX_NUMBERS} numbers, found {rows * layout.channels}")
    if len(body) != wanted and not (len(body) > wanted and len(body) == layout.stored_bytes):
        raise BadInput(f"{source}: expected {wanted} bytes of numbers, found {len(body)}")
    with np.errstate(invalid="ignore"):  # numbers that are none are refused by the caller
        return np.frombuffer(body[:wanted], kind).astype(float)


def _shaped(numbers: Array, layout: _Layout, file: str) -> Array:
    rows, rest = divmod(len(numbers), layout.channels)
    if len(numbers) > MAX_NUMBERS:
        raise BadInput(f"{file}:2: expected at most {MAX_NUMBERS} numbers, found more")
    if rest or rows == 0 or (layout.samples is not None and rows != layout.samples):
        wanted = "rows of" if layout.samples is None else f"{layout.samples} samples of"
        raise BadInput(f"{file}:2: expected {wanted} {layout.channels} numbers, found {len(numbers)} numbers")
    return numbers.reshape(rows, layout.channels)


COLUMNS = ("distance_m", "elevation_m", "elevation_right_m")
PLACE = ("lat_deg", "lon_deg")
PROFILE_NAME = "profile.csv"
WIDEST_BRIDGED_M = 1.0
"""A straight line is laid across no wider hole than this: what lies in a wider one cannot be known."""


@dataclass(frozen=True, eq=False)
class Wheelpaths:
    """Elevations (n,) [m] of one or two wheel tracks at start_m, start_m + spacing_m, ... [m].

    widest_step_m    for a profile that was resampled: the widest distance between its samples that a straight line
                     was laid across [m]; None for samples as they were measured
    """

    start_m: float
    spacing_m: float
    elevation_m: Array
    elevation_right_m: Array | None
    widest_step_m: float | None = None


def read_profile(path: Path | str, resample_m: float | None = None, judged: bool = False) -> Wheelpaths:
    """Read a profile: CSV ``distance_m,elevation_m[,elevation_right_m]``, or ERD (recognised by its first line).

    resample_m    lay a grid of this spacing [m] over the profile, linearly between its samples
    judged        refuse elevations that no road has, as ``check_road``

    Raises BadInput ("file:line: expected ...") for a file that is neither, for values that are missing or not finite,
    and for distances that do not grow or, without ``resample_m``, are not evenly spaced.
    """
    path = file_in(path, PROFILE_NAME)
    data = read_bounded(path, MAX_BYTES)
    found = (_from_erd(parse_erd(data, path), str(path), resample_m) if data.lstrip().startswith(b"ERDFILEV") else
             _from_table(*parse_table(data, str(path)), resample_m))
    if judged:
        check_road(found, str(path))
    return found


def check_road(profile: Wheelpaths, name: str) -> None:
    """Raise BadInput for a profile that cannot be one in metres; ``name``: what it is called."""
    for track in (profile.elevation_m, profile.elevation_right_m):
        if track is not None and (words := unit_complaint(track, profile.spacing_m)):
            raise BadInput(f"{name}: {words}")


def parse_table(data: bytes, file: str) -> tuple[Array, str]:
    """The numbers of a CSV profile, (n, 2) or (n, 3): distance, elevation, right elevation [m]; and the file's name for
    ``place``. Columns may have another unit, by the ending of their names."""

    def choose(names: tuple[str, ...]) -> tuple[str, ...] | None:
        numbers = names[: -len(PLACE)] if names[-len(PLACE) :] == PLACE else names
        in_metres = tuple(f"{name.rpartition('_')[0]}_m" for name in numbers)
        units = {name.rpartition("_")[2] for name in numbers}
        return numbers if in_metres in (COLUMNS[:2], COLUMNS) and units <= set(UNITS_M) else None

    names, values, named = parse_columns(data, file, choose, f"the header {','.join(COLUMNS[:2])}[,{COLUMNS[2]}] "
                                         "(other units by name: distance_ft,elevation_in)")
    return values * [UNITS_M[name.rpartition("_")[2]] for name in names], named


def read_places(path: Path | str) -> tuple[Array, Array, Array]:
    """Distances [m], growing, latitudes and longitudes [degrees] (m,) of the rows of a CSV profile that have a place.

    Raises BadInput ("file:line: expected ...") for a profile of which fewer than two rows do, and for a place that
    cannot be.
    """
    path = file_in(path, PROFILE_NAME)
    wanted = (COLUMNS[0], *PLACE)
    _, values, file = parse_columns(
        read_bounded(path, MAX_BYTES), str(path), lambda names: wanted if set(wanted) <= set(names) else None,
        f"a header with {','.join(wanted)}, as positions locate a drive on the line", gaps=True)
    known = np.isfinite(values)
    placed = known[:, 1:].all(axis=1)
    if (half := known[:, 1:].any(axis=1) & ~placed).any():
        raise BadInput(f"{place(file, int(np.argmax(half)))}: expected both of {','.join(PLACE)} or neither")
    off = placed & ((np.abs(values[:, 1]) > 90) | (np.abs(values[:, 2]) > 180))
    if off.any():
        row = int(np.argmax(off))
        raise BadInput(f"{place(file, row)}: expected degrees within 90 north and south and 180 east and west, found "
                       f"{values[row, 1]:g},{values[row, 2]:g}")
    distances_m = taken(DISTANCE, "distances", np.where(placed, values[:, 0], 0.0), file)
    if placed.sum() < 2:
        raise BadInput(f"{path}: expected two rows or more with {','.join(PLACE)}, found {placed.sum()}")
    return distances_m[placed], values[placed, 1].copy(), values[placed, 2].copy()


def _from_table(table: Array, file: str, resample_m: float | None) -> Wheelpaths:
    try:
        tracks = [taken(ELEVATION, "elevations", track, file) for track in table.T[1:]]
    except BadInput as error:
        raise BadInput(f"{error} (in mm? Name the column by its unit, as elevation_mm)") from None
    distance = taken(DISTANCE, "distances", table[:, 0], file)
    if len(distance) < 2:
        raise BadInput(f"{place(file, 1)}: expected at least two samples, found the end of the file")
    steps = np.diff(distance)
    if (steps <= 0).any():
        sample = int(np.argmax(steps <= 0)) + 1
        raise BadInput(f"{place(file, sample)}: expected a distance above {distance[sample - 1]:.10g} m, "
                       f"found {distance[sample]:.10g}")
    if resample_m is not None:
        if steps.max() > WIDEST_BRIDGED_M:
            sample = int(np.argmax(steps)) + 1
            raise BadInput(f"{place(file, sample)}: expected no gap above {WIDEST_BRIDGED_M:g} m, found one of "
                           f"{steps[sample - 1]:.6g} m: cut the profile there")
        return _resampled(distance, tracks, resample_m, file)
    return Wheelpaths(float(distance[0]), _even_spacing(distance, steps, file), *_pair(tracks))


def _even_spacing(distance: Array, steps: Array, file: str) -> float:
    """Spacing of the even grid nearest to the distances [m]; BadInput when they are off it by more than rounding."""
    number = np.arange(len(distance), dtype=float)
    centred = number - number.mean()
    spacing_m = round(float(centred @ (distance - distance.mean()) / (centred @ centred)), 12)
    off_grid = distance - distance.mean() - spacing_m * centred
    if (np.abs(off_grid) <= _rounding_m(spacing_m)).all():
        return spacing_m
    usual_m = float(np.median(steps))
    hint = f"(--resample {usual_m:.4g} interpolates between the samples)"
    if steps.max() > WIDEST_BRIDGED_M:
        hint = "(cut the profile there)"
    odd = np.abs(steps - usual_m) > 2 * _rounding_m(usual_m)
    if odd.any():
        step = int(np.argmax(odd))
        fault = "a gap" if steps[step] > 1.5 * usual_m else "a step"
        raise BadInput(f"{place(file, step + 1)}: expected even steps of {usual_m:.6g} m, found {fault} of "
                       f"{steps[step]:.6g} m {hint}")
    grid = distance[0] + usual_m * number
    sample = int(np.argmax(np.abs(distance - grid) > _rounding_m(usual_m)))
    raise BadInput(f"{place(file, sample)}: expected even steps of {usual_m:.6g} m to reach {grid[sample]:.10g} m, "
                   f"found {distance[sample]:.10g} m {hint}")


def _rounding_m(spacing_m: float) -> float:
    # Distances printed with three decimals are up to half a millimetre off their grid; that much, and of short steps
    # 5 %, is taken for rounding.
    rounding_m, rounding_steps = 0.0006, 0.05
    return min(rounding_m, rounding_steps * spacing_m)


def _pair(tracks: Sequence[Array]) -> tuple[Array, Array | None]:
    return tracks[0], tracks[1] if len(tracks) > 1 else None


def _resampled(distance: Array, tracks: Sequence[Array], spacing_m: float, file: str) -> Wheelpaths:
    length_m = float(distance[-1] - distance[0])
    if not 0 < spacing_m <= length_m <= MOST_SAMPLES * spacing_m:
        raise BadInput(f"{file}: expected a spacing within the {length_m:.6g} m of profile to resample to, "
                       f"found {spacing_m:g} m")
    grid = distance[0] + spacing_m * np.arange(int(length_m / spacing_m + 1e-9) + 1)
    laid = [np.interp(grid, distance, track) for track in tracks]
    return Wheelpaths(float(distance[0]), spacing_m, *_pair(laid), float(np.diff(distance).max()))


def _from_erd(erd: ErdFile, file: str, resample_m: float | None) -> Wheelpaths:
    tracks = erd.wheel_tracks()
    if resample_m is not None:
        distance = erd.spacing_m * np.arange(len(tracks[0]), dtype=float)
        return _resampled(distance.astype(np.float64), tracks, resample_m, file)
    return Wheelpaths(0.0, erd.spacing_m, *_pair(tracks))


EXCITATION_COLUMNS = (TIME, "elevation_m", "elevation_rear_m")
PART_COLUMNS = (TIME, "displacement_m", "velocity_mps")
_FORCE = re.compile("force(_[a-z0-9_]+)?_n")
_OTHER_UNIT = re.compile("(force|elevation|displacement)(_[a-z0-9]+)*?_(kn|mn|lbf|lb|kgf|kg|v|mm|cm|um|in|ft)",
                         re.IGNORECASE)


def read_excitation(path: Path | str, forces: Sequence[AppliedForce] = ()) -> Excitation:
    """Read CSV ``t_s`` with ``elevation_m[,elevation_rear_m]``, forces (``force_n``, ``force_NAME_n``), or both; or
    of a part alone ``displacement_m`` or ``velocity_mps``. It begins at the file's own time, and has even ones
    (``laid_evenly``). A velocity beside a displacement is not read; one alone is integrated.

    forces    what each of its forces acts on

    Raises BadInput ("file:line: expected ..., found ...") for anything else, for times that are not even, for
    elevations and forces that no rig has, for forces of which is not said what they act on, and for a velocity alone
    whose zero seems off, as its integral drifts by more than it swings.
    """
    fewest = 4
    known = {one.name: one for one in forces}
    names, table, file = parse_columns(
        read_bounded(path, MAX_BYTES), str(path), partial(_driving, file=str(path)),
        f"the header {','.join(EXCITATION_COLUMNS[:2])}[,{EXCITATION_COLUMNS[2]}][,force_n][,force_NAME_n], in metres "
        f"and newtons, or of a part alone {','.join(PART_COLUMNS[:2])} or {TIME},{PART_COLUMNS[2]}")
    if len(table) < fewest:
        raise BadInput(f"{place(file, len(table))}: expected at least {fewest} samples, found the end of the file")
    pushes = tuple(name for name in names if _FORCE.fullmatch(name))
    if unsaid := [name for name in pushes if name not in known]:
        raise BadInput(f"{file}:1: expected a run.yaml beside it that says what {unsaid[0]} acts on, as forces: "
                       f"{{{unsaid[0]}: {{on: body}}}}, found none")
    if lost := [name for name in known if name not in pushes]:
        raise BadInput(f"{file}:1: expected a column {lost[0]}, as the run.yaml beside it says what that acts on, "
                       f"found {', '.join(names)}")
    columns = {name: taken(FORCE if name in pushes else ELEVATION, name, column, file)
               for name, column in zip(names[1:], table.T[1:], strict=True)}
    moves_part = names[1] in PART_COLUMNS
    heights = names[1:2] if moves_part else tuple(name for name in EXCITATION_COLUMNS if name in columns)
    rate_hz, laid, read = laid_evenly(table[:, 0], np.stack([columns[name] for name in (*heights, *pushes)], axis=1),
                                      np.ones(len(table)), file)
    if not read.all():
        even_rate_hz(table[:, 0], file)
    moved = laid[:, :len(heights)] if heights else np.zeros((len(laid), 1))
    if heights == PART_COLUMNS[2:]:
        moved = _way_of(moved, rate_hz, file)
    return Excitation(rate_hz, moved if len(heights) > 1 else moved[:, 0].copy(), float(table[0, 0]),
                      laid[:, len(heights):] if pushes else None, tuple(known[name] for name in pushes),
                      moves_part)


def _way_of(velocity_mps: Array, rate_hz: float, file: str) -> Array:
    """The displacement (n, 1) from the first sample on. BadInput as ``read_excitation``."""
    from scipy.interpolate import CubicSpline

    time_s = np.arange(len(velocity_mps)) / rate_hz
    way_m = np.asarray(CubicSpline(time_s, velocity_mps).antiderivative()(time_s))
    drift_m = float(way_m[-1, 0])
    swing_m = float(np.ptp(way_m[:, 0] - np.linspace(0.0, drift_m, len(way_m))))
    if abs(drift_m) > swing_m:
        raise BadInput(f"{file}: expected velocities of a part that stays on its bench, found a drift by "
                       f"{drift_m:.3g} m beside a stroke of {swing_m:.3g} m: give {PART_COLUMNS[1]}, or subtract "
                       f"the zero offset of {PART_COLUMNS[2]}")
    return way_m


def _driving(names: tuple[str, ...], file: str) -> tuple[str, ...] | None:
    """All columns, where the times come first and each of the others drives a rig, once; else None. BadInput for one in
    another unit."""
    if other := [name for name in names[1:] if names[0] == TIME and _OTHER_UNIT.fullmatch(name)]:
        raise BadInput(f"{file}:1: expected elevations in metres and forces in newtons (elevation_m, force_n), found "
                       f"{other[0]}: convert its numbers")
    heights = tuple(name for name in names if not _FORCE.fullmatch(name))
    moved = heights in (PART_COLUMNS[:2], PART_COLUMNS, (TIME, PART_COLUMNS[2]))
    if moved and heights != names:
        raise BadInput(f"{file}:1: expected a part that is moved ({' or '.join(PART_COLUMNS[1:])}) or forces on it, "
                       "found both")
    fits = moved or heights in (EXCITATION_COLUMNS[:1], EXCITATION_COLUMNS[:2], EXCITATION_COLUMNS)
    return names if fits and len(set(names)) == len(names) > 1 else None
