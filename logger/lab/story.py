"""The whole loop as one record: from the first comparison of a model to the last effect that was added to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from logger.lab.compare import Comparison
from logger.lab.gained import Gained, Moved, bias, moved_between
from logger.lab.verdict import Verdict


@dataclass(frozen=True, eq=False)
class Round:
    """Effects that were added, what that brought, the comparison with them, and the vehicle file that was written."""

    gained: Gained
    comparison: Comparison
    file: str


@dataclass(frozen=True, eq=False)
class Story:
    """What was done, in order.

    first       of the vehicle as it was given
    verdicts    at least one
    refused     effects of a verdict that the user did not want
    """

    first: Comparison
    verdicts: tuple[Verdict, ...]
    rounds: tuple[Round, ...]
    refused: tuple[str, ...]

    @property
    def last(self) -> Comparison:
        """Of the vehicle that it ends with."""
        return self.rounds[-1].comparison if self.rounds else self.first

    @property
    def added(self) -> list[str]:
        """Names of the effects that were added, in order."""
        return [name for one in self.rounds for name in one.gained.names]

    @property
    def left(self) -> list[str]:
        """Names of the effects that were found missing last and neither added nor refused: the rounds were used up."""
        missing = [one.effect.name for one in self.verdicts[-1].missing]
        return [name for name in missing if name not in self.added and name not in self.refused]

    @property
    def floor(self) -> float | None:
        """The error that the sensor's noise alone makes."""
        return self.rounds[-1].gained.floor if self.rounds else self.verdicts[-1].diagnosis.noise_floor_error

    @property
    def steps(self) -> list[tuple[str, float]]:
        """Models on the way, each with its error on all samples."""
        if not self.rounds:
            return [("as its file says", self.first.plain.error), ("numbers refitted", self.first.refitted.error)]
        start = self.rounds[0].gained.added
        return [("as its file says", start.error_before), ("numbers refitted", start.error_refitted),
                *((f"with {' and '.join(one.gained.names)}", one.gained.added.error_after) for one in self.rounds)]

    @property
    def moved(self) -> list[Moved]:
        """The car's numbers without and with the effects; none where nothing was added."""
        return moved_between(self.rounds[0].gained.added, self.rounds[-1].gained.added) if self.rounds else []


def ending(story: Story) -> list[str]:
    """What it came to."""
    verdict, steps = story.verdicts[-1], story.steps
    with_what = [bias(story.added, story.moved)] if story.added else []
    lines = []
    if story.added:
        lines.append(f"{' and '.join(story.added)} took the error from {steps[1][1]:.3f} to {steps[-1][1]:.3f}, "
                     "before and after with the car's numbers and the distances refitted within their tolerance. "
                     f"As the last file says, on the distances as recorded, it is {story.last.plain.error:.3f}.")
    if story.floor is not None:
        lines.append(f"The sensor's noise alone makes about {story.floor:.3f}.")
    if story.refused:
        lines.append(f"Found missing and left out as you wished: {', '.join(story.refused)}.")
    if story.left:
        lines.append(f"Found missing and not added: {', '.join(story.left)}. Go on with the last file.")
    if story.refused or story.left:
        return [*lines, *with_what]
    if verdict.diagnosis.strained and not verdict.diagnosis.left_over:
        lines.append("Numbers of the vehicle's file are outside their tolerance: check them.")
    elif verdict.diagnosis.unexplained:
        lines.append("Something is missing still that no effect explains: an effect of your own may do it.")
    else:
        lines.append(f"Nothing {'more ' * bool(story.added)}is missing, as far as these runs can tell.")
    return [*lines, *with_what]


def as_json(story: Story) -> dict[str, Any]:
    """The story as one JSON object."""
    verdict = story.verdicts[-1]
    return {
        "error_before": story.steps[0][1], "error_after": story.steps[-1][1], "noise_floor_error": story.floor,
        "added": story.added, "refused": list(story.refused), "left": story.left,
        "unexplained": verdict.diagnosis.unexplained,
        "steps": [{"step": words, "error": error} for words, error in story.steps],
        "effects": [{"effect": one.effect.name, "parameters": dict(one.values)} for one in story.last.effects],
        "biased": [one.name for one in story.moved if one.biased],
        "vehicles": [one.file for one in story.rounds], "sentences": ending(story),
    }
