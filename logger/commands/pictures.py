"""``--out FILE.html`` of commands whose results have charts; ``.png``, ``.svg`` and ``.pdf`` hold the charts alone."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.outputs import check_outs
from logger.errors import BadInput
from logger.files import together, write_file
from logger.report.drawing import ENDINGS

if TYPE_CHECKING:
    from logger.chart_data import Chart

PAGE = ".html"
HELP = "write a page with pictures; .png, .svg or .pdf: the pictures alone"


def add_out(parser: argparse.ArgumentParser) -> None:
    """Declare ``--out`` of a command that writes nothing else with it."""
    parser.add_argument("--out", type=Path, action="append", default=[], metavar="FILE.html",
                        help=f"{HELP}; may repeat")


def is_picture(path: Path) -> bool:
    """Whether a file that was asked for is one."""
    return path.suffix.lower() in (PAGE, *ENDINGS)


def parted(asked: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Of files that ``--out`` was given: the pictures, and the others."""
    return [path for path in asked if is_picture(path)], [path for path in asked if not is_picture(path)]


def check_pictures(asked: Sequence[Path], read: Iterable[Path], beside: Sequence[tuple[str, Path | None]] = ()) -> None:
    """Raise BadInput where a file of ``--out`` is none of a picture, or cannot be written, nor those ``beside`` it."""
    if other := next((path for path in asked if not is_picture(path)), None):
        raise BadInput(f"--out {other}: expected a file that ends in one of {', '.join((PAGE, *ENDINGS))}")
    check_outs([*beside, *(("--out", path) for path in asked)], read=read)


def write_pictures(paths: Sequence[Path], title: str, of: str, text: str, charts_of: Callable[[], Sequence[Chart]]
                   ) -> None:
    """Write those that were asked for, all of them or none.

    of           what it is a result of, such as a file
    text         what the command prints
    charts_of    makes the charts
    """
    if not paths:
        return
    charts = charts_of()
    made = [_content(path, title, of, text, charts) for path in paths]
    with together():
        for path, content in zip(paths, made, strict=True):
            write_file(path, [content])


def _content(path: Path, title: str, of: str, text: str, charts: Sequence[Chart]) -> bytes:
    if path.suffix.lower() == PAGE:
        from logger.report.result_page import page

        return page(title, of, text, charts).encode()
    if not charts:
        raise BadInput(f"--out {path}: expected a result with pictures, found one without; {PAGE} holds its words")
    from logger.report.drawing import drawn

    return drawn(charts, path)
