"""Samples that were written more often than they were taken, distinguished from a coarse sensor that rightly stays on
one code.

Problem: a program that asks a phone 200 times a second gets each of its 51 readings three or four times. Steps that no
car makes stand between the held values, and the ride reads too rough. A sensor with coarse steps repeats values too,
for most of a quiet drive, and nothing is wrong with it: how many samples repeat does not distinguish one from the
other.

Solution: where a sensor moves by several steps before and after, a sample at which it hardly moves is a turning point,
and there a move by one or two steps either way is as likely as none: the density of moves is flat over so few steps.
So among the stretches of small moves between two large ones (``SMALL`` and ``LARGE`` steps) at most about one in five
stands still, on all axes at once. In a held record nearly all of them do. That so many more than half of them do has,
without repeats, at most the probability of Chernoff's bound (H. Chernoff, Ann. Math. Stat. 23, 1952): repeats are
reported where it is below ``FALSE_ALARM``. Stretches at the largest or smallest value of an axis are left out: there a
sensor may stand at the end of its range. What never moves by several steps between two samples is not judged.

That judges many short holds by their number. A few long ones are judged by their length: where a sensor moves by m
steps from sample to sample right before and right after, each further sample that stands still on all axes has, by the
same flat density, a chance of 1 in m. A car that comes to rest, or a coarse sensor on a quiet road, moves by single
steps before it stands still, and is not meant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log

import numpy as np
import numpy.typing as npt

from logger.dsp.stretches import stretches_inside, stretches_of

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

FALSE_ALARM = 1e-6
"""Most probability with which a record without repeats is said to have some."""
SMALL, LARGE = 2.5, 3.5  # steps; between whole ones, as steps are written rounded
CHANCE_STILL = 0.5  # that a stretch of small moves is none at all: 1 in 5 by the flat density, with room
LEAST_SHARE = 0.03  # fewer repeats raise a weighted r.m.s. by 2 % at most
_OUTER = 0.05
_CONVERSION = 1e-9  # of the span: whole steps times a factor differ by so little at most
_WIDE = 16.0  # steps
_BESIDE = 7  # moves beside a long hold, of which the median counts: a bump that dies away ends in small ones
_FEWEST_BESIDE = 3
LONGEST_END_S = 0.5
"""A car leaves the range of no sensor for longer: half a second of free fall is a drop of 1.2 m."""
_FOLLOW = 0.1
_ON_COMB = 1.0  # samples: a held reading is written at the next instant


@dataclass(frozen=True, eq=False)
class RepeatedSamples:
    """Samples that repeat the one before.

    share         of all samples that repeat
    chance        probability bound of so many without a fault
    fresh         (n,) which samples are new
    period        samples between two new ones, in the middle
    """

    share: float
    chance: float
    fresh: Bools
    period: float

    @property
    def complaint(self) -> str:
        """Words for who refuses such a record."""
        return f"expected every sample to be a new measurement, found {self.share:.0%} that repeat the one before"


def resolution(values: Array) -> float:
    """The step between neighbouring values of an axis (n,): the median over those that occur, without the outermost,
    0 where it never changes. Of values that are not rounded it is about their range over their number."""
    low, high = np.quantile(values, [_OUTER, 1 - _OUTER])
    there = np.unique(values[(values >= low) & (values <= high)])
    if len(there) < 2:
        there = np.unique(values)
    return float(np.median(np.diff(there))) if len(there) > 1 else 0.0


def moves(samples: Array, resolutions: Sequence[float]) -> Array:
    """How far each sample is from the one before, in steps of its axis, on the axis where that is most: samples
    (n, axes) to (n - 1,)."""
    steps = np.zeros(max(0, len(samples) - 1))
    for axis, step in zip(samples.T, resolutions, strict=True):
        if step > 0:
            np.maximum(steps, np.abs(np.diff(axis)) / step, out=steps)
    return steps


def fresh_samples(samples: Array) -> Bools:
    """Which samples (n, axes) differ from the one before on some axis (n,); the first one is new."""
    fresh = np.ones(len(samples), dtype=np.bool_)
    fresh[1:] = (np.diff(samples, axis=0) != 0).any(axis=1)
    return fresh


def still_until_s(time_s: Array, samples: Array) -> float:
    """Until when samples (n, axes) are all the same as the first [s]: a parked car, or a sensor that does not work."""
    return float(time_s[max(0, int(np.argmax(np.append(fresh_samples(samples)[1:], True))))])


def find_repeats(samples: Array, false_alarm: float = FALSE_ALARM) -> RepeatedSamples | None:
    """Repeated samples (n, axes), all axes at once; None where there are none beyond chance, which
    gives some with a probability of ``false_alarm`` at most."""
    fresh = fresh_samples(samples)
    share = 1.0 - float(fresh.mean())
    if share < LEAST_SHARE:
        return None
    still, stretches = _turning_points(samples, fresh)
    chance = chernoff(still, stretches, CHANCE_STILL)
    if chance > false_alarm:
        return None
    return RepeatedSamples(share, chance, fresh, _period(np.flatnonzero(fresh)))


def find_holds(time_s: Array, samples: Array, false_alarm: float = FALSE_ALARM) -> Bools:
    """Which samples (n, axes) at times (n,) [s] repeat the one before in a stretch in which the sensor stood still on
    all axes for longer than by chance (n,). Before it moved for the first time it may have been parked, unless it
    stood still for longer later."""
    held = np.zeros(len(samples), dtype=np.bool_)
    fresh = fresh_samples(samples)
    first, end = stretches_of(~fresh)
    if not len(first):
        return held
    steps = [_finest(axis) for axis in samples.T]
    places = np.flatnonzero(fresh)
    size = np.append(np.inf, moves(samples, steps))[places]
    span = np.ptp(samples, axis=0)
    extreme = ((samples == samples.max(axis=0)) | (samples == samples.min(axis=0)) | (span == 0)).all(axis=1)
    least, longest = log(len(samples) / false_alarm), 0
    may_be = (end - first) * log(max(2.0, float(size[1:].max(initial=0.0)))) > least
    for begin, stop in zip(first[may_be], end[may_be], strict=True):
        at = int(np.searchsorted(places, begin))
        before, after = size[max(1, at - _BESIDE) : at], size[at : at + _BESIDE]
        sides = [one for one in (before, after) if len(one)] if max(len(before), len(after)) >= _FEWEST_BESIDE else []
        move = min((float(np.median(one)) for one in sides), default=0.0) if len(before) else 0.0
        clipped = extreme[begin] and time_s[stop - 1] - time_s[begin - 1] <= LONGEST_END_S
        if move > LARGE and (stop - begin) * log(move) > least and not clipped:
            held[begin:stop] = True
            longest = max(longest, stop - begin)
    if first[0] == 1 and end[0] - 1 <= longest:
        held[1 : end[0]] = True
    return held


def _finest(values: Array) -> float:
    """The finest step in which values (n,) are written, but for the rounding of a conversion; 0: they never change."""
    there = np.diff(np.unique(values))
    there = there[there > _CONVERSION * np.ptp(values)]
    return float(np.quantile(there, _OUTER)) if len(there) else 0.0


def are_fresh(samples: Array, least_stretches: int = 20) -> bool:
    """Whether samples (n, axes) show that none is held: of so many turning points no more stand still than by chance.
    In a held record nearly all of them do."""
    still, stretches = _turning_points(samples, fresh_samples(samples))
    return stretches >= least_stretches and still <= CHANCE_STILL * stretches


def _turning_points(samples: Array, fresh: Bools) -> tuple[int, int]:
    """How many stretches of small moves between two large ones stand still, and how many there are."""
    resolutions = [resolution(axis) for axis in samples.T]
    move = moves(samples, resolutions)
    large = move > LARGE
    first, end = stretches_inside(move < SMALL)
    at_end = _at_an_end(samples, resolutions)
    good = large[first - 1] & large[end] & ~at_end[first]
    first, end = first[good], end[good]
    still = np.concatenate([[0], np.cumsum(fresh[1:])])
    return int(np.count_nonzero(still[end] == still[first])), len(first)


def _at_an_end(samples: Array, resolutions: Sequence[float]) -> Bools:
    """(n,) where an axis has its largest or smallest value; an axis of few steps, which has it often, does not count
    beside one of many."""
    spans = [float(np.ptp(axis)) / step if step > 0 else 0.0 for axis, step in zip(samples.T, resolutions, strict=True)]
    wide = samples[:, np.array(spans) >= min(_WIDE, max(spans))]
    return np.asarray(((wide == wide.max(axis=0)) | (wide == wide.min(axis=0))).any(axis=1))


def chernoff(hits: int, tries: int, chance: float) -> float:
    """Bound of the probability of ``hits`` or more in ``tries`` of one ``chance`` each (Chernoff 1952)."""
    share = hits / tries if tries else 0.0
    if share <= chance:
        return 1.0
    divergence = share * log(share / chance)
    if share < 1:
        divergence += (1 - share) * log((1 - share) / (1 - chance))
    return exp(-tries * divergence)


def _period(places: npt.NDArray[np.int64]) -> float:
    """Usual distance of new samples: a mean that leaves out where a new one happened to equal the one before."""
    gaps = np.diff(places)
    return float(gaps[gaps <= np.quantile(gaps, _OUTER) + 1].mean())


def fresh_times(repeats: RepeatedSamples, t_s: Array) -> Array:
    """When the new samples (m,) of a record with times (n,) [s] were taken: on an even grid where theirs can be one,
    for a held reading is written up to a sample late; else when they were written."""
    places = np.flatnonzero(repeats.fresh)
    number = _teeth(places.tolist(), repeats.period)
    for _ in range(3):
        slope, start = np.polyfit(number, places, 1)
        if np.abs(places - start - slope * number).max() <= _ON_COMB:
            return np.asarray(np.interp(start + slope * number, np.arange(len(t_s)), t_s))
        again = np.rint((places - start) / slope)
        if (np.diff(again) <= 0).any():
            break
        number = again
    return t_s[places]


def _teeth(places: list[int], period: float) -> Array:
    """Numbers (m,) on a comb of about this period of the samples nearest to its teeth; the comb follows them slowly."""
    number, tooth = 0, float(places[0])
    numbers: list[float] = []
    for place in places:
        ahead = round((place - tooth) / period)
        if numbers:
            ahead = max(1, ahead)
        number += ahead
        tooth += ahead * period
        tooth += _FOLLOW * (place - tooth)
        period += _FOLLOW**2 / 4 * (place - tooth)
        numbers.append(float(number))
    return np.array(numbers)
