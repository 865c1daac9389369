"""What runs that repeat each other differ by: noise that no model explains, whatever its kind.

Problem: the noise of a sensor is estimated where no car moves it, at the highest frequencies. A rig that sticks here
and there, a cable or a rubber that warms up differ from run to run in the middle of the band; a model that has to
explain that as well seems to lack something. Solution: the variance of runs of one excitation around their mean
estimates all that does not repeat (analysis of variance: R. A. Fisher, Statistical Methods for Research Workers, 1925).
No shaker moves twice quite alike; the model predicts what that makes, so that it is the residuals that are compared.
On roads no two drives have the same places and speeds, so that this is known of rigs only.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.profiles.excitation import Excitation
from logger.runs import Run


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


def find_repeats(runs: Sequence[Run], residuals: Sequence[Array] | None = None) -> Repeats | None:
    """The runs of one excitation, and what the sensor's acceleration differs by in them beyond what a model says, by
    its residuals (n,) per run; None: what was measured is compared. None where none repeats another."""
    samples = [run.measured_mps2 for run in runs] if residuals is None else list(residuals)
    groups: list[list[int]] = []
    for index, run in enumerate(runs):
        group = next((one for one in groups if repeat_each_other(runs[one[0]], run)), None)
        if group is None:
            groups.append([index])
        else:
            group.append(index)
    repeated = [group for group in groups if len(group) > 1]
    if not repeated:
        return None
    squares = freedom = 0.0
    for group in repeated:
        first, count = max(runs[one].first for one in group), min(runs[one].count for one in group)
        both = np.stack([samples[one][first:count] for one in group])
        squares += float(((both - both.mean(axis=0)) ** 2).sum())
        freedom += (len(group) - 1) * both.shape[1]
    return Repeats(tuple(runs[one].name for group in repeated for one in group), float(np.sqrt(squares / freedom)),
                   int(freedom))


def repeat_each_other(first: Run, other: Run) -> bool:
    """Whether two runs are of one excitation: tables and forces differ by no more than what counts as explained. (Two
    runs of one command on a bench car were measured to differ by 6 to 9 %, other sweeps differ by their whole size.)
    What nothing drives repeats another that begins alike: then all of it is."""
    one, two = first.track, other.track
    if not (isinstance(one, Excitation) and isinstance(two, Excitation)) or (
            (one.rate_hz, one.start_s, one.forces) != (two.rate_hz, two.start_s, two.forces)):
        return False
    pairs = [(first.measured_mps2, other.measured_mps2) if one.is_still else (one.elevation_m, two.elevation_m)]
    if one.force_n is not None and two.force_n is not None:
        pairs += zip(one.force_n.T, two.force_n.T, strict=True)
    return all(_alike(here, there) for here, there in pairs)


def _alike(one: Array, two: Array) -> bool:
    count = min(len(one), len(two))
    one, two = one[:count] - one[:count].mean(axis=0), two[:count] - two[:count].mean(axis=0)
    return one.shape == two.shape and bool(np.linalg.norm(one - two) <= UNEXPLAINED * np.linalg.norm(one))
