"""Logs as files for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.outputs import check_out
from logger.api.shown import Shown
from logger.errors import BadInput
from logger.left_out import LeftOut, counting, left_out_lines
from logger.printable import counted
from logger.report.left_rows import damaged

if TYPE_CHECKING:
    from logger.exchange.layer import Layer
    from logger.store.log.log_reader import LoggedFile


@dataclass(frozen=True, eq=False, repr=False)
class Conversion(Shown):
    """What was written.

    path             the file
    format           its ending
    rows             windows in it, or ways
    placed           those of them with a place on the ground
    damaged_lines    lines of the logs that were left out
    of               what a row is
    """

    path: Path
    format: str
    rows: int
    placed: int
    damaged_lines: int
    of: str = "window"

    @property
    def left_out(self) -> tuple[LeftOut, ...]:
        """What of the logs is not in it."""
        return counting([damaged(self.damaged_lines)])

    def __repr__(self) -> str:
        said = f"{self.path}: {counted(self.rows, self.of)}"
        if self.placed < self.rows:
            said += f", {self.rows - self.placed} of them without a position"
        return "\n".join([said, *left_out_lines(self.left_out)])


def convert(logs: Path | str | Sequence[Path | str], to: Path | str, smoothness: Path | str | None = None
            ) -> Conversion:
    """Write the intact rows of segment logs for other programs, in the format that the file's ending asks for.

    logs    folders at any depth, or files, of segment logs; open ones too
    to      file with one of the endings that ``ridelog convert --help`` lists; GeoPackage and Parquet need the ``maps``
            extra. Written whole, or not at all.
    smoothness    GeoJSON with ways of OpenStreetMap: instead of the rows, each way that was driven, with the value of
                  the key ``smoothness`` that its IRI suggests, for a person to review

    Raises BadInput for another ending, a missing extra, no log or none with an intact row, a file without ways, and
    where none of them was driven.

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
    check_out(path, (), [*([] if smoothness is None else [Path(smoothness)]), *(log for log, _ in found)], "--to")
    files = read_found(found)
    if not any(one.records for one in files):
        raise BadInput(f"{', '.join(map(str, places))}: expected a log with at least one intact row")
    layer = windows_layer(files) if smoothness is None else _ways(files, smoothness)
    write_layer(layer, path)
    return Conversion(path, form.name, len(layer.features), layer.placed, sum(one.damaged_lines for one in files),
                      "window" if smoothness is None else "way")


def _ways(files: Sequence[LoggedFile], roads: Path | str) -> Layer:
    from logger.report.smoothness_layer import smoothness_layer
    from logger.store.formats.road_lines import read_map_ways

    layer = smoothness_layer([one for file in files for one in file.records], read_map_ways(roads))
    if not layer.features:
        raise BadInput(f"{roads}: expected ways that these logs passed with an IRI, found none")
    return layer
