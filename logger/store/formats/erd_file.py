"""ERD files, in which profilers and their programs exchange road profiles.

The format is that of the Engineering Research Division of UMTRI ("The ERD File Specification"; Sayers and others,
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

from __future__ import annotations

import re
from array import array
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path

import numpy as np
import numpy.typing as npt

from logger.bounds import ELEVATION
from logger.errors import BadInput
from logger.files import read_bounded
from logger.store.formats.csv_table import refuse_long_lines, shown
from logger.units import FOOT_M

Array = npt.NDArray[np.float64]

MAX_CHANNELS = 1000
MAX_SAMPLES = 50_000_000
MAX_HEADER_LINES = 10_000
MAX_HEADER_BYTES = 1024 * 1024
MAX_NUMBERS = 50_000_000
SHORTEST_STEP, LONGEST_STEP = 1e-6, 1e6
MAX_LINE = 64 * 1024

_BLOCK_BYTES = 1024 * 1024
_FIELD_CHARS = 20
_BINARY = {0: "<i2", 1: "<f4", 2: "<f8"}
_TEXT = 5
_UNITS_M = {
    "m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0,
    "ft": FOOT_M, "feet": FOOT_M, "foot": FOOT_M, "in": FOOT_M / 12, "inch": FOOT_M / 12, "inches": FOOT_M / 12,
    "mil": FOOT_M / 12_000, "mils": FOOT_M / 12_000,
}
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
        tracks = tuple(self.values[:, channel] * self._unit_m(channel) for channel in chosen)
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

    def _unit_m(self, channel: int) -> float:
        unit_m = _UNITS_M.get(self.units[channel].lower().rstrip("."))
        if unit_m is None:
            raise BadInput(f"{self.place}: expected elevations in m, mm, ft or in, found {shown(self.units[channel])} "
                           f"for channel {channel + 1} (UNITSNAM)")
        return unit_m


def is_erd(data: bytes) -> bool:
    """Tell an ERD file by its first bytes."""
    return data.lstrip().startswith(b"ERDFILEV")


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
            text = data[self.size: min(stop, self.size + MAX_LINE)].decode("latin-1").rstrip()
            self.size = min(stop + 1, len(data))
            self.lines += 1
            if text.upper() == "END":
                return
            if end < 0 or self.lines == MAX_HEADER_LINES or self.size > MAX_HEADER_BYTES:
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
        """What the second line says."""
        fields = [field[:_FIELD_CHARS] for field in re.split(r"[,\s]+", self._second) if field]
        expected = f"{self._file}:2: expected channels, samples, records, bytes, key, step"
        try:
            channels, samples, records, record_bytes, key = map(int, fields[:5])
            step = float(fields[5])
        except (ValueError, IndexError):
            raise BadInput(f"{expected}, found {shown(self._second)}") from None
        if not 1 <= channels <= MAX_CHANNELS:
            raise BadInput(f"{expected}, found {channels} channels")
        if not (samples == -1 or 1 <= samples <= MAX_SAMPLES):
            raise BadInput(f"{expected}, found {samples} samples")
        if not SHORTEST_STEP <= step <= LONGEST_STEP:
            raise BadInput(f"{expected} above 0, found a step of {step:g}")
        if key not in _BINARY and key != _TEXT:
            raise BadInput(f"{expected} with key 0, 1, 2 (binary) or 5 (text), found key {key}")
        return _Layout(channels, None if samples == -1 else samples, max(records, 0) * max(record_bytes, 0), key, step)

    def step_unit_m(self) -> float:
        """Metres per unit of the step."""
        line, text = self._texts.get("XUNITS", (2, ""))
        unit_m = _UNITS_M.get(text.strip().lower().rstrip("."))
        if unit_m is None:
            raise BadInput(f"{self._file}:{line}: expected XUNITS m, mm, ft or in, found {shown(text.strip())}")
        return unit_m

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
    refuse_long_lines(body, file, first_line=first_line)
    numbers = array("d")
    start = 0
    while start < len(body) and len(numbers) <= MAX_NUMBERS:
        end = body.find(b"\n", start + _BLOCK_BYTES) + 1 or len(body)
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
