"""What is left when no candidate explains it: not named, but described.

Problem: something is missing, and nothing on the list is it. Solution: what the best model leaves is read as a
comparison reads it (which force in the suspensions, at which frequencies, following what), and once more along the way
instead of along the time: what a wheel does once in a turn repeats every so many metres, whatever the speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.lab.beside import Beside, Located, located, short_names
from logger.lab.fitting import Problem, State
from logger.lab.marks import DOUBT, Marks, read_marks
from logger.lab.tones import NEIGHBOURS, loudest, periodogram

Array = npt.NDArray[np.float64]

_SLOWEST_MPS = 1.0
_FROM_PER_M, _TO_PER_M = 0.3, 2.2
_WHEEL_M = (0.22, 0.5)


@dataclass(frozen=True)
class Turns:
    """What repeats along the way in the run where that is clearest: how often [1/m], how probable by chance, and the
    powers (n,) at all wave numbers (n,) [1/m] over their mean."""

    run: str
    at_per_m: float
    p_value: float
    per_m: Array
    power: Array

    @property
    def found(self) -> bool:
        """Whether it is no chance."""
        return self.p_value < DOUBT

    @property
    def sentence(self) -> str:
        """What it says when it is found."""
        radius_m = 1 / (2 * np.pi * self.at_per_m)
        wheel = (f" A wheel of {radius_m:.2f} m radius turns so often: look at its balance and roundness."
                 if _WHEEL_M[0] < radius_m < _WHEEL_M[1] else "")
        return (f"It repeats every {1 / self.at_per_m:.2f} m of the way, whatever the speed (clearest in {self.run})."
                f"{wheel}")


@dataclass(frozen=True, eq=False)
class Shape:
    """What a model leaves: where it sits, its marks, and what repeats along the way (None: no run tells)."""

    beside: Beside
    where: Located
    marks: Marks
    turns: Turns | None


def shape_of(problem: Problem, state: State) -> Shape:
    """The shape of what a fitted model leaves."""
    car = problem.car(state.effects, state.logs)
    responses = problem.runs.respond(car, problem.moved_m(state.wander))
    beside = Beside(problem.runs.runs, car, state.predictions, responses)
    unmoved = Beside(problem.runs.runs, car, problem.runs.predict(car), responses)
    where = located(beside)
    return Shape(beside, where, read_marks(beside, where, unmoved), turns_of(beside))


def sentences(shape: Shape) -> list[str]:
    """What it looks like."""
    turns = [shape.turns.sentence] if shape.turns is not None and shape.turns.found else []
    found = turns + [mark.sentence for mark in shape.marks.found]
    return found or ["No mark of it stands out: it is spread over all frequencies, speeds and places."]


def turns_of(beside: Beside) -> Turns | None:
    """What repeats along the way: as for a tone in time."""
    found = []
    names = short_names(beside.runs)
    for run, left in zip(beside.runs, beside.left, strict=True):
        speed = run.speed_mps[run.first:]
        if speed.min() < _SLOWEST_MPS or run.distance_m[-1] <= run.distance_m[run.first]:
            continue
        way = np.maximum.accumulate(run.distance_m[run.first:])
        step_m = float(np.median(speed)) / run.rate_hz
        along = np.interp(np.arange(way[0], way[-1], step_m), way, left)
        per_m = np.fft.rfftfreq(len(along), step_m)
        asked = (per_m > _FROM_PER_M) & (per_m < _TO_PER_M)
        power = periodogram(along)
        stands_out = loudest(power, asked)
        if stands_out is None or asked.sum() < NEIGHBOURS:
            continue
        found.append(Turns(names[run.name], float(per_m[stands_out[0]]), stands_out[1], np.asarray(per_m[asked], float),
                           power[asked] / float(power[asked].mean())))
    best = min(found, key=lambda one: one.p_value, default=None)
    if best is None:
        return None
    return Turns(best.run, best.at_per_m, min(1.0, best.p_value * len(found)), best.per_m, best.power)
