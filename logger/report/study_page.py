"""Pages of studies: one study with its tables and pictures, and all of them with a table of contents.

Self-contained, in the style of the report.
"""

from collections.abc import Mapping, Sequence

from logger.report import document as doc
from logger.report.charts import chart
from logger.studies.all_studies import Carried
from logger.studies.study import DISSERTATION, Item, Picture, Result, Study, Table, Word, word_of

_FIRM = "\u00a0"  # a space at which no line breaks
_NOT_RUN = "not run"
_FAILED = "failed"
_STYLE = "td:first-child{white-space:normal;min-width:9em}figure+.hint{margin-bottom:2em}"
_UNBROKEN = ("of", "verdict", "true for")  # Columns of short words, which break between items only
_INDEX_STYLE = _STYLE + (
    "th,td{vertical-align:top}td:nth-child(3){font-weight:600}td:nth-child(3),td:nth-child(5){white-space:nowrap}"
    "@media screen and (max-width:640px){table,tbody,tr,td{display:block;text-align:left}tr:first-child{display:none}"
    "tr{border-bottom:1px solid;padding:8px 0}td,td.n,td:first-child{border:0;text-align:left;padding:1px 0}}")
"""On a phone each study is a block, as a row of five columns does not fit."""


def page(study: Study, result: Result, contents: str = "", share: float = 1.0) -> doc.Html:
    """The study as one HTML document.

    contents    the name of a page beside it that lists all
    share       of its draws and grid points that was computed
    """
    quick, differs = _quick(share), study.differs(result)
    return doc.document(f"{study.where}: {study.title}", [
        doc.heading(study.title, f"{study.where} of {study.source}"),
        doc.paragraphs([*quick, *([differs] if differs else []), result.verdict]), _items(study, result),
        *map(_table, result.all_tables),
        doc.section("Pictures", doc.concatenated(map(_picture, result.pictures))) if result.pictures else doc.EMPTY,
        doc.section("How it was made", doc.paragraphs([
            study.how, f"ridelog study {study.called}{' DIR' * bool(study.data)}{' --quick' * bool(quick)}"])),
        doc.html('<p><a href="{}">All studies</a></p>', contents) if contents else doc.EMPTY], style=_STYLE)


def _items(study: Study, result: Result) -> doc.Html:
    """Each printed item with the word that its checks come to."""
    lines = []
    for names, item in study.groups:
        checks = max(len(study.checks_of(name, result)) for name in names)
        counted = f" ({checks} check{'s' * (checks > 1)}{' of each' * (len(names) > 1)})" if checks else ""
        lines.append(f"{_joined(names)}: {word_of(study.checks_of(item.name, result))}. {item.because}{counted}")
    return doc.section("ridelog against the published values", doc.bullets(lines))


def _picture(picture: Picture) -> doc.Html:
    drawn = chart(picture.chart)
    return doc.html("{}{}", drawn, doc.hint(f"Published: {picture.printed}.")) if picture.printed else drawn


def _joined(names: Sequence[str]) -> str:
    """Names that break at their commas only."""
    return ", ".join(name.replace(" ", _FIRM) for name in names)


def _quick(share: float) -> list[str]:
    return [] if share == 1.0 else [f"Quick: with {share:.0%} of the draws and grid points."]


def index(known: Sequence[Study], carried: Mapping[str, Carried], share: float = 1.0) -> doc.Html:
    """The table of contents of studies whose pages lie beside it, with the word of each; ``carried`` by the studies'
    names, without those that were not run; ``share`` of their draws and grid points that was computed."""
    words = [word for one in known for names, item in one.groups
             for word in [_word(item, carried.get(one.called))] * len(names)]
    counts = [(word, str(words.count(word)), "") for word in (*map(str, Word), _FAILED, _NOT_RUN)]
    parts = [[one for one in known if (one.source == DISSERTATION) is its_own] for its_own in (True, False)]
    titles = (f"Contents: {DISSERTATION}", "Contents: other sources")
    return doc.document("Studies", [
        doc.heading("Studies: published results, recomputed",
                    "Each published item has a verdict on how ridelog compares with it."),
        doc.paragraphs(_quick(share)), doc.tiles(tile for tile in counts if tile[1] != "0"),
        *(doc.section(title, doc.grid(("published", "study", "verdict", "because", "time"), [
            row for one in part for row in _rows(one, carried.get(one.called))], range(4)))
          for title, part in zip(titles, parts, strict=True) if part)],
        style=_INDEX_STYLE)


def _rows(study: Study, found: Carried | None) -> list[tuple[str, doc.Html, str, str, str]]:
    """A row for each word and reason of a study; its time stands in the first."""
    seconds = f"{found.seconds:.1f} s" if found is not None else "-"
    by_source = "" if study.source == DISSERTATION else f" ({study.source})"
    because = f"Needs {study.data}: ridelog study {study.called} DIR." if found is None else found.failure
    return [(_joined(names) + by_source, _link(study, found), _word(item, found), because or item.because,
             "" if place else seconds) for place, (names, item) in enumerate(study.groups)]


def _word(item: Item, found: Carried | None) -> str:
    if found is None:
        return _NOT_RUN
    return _FAILED if found.failure else str(item.word)


def _link(study: Study, found: Carried | None) -> doc.Html:
    if found is None or found.result is None:
        return doc.html("{}", study.title)
    return doc.html('<a href="{}.html">{}</a>', study.called, study.title)


def _table(table: Table) -> doc.Html:
    heads = table.heads
    rows = [[_joined(cell.split(", ")) if head in _UNBROKEN else cell for head, cell in zip(heads, row, strict=True)]
            for row in table.texts]
    return doc.section(table.title, doc.grid(heads, rows, table.words))
