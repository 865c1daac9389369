"""Excitations as files: ``excitation.csv``, what stood under the wheels of a rig over time."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from logger.bounds import ELEVATION
from logger.errors import BadInput
from logger.files import read_bounded
from logger.profiles.excitation import Excitation
from logger.store.formats.csv_table import parse_columns, place, taken
from logger.store.formats.record_file import MAX_BYTES, TIME, even_rate_hz

COLUMNS = (TIME, "elevation_m", "elevation_rear_m")
_FEWEST = 4


def read_excitation(path: Path | str) -> Excitation:
    """Read CSV ``t_s,elevation_m[,elevation_rear_m]``; it begins at the file's own time.

    Raises BadInput ("file:line: expected ..., found ...") for anything else, for times that are not even and for
    elevations that no rig has.
    """
    names, table, file = parse_columns(
        read_bounded(path, MAX_BYTES), str(path), lambda names: names if names in (COLUMNS[:2], COLUMNS) else None,
        f"the header {','.join(COLUMNS[:2])}[,{COLUMNS[2]}]")
    if len(table) < _FEWEST:
        raise BadInput(f"{place(file, len(table))}: expected at least {_FEWEST} samples, found the end of the file")
    columns = [taken(ELEVATION, name, column, file) for name, column in zip(names[1:], table.T[1:], strict=True)]
    heights = np.stack(columns, axis=1) if len(columns) > 1 else columns[0]
    return Excitation(even_rate_hz(table[:, 0], file), np.ascontiguousarray(heights), float(table[0, 0]))
