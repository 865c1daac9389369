"""``ridelog study``: what the studies print, beside what was printed."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Annotated, Any

from logger.errors import BadInput
from logger.files import make_folder, together, write_text
from logger.question import Answer, Argument, Checked, LongQuestion, Option, Verb

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.studies.study import Cell, Result, Study, Table

QUICK_SHARE = 0.1
SHELF_NAMES = ("dissertation", "field", "roads")
_WIDTH, _NARROWEST = 118, 24


@dataclass(frozen=True, kw_only=True)
class StudyQuestion(LongQuestion):
    """Reproduce a table or a figure of the reference dissertation, or of other papers, beside its published values.

      ridelog study --list
      ridelog study table-4-4
      ridelog study fig-4-27 --out fig-4-27.html
      ridelog study all --quick --out studies
      ridelog study field --out studies
      ridelog study lira-cd DIR --vehicle mycar.yaml

    Each item gets one of four verdicts: agrees, misprint, better, not reproducible. Where the dissertation
    measured, the study simulates under the conditions that its text gives: the records were never published.
    """

    name: Annotated[str | None, Argument(
        "the study, as --list names it; dissertation, field (other papers) or roads (public records): all of that "
        "group; or all", metavar="NAME")] = None
    folder: Annotated[Path | None, Argument("folder of the data, for a study that needs some", metavar="DIR",
        read=Path)] = None
    listed: Annotated[bool, Option("list the studies", flag="--list")] = False
    quick: Annotated[bool, Option("a tenth of the draws and grid points")] = False
    out: Annotated[Path | None, Option(
        "also write a page with tables and pictures; for all: a folder of pages with index.html", metavar="PLACE",
        read=Path)] = None
    vehicle: Annotated[str | None, Option("the car, for a study of road records", metavar="NAME|FILE")] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.listed and self.name not in (None, *SHELF_NAMES):
            raise self.complaint(f"study `listed`: expected no NAME with it, found {self.name}")
        if self.listed and (given := "quick" * self.quick or "out" * (self.out is not None)):
            raise self.complaint(f"study `{given}`: expected a NAME with it, not `listed`")
        if not self.listed and self.name is None:
            raise self.complaint("study: expected the NAME of a study, all, or `listed`")

    @property
    def share(self) -> float:
        """Of the draws and grid points."""
        return QUICK_SHARE if self.quick else 1.0


VERB = Verb(StudyQuestion, "logger.commands.study:answered")


def answered(asked: StudyQuestion) -> Answer:
    """The list, one study, or every study of a group that needs no data of its own."""
    from logger.studies.study import studies, study_of

    known = studies(asked.name if asked.name in SHELF_NAMES else None)
    if asked.listed:
        return Answer("\n".join(_list(list(known.values()))), {"studies": list(map(_in_short, known.values()))})
    assert asked.name is not None
    if asked.name in ("all", *SHELF_NAMES):
        return _all(list(known.values()), asked)
    return _one(study_of(asked.name, known), asked)


def _one(study: "Study", asked: StudyQuestion) -> Answer:
    from logger.api.shown import check_outs
    from logger.studies.study import Workload

    if study.data and asked.folder is None:
        raise BadInput(f"study {study.called}: expected DIR, {study.data}")
    if not study.data and asked.folder is not None:
        raise BadInput(f"study {study.called}: expected no DIR, found {asked.folder}")
    if not study.data and asked.vehicle is not None:
        raise BadInput(f"study {study.called}: expected no --vehicle, found {asked.vehicle}")
    check_outs([("--out", asked.out)])
    result = study.run(Workload(asked.share, lambda done, of: asked.progress(f"{done} of {of}"), asked.folder,
                                asked.vehicle))
    if asked.out is not None:
        from logger.report.study_page import page

        write_text(asked.out, page(study, result, share=asked.share))
    return Checked("\n".join(lines(study, result)), as_json(study, result), not study.differs(result))


def _all(known: list["Study"], asked: StudyQuestion) -> Answer:
    """Pages of each study and of all."""
    from logger.report.study_page import index, page
    from logger.studies.all_studies import carry_out_all

    if asked.out is None:
        raise BadInput("study all: expected --out DIR, a folder for its pages")
    if asked.folder is not None:
        raise BadInput(f"study all: expected no DIR, found {asked.folder}")
    make_folder(asked.out)
    chosen = [one for one in known if not one.data]
    carried = {}
    try:
        for study, found in carry_out_all(chosen, asked.share):
            carried[study.called] = found
            print(f"[{len(carried):{len(str(len(chosen)))}} of {len(chosen)}] {study.called}: "
                  f"{found.failure or study.words} ({found.seconds:.1f} s)", file=sys.stderr, flush=True)
    finally:  # what there is, when it is interrupted
        with together():
            for study in known:
                if study.called in carried and (result := carried[study.called].result) is not None:
                    write_text(asked.out / f"{study.called}.html", page(study, result, "index.html", asked.share))
            write_text(asked.out / "index.html", index(known, carried, asked.share))
    failed = [one for one in chosen if carried[one.called].failure]
    said = {"page": str(asked.out / "index.html"), "studies": [
        {**_in_short(one), "seconds": round(carried[one.called].seconds, 2),
         "failure": carried[one.called].failure or None} for one in chosen]}
    return Checked(f"{len(chosen)} studies, {len(failed)} contradict their stated verdicts. "
                   f"Page: {asked.out / 'index.html'}", said, not failed)


def _list(known: list["Study"]) -> Iterator[str]:
    if not known:
        yield "No studies in this group."
        return
    name, where, words = (max(len(getattr(one, what)) for one in known) for what in ("called", "where", "words"))
    for one in known:
        yield f"{one.called:{name}}  {one.words:{words}}  {one.where:{where}}  {one.title}"


def _in_short(study: "Study") -> dict[str, Any]:
    return {"name": study.called, "where": study.where, "title": study.title, "covers": list(study.covers),
            "words": study.words, "items": [{"item": one.name, "word": str(one.word), "because": one.because}
                                            for one in study.items]}


# --- what is shown ---


def lines(study: "Study", result: "Result") -> list[str]:
    """What a person reads."""
    shown = [f"{study.where}: {study.title}", fill(study.how, _WIDTH)]
    for table in result.all_tables:
        shown += ["", table.title, *_table_lines(table)]
    differs = study.differs(result)
    words = [f"{', '.join(names)}: {item.word}. {item.because}" for names, item in study.groups]
    return [*shown, "", *(fill(one, _WIDTH, subsequent_indent="  ") for one in ([differs] if differs else words)), "",
            fill(result.verdict, _WIDTH)]


def _table_lines(table: "Table") -> list[str]:
    """Columns as wide as what is in them; headings, and words where the line would be too long, are broken."""
    cells, names = table.texts, table.heads
    widths = [max(max((len(row[index]) for row in cells), default=0), max(map(len, name.split())))
              for index, name in enumerate(names)]
    left = [index in table.words for index in range(len(widths))]
    while sum(widths) + 2 * len(widths) > _WIDTH and max(widths) > _NARROWEST:
        widths[widths.index(max(widths))] -= 1
    heads = _broken(names, widths, lowest=True)
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


def as_json(study: "Study", result: "Result") -> dict[str, Any]:
    """All of it for a program; null for what is not there or has no number."""
    return {
        "study": study.called, **{key: value for key, value in _in_short(study).items() if key != "name"},
        "how": study.how, "source": study.source, "failure": study.differs(result) or None,
        "tables": [{"title": table.title, "columns": table.heads,
                    "rows": [[_known(cell) for cell in row] for row in table.rows]} for table in result.all_tables],
        "verdict": result.verdict,
        "figures": [{**_figure(one.chart), "printed": one.printed or None} for one in result.pictures],
    }


def _figure(one: "Chart") -> dict[str, Any]:
    from logger.chart_data import Bars, Field

    if isinstance(one, Bars):
        return {"title": one.title, "value": one.value_name, "bars": [list(bar) for bar in one.bars]}
    named: dict[str, Any] = {"title": one.title, "x": one.x_name, "y": one.y_name}
    if isinstance(one, Field):
        return {**named, "value": one.value_name, "x_values": one.x.tolist(), "y_values": one.y.tolist(),
                "values": [[_known(value) for value in row] for row in one.values.tolist()]}
    return {**named, "lines": [{"name": line.name, "x": line.x.tolist(), "y": [_known(y) for y in line.y.tolist()]}
                              for line in one.lines]}


def _known(cell: "Cell") -> "Cell":
    return None if isinstance(cell, float) and not isfinite(cell) else cell
