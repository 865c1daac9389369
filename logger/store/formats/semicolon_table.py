"""Tables of a road authority: columns between semicolons, Latin-1, the decimal sign a point or a comma, cells that may
be empty."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import numpy.typing as npt

from logger.errors import BadInput
from logger.files import read_bounded

Array = npt.NDArray[np.float64]

_MOST_BYTES = 1 << 30


def read_semicolons(path: Path, names: tuple[str, ...]) -> list[Array]:
    """The columns (n,) of these names; NaN where a cell is empty or no number.

    Raises BadInput (``file:line: expected ..., found ...``) for a file that cannot be read, a column that is not there,
    and one without a number.
    """
    text = read_bounded(path, _MOST_BYTES).decode("latin-1").removeprefix("\xef\xbb\xbf")
    header, _, rows = text.partition("\n")
    there = [one.strip().strip('"') for one in header.split(";")]
    if missing := [one for one in names if one not in there]:
        raise BadInput(f"{path}:1: expected a column {missing[0]}, found {'; '.join(there)[:160] or 'nothing'}")
    if not rows.strip():
        raise BadInput(f"{path}:2: expected numbers below the header, found nothing")
    try:
        table = np.genfromtxt(io.StringIO(rows.replace(",", ".")), delimiter=";", comments="\0", ndmin=2,
                              usecols=[there.index(one) for one in names])
    except ValueError:
        line = next(number for number, row in enumerate(rows.splitlines(), start=2)
                    if row.strip() and row.count(";") != header.count(";"))
        raise BadInput(f"{path}:{line}: expected {len(there)} cells between semicolons, as in the header") from None
    for name, column in zip(names, table.T, strict=True):
        if not np.isfinite(column).any():
            raise BadInput(f"{path}:2: expected numbers in the column {name}, found none")
    return list(table.T)
