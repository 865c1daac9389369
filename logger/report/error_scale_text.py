"""The errors of models on one scale (``lab.selection.error_scale``): in a sentence and for a program."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from logger.lab.selection.error_scale import AS_FILED, JUDGED_ON, REFITTED, Step, fit_percent, rising
from logger.report.text_layout import enumerated

_WORDS = {AS_FILED: "as the vehicle's file says", REFITTED: "with its numbers refitted"}


def error_words(steps: Sequence[Step], floor: float) -> list[str]:
    """The errors of each step and of the noise alone, and why one rises."""
    each = ", ".join(f"{error_and_fit(one.error)} {_WORDS.get(one.words, one.words)}" for one in steps)
    lines = [f"Error on {JUDGED_ON}: {each}. The sensor's noise alone makes about {error_and_fit(floor)}."]
    if rises := rising(steps):
        said = enumerated([_WORDS.get(one, one) for one in rises], "and")
        lines.append(f"It rises {said}: the error counts all frequencies alike, and a fit weighs each by its noise. It "
                     "gains where there is little noise, and loses where there is much.")
    return lines


def error_and_fit(error: float) -> str:
    """An error with its fit per cent: "0.153 (fit 84.7 %)"."""
    return f"{error:.3f} (fit {fit_percent(error):.1f} %)"


def errors_json(steps: Sequence[Step], floor: float) -> dict[str, Any]:
    """The same for a program."""
    return {"errors": [{"model": one.words, "error": one.error, "fit_percent": fit_percent(one.error)}
                       for one in (*steps, Step("noise alone", floor))]}
