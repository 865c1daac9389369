"""The unexplained residual: what no candidate explains, described by tests and by lines along the way.

Problem: something is missing that is not on the list of effects. Solution: the residual of the best model is tested as
a comparison tests it (which force in the suspensions, at which frequencies, correlated with what), and its spectrum is
taken along the way instead of along the time: what a wheel does once in a turn repeats every so many metres, whatever
the speed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.residual_tests import run_residual_tests
from logger.lab.residual_tests.tests import SIGNIFICANCE, ResidualEvidence, ResidualTestResults
from logger.lab.residuals.breakdown import Breakdown, ModelResiduals, breakdown
from logger.lab.residuals.removed import Removed
from logger.lab.residuals.statistics import NEIGHBOURS, periodogram, strongest_line
from logger.runs import short_names


@dataclass(frozen=True)
class SpatialLine:
    """A line at a wave number, in the run where it is most significant: the wave number [1/m], the run's usual speed,
    the p-value (1 where runs at other speeds do not have it), and the powers (n,) at all wave numbers (n,) [1/m] over
    their mean.

    steady    the speed hardly changed, so that it may as well be a line in time
    """

    run: str
    at_per_m: float
    speed_mps: float
    p_value: float
    per_m: Array
    power: Array
    steady: bool

    @property
    def found(self) -> bool:
        """Whether the line is significant."""
        return self.p_value < SIGNIFICANCE


@dataclass(frozen=True, eq=False)
class Shape:
    """Residuals of a model: their power by frequency, speed, excitation and place, their tests, and the strongest line
    along the way (None: there is none)."""

    residuals: ModelResiduals
    where: Breakdown
    tests: ResidualTestResults
    line: SpatialLine | None


def shape_of(posterior: Posterior, state: State, removed: Removed) -> Shape:
    """The shape of the residuals of a fitted model, without the drift of its sensors."""
    runs, car = posterior.runs, posterior.car(state.effects, state.logs)
    responses = runs.respond(car, posterior.distance_error_m(state.record))
    residuals, as_recorded = (
        ModelResiduals(runs.runs, car, [run.main(one) for run, one in zip(runs.runs, some, strict=True)], responses)
        for some in map(removed.with_drifts, (state.predictions, runs.predict(car))))
    where = breakdown(residuals)
    return Shape(residuals, where, run_residual_tests(ResidualEvidence(residuals, where, as_recorded)),
                 spatial_line_of(residuals))


def spatial_line_of(residuals: ModelResiduals) -> SpatialLine | None:
    """The strongest line along the way, at the wave numbers of one to three in a turn of a wheel of 0.22 to 0.5 m
    radius. A tone in time is distinguished from it where the speed changes, or where another run has another speed.
    Runs that are slower than 1 m/s somewhere are not tested."""
    found, names = [], short_names(residuals.runs)
    for run, residual in zip(residuals.runs, residuals.residual, strict=True):
        speed = run.speed_mps[run.first:]
        if speed.min() < 1.0 or run.distance_m[-1] <= run.distance_m[run.first]:
            continue
        way, usual_mps = np.maximum.accumulate(run.distance_m[run.first:]), float(np.median(speed))
        step_m = usual_mps / run.rate_hz
        along = np.interp(np.arange(way[0], way[-1], step_m), way, residual)
        waves_per_m = np.fft.rfftfreq(len(along), step_m)
        asked = (waves_per_m > 0.3) & (waves_per_m < 2.2)
        power = periodogram(along)
        line = strongest_line(power, asked)
        if line is None or asked.sum() < NEIGHBOURS:
            continue
        at_per_m = float(waves_per_m[line[0]])
        # A tone in time whose phase along the way varies by a cycle or more is no line there.
        steady = _schedule_range_s(way, run.rate_hz) * at_per_m * usual_mps < 1
        found.append(SpatialLine(names[run.name], at_per_m, usual_mps, line[1],
                                 np.asarray(waves_per_m[asked], float), power[asked] / float(power[asked].mean()),
                                 steady))
    best = min(found, key=lambda one: one.p_value, default=None)
    if best is None:
        return None
    best = replace(best, p_value=min(1.0, best.p_value * len(found)))
    others = [one for one in found if abs(one.speed_mps / best.speed_mps - 1) > 0.05]
    if not best.steady or not others:
        return best
    # A tapered line is two ordinates wide.
    recurs = any(one.found and abs(one.at_per_m - best.at_per_m) < 2 * max(
        np.diff(line.per_m[:2])[0] for line in (one, best)) for one in others)
    return replace(best, steady=False) if recurs else replace(best, p_value=1.0)


def _schedule_range_s(way_m: Array, rate_hz: float) -> float:
    """Range of the deviation from a steady speed's schedule along the way [s]."""
    time_s = np.arange(len(way_m)) / rate_hz
    return float(np.ptp(time_s - np.polyval(np.polyfit(way_m, time_s, 1), way_m)))
