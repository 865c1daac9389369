"""Acceleration records as CSV: evenly sampled columns, told by the names in the header.

Problem: an hour at 1000 Hz is 3.6 million lines, and a record with a hole or an uneven clock gives figures that look
like any others. Solution: NumPy reads the columns at once, and only when that fails are the lines looked at one by one
to name the one at fault. The times must lie on an even grid, but for the rounding of their digits; a record that does
not is refused with its line. Columns of other names are not read.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np
import numpy.typing as npt

from logger.errors import BadInput

Array = npt.NDArray[np.float64]

TIME = "t_s"
VERTICAL = "accel_z_mps2"
HORIZONTAL = ("accel_x_mps2", "accel_y_mps2")
MAX_BYTES = 1024 * 1024 * 1024
# Beyond this something else than an acceleration has been written, and its fourth power may not be a number.
MAX_MPS2 = 1e6
_SHOWN = 40
# A time printed with three decimals is up to half a millisecond off, and so are the ends that the grid is laid between.
_ROUNDING_S = 0.00101
_ROUNDING_STEPS = 0.2

_NUMBER = re.compile(rb"[ \t]*[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?[ \t]*\r?")
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


@dataclass(frozen=True)
class AccelerationRecord:
    """Samples at start_s, start_s + 1 / rate_hz, ... [s]; acceleration per axis (n,) [m/s2], None where not measured.

    z is vertical, x along the vehicle, y across it.
    """

    start_s: float
    rate_hz: float
    accel_z_mps2: Array
    accel_x_mps2: Array | None
    accel_y_mps2: Array | None

    @property
    def duration_s(self) -> float:
        """Every sample stands for one step of time [s]."""
        return len(self.accel_z_mps2) / self.rate_hz


def read_record(path: Path | str) -> AccelerationRecord:
    """Read a CSV record with the columns ``t_s`` and ``accel_z_mps2``, perhaps ``accel_x_mps2`` and ``accel_y_mps2``.

    Raises BadInput ("file:line: expected ..., found ...") for anything else, and OSError.
    """
    file = str(path)
    size = Path(path).stat().st_size
    if size > MAX_BYTES:
        raise BadInput(f"{file}: expected at most {MAX_BYTES} bytes, found {size}")
    data = Path(path).read_bytes().removeprefix(_BYTE_ORDER_MARK)
    columns = _Columns.of_header(data, file)
    table = columns.read(data)
    t_s = table[:, 0]
    rate_hz = _even_rate_hz(t_s, file)
    accel = dict(zip(columns.wanted[1:], table.T[1:].copy(), strict=True))
    for name, samples in accel.items():
        if (wild := np.abs(samples) > MAX_MPS2).any():
            line = int(np.argmax(wild)) + 2
            raise BadInput(f"{file}:{line}: expected {name} within {MAX_MPS2:g} m/s2, found {samples[line - 2]:g}")
    return AccelerationRecord(float(t_s[0]), rate_hz, accel[VERTICAL], *(accel.get(name) for name in HORIZONTAL))


@dataclass(frozen=True)
class _Columns:
    """The names in the header of a file, and those of them that are read."""

    file: str
    names: tuple[str, ...]
    wanted: tuple[str, ...]

    @classmethod
    def of_header(cls, data: bytes, file: str) -> _Columns:
        header = data[: data.find(b"\n")] if b"\n" in data else data
        text = header.decode("ascii", "replace").strip()
        names = tuple(name.strip() for name in text.split(","))
        wanted = (TIME, VERTICAL, *(name for name in HORIZONTAL if name in names))
        if any(names.count(name) != 1 for name in wanted):
            raise BadInput(f"{file}:1: expected a header with {TIME},{VERTICAL}[,{','.join(HORIZONTAL)}], each once, "
                           f"found {_shown(text)}")
        return cls(file, names, wanted)

    def read(self, data: bytes) -> Array:
        """(rows, wanted), every value finite, every row with as many fields as the header."""
        data = data.rstrip()
        rows = data.count(b"\n")
        if rows < 2:
            raise BadInput(f"{self.file}:{rows + 2}: expected at least two samples, found the end of the file")
        if data.count(b",") == (rows + 1) * (len(self.names) - 1):
            places = [self.names.index(name) for name in self.wanted]
            try:
                table = np.loadtxt(io.BytesIO(data), delimiter=",", comments=None, skiprows=1, usecols=places, ndmin=2)
            except ValueError:
                table = np.empty((0, 0))
            if len(table) == rows and np.isfinite(table).all():
                return table
        return self._by_line(data)

    def _by_line(self, data: bytes) -> Array:
        table = []
        for line, text in enumerate(data.split(b"\n")[1:], start=2):
            fields = text.split(b",")
            if len(fields) != len(self.names):
                raise BadInput(f"{self.file}:{line}: expected {len(self.names)} fields as in the header, found "
                               f"{_shown(text.decode('ascii', 'replace').strip())}")
            row = []
            for name in self.wanted:
                field = fields[self.names.index(name)]
                if not _NUMBER.fullmatch(field) or not isfinite(float(field)):
                    raise BadInput(f"{self.file}:{line}: expected a number for {name}, found "
                                   f"{_shown(field.decode('ascii', 'replace').strip())}")
                row.append(float(field))
            table.append(row)
        return np.array(table)


def _even_rate_hz(t_s: Array, file: str) -> float:
    """The rate of the times; BadInput with the line where they leave an even grid."""
    steps = np.diff(t_s)
    if (steps <= 0).any():
        sample = int(np.argmax(steps <= 0)) + 1
        raise BadInput(f"{file}:{sample + 2}: expected a time after {t_s[sample - 1]:.10g} s, found {t_s[sample]:.10g}")
    step_s = float(t_s[-1] - t_s[0]) / len(steps)
    tolerance_s = min(_ROUNDING_S, _ROUNDING_STEPS * step_s)
    off = np.abs(t_s - (t_s[0] + step_s * np.arange(len(t_s))))
    if (off > tolerance_s).any():
        usual_s = float(np.median(steps))
        odd = np.abs(steps - usual_s) > min(_ROUNDING_S, _ROUNDING_STEPS * usual_s)
        sample = int(np.argmax(odd)) + 1 if odd.any() else int(np.argmax(off))
        raise BadInput(f"{file}:{sample + 2}: expected samples evenly {usual_s:.6g} s apart, found a step of "
                       f"{steps[sample - 1]:.6g} s")
    return 1.0 / step_s


def _shown(text: str) -> str:
    return repr(text if len(text) <= _SHOWN else text[:_SHOWN] + "...") if text else "nothing"
