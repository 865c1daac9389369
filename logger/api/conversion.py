"""Logs as files for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.log_questions import ConvertQuestion
from logger.api.outputs import check_out
from logger.api.question import function
from logger.api.shown import CommandResult
from logger.errors import BadInput
from logger.left_out import counting, left_out_json, left_out_lines
from logger.printable import counted
from logger.report.left_rows import damaged

if TYPE_CHECKING:
    from logger.exchange.layer import Layer
    from logger.store.log.log_reader import LoggedFile


@dataclass(frozen=True, eq=False, repr=False)
class Conversion(CommandResult):
    """What was written.

    path             the file
    format           its ending
    rows             windows in it, or ways
    placed           those of them with a place on the ground
    damaged_lines    lines of the logs that were left out
    """

    path: Path
    format: str
    rows: int
    placed: int
    damaged_lines: int


def converted(question: ConvertQuestion) -> Conversion:
    """The answer to ``ConvertQuestion``, which says what is raised."""
    from logger.exchange.format import format_of, write_layer
    from logger.exchange.windows import windows_layer
    from logger.store.log.log_reader import find_logs_in, read_found

    path, smoothness = Path(question.to), question.smoothness
    form, found = format_of(path), find_logs_in(question.places)
    check_out(path, (), [*([] if smoothness is None else [Path(smoothness)]), *(log for log, _ in found)], "--to")
    files = read_found(found)
    if not any(one.records for one in files):
        raise BadInput(f"{question.named()}: expected a log with at least one intact row")
    layer = windows_layer(files) if smoothness is None else _ways(files, smoothness)
    write_layer(layer, path)
    rows, placed, of = len(layer.features), layer.placed, "window" if smoothness is None else "way"
    damaged_lines = sum(one.damaged_lines for one in files)
    left_out = counting([damaged(damaged_lines)])
    words = f"{path}: {counted(rows, of)}" + f", {rows - placed} of them without a position" * (placed < rows)
    made = {"file": str(path), "format": form.name, "rows" if smoothness is None else "ways": rows, "placed": placed,
            "damaged_lines": damaged_lines, **left_out_json(left_out)}
    return Conversion("\n".join([words, *left_out_lines(left_out)]), made, path, form.name, rows, placed, damaged_lines)


convert = function("convert", ConvertQuestion, converted)


def _ways(files: Sequence[LoggedFile], roads: Path | str) -> Layer:
    from logger.report.smoothness_layer import smoothness_layer
    from logger.store.formats.road_lines import read_map_ways

    layer = smoothness_layer([one for file in files for one in file.records], read_map_ways(roads))
    if not layer.features:
        raise BadInput(f"{roads}: expected ways that these logs passed with an IRI, found none")
    return layer
