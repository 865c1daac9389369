"""Faults, their trials, and the line that each of them gets in the table.

A trial injects its fault in a new folder and asserts what is promised. The tests run a few cases of each fault, the
bench all of them; both take them from the same lists.
"""

from __future__ import annotations

import shutil
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..slow import slow


@dataclass(frozen=True)
class Found:
    """What a case has shown: how often the fault was injected, figures by name, what ``ridelog status`` said, and
    promises broken, in words."""

    trials: int = 1
    figures: dict[str, float] = field(default_factory=dict)
    reported: str = ""
    wrong: tuple[str, ...] = ()


def found(trials: int = 1, reported: str = "", **figures: float) -> Found:
    """The fault was injected so often, and every promise was held."""
    return Found(trials, figures, reported)


@dataclass(frozen=True)
class Hazard:
    """One line of the table.

    name        what goes wrong
    injected    how the trial brings it about
    promised    what is promised then
    happened    what to say when all was held; ``{x.least}``, ``{x.most}`` and ``{x.total}`` are of the figure x
    trial       takes a new folder and a case; raises ``AssertionError`` when a promise is broken
    few         so many cases, spread over all, are for the tests and the short form
    """

    name: str
    injected: str
    promised: str
    happened: str
    trial: Callable[[Path, Any], Found]
    cases: Sequence[Any] = (None,)
    few: int = 1_000_000

    def some(self) -> Sequence[Any]:
        """The cases for the tests and the short form."""
        return self.cases[:: -(-len(self.cases) // self.few)]


@dataclass(frozen=True)
class Spread:
    """One figure over all cases."""

    least: float
    most: float
    total: float


@dataclass(frozen=True)
class Line:
    """What came of a fault. ``reported``: by ``ridelog status``; ``wrong``: empty when every promise was held."""

    name: str
    injected: str
    promised: str
    happened: str
    trials: int
    figures: dict[str, Spread] = field(default_factory=dict)
    reported: str = ""
    wrong: tuple[str, ...] = ()


def run(hazard: Hazard, cases: Sequence[Any], folder: Path) -> Line:
    """Every case in a folder of its own below ``folder``."""
    seen = []
    for case in cases:
        place = folder / "case"
        place.mkdir()
        try:
            seen.append(hazard.trial(place, case))
        except AssertionError as broken:
            seen.append(Found(wrong=(f"case {case}: {_words(broken)}",)))
        shutil.rmtree(place)
    wrong = tuple(words for one in seen for words in one.wrong)
    figures = {}
    for name in dict.fromkeys(name for one in seen for name in one.figures):
        values = [one.figures[name] for one in seen if name in one.figures]
        figures[name] = Spread(min(values), max(values), sum(values))
    happened = hazard.happened.format(**figures) if not wrong else f"**BROKEN**: {'; '.join(wrong[:3])}"
    reported = next((one.reported for one in seen if one.reported), "")
    trials = sum(one.trials for one in seen)
    return Line(hazard.name, hazard.injected, hazard.promised, happened, trials, figures, reported, wrong)


def _words(broken: AssertionError) -> str:
    """The promise that was broken: its own words, or the line that asserts it."""
    return str(broken) or str(traceback.extract_tb(broken.__traceback__)[-1].line)


def cases_for_tests(hazards: Sequence[Hazard], quick: int | None = None, long: Sequence[str] = ()) -> list[Any]:
    """Each fault with each of its few cases; of these all but the first so many are slow tests, where that is said, and
    all of those that are named as long."""
    found: list[Any] = []
    for hazard in hazards:
        cases = [(hazard, case) for case in hazard.some()]
        sooner = 0 if hazard.name in long else len(cases) if quick is None else quick
        found += [*cases[:sooner], *slow(*cases[sooner:])]
    return found


def label(value: object) -> str:
    """How pytest is to name a fault or a case; the same in every process."""
    if isinstance(value, tuple):
        return "-".join(map(label, value))
    return str(getattr(value, "name", getattr(value, "__name__", value)))
