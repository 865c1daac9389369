"""Records of many channels as CSV: ``t_s`` and any number of evenly sampled columns, named by the header."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from logger.bounds import SIGNAL
from logger.dsp.repeated_samples import find_holds, find_repeats
from logger.errors import BadInput
from logger.files import file_in, read_bounded
from logger.store.formats.csv_table import parse_columns, place, taken
from logger.store.formats.drive_file import DISTANCE, DRIVE, PLACE, SPEED, USABLE, header_of
from logger.store.formats.record_checks import hold_doubts
from logger.store.formats.record_file import MAX_BYTES, TIME, even_rate_hz

Array = npt.NDArray[np.float64]

MAX_CHANNELS = 64
LONGEST_NAME = 100
NOT_SENSORS = (SPEED, DISTANCE, *PLACE, USABLE)
"""Columns of a drive that say where and how the car went."""
_STANDING_M = 1.0  # a receiver that stands wanders by more, a wheel's counter by less


@dataclass(frozen=True)
class ChannelRecord:
    """Samples (n, channels) of the named channels at start_s, start_s + 1 / rate_hz, ... [s]."""

    names: tuple[str, ...]
    start_s: float
    rate_hz: float
    samples: Array


def read_channels(path: Path | str, only: Sequence[str] = ()) -> ChannelRecord:
    """Read a CSV record: the named columns in that order, or all but ``t_s`` and what is no sensor of a drive.

    Raises BadInput ("file:line: expected ..., found ...") for anything else.
    """
    path = file_in(path, DRIVE)
    file = str(path)
    wished = ",".join(only) if only else "CHANNEL[,CHANNEL...]"
    if no_sensors := [name for name in only if name in NOT_SENSORS]:
        raise BadInput(f"{file}:1: expected columns of sensors, found {no_sensors[0]}, which says how the car went")

    def choose(names: tuple[str, ...]) -> tuple[str, ...] | None:
        wanted = tuple(only) or tuple(name for name in names if name not in (TIME, *NOT_SENSORS))
        good = names.count(TIME) == 1 and wanted and all(_is_name(name) and names.count(name) == 1 for name in wanted)
        return (TIME, *wanted) if good and len(wanted) <= MAX_CHANNELS else None

    header = f"a header with {TIME},{wished}, each once, at most {MAX_CHANNELS}"
    wanted, table, file = parse_columns(read_bounded(path, MAX_BYTES), file, choose, header)
    if len(table) < 2:
        raise BadInput(f"{place(file, 1)}: expected at least two samples, found the end of the file")
    samples = np.stack([taken(SIGNAL, name, column, file)
                        for name, column in zip(wanted[1:], table.T[1:], strict=True)], axis=1)
    for column, name in enumerate(wanted[1:]):
        if not samples[:, column].std() > 1e-12 * np.abs(samples[:, column]).max():
            raise BadInput(f"{place(file, 0)}: expected {name} to move, found {samples[0, column]:g} all along; "
                           "leave its column out")
    if repeats := find_repeats(samples):
        raise BadInput(f"{file}: {repeats.complaint}: write a record only as often as the sensor is read")
    hold_doubts(table[:, 0], find_holds(table[:, 0], samples), file)
    return ChannelRecord(wanted[1:], float(table[0, 0]), even_rate_hz(table[:, 0], file), samples)


def is_drive(path: Path | str) -> bool:
    """Whether a CSV record is of a car that went somewhere: its speed or its distance says so. BadInput as above."""
    how = tuple(name for name in header_of(Path(path)) if name in (SPEED, DISTANCE))
    if not how:
        return False
    path = file_in(path, DRIVE)
    table = parse_columns(read_bounded(path, MAX_BYTES), str(path),
                          lambda there: how if set(how) <= set(there) else None, ",".join(how))[1]
    return any(float(np.ptp(one) if name == DISTANCE else one.max()) > _STANDING_M
               for name, one in zip(how, table.T, strict=True))


def _is_name(name: str) -> bool:
    """Something that can be shown and typed, of bytes that are text."""
    return 0 < len(name) <= LONGEST_NAME and name.isprintable() and "\ufffd" not in name
