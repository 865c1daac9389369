"""Samples that are none: repeated ones, those at the end of a range, and bursts of calls."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log

import numpy as np

from logger.arrays import Array, Bools, Whole


def stretches_of(mask: Bools) -> tuple[Whole, Whole]:
    """First places and ends (k,), half open, of the stretches in which a mask (n,) holds."""
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return edges[::2], edges[1::2]


def stretches_inside(mask: Bools) -> tuple[Whole, Whole]:
    """The same, without those that hold the first or the last place."""
    first, end = stretches_of(mask)
    inside = (first > 0) & (end < len(mask))
    return first[inside], end[inside]


_WITHIN = 0.2  # of the mean step: so near to the one before only in a burst
_SHARE = 0.3
_LATE = 0.5  # of the usual time between bursts


def burst_ends(t_s: Array) -> Whole | None:
    """Numbers of the last samples of the bursts of a record with times (n,), not decreasing [s]; None: it has none."""
    steps = np.diff(t_s)
    inside = steps < _WITHIN * (t_s[-1] - t_s[0]) / max(1, len(steps))
    if np.count_nonzero(inside) < _SHARE * len(steps):
        return None
    return np.flatnonzero(np.append(~inside, True))


def spread(t_s: Array, ends: Whole) -> Array:
    """Even times (n,) [s] of samples that came in bursts. ValueError where no even rate stands behind them.

    Problem: a recorder that empties a sensor's buffer every now and then gives several samples one time, or nearly one.
    Solution: the last sample of a burst is the newest, and is no later than the burst. A sensor with a clock of its own
    takes samples evenly, so the straight line through number and time of those is the time of all.
    """
    ends = ends[1:-1]  # those that the record cuts off
    if len(ends) < 3:
        raise ValueError(f"found {len(ends)} bursts of samples, too few for a rate")
    slope_s, start_s = np.polyfit(ends, t_s[ends], 1)
    late_s = np.abs(t_s[ends] - start_s - slope_s * ends).max()
    if slope_s <= 0 or late_s > _LATE * np.median(np.diff(t_s[ends])):
        raise ValueError(f"found bursts of samples that are up to {late_s:.3g} s off an even rate")
    return np.asarray(start_s + slope_s * np.arange(len(t_s)))


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

    Problem: a program that asks a phone 200 times a second gets each of its 51 readings three or four times. Steps that
    no car makes stand between the held values, and the ride reads too rough. A sensor with coarse steps repeats values
    too, for most of a quiet drive, and nothing is wrong with it: how many samples repeat does not distinguish one from
    the other.

    Solution: where a sensor moves by several steps before and after, a sample at which it hardly moves is a turning
    point, and there a move by one or two steps either way is as likely as none: the density of moves is flat over so
    few steps. So among the stretches of small moves between two large ones (``SMALL`` and ``LARGE`` steps) at most
    about one in five stands still, on all axes at once. In a held record nearly all of them do. That so many more than
    half of them do has, without repeats, at most the probability of Chernoff's bound (H. Chernoff, Ann. Math. Stat. 23,
    1952): repeats are reported where it is below ``FALSE_ALARM``. Stretches at the largest or smallest value of an axis
    are left out: there a sensor may stand at the end of its range. What never moves by several steps between two
    samples is not judged.

    That judges many short holds by their number. A few long ones are judged by their length: where a sensor moves by m
    steps from sample to sample right before and right after, each further sample that stands still on all axes has, by
    the same flat density, a chance of 1 in m. A car that comes to rest, or a coarse sensor on a quiet road, moves by
    single steps before it stands still, and is not meant.

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


def find_holds(time_s: Array, samples: Array) -> Bools:
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
    least, longest = log(len(samples) / FALSE_ALARM), 0
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


def are_fresh(samples: Array) -> bool:
    """Whether samples (n, axes) show that none is held: of twenty turning points or more no more stand still than by
    chance. In a held record nearly all of them do."""
    still, stretches = _turning_points(samples, fresh_samples(samples))
    return stretches >= 20 and still <= CHANCE_STILL * stretches


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


def _period(places: Whole) -> float:
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


END_FALSE_ALARM = 1e-4
"""Most probability of reporting an end where there is none."""
JUMP = 6.0  # steps
_LEAST_SAMPLES = 3


@dataclass(frozen=True)
class RangeEnd:
    """``at`` an end of the range stand ``samples``; the bound of its ``chance`` without an end.

    Problem: an accelerometer that was set to 2 g reads 2 g in a pothole, and the ride reads smoother than it was.
    Nothing in the record says what the range was, and the largest value of a ride is no sign: every ride has one.

    Solution: at the end of its range a sensor arrives by a jump, stands for samples, and leaves by a jump. A crest that
    is passed does not: of three equal samples and those beside them the moves of any smooth crest are at most 4 steps.
    By chance each further sample that stands still where the moves are of ``JUMP`` steps has a probability of 1 in
    ``JUMP`` at most, by a flat density of moves.
    """

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
    return RangeEnd(top, int(np.count_nonzero(at_top)), chance) if chance < END_FALSE_ALARM else None
