"""What a study is: a table or a figure that was printed, made again and set beside what is printed there.

Every file of a shelf's folder is one, offered as ``STUDY``. A study holds the printed values, so that what is ours is
never seen without them, says in a word and a sentence how they agree, and why where they do not. The records that the
dissertation measured were never published: where it measured, a study simulates under the conditions that the text
gives, and says so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from logger.chart_data import Chart
from logger.errors import BadInput
from logger.plugins import catalogue

Array = npt.NDArray[np.float64]
T = TypeVar("T")
Cell = str | float | None

OFFER = "STUDY"
SHELVES = {"dissertation": "logger.studies.dissertation", "field": "logger.studies.field",
           "roads": "logger.api.datasets"}
"""Folders of studies: of the reference dissertation, of other papers that a reader knows, and of public records of
roads."""
DISSERTATION = "N. Blum, dissertation, University of Maryland, 2015"


class Word(StrEnum):
    """How a study's result stands beside the print."""

    AGREES = "agrees"
    MISPRINT = "misprint"
    BETTER = "better"
    NOT_REPRODUCIBLE = "not reproducible"


def _silent(_done: int, _of: int) -> None:
    pass


@dataclass(frozen=True)
class Effort:
    """How much work to spend, and whom to tell how much of it is done.

    share       of the full number of draws and grid points, above 0, up to 1
    progress    called with how many of how many parts are done
    folder      of the data, for a study that needs some (``Study.data``)
    vehicle     the car of those data, a name or a file; None: what the study takes
    """

    share: float = 1.0
    progress: Callable[[int, int], None] = _silent
    folder: Path | None = None
    vehicle: str | None = None

    def count(self, full: int, least: int = 2) -> int:
        """How many draws to make instead of ``full``."""
        return max(min(least, full), round(self.share * full))

    def some(self, items: Sequence[T], least: int = 2) -> list[T]:
        """So many of the items, evenly spread, the first and the last among them."""
        kept = np.linspace(0, len(items) - 1, self.count(len(items), least)).round().astype(int)
        return [items[place] for place in kept]

    def each(self, items: Sequence[T]) -> Iterator[T]:
        """The items, one after the other, told to ``progress``."""
        for done, item in enumerate(items):
            self.progress(done, len(items))
            yield item
        self.progress(len(items), len(items))


@dataclass(frozen=True)
class Column:
    """A column of a table: its heading, with the unit in brackets, and how its numbers are written."""

    name: str
    form: str = ".4g"

    def text(self, cell: Cell) -> str:
        """A cell as a person reads it; a dash where there is nothing."""
        if cell is None:
            return "-"
        return cell if isinstance(cell, str) else format(cell, self.form)


@dataclass(frozen=True)
class Table:
    """Rows of cells (a word, a number, None for nothing) under columns; columns of the print say ``printed``."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]

    @property
    def words(self) -> tuple[int, ...]:
        """Places of the columns of words, which stand left; numbers stand right."""
        kinds = (set(map(type, cells)) - {type(None)} for cells in zip(*self.rows, strict=True))
        return tuple(place for place, kind in enumerate(kinds) if kind == {str})


@dataclass(frozen=True)
class Value:
    """A printed value beside ours, and how far apart they may lie.

    name         what it is, with its unit in brackets
    tolerance    of the difference, in the value's unit
    word         AGREES, NOT_REPRODUCIBLE: ours lies within the tolerance of the print. MISPRINT: ours lies farther off
                 than that. BETTER: the value is an error (a scatter, a bias), and ours is smaller than the print by at
                 least the tolerance
    """

    name: str
    printed: float
    ours: float
    tolerance: float
    word: Word = Word.AGREES

    @property
    def difference(self) -> float:
        """Ours less the printed; what is below the last bits of the print is nothing."""
        difference = self.ours - self.printed
        return 0.0 if abs(difference) < 1e-12 * abs(self.printed) else difference

    @property
    def holds(self) -> bool:
        """Whether ours stands beside the print as ``word`` says."""
        if self.word is Word.BETTER:
            return abs(self.ours) <= abs(self.printed) - self.tolerance
        return (abs(self.ours - self.printed) <= self.tolerance) != (self.word is Word.MISPRINT)


@dataclass(frozen=True)
class Result:
    """What a study found: tables, printed beside ours; what agrees and what does not, and why; pictures; the printed
    values that can be checked."""

    tables: tuple[Table, ...]
    verdict: str
    pictures: tuple[Chart, ...] = ()
    values: tuple[Value, ...] = ()

    @property
    def all_tables(self) -> tuple[Table, ...]:
        """The checked values first, where there are any."""
        return (_checked(self.values), *self.tables) if self.values else self.tables


def _checked(values: Sequence[Value]) -> Table:
    rows = tuple((one.name, one.printed, one.ours, one.difference, one.tolerance,
                  str(one.word) if one.holds else f"expected: {one.word}") for one in values)
    return Table("Printed and ours", (Column("value"), Column("printed", ".6g"), Column("ours", ".6g"), Column(
        "difference", "+.3g"), Column("tolerance", ".3g"), Column("word")), rows)


@dataclass(frozen=True)
class Study:
    """A printed table, figure or statement.

    name       as its file is called; people write it with - for _
    title      what it shows
    where      its place in what was printed
    how        under which conditions it is made again here, and what is simulated that was measured there
    run        make it
    covers     the printed items that it holds, each "Table 4.4", "Fig 4.26" or "7.2 full car"
    word       how ours stands beside the print
    because    the reason for the word, one sentence
    source     who printed it
    data       what a person has to download before it can run; empty: nothing
    """

    name: str
    title: str
    where: str
    how: str
    run: Callable[[Effort], Result]
    covers: tuple[str, ...]
    word: Word
    because: str
    source: str = DISSERTATION
    data: str = ""

    def differs(self, result: Result) -> str:
        """A sentence that names the values which do not stand beside the print as they should; empty: all do."""
        wrong = [f"{one.name} ({one.ours:.5g}, printed {one.printed:.5g}, tolerance {one.tolerance:.2g}, expected: "
                 f"{one.word})" for one in result.values if not one.holds]
        return f"Not as this study states: {'; '.join(wrong)}." if wrong else ""

    @property
    def called(self) -> str:
        """The name as people write it."""
        return self.name.replace("_", "-")


def studies(shelf: str | None = None) -> dict[str, Study]:
    """All of a shelf, or of all shelves, by the names that people write; the dissertation's in its order."""
    shelves = SHELVES.values() if shelf is None else [SHELVES[shelf]]
    found: Iterable[Study] = (one for package in shelves
                              for one in sorted(catalogue(package, OFFER).values(), key=lambda one: _order(one.name)))
    return {one.called: one for one in found}


def study_of(name: str, among: Mapping[str, Study]) -> Study:
    """The study of a name, or of an item that it covers (``table-4-5``), written with - or _.

    Raises BadInput, which lists the names there are.
    """
    called = name.strip().lower().replace("_", "-")
    items = {slug(item): one for one in among.values() for item in one.covers}
    if called not in among and called not in items:
        raise BadInput(f"study {name!r}: expected one of {', '.join(among)}")
    return among.get(called) or items[called]


def slug(item: str) -> str:
    """An item as people may write it: ``fig-4-26`` for Fig 4.26."""
    return item.lower().replace(" ", "-").replace(".", "-")


def _order(name: str) -> tuple[list[int], str]:
    """By the numbers in a name, then by its words."""
    return [int(part) for part in name.split("_") if part.isdigit()], name
