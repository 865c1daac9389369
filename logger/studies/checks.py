"""What a study checks: the print beside ours, value by value, each with the word that it has to bear out.

A ``Value`` is a printed number, a ``Statement`` what is printed in words beside the figure of ours that it is about.
The word of a printed item is computed from its checks: a misprint first, then what cannot be reproduced, then what is
better, then what agrees. An item without any check is not reproducible.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf, isfinite
from typing import TypeVar


class Word(StrEnum):
    """How ours stands beside the print; the first that any check of an item has is the item's."""

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
        return (f"{self.name} ({self.ours:.5g}, printed {self.printed:.5g}, tolerance {self.tolerance:.2g}, expected: "
                f"{self.word})")


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
        return f"{self.name} ({self.ours:.5g}, printed {self.printed!r}, true for {self.bounds}, expected: {self.word})"


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
