"""What a study is: a table or a figure of the reference dissertation, made again and set beside what is printed there.

Every file of ``logger/studies/dissertation`` is one, offered as ``STUDY``. A study holds the printed values in its
tables, so that what is ours is never seen without them, and says in a sentence what agrees, what does not, and why.
The records that the dissertation measured were never published: where it measured, a study simulates under the
conditions that the text gives, and says so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from logger.chart_data import Chart
from logger.errors import BadInput
from logger.plugins import catalogue

Array = npt.NDArray[np.float64]
T = TypeVar("T")
Cell = str | float | None

PACKAGE, OFFER = "logger.studies.dissertation", "STUDY"


def _silent(_done: int, _of: int) -> None:
    pass


@dataclass(frozen=True)
class Effort:
    """How much work to spend, and whom to tell how much of it is done.

    share       of the full number of draws and grid points, above 0, up to 1
    progress    called with how many of how many parts are done
    """

    share: float = 1.0
    progress: Callable[[int, int], None] = _silent

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


@dataclass(frozen=True)
class Result:
    """What a study found: tables, printed beside ours; what agrees and what does not, and why; pictures."""

    tables: tuple[Table, ...]
    verdict: str
    pictures: tuple[Chart, ...] = ()


@dataclass(frozen=True)
class Study:
    """One table or figure of the dissertation.

    name     as its file is called; people write it with - for _
    title    what it shows
    where    its place in the dissertation
    how      under which conditions it is made again here, and what is simulated that was measured there
    run      make it
    """

    name: str
    title: str
    where: str
    how: str
    run: Callable[[Effort], Result]

    @property
    def called(self) -> str:
        """The name as people write it."""
        return self.name.replace("_", "-")


def studies() -> dict[str, Study]:
    """All there are, by the names that people write, in the order of the dissertation."""
    found: Iterable[Study] = catalogue(PACKAGE, OFFER).values()
    return {one.called: one for one in sorted(found, key=lambda one: _order(one.name))}


def study_of(name: str, among: Mapping[str, Study]) -> Study:
    """The study of a name, written with - or _. Raises BadInput, which lists the names there are."""
    called = name.strip().lower().replace("_", "-")
    if called not in among:
        raise BadInput(f"study {name!r}: expected one of {', '.join(among)}")
    return among[called]


def _order(name: str) -> tuple[list[int], str]:
    kind, *numbers = name.split("_")
    return [int(number) for number in numbers], kind
