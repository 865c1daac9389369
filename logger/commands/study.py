"""Reproduce a table or a figure of the reference dissertation, or of other papers, with its printed values.

  ridelog study --list
  ridelog study table-4-4
  ridelog study fig-4-27 --out fig-4-27.html
  ridelog study all --quick --out studies
  ridelog study field --out studies
  ridelog study lira-cd DIR --vehicle mycar.yaml

Each printed item ends in one of four words: agrees, misprint, better, not reproducible. Where the dissertation
measured, the study simulates under the conditions that its text gives: the records were never published.
"""

from __future__ import annotations

import argparse
import json
import sys
from math import isfinite
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from logger.api.shown import check_outs
from logger.errors import EXIT_CHECK_FAILED, EXIT_DONE, BadInput
from logger.files import make_folder, together, write_text

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.studies.study import Cell, Result, Study, Table

QUICK_SHARE = 0.1
SHELF_NAMES = ("dissertation", "field", "roads")
_WIDTH, _NARROWEST = 118, 24
_BAR = 30


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", nargs="?", metavar="NAME",
                        help="the study, as --list names it; dissertation, field (other papers) or roads (public "
                             "records): all of that group; or all")
    parser.add_argument("folder", nargs="?", type=Path, metavar="DIR", help="the data of a study that needs some")
    parser.add_argument("--list", action="store_true", help="list the studies there are")
    parser.add_argument("--quick", action="store_true", help="a tenth of the draws and grid points")
    parser.add_argument("--out", type=Path, metavar="PLACE",
                        help="also write a page with tables and pictures; for all: a folder of pages with index.html")
    parser.add_argument("--vehicle", metavar="NAME|FILE", help="the car of a study of records of a road")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog study``."""
    from logger.studies.study import studies, study_of

    shelf = args.name if args.name in SHELF_NAMES else None
    known = studies(shelf)
    if args.list:
        if args.name != shelf:
            raise BadInput(f"study --list: expected no NAME with it, found {args.name}")
        for option, value in (("--quick", args.quick), ("--out", args.out)):
            if value:
                raise BadInput(f"study {option}: expected a NAME with it, not --list")
        _list(list(known.values()), args.json)
        return EXIT_DONE
    if args.name is None:
        raise BadInput("study: expected the NAME of a study, all, or --list")
    if args.name in ("all", shelf):
        return _all(list(known.values()), args)
    return _one(study_of(args.name, known), args)


def _one(study: Study, args: argparse.Namespace) -> int:
    from logger.studies.study import Workload

    if study.data and args.folder is None:
        raise BadInput(f"study {study.called}: expected DIR, {study.data}")
    if not study.data and args.folder is not None:
        raise BadInput(f"study {study.called}: expected no DIR, found {args.folder}")
    if not study.data and args.vehicle is not None:
        raise BadInput(f"study {study.called}: expected no --vehicle, found {args.vehicle}")
    check_outs([("--out", args.out)])
    show = show_progress if sys.stderr.isatty() else _show_nothing
    result = study.run(Workload(QUICK_SHARE if args.quick else 1.0, show, args.folder, args.vehicle))
    if args.out is not None:
        from logger.report.study_page import page

        write_text(args.out, page(study, result, share=QUICK_SHARE if args.quick else 1.0))
    if args.json:
        print(json.dumps(as_json(study, result), allow_nan=False))
    else:
        print("\n".join(lines(study, result)))
    return EXIT_CHECK_FAILED if study.differs(result) else EXIT_DONE


def _all(known: list[Study], args: argparse.Namespace) -> int:
    """Every study that needs no data of its own; pages of each and of all."""
    from logger.report.study_page import index, page
    from logger.studies.all_studies import carry_out_all

    if args.out is None:
        raise BadInput("study all: expected --out DIR, a folder for its pages")
    if args.folder is not None:
        raise BadInput(f"study all: expected no DIR, found {args.folder}")
    make_folder(args.out)
    chosen = [one for one in known if not one.data]
    share = QUICK_SHARE if args.quick else 1.0
    carried = {}
    try:
        for study, found in carry_out_all(chosen, share):
            carried[study.called] = found
            print(f"[{len(carried):{len(str(len(chosen)))}} of {len(chosen)}] {study.called}: "
                  f"{found.failure or study.words} ({found.seconds:.1f} s)", file=sys.stderr, flush=True)
    finally:  # what there is, when it is interrupted
        with together():
            for study in known:
                if study.called in carried and (result := carried[study.called].result) is not None:
                    write_text(args.out / f"{study.called}.html", page(study, result, "index.html", share))
            write_text(args.out / "index.html", index(known, carried, share))
    failed = [one for one in chosen if carried[one.called].failure]
    if args.json:
        print(json.dumps({"page": str(args.out / "index.html"), "studies": [
            {**_in_short(one), "seconds": round(carried[one.called].seconds, 2),
             "failure": carried[one.called].failure or None} for one in chosen]}))
    else:
        print(f"{len(chosen)} studies, {len(failed)} not as they state. Page: {args.out / 'index.html'}")
    return EXIT_CHECK_FAILED if failed else EXIT_DONE


def show_progress(done: int, of: int) -> None:
    """Show a bar with ``done`` parts of so many, on one line that is wiped at the end."""
    bar = "#" * (_BAR * done // of)
    print(f"\r[{bar:{_BAR}}] {done} of {of}" if done < of else "\r" + " " * (_BAR + 30) + "\r", end="", file=sys.stderr,
          flush=True)


def _show_nothing(_done: int, _of: int) -> None:
    pass


def _list(known: list[Study], wants_json: bool) -> None:
    if wants_json:
        print(json.dumps({"studies": [_in_short(one) for one in known]}))
        return
    if not known:
        print("No studies in this group.")
        return
    name, where, words = (max(len(getattr(one, what)) for one in known) for what in ("called", "where", "words"))
    for one in known:
        print(f"{one.called:{name}}  {one.words:{words}}  {one.where:{where}}  {one.title}")


def _in_short(study: Study) -> dict[str, Any]:
    return {"name": study.called, "where": study.where, "title": study.title, "covers": list(study.covers),
            "words": study.words, "items": [{"item": one.name, "word": str(one.word), "because": one.because}
                                            for one in study.items]}


# --- what is shown ---


def lines(study: Study, result: Result) -> list[str]:
    """What a person reads."""
    shown = [f"{study.where}: {study.title}", fill(study.how, _WIDTH)]
    for table in result.all_tables:
        shown += ["", table.title, *_table_lines(table)]
    differs = study.differs(result)
    words = [f"{', '.join(names)}: {item.word}. {item.because}" for names, item in study.groups]
    return [*shown, "", *(fill(one, _WIDTH, subsequent_indent="  ") for one in ([differs] if differs else words)), "",
            fill(result.verdict, _WIDTH)]


def _table_lines(table: Table) -> list[str]:
    """Columns as wide as what is in them; headings, and words where the line would be too long, are broken."""
    cells = [[column.text(cell) for column, cell in zip(table.columns, row, strict=True)] for row in table.rows]
    widths = [max(max((len(row[index]) for row in cells), default=0), max(map(len, column.name.split())))
              for index, column in enumerate(table.columns)]
    left = [index in table.words for index in range(len(widths))]
    while sum(widths) + 2 * len(widths) > _WIDTH and max(widths) > _NARROWEST:
        widths[widths.index(max(widths))] -= 1
    heads = _broken([column.name for column in table.columns], widths, lowest=True)
    return ["  ".join(f"{cell:<{width}}" if words else f"{cell:>{width}}"
                      for cell, width, words in zip(row, widths, left, strict=True)).rstrip()
            for rows in (heads, *(_broken(row, widths) for row in cells)) for row in rows]


def _broken(cells: list[str], widths: list[int], lowest: bool = False) -> list[tuple[str, ...]]:
    """The lines of a row whose cells are as wide; of heads, which stand ``lowest``, the last ones are full."""
    parts = [fill(cell, width, break_long_words=False).split("\n") for cell, width in zip(cells, widths, strict=True)]
    deep = max(map(len, parts))
    empty = [[""] * (deep - len(part)) for part in parts]
    return list(zip(*(blank + part if lowest else part + blank for part, blank in zip(parts, empty, strict=True)),
                    strict=True))


def as_json(study: Study, result: Result) -> dict[str, Any]:
    """All of it for a program; null for what is not there or has no number."""
    return {
        "study": study.called, **{key: value for key, value in _in_short(study).items() if key != "name"},
        "how": study.how, "source": study.source, "failure": study.differs(result) or None,
        "tables": [{"title": table.title, "columns": [column.name for column in table.columns],
                    "rows": [[_known(cell) for cell in row] for row in table.rows]} for table in result.all_tables],
        "verdict": result.verdict,
        "figures": [{**_figure(one.chart), "printed": one.printed or None} for one in result.pictures],
    }


def _figure(one: Chart) -> dict[str, Any]:
    from logger.chart_data import Bars, Field

    if isinstance(one, Bars):
        return {"title": one.title, "value": one.value_name, "bars": [list(bar) for bar in one.bars]}
    named: dict[str, Any] = {"title": one.title, "x": one.x_name, "y": one.y_name}
    if isinstance(one, Field):
        return {**named, "value": one.value_name, "x_values": one.x.tolist(), "y_values": one.y.tolist(),
                "values": [[_known(value) for value in row] for row in one.values.tolist()]}
    return {**named, "lines": [{"name": line.name, "x": line.x.tolist(), "y": [_known(y) for y in line.y.tolist()]}
                              for line in one.lines]}


def _known(cell: Cell) -> Cell:
    return None if isinstance(cell, float) and not isfinite(cell) else cell
