"""An answer as a list of blocks, written once: lines of a terminal and a page are made of the same.

Problem: what an answer says was written as text and again as a page, and the two came apart. Solution: sentences,
tables, pictures and sections of them in a list; what is HTML already, and pictures, are for the page alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from logger.chart_data import Bars, Chart, Curves, Field
from logger.report import document as doc
from logger.report.charts import chart
from logger.report.quantities import UNITS, DisplayUnits, columns, known, wrapped
from logger.units import INCH_PER_MILE_M_PER_KM

if TYPE_CHECKING:
    from logger.roads.iri import Area


@dataclass(frozen=True)
class Lines:
    """Lines that a terminal shows as they are; nothing where there are none."""

    lines: Sequence[str]


@dataclass(frozen=True)
class Bullets:
    """A list of sentences; nothing where there are none."""

    lines: Sequence[str]


@dataclass(frozen=True)
class Hint:
    """A remark in small letters."""

    text: str


class Linked(str):
    """The words of a table's cell, for which a page shows ``html``."""

    html: doc.Html

    def __new__(cls, words: str, html: doc.Html) -> Linked:
        one = super().__new__(cls, words)
        one.html = html
        return one


SHOWN_ROWS = 8
"""Rows of a long table at a terminal; a page and ``--json`` have all."""


@dataclass(frozen=True)
class Table:
    """Rows under heads; without rows nothing, and columns that are empty in all rows are left out. Those of the numbers
    ``words`` stand left, the others right. A terminal shows the ``most`` first of the rows, and ``more`` says where the
    others are."""

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: Sequence[int] = (0,)
    most: int | None = None
    more: str = ""


@dataclass(frozen=True)
class Section:
    """Blocks under a heading; nothing where they show nothing but hints."""

    title: str
    blocks: Sequence[Block]


class Detail(Section):
    """A section of a page alone."""


Block = str | doc.Html | Lines | Bullets | Hint | Table | Section | Chart
"""A ``str`` that is no HTML is a sentence, or some."""


class Blocks(tuple[Block, ...]):
    """The blocks of an answer; as ``str`` what a terminal shows."""

    def __str__(self) -> str:
        return text(self)


def text(blocks: Iterable[Block]) -> str:
    """What a terminal shows: sentences follow each other, all else has a blank line around it."""
    return _joined([(one, _lines(one)) for one in blocks])


def _joined(rendered: Iterable[tuple[Block, str]]) -> str:
    said: list[str] = []
    was_sentence = False
    for one, lines in rendered:
        if lines:
            is_sentence = isinstance(one, str)
            said += ["", lines] if said and not (is_sentence and was_sentence) else [lines]
            was_sentence = is_sentence
    return "\n".join(said)


def _lines(one: Block) -> str:
    if isinstance(one, doc.Html | Curves | Bars | Field | Detail):
        return ""
    if isinstance(one, str):
        return wrapped([one])
    if isinstance(one, Hint):
        return wrapped([one.text])
    if isinstance(one, Lines):
        return "\n".join(one.lines)
    if isinstance(one, Bullets):
        return wrapped(one.lines, "- ")
    if isinstance(one, Table):
        return _table_lines(one)
    rendered = [(block, _lines(block)) for block in one.blocks]
    return f"{one.title}:\n{_joined(rendered)}" if _says_something(rendered) else ""


def _says_something(rendered: Iterable[tuple[Block, str]]) -> bool:
    """Whether blocks show more than hints."""
    return any(shown for block, shown in rendered if not isinstance(block, Hint))


def _table_lines(one: Table) -> str:
    if not one.rows:
        return ""
    shown = _filled(one.heads, one.rows[:one.most], one.words)
    rest = len(one.rows) - len(shown.rows)
    more = [f"and {rest} more{one.more}"] if rest else []
    return "\n".join([*columns([shown.heads, *shown.rows], shown.words), *more])


def _filled(heads: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[int]) -> Table:
    """Without columns that are empty in all rows."""
    kept = [index for index, column in enumerate(zip(*rows, strict=True)) if any(column)]
    return Table([heads[index] for index in kept], [[row[index] for index in kept] for row in rows],
                 [place for place, index in enumerate(kept) if index in words])


def elements(blocks: Iterable[Block]) -> doc.Html:
    """What a page shows."""
    return doc.concatenated(map(_element, blocks))


def _element(one: Block) -> doc.Html:
    if isinstance(one, Bullets):
        return doc.bullets(one.lines)
    if isinstance(one, Hint):
        return doc.hint(one.text)
    if isinstance(one, Lines):
        return _laid(one.lines) if one.lines else doc.EMPTY
    if isinstance(one, Table):
        shown = _filled(one.heads, [[getattr(cell, "html", cell) for cell in row] for row in one.rows], one.words)
        return doc.grid(shown.heads, shown.rows, shown.words) if one.rows else doc.EMPTY
    if isinstance(one, Section):
        rendered = [(block, _element(block)) for block in one.blocks]
        return doc.section(one.title, doc.concatenated(shown for _, shown in rendered) if _says_something(rendered)
                           else "")
    if isinstance(one, str):
        return one if isinstance(one, doc.Html) else doc.paragraphs([one])
    return chart(one)


def area_blocks(found: Sequence[Area], limit_m_per_km: float, units: DisplayUnits = UNITS["si"]) -> Iterator[Block]:
    """A table of areas of localized roughness, or a sentence where there is none."""
    (place, place_m), (iri, scale), decimals = units.place, units.iri, units.iri_decimals
    limit = f"{limit_m_per_km:.4g} m/km ({limit_m_per_km / INCH_PER_MILE_M_PER_KM:.0f} in/mi)"
    if not found:
        yield Lines([f"Areas of localized roughness: none. The IRI over a sliding base of 25 ft stays below {limit}."])
        return
    rows = []
    for one in found:
        error = known(one.worst_std_m_per_km)
        worst = f"{one.worst_m_per_km / scale:.{decimals}f}" + (
            "" if error is None else f" ± {error / scale:.{decimals}f}")
        start, end, length, at = (f"{value / place_m:.{units.place_decimals}f}" for value in (
            one.start_m, one.end_m, one.end_m - one.start_m, one.worst_at_m))
        rows.append((start, end, length, worst, at))
    yield Section(f"Areas of localized roughness: where the IRI over a sliding base of 25 ft exceeds {limit}", [
        Table((f"from {place}", f"to {place}", f"length {place}", f"worst {iri}", f"at {place}"), rows, ())])


def _laid(lines: Sequence[str]) -> doc.Html:
    """Lines of a table stay in their columns, and are shifted sideways on a phone; sentences wrap."""
    is_table = any("  " in line.strip() for line in "\n".join(lines).split("\n"))
    return doc.html('<pre class="whole">{}</pre>' if is_table else '<p class="lines">{}</p>', "\n".join(lines))


def page(title: str, under: str, blocks: Iterable[Block]) -> doc.Html:
    """A page of blocks that stands alone; ``under``: a line under its title."""
    return doc.document(title, [doc.heading(title, under), elements(blocks)])
