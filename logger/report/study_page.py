"""Pages of studies: one study with its tables and pictures, and all of them with a table of contents.

Self-contained, in the style of the report.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from logger.report.charts import chart
from logger.report.document import document, grid, heading, paragraphs, section, tiles
from logger.report.html import EMPTY, Html, concatenated, html
from logger.studies.all_studies import Carried
from logger.studies.study import DISSERTATION, Result, Study, Table, Word

_FIRM = "\u00a0"  # a space at which no line breaks
_NOT_RUN = "not run"
_FAILED = "failed"
_STYLE = "td:first-child{white-space:normal;min-width:9em}"
_INDEX_STYLE = _STYLE + (
    "th,td{vertical-align:top}td:nth-child(3){font-weight:600}td:nth-child(3),td:nth-child(5){white-space:nowrap}"
    "@media screen and (max-width:640px){table,tbody,tr,td{display:block;text-align:left}tr:first-child{display:none}"
    "tr{border-bottom:1px solid;padding:8px 0}td,td.n,td:first-child{border:0;text-align:left;padding:1px 0}}")
"""On a phone each study is a block, as a row of five columns does not fit."""


def page(study: Study, result: Result, contents: str = "", share: float = 1.0) -> Html:
    """The study as one HTML document.

    contents    the name of a page beside it that lists all
    share       of its draws and grid points that was computed
    """
    quick = _quick(share)
    word = study.differs(result) or f"{str(study.word).capitalize()}: {study.because}"
    return document(f"{study.where}: {study.title}", [
        heading(study.title, f"{study.where} of {study.source}"),
        paragraphs([*quick, word, result.verdict]), *map(_table, result.all_tables),
        section("Pictures", concatenated(map(chart, result.pictures))),
        section("How it was made", paragraphs([
            study.how, f"ridelog study {study.called}{' DIR' * bool(study.data)}{' --quick' * bool(quick)}"])),
        html('<p><a href="{}">All studies</a></p>', contents) if contents else EMPTY], style=_STYLE)


def _quick(share: float) -> list[str]:
    return [] if share == 1.0 else [f"Quick: with {share:.0%} of the draws and grid points."]


def index(known: Sequence[Study], carried: Mapping[str, Carried], share: float = 1.0) -> Html:
    """The table of contents of studies whose pages lie beside it, with the word of each; ``carried`` by the studies'
    names, without those that were not run; ``share`` of their draws and grid points that was computed."""
    words = {one.called: _word(one, carried.get(one.called)) for one in known}
    counts = [(word, str(list(words.values()).count(word)), "") for word in (*map(str, Word), _FAILED, _NOT_RUN)]
    parts = [[one for one in known if (one.source == DISSERTATION) is its_own] for its_own in (True, False)]
    titles = (f"Contents: {DISSERTATION}", "Contents: other sources")
    return document("Studies", [
        heading("Studies: printed results, made again", "Each with one word for how ours compares with the print."),
        paragraphs(_quick(share)), tiles(tile for tile in counts if tile[1] != "0"),
        *(_contents(title, part, words, carried) for title, part in zip(titles, parts, strict=True) if part)],
        style=_INDEX_STYLE)


def _contents(title: str, part: Sequence[Study], words: Mapping[str, str], carried: Mapping[str, Carried]) -> Html:
    rows = [(", ".join(item.replace(" ", _FIRM) for item in one.covers) if one.source == DISSERTATION else one.source,
             _link(one, carried.get(one.called)), words[one.called], _because(one, carried.get(one.called)),
             f"{carried[one.called].seconds:.1f} s" if one.called in carried else "-") for one in part]
    return section(title, grid(("printed", "study", "word", "because", "time"), rows, range(4)))


def _word(study: Study, found: Carried | None) -> str:
    if found is None:
        return _NOT_RUN
    return _FAILED if found.failure else str(study.word)


def _because(study: Study, found: Carried | None) -> str:
    if found is None:
        return f"Needs {study.data}: ridelog study {study.called} DIR."
    return found.failure or study.because


def _link(study: Study, found: Carried | None) -> Html:
    if found is None or found.result is None:
        return html("{}", study.title)
    return html('<a href="{}.html">{}</a>', study.called, study.title)


def _table(table: Table) -> Html:
    rows = [[column.text(cell) for column, cell in zip(table.columns, row, strict=True)] for row in table.rows]
    return section(table.title, grid([column.name for column in table.columns], rows, table.words))
