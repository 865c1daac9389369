"""Logs as files for other programs."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from logger.api.shown import Shown
from logger.errors import BadInput


@dataclass(frozen=True, eq=False, repr=False)
class Conversion(Shown):
    """What was written.

    path             the file
    format           its ending
    rows             windows in it
    placed           those of them with a place on the ground
    damaged_lines    lines of the logs that were left out
    """

    path: Path
    format: str
    rows: int
    placed: int
    damaged_lines: int

    def __repr__(self) -> str:
        said = f"{self.path}: {_count(self.rows, 'window')}"
        if self.placed < self.rows:
            said += f", {self.rows - self.placed} of them without a position"
        if self.damaged_lines:
            said += f"; {_count(self.damaged_lines, 'damaged line')} left out ('ridelog verify' lists them)"
        return said


def convert(logs: Path | str | Sequence[Path | str], to: Path | str) -> Conversion:
    """Write the intact rows of segment logs for other programs, in the format that the file's ending asks for.

    logs    folders at any depth, or files, of segment logs; open ones too
    to      ``.csv``, ``.geojson`` (RFC 7946), ``.gpkg`` (OGC 12-128), ``.gpx`` (1.1), ``.kml`` (2.2) or ``.parquet``
            (GeoParquet 1.1); GeoPackage and Parquet need the ``maps`` extra. Written whole, or not at all.

    Raises BadInput for another ending, a missing extra, no log or none with an intact row.

    >>> convert(folder / "logs", folder / "drive.geojson").rows > 0
    True
    """
    from logger.exchange.format import format_of
    from logger.exchange.windows import windows_of
    from logger.store.log.log_reader import find_logs, read_logged

    path = Path(to)
    form = format_of(path)
    places = [Path(logs)] if isinstance(logs, str | Path) else [Path(one) for one in logs]
    found = {log.resolve(): (log, place) for place in places for log in find_logs(place)}
    _check(path, [log for log, _ in found.values()])
    files = [logged for log, place in found.values() if (logged := read_logged(log, place)) is not None]
    windows = windows_of(files)
    if not windows.rows:
        raise BadInput(f"{', '.join(map(str, places))}: expected a log with at least one intact row")
    new = path.with_name(f".{os.getpid()}-{path.name}")  # GDAL goes by the ending
    try:
        form.write(windows, new)
        new.replace(path)
    except OSError as error:
        raise BadInput(f"{path}: expected a file that can be written ({error.strerror or error})") from None
    finally:
        new.unlink(missing_ok=True)
    return Conversion(path, form.name, len(windows.rows), windows.placed, sum(one.damaged_lines for one in files))


def _check(out: Path, logs: Sequence[Path]) -> None:
    """Raise BadInput where the file to write is a log, or cannot be written."""
    from logger.api.outputs import check_out

    check_out(out, (), logs, "--to")


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'s' * (number != 1)}"
