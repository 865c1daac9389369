"""``--out FILE.html`` of commands whose results have charts; ``.png``, ``.svg`` and ``.pdf`` hold the charts alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from logger.errors import BadInput
from logger.files import together, write_file
from logger.report.drawing import ENDINGS

if TYPE_CHECKING:
    from logger.api.shown import CommandResult
    from logger.chart_data import Chart

PAGE = ".html"
PICTURES = (PAGE, *ENDINGS)
HELP = "write a page with pictures; .png, .svg or .pdf: the pictures alone"


def is_picture(path: Path) -> bool:
    """Whether a file that was asked for is one."""
    return path.suffix.lower() in PICTURES


def parted(asked: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Of files that ``--out`` was given: the pictures, and the others."""
    return [path for path in asked if is_picture(path)], [path for path in asked if not is_picture(path)]


def write_pictures(paths: Sequence[Path], title: str, of: str, text: str, charts_of: Callable[[], Sequence[Chart]]
                   ) -> None:
    """Write those that were asked for, all of them or none.

    of           what it is a result of, such as a file
    text         what the command prints
    charts_of    makes the charts
    """
    from logger.report.result_page import page

    if paths:
        charts = charts_of()
        _write(paths, lambda: page(title, of, text, charts), charts)


def write_result(paths: Sequence[Path], found: CommandResult, of: str) -> None:
    """The same of a result, whose page may be its own."""
    if paths:
        _write(paths, lambda: found.as_page(of), found.charts())


def _write(paths: Sequence[Path], page: Callable[[], str], charts: Sequence[Chart]) -> None:
    made = [page().encode() if path.suffix.lower() == PAGE else _drawn(path, charts) for path in paths]
    with together():
        for path, content in zip(paths, made, strict=True):
            write_file(path, [content])


def _drawn(path: Path, charts: Sequence[Chart]) -> bytes:
    if not charts:
        raise BadInput(f"--out {path}: expected a result with pictures, found one without; {PAGE} holds its words")
    from logger.report.drawing import drawn

    return drawn(charts, path)
