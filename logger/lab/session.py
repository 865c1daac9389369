"""The record of a session: from the first comparison of a model to the last effect that was added to it."""

from __future__ import annotations

from dataclasses import dataclass

from logger.chart_data import Curves
from logger.lab.compare import LabComparison
from logger.lab.diagnosis import LabDiagnosis
from logger.lab.laws.learn import Learning
from logger.lab.selection.add_effect import AddedEffects, Number, moved_between


@dataclass(frozen=True, eq=False)
class Round:
    """Effects that were added, the result, the comparison with them, and the vehicle file that was written."""

    addition: AddedEffects
    comparison: LabComparison
    file: str


@dataclass(frozen=True, eq=False)
class LawSearch:
    """The search for a law where no effect explained what is missing.

    addition    the model with it, and its picture; None: none was learned, or it is no force that a picture shows
    file        that was written; empty: none
    """

    learning: Learning
    addition: AddedEffects | None
    picture: Curves | None
    file: str


@dataclass(frozen=True, eq=False)
class Story:
    """A session, in order.

    first       comparison of the vehicle as it was given
    diagnoses   at least one
    refused     effects that a diagnosis found missing and the user did not want
    law         None: none was looked for
    """

    first: LabComparison
    diagnoses: tuple[LabDiagnosis, ...]
    rounds: tuple[Round, ...]
    refused: tuple[str, ...]
    law: LawSearch | None = None

    @property
    def last(self) -> LabComparison:
        """Comparison of the vehicle that the session ends with."""
        return self.rounds[-1].comparison if self.rounds else self.first

    @property
    def added(self) -> list[str]:
        """Names of the effects that were added, in order."""
        return [name for one in self.rounds for name in one.addition.names]

    @property
    def not_added(self) -> list[str]:
        """Names of the effects that were found missing last and neither added nor refused: the rounds were used up."""
        missing = [one.effect.name for one in self.diagnoses[-1].missing]
        return [name for name in missing if name not in self.added and name not in self.refused]

    @property
    def floor(self) -> float:
        """The error that the sensor's noise alone makes."""
        return (self.rounds[-1].addition if self.rounds else self.diagnoses[-1]).noise_floor_error

    @property
    def moved(self) -> list[Number]:
        """The car's numbers without and with the effects; none where nothing was added."""
        return moved_between(self.rounds[0].addition, self.rounds[-1].addition) if self.rounds else []
