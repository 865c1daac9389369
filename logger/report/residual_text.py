"""What the residual of a model looks like, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from logger.lab.residuals.breakdown import Part
from logger.lab.residuals.unexplained import Shape, SpatialLine

_WHEEL_RADII_M = (0.22, 0.5)


def looks_like(shape: Shape) -> list[str]:
    """What a residual that no candidate explains looks like."""
    turns = [line_sentence(shape.line)] if shape.line is not None and shape.line.found else []
    found = turns + [test.sentence for test in shape.tests.found]
    return found or ["No test says more: it is spread over all frequencies, speeds and places."]


def line_sentence(line: SpatialLine) -> str:
    """What repeats along the way, and what may do so."""
    every_m = 1 / line.at_per_m
    if line.steady:
        return (f"It repeats every {every_m:.2f} m of the way or {line.at_per_m * line.speed_mps:.1f} times a second: "
                f"at a steady speed that is the same (clearest in {line.run}). A drive at another speed would show "
                "which.")
    radius_m = 1 / (2 * np.pi * line.at_per_m)
    wheel = (f" A wheel of {radius_m:.2f} m radius turns at that rate: look at its balance and roundness."
             if _WHEEL_RADII_M[0] < radius_m < _WHEEL_RADII_M[1] else "")
    return f"It repeats every {every_m:.2f} m of the way, at any speed (clearest in {line.run}).{wheel}"


def error_text(part: Part, digits: int) -> str:
    """The error of a part with so many digits behind the point; a dash where there is none."""
    return f"{part.error:.{digits}f}" if np.isfinite(part.error) else "-"


def paired(before: Sequence[Part], after: Sequence[Part]) -> list[tuple[Part | None, Part]]:
    """Parts with those of another model of the same runs: bands by their names, as a car's own vibrations move with its
    numbers; others by their ends. None where there is no such part."""
    known = {one.name or (one.low, one.high): one for one in before}
    return [(known.get(one.name or (one.low, one.high)), one) for one in after]
