"""Drives over one road: a test whether they are, and the distance that all are laid on.

Problem: drives over two roads disagree whatever the car, and a search for what a model lacks then finds effects that
imitate the disagreement. The size of the residual cannot decide: a car that lacks something has a large one as well.
Solution: the record that one drive predicts is correlated with another drive's. Over one road they correlate, through a
wrong car as well, if less; over two roads only by chance, which is measured at lags far apart. Both are divided by the
spectrum and by the envelope of what was read, so that neither a resonance of the car nor a bump dominates. A car that
lacks much may correlate with nothing: before drives are rejected, the car is tried with each of the effects that it may
lack. Where one road would not be significant either, the pair is reported as doubtful.

A receiver's speeds put a drive on the road to a tenth of a metre within some seconds and to metres within a
minute, each drive differently. At the frequency of the wheels' bounce that is a wave of the road, and effects that damp
it or delay the record imitate the blur. So the record of each drive is compared, window by window, with what the
others make a model of the car expect there (``lab.likelihood.lag``), and its distances are moved by the lags, again and
again until these are small. A delay of the record moves with them: of such drives it cannot be distinguished from the
receiver's.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.lag import lags
from logger.lab.likelihood.priors import Tolerance
from logger.lab.unknown_road.likelihood import RoadFitState, SameRoad
from logger.runs import Run
from logger.vehicle.effect import Chosen
from logger.vehicle.simulate import PASS_OF_RATE
from logger.vehicle.vehicle import Vehicle

AGREEMENT_SIGMA = 5.0
"""Standard deviations of chance from which on two drives are over one road: a p-value of 3e-7, and some hundred lags
and tens of cars are tried."""


@dataclass(frozen=True)
class RoadAgreement:
    """Correlation of one run with its prediction by another one, in standard deviations of chance.

    run, by    numbers of the runs: the one that is predicted, and the one that predicts it
    found      the correlation
    expected   with a right model
    """

    run: int
    by: int
    found: float
    expected: float

    @property
    def is_significant(self) -> bool:
        """Whether the correlation is more than chance."""
        return self.found > AGREEMENT_SIGMA


def road_agreements(problem: SameRoad, state: RoadFitState, lacking: Sequence[Chosen] = ()) -> list[RoadAgreement]:
    """Agreements of all pairs of runs that share some of the way, in either direction: by the car of a state and, where
    that would mean two roads, with each of the effects that it may lack; the largest of these."""
    found = _road_agreements(problem, state)
    for one in lacking:
        if certain_two_roads(found) is None:
            break
        effects = (*state.effects, one)
        other = _road_agreements(problem, replace(state, effects=effects, gains=problem.response(effects, state.logs)))
        found = [replace(old, found=max(old.found, new.found)) for old, new in zip(found, other, strict=True)]
    return found


def certain_two_roads(found: Sequence[RoadAgreement]) -> tuple[int, int] | None:
    """The two runs that are most certainly over two roads; None if no two are."""
    certain = {pair: most for pair, most in _disagreeing_pairs(found).items() if _is_certain(most)}
    return max(certain, key=lambda pair: certain[pair]) if certain else None


def possible_two_roads(found: Sequence[RoadAgreement]) -> list[tuple[int, int]]:
    """Pairs of runs that may be over one road or two."""
    return [pair for pair, most in _disagreeing_pairs(found).items() if not _is_certain(most)]


def _is_certain(expected: float) -> bool:
    """Whether one road would have shown: with twice what is significant, as drives that disagree show less than
    half."""
    return expected > 2 * AGREEMENT_SIGMA


def _disagreeing_pairs(found: Sequence[RoadAgreement]) -> dict[tuple[int, int], float]:
    """Pairs of runs of which neither predicts the other, with the agreement expected over one road."""
    ways: defaultdict[tuple[int, int], list[RoadAgreement]] = defaultdict(list)
    for one in found:
        ways[min(one.run, one.by), max(one.run, one.by)].append(one)
    return {pair: max(one.expected for one in both) for pair, both in ways.items()
            if not any(one.is_significant for one in both)}


def _road_agreements(problem: SameRoad, state: RoadFitState) -> list[RoadAgreement]:
    """Agreements by the car of a state."""
    parts: defaultdict[tuple[int, int], list[tuple[Array, Array]]] = defaultdict(list)
    for run, by, read, predicted in problem.predicted_by_each(state):
        parts[run, by].append((read, predicted))
    return [_road_agreement(run, by, pairs, problem.rate_hz) for (run, by), pairs in parts.items()]


def _road_agreement(run: int, by: int, pairs: Sequence[tuple[Array, Array]], rate_hz: float) -> RoadAgreement:
    """The agreement of what was read and predicted (n,) over each stretch: the largest correlation within 0.05 s, as
    places may be a little off, over the r.m.s. correlation beyond a second."""
    near = round(0.05 * rate_hz)
    correlation, chance, expected = np.zeros(2 * near + 1), 0.0, 0.0
    for read, predicted in pairs:
        ours, theirs = _spectrally_flat(read, predicted, rate_hz)
        size = float(np.linalg.norm(ours))
        share = min(1.0, float(np.linalg.norm(theirs)) / size) if size > 0 else 0.0
        ours, theirs = (_envelope_flat(one, rate_hz) for one in (ours, theirs))
        both = np.fft.irfft(np.fft.rfft(ours) * np.conj(np.fft.rfft(theirs)), len(ours))  # one for each shift
        far = min(round(rate_hz), len(both) // 4)
        chance += float((both[far:-far] ** 2).mean())
        correlation += both[np.arange(-near, near + 1)]
        expected += share * float(np.linalg.norm(ours) * np.linalg.norm(theirs))
    deviation = float(np.sqrt(chance))
    if not deviation > 0:  # nothing is predicted
        return RoadAgreement(run, by, 0.0, 0.0)
    return RoadAgreement(run, by, float(correlation.max()) / deviation, expected / deviation)


def _spectrally_flat(read: Array, predicted: Array, rate_hz: float) -> tuple[Array, Array]:
    """What was read and what was predicted (n,), tapered by a tenth at each end, both divided by the smoothed spectrum
    of what was read, at the frequencies that the recorder passes."""
    n = len(read)
    ends = np.minimum(np.arange(n), np.arange(n)[::-1]) / (0.1 * n)
    taper = np.sin(0.5 * np.pi * np.minimum(ends, 1.0)) ** 2
    ours, theirs = (np.fft.rfft(taper * (one - one.mean())) for one in (read, predicted))
    f_hz = np.fft.rfftfreq(n, 1 / rate_hz)
    power = _smooth(np.abs(ours) ** 2, round(1.5 * n / rate_hz))
    used = (f_hz >= 0.5) & (f_hz <= PASS_OF_RATE * rate_hz) & (power > 0)
    gain = np.where(used, 1 / np.sqrt(np.where(used, power, 1.0)), 0.0)
    return np.fft.irfft(gain * ours, n), np.fft.irfft(gain * theirs, n)


def _envelope_flat(samples: Array, rate_hz: float) -> Array:
    """Samples (n,) over their envelope, the r.m.s. of half a second: two roads with a bump at about one place are
    two roads all the same."""
    envelope = np.sqrt(_smooth(samples**2, round(0.5 * rate_hz)))
    return np.asarray(samples / np.maximum(envelope, 1e-300))


def _smooth(power: Array, width: int) -> Array:
    """Moving average (n,) over so many samples."""
    width = max(1, width)
    around = np.pad(power, width, mode="reflect")
    return np.asarray(np.convolve(around, np.ones(width) / width, "same")[width:-width])


def placed_by_road(runs: Sequence[Run], vehicle: Vehicle, tolerance: Tolerance, present: Sequence[Chosen] = (),
                   start_vehicle: Vehicle | None = None, rounds: int = 8) -> list[Run]:
    """Runs with the distances at which the others agree with them, but for a constant of some metres, which is a number
    of the road (``RoadFitState.roads``). The first stays where it is; where windows do not correlate, so does the run.

    rounds    so many at most

    NotOneRoad, ValueError as ``SameRoad`` and its ``start``.
    """
    found = list(runs)
    for _ in range(rounds):
        problem = SameRoad(found, vehicle, tolerance, start_vehicle)
        offsets_m = _offsets(problem, present)
        found = [replace(run, distance_m=run.distance_m + off_m)
                 for run, off_m in zip(found, offsets_m, strict=True)]
        # A fiftieth of the shortest wave that a car feels: no larger than the errors of lags.
        if np.sqrt(np.mean(np.concatenate(offsets_m[1:]) ** 2)) < 0.01:
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
