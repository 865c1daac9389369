"""Drives over one road laid on one distance, by the road as the car felt it.

Problem: a receiver's speeds put a drive on the road to a tenth of a metre within some seconds and to metres within a
minute, each drive differently. At the frequency of the wheels' bounce that is a wave of the road, and effects that damp
it or delay the record imitate the blur. Solution: the record of each drive is compared, window by window, with what the
others make a model of the car expect there (``lab.likelihood.lag``), and its distances are moved by the lags, again and
again until these are small. A delay of the record moves with them: of such drives it cannot be distinguished from the
receiver's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.lag import lags
from logger.lab.likelihood.priors import Tolerance
from logger.lab.unknown_road.likelihood import SameRoad
from logger.runs import Run
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]


def placed_by_road(runs: Sequence[Run], vehicle: Vehicle, tolerance: Tolerance, present: Sequence[Chosen] = (),
                   start_vehicle: Vehicle | None = None, rounds: int = 8, small_m: float = 0.01) -> list[Run]:
    """Runs with the distances at which the others agree with them, but for a constant of some metres, which is a number
    of the road (``RoadFitState.roads``). The first stays where it is; where windows do not correlate, so does the run.

    rounds     so many at most
    small_m    lags of this r.m.s. are no larger than their errors: a fiftieth of the shortest wave that a car feels

    NotOneRoad, ValueError as ``SameRoad`` and its ``start``.
    """
    found = list(runs)
    for _ in range(rounds):
        problem = SameRoad(found, vehicle, tolerance, start_vehicle)
        offsets_m = _offsets(problem, present)
        found = [replace(run, distance_m=run.distance_m + off_m)
                 for run, off_m in zip(found, offsets_m, strict=True)]
        if np.sqrt(np.mean(np.concatenate(offsets_m[1:]) ** 2)) < small_m:
            break
    return found


def _offsets(problem: SameRoad, present: Sequence[Chosen]) -> list[Array]:
    """By how much each run's distances (n,) are short [m], of the first nothing."""
    predictions = [np.zeros(run.count) for run in problem.runs]
    ways = [np.maximum.accumulate(run.distance_m) for run in problem.runs]
    drives = [drive for parts in problem.stretches for _, drive in parts]
    for drive, (number, _, expected) in zip(drives, problem.predicted_by_others(problem.start(present)), strict=True):
        first = int(np.searchsorted(ways[number], drive.distance_m[0]))
        predictions[number][first : first + len(expected)] = expected
    found = [np.zeros(problem.runs[0].count)]
    for run, prediction in list(zip(problem.runs, predictions, strict=True))[1:]:
        windows = lags([run], [prediction])
        found.append(np.interp(np.arange(run.count), windows.middle, -windows.lag_m) if len(windows.run)
                     else np.zeros(run.count))
    return found
