"""Reproduce a table or a figure of the reference dissertation beside its printed values.

  ridelog study --list
  ridelog study table-4-4
  ridelog study fig-4-27 --out fig-4-27.html

Where the dissertation measured, the study simulates under the conditions that its text gives: the records were never
published.
"""

from __future__ import annotations

import argparse
import json
import sys
from math import isfinite
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from logger.errors import EXIT_DONE, BadInput
from logger.files import write_text

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.studies.study import Cell, Result, Study, Table

QUICK_SHARE = 0.1
_WIDTH = 118
_BAR = 30


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", nargs="?", metavar="NAME", help="the study, as --list names it")
    parser.add_argument("--list", action="store_true", help="list the studies there are")
    parser.add_argument("--quick", action="store_true", help="a tenth of the draws and grid points")
    parser.add_argument("--out", type=Path, metavar="FILE.html", help="also write a page with tables and pictures")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog study``."""
    from logger.studies.study import Effort, studies, study_of

    known = studies()
    if args.list:
        if args.name is not None:
            raise BadInput(f"study --list: expected no NAME beside it, found {args.name}")
        for option, value in (("--quick", args.quick), ("--out", args.out)):
            if value:
                raise BadInput(f"study {option}: expected a NAME with it, not --list")
        _list(list(known.values()), args.json)
        return EXIT_DONE
    if args.name is None:
        raise BadInput("study: expected the NAME of a study, or --list")
    study = study_of(args.name, known)
    tell = show_progress if sys.stderr.isatty() else _say_nothing
    result = study.run(Effort(QUICK_SHARE if args.quick else 1.0, tell))
    if args.out is not None:
        from logger.report.study_page import page

        write_text(args.out, page(study, result, QUICK_SHARE if args.quick else 1.0))
    if args.json:
        print(json.dumps(as_json(study, result), allow_nan=False))
    else:
        print("\n".join(lines(study, result)))
        if args.out is not None:
            print(f"\nPage: {args.out}")
    return EXIT_DONE


def show_progress(done: int, of: int) -> None:
    """Show a bar with ``done`` parts of so many, on one line that is wiped at the end."""
    bar = "#" * (_BAR * done // of)
    print(f"\r[{bar:{_BAR}}] {done} of {of}" if done < of else "\r" + " " * (_BAR + 30) + "\r", end="", file=sys.stderr,
          flush=True)


def _say_nothing(_done: int, _of: int) -> None:
    pass


def _list(known: list[Study], wants_json: bool) -> None:
    if wants_json:
        print(json.dumps({"studies": [{"name": one.called, "where": one.where, "title": one.title} for one in known]}))
        return
    name, where = (max(len(getattr(one, what)) for one in known) for what in ("called", "where"))
    for one in known:
        print(f"{one.called:{name}}  {one.where:{where}}  {one.title}")


# --- what is shown ---


def lines(study: Study, result: Result) -> list[str]:
    """What a person reads."""
    shown = [f"{study.where}: {study.title}", fill(study.how, _WIDTH)]
    for table in result.tables:
        shown += ["", table.title, *_table_lines(table)]
    return [*shown, "", fill(result.verdict, _WIDTH)]


def _table_lines(table: Table) -> list[str]:
    """Columns as wide as what is in them; a heading that is wider is broken into lines."""
    cells = [[column.text(cell) for column, cell in zip(table.columns, row, strict=True)] for row in table.rows]
    widths = [max(max((len(row[index]) for row in cells), default=0), max(map(len, column.name.split())))
              for index, column in enumerate(table.columns)]
    heads = [fill(column.name, width, break_long_words=False).split("\n")
             for column, width in zip(table.columns, widths, strict=True)]
    deep = max(map(len, heads))
    rows = [*zip(*([""] * (deep - len(head)) + head for head in heads), strict=True), *cells]
    left = [all(isinstance(row[index], str) for row in table.rows) for index in range(len(widths))]
    return ["  ".join(f"{cell:<{width}}" if words else f"{cell:>{width}}"
                      for cell, width, words in zip(row, widths, left, strict=True)).rstrip() for row in rows]


def as_json(study: Study, result: Result) -> dict[str, Any]:
    """All of it for a program; null for what is not there or has no number."""
    return {
        "study": study.called, "title": study.title, "where": study.where, "how": study.how,
        "tables": [{"title": table.title, "columns": [column.name for column in table.columns],
                    "rows": [[_known(cell) for cell in row] for row in table.rows]} for table in result.tables],
        "verdict": result.verdict, "figures": [_figure(one) for one in result.pictures],
    }


def _figure(one: Chart) -> dict[str, Any]:
    from logger.chart_data import Bars, Field

    if isinstance(one, Bars):
        return {"title": one.title, "value": one.value_name, "bars": [list(bar) for bar in one.bars]}
    told: dict[str, Any] = {"title": one.title, "x": one.x_name, "y": one.y_name}
    if isinstance(one, Field):
        return {**told, "value": one.value_name, "x_values": one.x.tolist(), "y_values": one.y.tolist(),
                "values": [[_known(value) for value in row] for row in one.values.tolist()]}
    return {**told, "lines": [{"name": line.name, "x": line.x.tolist(), "y": [_known(y) for y in line.y.tolist()]}
                              for line in one.lines]}


def _known(cell: Cell) -> Cell:
    return None if isinstance(cell, float) and not isfinite(cell) else cell
