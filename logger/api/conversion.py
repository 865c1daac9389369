"""Logs as files for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from logger.api.outputs import check_out
from logger.api.shown import Shown
from logger.errors import BadInput
from logger.printable import counted


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
        said = f"{self.path}: {counted(self.rows, 'window')}"
        if self.placed < self.rows:
            said += f", {self.rows - self.placed} of them without a position"
        if self.damaged_lines:
            said += f"; {counted(self.damaged_lines, 'damaged line')} left out ('ridelog verify' lists them)"
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
    from logger.exchange.format import format_of, write_layer
    from logger.exchange.windows import windows_layer
    from logger.store.log.log_reader import find_logs_in, read_found

    path = Path(to)
    form = format_of(path)
    places = [Path(logs)] if isinstance(logs, str | Path) else [Path(one) for one in logs]
    found = find_logs_in(places)
    check_out(path, (), [log for log, _ in found], "--to")
    files = read_found(found)
    layer = windows_layer(files)
    if not layer.features:
        raise BadInput(f"{', '.join(map(str, places))}: expected a log with at least one intact row")
    write_layer(layer, path)
    return Conversion(path, form.name, len(layer.features), layer.placed, sum(one.damaged_lines for one in files))
