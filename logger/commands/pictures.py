"""``--out FILE.html`` of commands whose results have charts; ``.png``, ``.svg`` and ``.pdf`` hold the charts alone."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.outputs import check_out
from logger.errors import BadInput
from logger.files import write_text
from logger.report.drawing import ENDINGS

if TYPE_CHECKING:
    from logger.chart_data import Chart

PAGE = ".html"
HELP = "write a page with pictures; .png, .svg or .pdf: the pictures alone"


def add_out(parser: argparse.ArgumentParser) -> None:
    """Declare ``--out`` of a command that writes nothing else with it."""
    parser.add_argument("--out", type=Path, metavar="FILE.html", help=HELP)


def is_picture(path: Path) -> bool:
    """Whether a file that was asked for is one."""
    return path.suffix.lower() in (PAGE, *ENDINGS)


def parted(asked: Sequence[Path] | None) -> tuple[Path | None, Path | None]:
    """Of files that ``--out`` was given: the picture, and the other one, the last of each kind."""
    found = {is_picture(path): path for path in asked or ()}
    return found.get(True), found.get(False)


def check_picture(path: Path | None, read: Iterable[Path]) -> None:
    """Raise BadInput where the file of ``--out`` is none of a picture, or cannot be written."""
    if path is None:
        return
    if not is_picture(path):
        raise BadInput(f"--out {path}: expected a file that ends in one of {', '.join((PAGE, *ENDINGS))}")
    check_out(path, (), read)


def write_picture(path: Path | None, title: str, of: str, text: str, charts_of: Callable[[], Sequence[Chart]]) -> None:
    """Write what was asked for; nothing where nothing was.

    of           what it is a result of, such as a file
    text         what the command prints
    charts_of    makes the charts
    """
    if path is None:
        return
    charts = charts_of()
    if path.suffix.lower() == PAGE:
        from logger.report.result_page import page

        write_text(path, page(title, of, text, charts))
    elif charts:
        from logger.report.drawing import draw

        draw(charts, path)
    else:
        raise BadInput(f"--out {path}: expected a result with pictures, found one without; {PAGE} holds its words")
