"""Acceleration records as CSV: evenly sampled columns, recognised by the names in the header.

Problem: an hour at 1000 Hz is 3.6 million lines, and a record with a hole or an uneven clock gives figures that look
like any others. Solution: the times must lie on an even grid, but for the rounding of their digits; a record that does
not is refused with its line. Columns of other names are not read.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from logger import bounds
from logger.arrays import Array
from logger.bounds import EVEN_SAMPLES
from logger.dsp.whole_record import mean_rate_hz, on_even_grid
from logger.errors import BadInput
from logger.files import file_in, read_bounded
from logger.runs import NO_READING
from logger.store.formats.csv_table import parse_columns, place, taken

DRIVE_NAME = "drive.csv"
TIME = "t_s"
VERTICAL = "accel_z_mps2"
USABLE = "usable"
HORIZONTAL = ("accel_x_mps2", "accel_y_mps2")
MAX_BYTES = 1024 * 1024 * 1024
HOLE_STEPS = 2.5  # Longer than so many steps is a hole: more than one sample is lost
_HEADER = f"a header with {TIME},{VERTICAL}[,{','.join(HORIZONTAL)}], each once"


@dataclass(frozen=True, eq=False)
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

    @property
    def by_axis(self) -> dict[str, Array | None]:
        """The accelerations by axis: ``z``, ``x``, ``y``."""
        return {"z": self.accel_z_mps2, "x": self.accel_x_mps2, "y": self.accel_y_mps2}


def read_record(path: Path | str) -> AccelerationRecord:
    """Read a CSV record with the columns ``t_s`` and ``accel_z_mps2``, perhaps ``accel_x_mps2`` and ``accel_y_mps2``.

    Raises BadInput ("file:line: expected ..., found ...") for anything else.
    """
    file, t_s, accel, _ = read_columns(path)
    rate_hz = even_rate_hz(t_s, file)
    return AccelerationRecord(float(t_s[0]), rate_hz, accel[VERTICAL], *(accel.get(name) for name in HORIZONTAL))


def read_columns(path: Path | str) -> tuple[str, Array, dict[str, Array], Array | None]:
    """The file's name for ``place``, the times (n,) [s] and accelerations by column (n,) of a record, the vertical
    first, as they are written, and the column ``usable`` (n,) of a drive; None where there is none.

    Raises BadInput ("file:line: expected ..., found ...") but for times that are not even.
    """
    path = file_in(path, DRIVE_NAME)
    wanted, table, file = parse_columns(read_bounded(path, MAX_BYTES), str(path), _choose, _HEADER, of_samples=True)
    columns = dict(zip(wanted[1:], table.T[1:], strict=True))
    usable = columns.pop(USABLE, None)
    return file, taken(bounds.TIME, TIME, table[:, 0], file), {
        name: taken(bounds.ACCELERATION, name, samples, file) for name, samples in columns.items()}, usable


def _choose(names: tuple[str, ...]) -> tuple[str, ...] | None:
    """The columns to read; None when one of them is missing or there twice."""
    wanted = (TIME, VERTICAL, *(name for name in (*HORIZONTAL, USABLE) if name in names))
    return wanted if all(names.count(name) == 1 for name in wanted) else None


def check_grows(t_s: Array, file: str, mend: str = "") -> None:
    """BadInput, with what would ``mend`` it, for a time that is not after the one before."""
    if (early := np.diff(t_s) < 1.0 / bounds.FASTEST_HZ).any():
        sample = int(np.argmax(early)) + 1
        raise BadInput(f"{place(file, sample)}: expected a time after {t_s[sample - 1]:.10g} s, found "
                       f"{t_s[sample]:.10g}{mend}")


def even_rate_hz(t_s: Array, file: str, mend: str = "") -> float:
    """The rate of the times; BadInput with the line where they leave an even grid, and what would ``mend`` it."""
    taken(bounds.TIME, TIME, t_s, file)
    steps = np.diff(t_s)
    check_grows(t_s, file, mend if (steps >= 0).all() and steps.any() else "")
    step_s = float(t_s[-1] - t_s[0]) / len(steps)
    off = _off_even(t_s)
    if (off > _tolerance_s(step_s)).any():
        usual_s = float(np.median(steps))
        odd = np.abs(steps - usual_s) > _tolerance_s(usual_s)
        if not odd.any():
            raise BadInput(f"{place(file, int(np.argmax(off)))}: expected samples evenly {step_s:.6g} s apart, found "
                           f"one {off.max():.3g} s off: the clock drifts{mend}")
        sample = int(np.argmax(odd)) + 1
        raise BadInput(f"{place(file, sample)}: expected samples evenly {usual_s:.6g} s apart, found a step of "
                       f"{steps[sample - 1]:.6g} s{mend}")
    return 1.0 / step_s


def laid_evenly(t_s: Array, columns: Array, usable: Array, file: str) -> tuple[float, Array, Array]:
    """A rate, columns (n, c) at even times and how ``usable`` (n,) they are there: as they are, or, where a clock is
    uneven or rows were left out, laid on even times, of which those in holes have no reading. BadInput as
    ``even_rate_hz``, where fewer than half of the samples are there too."""
    steps = np.diff(t_s)
    if (steps <= 0).any() or (_off_even(t_s) <= _tolerance_s(float(steps.mean()))).all():
        return even_rate_hz(t_s, file), columns, usable
    taken(bounds.TIME, TIME, t_s, file)
    rate_hz = mean_rate_hz(t_s)
    rows = np.append(0.0, np.cumsum(np.rint(steps * rate_hz)))
    if 2 * len(rows) < rows[-1]:
        even_rate_hz(t_s, file)
    even_s = np.interp(rows, rows[[0, -1]], t_s[[0, -1]])
    if (np.abs(t_s - even_s) <= _tolerance_s(1 / rate_hz)).all():  # but for rows that were left out
        t_s, rate_hz = even_s, float(rows[-1] / (t_s[-1] - t_s[0]))
    laid = on_even_grid(t_s, columns, rate_hz, rate_hz)
    at = np.interp(t_s[0] + np.arange(len(laid)) / rate_hz, t_s, np.arange(len(t_s)))
    beside = np.array([np.floor(at + EVEN_SAMPLES), np.ceil(at - EVEN_SAMPLES)], int)
    in_hole = np.diff(t_s[beside], axis=0)[0] > HOLE_STEPS * np.median(steps)
    marks = usable[beside]
    return rate_hz, laid, np.where(in_hole | (marks == NO_READING).any(axis=0), NO_READING, marks.max(axis=0))


def _off_even(t_s: Array) -> Array:
    """How far times (n,) are from an even grid between the first and the last [s]."""
    return np.abs(t_s - np.linspace(t_s[0], t_s[-1], len(t_s)))


def _tolerance_s(step_s: float) -> float:
    """How far a time may be from an even grid, as its digits are rounded [s]."""
    # A time printed with three decimals is up to half a millisecond off, and so are the ends that the grid is laid
    # between.
    rounding_s = 0.00101
    return min(rounding_s, bounds.ROUNDING_STEPS * step_s)
