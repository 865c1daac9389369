"""The errors of models on one scale, which every command of the lab prints: as the vehicle's file says, with its
numbers refitted, with each effect, and the floor.

Problem: a figure that one command calls "refitted" has to be the one that another does, and an error on data that a fit
saw falls whatever is added. Solution: errors are normalised r.m.s. errors on stretches that no fit saw
(``cross_validate``; no fit saw anything of the file's own numbers), beside the fit per cent of system identification
(L. Ljung, System Identification, 1999: "best fit", 100 (1 - error)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from logger.lab.selection.holdout import ROUNDING

JUDGED_ON = "held-out stretches"
"""What the errors of steps and candidates are errors of."""
AS_FILED, REFITTED = "the vehicle as its file says", "its parameters refitted"


def fit_percent(error: float) -> float:
    """The fit per cent of a normalised r.m.s. error."""
    return 100 * (1 - error)


@dataclass(frozen=True, eq=False)
class ErrorStep:
    """A model: what was done, and its error on what no fit saw."""

    words: str
    error: float


def rising(steps: Sequence[ErrorStep]) -> list[str]:
    """What was done in those steps that raise the error by more than a rounding."""
    return [now.words for before, now in pairwise(steps)
            if now.error > (1 + ROUNDING) * before.error]
