"""What runs that repeat each other differ by: noise that no model explains, whatever its kind.

Problem: the noise of a sensor is estimated where no car moves it, at the highest frequencies. A rig that sticks here
and there, a cable or a rubber that warms up differ from run to run in the middle of the band; a model that has to
explain that as well seems to lack something. Solution: the variance of runs of one excitation around their mean
estimates all that does not repeat (analysis of variance: R. A. Fisher, Statistical Methods for Research Workers, 1925).
On roads no two drives have the same places and speeds, so that this is known of rigs only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.profiles.excitation import Excitation
from logger.runs import Run

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Repeats:
    """Runs that repeat others.

    names             of the runs
    deviation_mps2    r.m.s. of what does not repeat [m/s2]
    freedom           degrees of freedom of that
    """

    names: tuple[str, ...]
    deviation_mps2: float
    freedom: int


def find_repeats(runs: Sequence[Run]) -> Repeats | None:
    """The runs of one excitation, and what the sensor's acceleration differs by in them; None where none repeats
    another."""
    groups: dict[tuple[float, float, bytes], list[Run]] = {}
    for run in runs:
        if isinstance(run.track, Excitation):
            same = run.track.rate_hz, run.track.start_s, run.track.elevation_m.tobytes()
            groups.setdefault(same, []).append(run)
    repeated = [group for group in groups.values() if len(group) > 1]
    if not repeated:
        return None
    squares = freedom = 0.0
    for group in repeated:
        first, count = max(run.first for run in group), min(run.count for run in group)
        both = np.stack([run.measured_mps2[first:count] for run in group])
        squares += float(((both - both.mean(axis=0)) ** 2).sum())
        freedom += (len(group) - 1) * both.shape[1]
    return Repeats(tuple(run.name for group in repeated for run in group), float(np.sqrt(squares / freedom)),
                   int(freedom))
