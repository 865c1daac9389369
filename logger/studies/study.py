"""What a study is: a table or a figure that was printed, made again and set beside what is printed there.

Every file of a shelf's folder offers some as ``STUDIES``. A study holds the printed values, so that this program's are
never seen without them, and says of each in a word and a sentence how they agree, and why where they do not. The word
that it states has to come out of its checks (``Value``, ``Statement``). The records that the dissertation measured were
never published: where it measured, a study simulates under the conditions that the text gives, and says so.

A ``Value`` is a printed number, a ``Statement`` what is printed in words beside the figure of ours that it is about.
The word of a printed item is computed from its checks: a misprint first, then what cannot be reproduced, then what is
better, then what agrees. An item without any check is not reproducible.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from importlib import import_module
from math import inf, isfinite
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from drivers.catalogue import names
from logger.chart_data import Chart
from logger.errors import BadInput
from logger.printable import silent


class Word(StrEnum):
    """Ours against the print; the first that any check of an item has is the item's."""

    MISPRINT = "misprint"
    NOT_REPRODUCIBLE = "not reproducible"
    BETTER = "better"
    AGREES = "agrees"


@dataclass(frozen=True)
class Value:
    """A printed value beside ours, and how far apart they may lie.

    name         what it is, with its unit in brackets
    tolerance    of the difference, in the value's unit
    word         AGREES, NOT_REPRODUCIBLE: ours lies within the tolerance of the print. MISPRINT: ours lies farther off
                 than that. BETTER: the value is an error (a scatter, a bias), and ours is smaller than the print by at
                 least the tolerance
    of           the printed items that it is about; none: the only one of its study
    of_print     ours is worked out of other printed figures, so it shows only whether the print agrees with itself: it
                 counts for an item's word as a misprint alone
    """

    name: str
    printed: float
    ours: float
    tolerance: float
    word: Word = Word.AGREES
    of: tuple[str, ...] = ()
    of_print: bool = False

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

    @property
    def wrong(self) -> str:
        """The value as it stands where it does not hold."""
        return (f"{self.name} ({self.ours:.5g}, published {self.printed:.5g}, tolerance {self.tolerance:.2g}, "
                f"expected: {self.word})")


@dataclass(frozen=True)
class Statement:
    """What is printed in words, and the figure of ours that it is about.

    name            what the figure is, with its unit in brackets
    printed         the statement, in short
    least, most     between which ours has to lie for the statement to be true of it
    word            AGREES, NOT_REPRODUCIBLE: it is true of ours. MISPRINT: it is not. BETTER: ours does what the print
                    could not or asks for
    of              as of a ``Value``
    """

    name: str
    printed: str
    ours: float
    least: float = -inf
    most: float = inf
    word: Word = Word.AGREES
    of: tuple[str, ...] = ()

    of_print = False

    @property
    def holds(self) -> bool:
        """Whether ours bears out ``word``."""
        return (self.least <= self.ours <= self.most) != (self.word is Word.MISPRINT)

    @property
    def bounds(self) -> str:
        """The ends as words."""
        if isfinite(self.least) and isfinite(self.most):
            return f"{self.least:.4g} to {self.most:.4g}"
        return f"{self.least:.4g} or more" if isfinite(self.least) else f"{self.most:.4g} or less"

    @property
    def wrong(self) -> str:
        """The statement as it stands where it does not hold."""
        return (f"{self.name} ({self.ours:.5g}, published {self.printed!r}, true for {self.bounds}, "
                f"expected: {self.word})")


Check = Value | Statement
C = TypeVar("C", Value, Statement)


def about(items: str | Sequence[str], checks: Iterable[C]) -> tuple[C, ...]:
    """The checks, as those of one printed item or of several."""
    names = (items,) if isinstance(items, str) else tuple(items)
    return tuple(replace(one, of=names) for one in checks)


def word_of(checks: Iterable[Check]) -> Word:
    """The word of an item with these checks."""
    words = {one.word for one in checks if not one.of_print or one.word is Word.MISPRINT}
    return next((one for one in Word if one in words), Word.NOT_REPRODUCIBLE)


T = TypeVar("T")
Cell = str | float | None

OFFER = "STUDIES"
SHELVES = {"dissertation": ("logger.studies.dissertation",), "field": ("logger.studies.field", "logger.api.rigs"),
           "roads": ("logger.api.datasets",)}
"""Folders of studies: of the reference dissertation, of other papers that a reader knows and of measured test rigs, and
of public records of roads."""
DISSERTATION = "N. Blum, dissertation, University of Maryland, 2015"


@dataclass(frozen=True)
class Workload:
    """How much work to spend, and whom to tell how much of it is done.

    share       of the full number of draws and grid points, above 0, up to 1
    progress    called with how many of how many parts are done
    folder      of the data, for a study that needs some (``Study.data``)
    vehicle     the car of those data, a name or a file; None: what the study takes
    """

    share: float = 1.0
    progress: Callable[[int, int], None] = silent
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
        """The items, one after the other; ``progress`` is called with each."""
        for done, item in enumerate(items):
            self.progress(done, len(items))
            yield item
        self.progress(len(items), len(items))


_FORM = re.compile(r" (\+?\.\d[efg%])$")


@dataclass(frozen=True)
class Table:
    """Rows of cells (a word, a number, None for nothing) under columns; columns of the print say ``printed``. A column
    is its heading, with the unit in brackets, and how its numbers are written, if not as .4g: "speed [km/h] .1f"."""

    title: str
    columns: Sequence[str]
    rows: tuple[tuple[Cell, ...], ...]

    @property
    def heads(self) -> list[str]:
        """Headings of the columns."""
        return [_FORM.sub("", one) for one in self.columns]

    @property
    def texts(self) -> list[list[str]]:
        """The rows as a person reads them; a dash where there is nothing."""
        forms = [found[1] if (found := _FORM.search(one)) else ".4g" for one in self.columns]
        return [["-" if cell is None else cell if isinstance(cell, str) else format(cell, form)
                 for cell, form in zip(row, forms, strict=True)] for row in self.rows]

    @property
    def words(self) -> tuple[int, ...]:
        """Places of the columns of words, which stand left; numbers stand right."""
        kinds = (set(map(type, cells)) - {type(None)} for cells in zip(*self.rows, strict=True))
        return tuple(place for place, kind in enumerate(kinds) if kind == {str})


@dataclass(frozen=True)
class Picture:
    """A chart of ours, and what the printed figure shows beside it; empty: nothing is printed."""

    chart: Chart
    printed: str = ""


@dataclass(frozen=True)
class Result:
    """What a study found: tables, printed beside ours; what agrees or not, and why; pictures; what can be checked."""

    tables: tuple[Table, ...]
    verdict: str
    pictures: tuple[Picture, ...] = ()
    values: tuple[Check, ...] = ()

    @property
    def all_tables(self) -> tuple[Table, ...]:
        """The checks first, where there are any: numbers, statements, and the print beside itself."""
        numbers = [one for one in self.values if isinstance(one, Value)]
        tables = [_of_checks(title, ("value", "published .6g", f"{ours} .6g", "difference +.3g", "tolerance .3g"), some,
                             lambda one: (one.name, one.printed, one.ours, one.difference, one.tolerance))
                  for title, ours, of_print in (("Published values and ridelog's", "ridelog", False),
                                                ("The publication against its own figures", "as published", True))
                  if (some := [one for one in numbers if one.of_print is of_print])]
        if statements := [one for one in self.values if isinstance(one, Statement)]:
            tables.insert(min(1, len(tables)), _of_checks(
                "Published in words, and ridelog's figures", ("published", "figure", "ridelog", "true for"), statements,
                lambda one: (one.printed, one.name, one.ours, one.bounds)))
        return (*tables, *self.tables)


def _of_checks(title: str, heads: Sequence[str], checks: Sequence[Check], cells: Callable[[Any], tuple[Cell, ...]]
               ) -> Table:
    """Checks in rows, with the items that each is about, where these are said, and how it stands."""
    said = any(len(one.of) for one in checks)
    rows: list[tuple[Cell, ...]] = []
    for one in checks:
        first, *others = cells(one)
        rows.append((first, *[", ".join(one.of)] * said, *others, _stands(one)))
    return Table(title, (heads[0], *["of"] * said, *heads[1:], "verdict"), tuple(rows))


def _stands(check: Check) -> str:
    if not check.holds:
        return f"expected: {check.word}"
    consistent = check.of_print and check.word is not Word.MISPRINT
    return "consistent" if consistent else str(check.word)


@dataclass(frozen=True)
class Item:
    """A printed table or figure, or a statement of a section, and how ours stands beside it.

    name       "Table 4.4", "Fig 4.26", "Eq 2.16", "7.2 full car"
    word       what its checks have to come to
    because    the reason for the word, one sentence
    """

    name: str
    word: Word
    because: str


def alike(names: Iterable[str], word: Word, because: str) -> tuple[Item, ...]:
    """Items of one word for one reason."""
    return tuple(Item(name, word, because) for name in names)


@dataclass(frozen=True)
class Study:
    """A printed table, figure or statement.

    name       as people write it, with _ for -
    title      what it shows
    where      its place in what was printed
    how        under which conditions it is made again here, and what is simulated that was measured there
    run        make it
    items      the printed items that it holds, each with its word
    source     who printed it
    data       what a person has to download before it can run; empty: nothing
    """

    name: str
    title: str
    where: str
    how: str
    run: Callable[[Workload], Result]
    items: tuple[Item, ...]
    source: str = DISSERTATION
    data: str = ""

    @property
    def covers(self) -> tuple[str, ...]:
        return tuple(one.name for one in self.items)

    @property
    def groups(self) -> tuple[tuple[tuple[str, ...], Item], ...]:
        """Names of the items that have one word for one reason, each with the first of them."""
        first = {(one.word, one.because): one for one in reversed(self.items)}
        kinds = dict.fromkeys((one.word, one.because) for one in self.items)
        return tuple((tuple(one.name for one in self.items if (one.word, one.because) == kind), first[kind])
                     for kind in kinds)

    @property
    def words(self) -> str:
        """The words of its items, each once."""
        return ", ".join(dict.fromkeys(str(one.word) for one in self.items))

    def checks_of(self, item: str, result: Result) -> tuple[Check, ...]:
        """What a result checks of one of the items."""
        return tuple(one for one in result.values if item in (one.of or self.covers))

    def differs(self, result: Result) -> str:
        """A sentence on checks that do not hold and items whose checks come to another word; empty: as stated."""
        wrong = [one.wrong for one in result.values if not one.holds]
        for item in self.items:
            found = word_of(self.checks_of(item.name, result))
            if found is not item.word:
                wrong.append(f"{item.name} (by its checks: {found}, expected: {item.word})")
        return f"Not as this study states: {'; '.join(wrong)}." if wrong else ""

    @property
    def called(self) -> str:
        """The name as people write it."""
        return self.name.replace("_", "-")


def study(title: str, where: str, how: str, *items: Item, source: str = DISSERTATION
          ) -> Callable[[Callable[[Workload], Result]], Study]:
    """Makes a function the study of its name, with these fields of ``Study``."""
    return lambda run: Study(run.__name__, title, where, how, run, items, source)


def studies(shelf: str | None = None) -> dict[str, Study]:
    """All of a shelf, or of all shelves, by the names that people write; the dissertation's in its order."""
    shelves = SHELVES.values() if shelf is None else [SHELVES[shelf]]
    found: list[Study] = []
    for package in (one for some in shelves for one in some):
        offered = (one for name in names(package, OFFER) for one in getattr(import_module(f"{package}.{name}"), OFFER))
        found += sorted(offered, key=lambda one: _order(one.name))
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
