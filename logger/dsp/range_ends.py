"""Samples that stand at the end of a sensor's range, where no more than the end could be read.

Problem: an accelerometer that was set to 2 g reads 2 g in a pothole, and the ride reads smoother than it was. Nothing
in the record says what the range was, and the largest value of a ride is no sign: every ride has one.

Solution: at the end of its range a sensor arrives by a jump, stands for samples, and leaves by a jump. A crest that is
passed does not: of three equal samples and those beside them the moves of any smooth crest are at most 4 steps. By
chance each further sample that stands still where the moves are of ``JUMP`` steps has a probability of 1 in ``JUMP`` at
most, by a flat density of moves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.dsp.repeated_samples import resolution
from logger.dsp.stretches import stretches_inside

Array = npt.NDArray[np.float64]

FALSE_ALARM = 1e-4
"""Most probability of reporting an end where there is none."""
JUMP = 6.0  # steps
_LEAST_SAMPLES = 3


@dataclass(frozen=True)
class RangeEnd:
    """``at`` an end of the range stand ``samples``; the bound of its ``chance`` without an end."""

    at: float
    samples: int
    chance: float


def range_ends(values: Array) -> list[RangeEnd]:
    """Ends of the range at which samples of an axis (n,) stand: none, one or two."""
    step = resolution(values)
    if step <= 0:
        return []
    found = [(sign, _upper_end(sign * values, step)) for sign in (1.0, -1.0)]
    return [RangeEnd(sign * one.at, one.samples, one.chance) for sign, one in found if one is not None]


def _upper_end(values: Array, step: float) -> RangeEnd | None:
    top = float(values.max())
    at_top = values > top - 0.5 * step
    first, end = stretches_inside(at_top)
    stands = end - first >= _LEAST_SAMPLES
    first, end = first[stands], end[stands]
    jumps = np.minimum(values[first] - values[first - 1], values[end - 1] - values[end]) > JUMP * step
    stays = int((end - first - 1)[jumps].sum())
    chance = float(JUMP ** -min(stays, 100))
    return RangeEnd(top, int(np.count_nonzero(at_top)), chance) if chance < FALSE_ALARM else None
