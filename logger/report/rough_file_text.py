"""That a vehicle's file turned out to be a rough one: in a sentence and for a program."""

from __future__ import annotations

from typing import Any

from logger.lab.diagnosis import Diagnosis
from logger.lab.selection.add_effect import AddedEffects


def rough_file_words(found: Diagnosis | AddedEffects) -> list[str]:
    """Which tolerance was used instead, and what that means; nothing of a file that is as good as it was taken to be.
    """
    if not found.rough_file:
        return []
    return ["On the whole the car's masses, springs and dampers are off by more than their tolerance. They were taken "
            f"to be good to {found.tolerance:.0%} instead: the vehicle's file is a rough one, and small changes of "
            "the car cannot be seen with it (ridelog identify measures its numbers)."]


def rough_file_json(found: Diagnosis | AddedEffects) -> dict[str, Any]:
    """The tolerance, and whether it is that of a rough file."""
    return {"tolerance": found.tolerance, "rough_file": found.rough_file}
