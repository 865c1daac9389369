"""Which effects a model lacks, from drives over one road that nobody measured.

Problem: without a profile there is no prediction to compare a drive with; the road would explain whatever the model
does not. Solution: drives at different speeds meet the same road, and what one of them says of it the others have to
agree with. The road, a Gaussian process of free level and waviness, is integrated out (``unknown_road``); models are
compared by the likelihood of all drives together. The way is cut into stretches of some seconds, each with a level and
a waviness of its own and with places that may be a little off, as roads change and distance signals wander.

The likelihood itself is never computed, only its slopes are. What one model gains over another is their integral along
a straight way from the one response to the other, which is short: the slopes, by a few points, are Gauss's.

Only effects that leave a car answering in proportion to the road can be tried. What a road that is free takes for
itself (a gain; a longer contact patch) shows in the information that remains of an effect once it is integrated out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, permutations

import numpy as np
import numpy.typing as npt

from logger.identification.unknown_road.drive_operator import Drive
from logger.identification.unknown_road.marginal_likelihood import UnknownRoad
from logger.identification.unknown_road.road_state import Options, RoadState
from logger.lab.likelihood.noise_floor import Noise, sensor_noise
from logger.lab.likelihood.priors import Tolerance, VehiclePrior
from logger.lab.likelihood.whittle import DISCREPANCY, Bands
from logger.lab.unknown_road.tabulated_response import Tabulated, response_of
from logger.roads.iso8608 import STANDARD_WAVINESS
from logger.runs import Run, normalised_rms
from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Ints = npt.NDArray[np.intp]

PROBES = 8
"""Simulated drives that slopes are compared with: gains are taken for less than they seem by one part in so many."""


class NotOneRoad(ValueError):
    """The drives are not over one road."""


@dataclass(frozen=True, eq=False)
class RoadFitState:
    """A model with all its numbers.

    effects    with their values
    logs       (p,) logarithms of the car's numbers over the nominal ones
    roads      (r,) of every stretch its level, its waviness and the places of its drives but the first, in this
               order; the logarithm of the noise last
    gains      (x, f) its response
    """

    effects: tuple[Chosen, ...]
    logs: Array
    roads: Array
    gains: Complex

    @property
    def noise_mps2(self) -> float:
        """Deviation of what no road explains."""
        return float(np.exp(self.roads[-1]))


class SameRoad:
    """Drives over one road, a nominal vehicle, and what may be a little off.

    start_vehicle    the vehicle as it stands, where fits begin, if that is another than was given

    NotOneRoad unless each of the runs shares some seconds of the way with another.
    """

    def __init__(self, runs: Sequence[Run], vehicle: Vehicle, tolerance: Tolerance,
                 start_vehicle: Vehicle | None = None) -> None:
        start_vehicle = start_vehicle or vehicle
        self.runs, self.rate_hz = list(runs), runs[0].rate_hz
        self.vehicle = replace(vehicle, contact_patch_m=start_vehicle.contact_patch_m)  # that is not free
        known = VehiclePrior.of(vehicle, tolerance)
        kept = [not name.endswith("contact_patch_m") for name in known.names]
        self.prior = VehiclePrior(tuple(np.array(known.names)[kept].tolist()), known.deviations[kept],
                                  known.steps[kept], soft_bounds=False)
        self.start_vehicle = self.prior.logs(self.vehicle, start_vehicle)
        structure = compose(start_vehicle).structure
        self._behind_m = np.unique(structure.behind_m)
        self._patch_m = structure.contact_patch_m
        least_s = 3.0  # of a stretch, some periods of a body's bounce, to say anything of it
        self.stretches = _cut(self.runs, least_s)
        shared = {run for parts in self.stretches for run, _ in parts}
        if alone := [run.name for number, run in enumerate(self.runs) if number not in shared]:
            raise NotOneRoad(f"{' and '.join(alone)}: expected drives over the same road, found no {least_s:g} s of "
                             "it that another drive was over too, by their distances")
        options = Options(free_waviness=True, probes=PROBES)
        generator = np.random.default_rng(options.seed)
        nominal = self.table(response_of(self.car((), self.start_vehicle), self.rate_hz))
        self._roads = [UnknownRoad(nominal, [one for _, one in parts], options, generator) for parts in self.stretches]
        sizes = [1 + len(parts) for parts in self.stretches]
        ends = np.cumsum(sizes)
        self._parts = [np.append(np.arange(end - size, end), ends[-1]) for size, end in zip(sizes, ends, strict=True)]
        self._first = self._start(nominal)
        self.count, self.rounds = len(self._first), 0

    def car(self, effects: Sequence[Chosen], logs: Array) -> Car:
        """The car with these numbers and effects."""
        return compose(self.prior.vehicle(self.vehicle, logs), effects)

    def response(self, effects: Sequence[Chosen], logs: Array) -> Complex:
        """The response (x, f) of the car with these numbers and effects. ValueError if it does not answer in proportion
        to the road."""
        return response_of(self.car(effects, logs), self.rate_hz)

    def table(self, gains: Complex, slopes: Complex | None = None) -> Tabulated:
        """A response (x, f) with slopes (p, x, f), as roads are asked with."""
        found = np.empty((0, *gains.shape), complex) if slopes is None else slopes
        return Tabulated(self._behind_m, self._patch_m, self.rate_hz, gains, found)

    def start(self, effects: Sequence[Chosen] = ()) -> RoadFitState:
        """The car as it stands on roads of a likely level."""
        return RoadFitState(tuple(effects), self.start_vehicle, self._first, self.response(effects, self.start_vehicle))

    def score_and_information(self, table: Tabulated, roads: Array, information: bool) -> tuple[Array, Array]:
        """Slopes of the log-likelihood (m,) by what a response was given slopes by and by the numbers of the roads, and
        the information (m, m) or zeros; nothing of the priors is in them."""
        p, self.rounds = len(table.slopes), 0
        slopes, matrix = np.zeros(p + self.count), np.zeros((p + self.count, p + self.count))
        for road, at, part, _ in self._at(table, roads):
            whole = np.append(np.arange(p), p + part)
            own, known, _ = road.score(at, information)
            self.rounds = max(self.rounds, road.rounds)
            slopes[whole] += own
            matrix[np.ix_(whole, whole)] += known
        return slopes, matrix

    def preconditioned(self, state: RoadFitState) -> SameRoad:
        """The same drives, quick for models that are like this one."""
        other = copy(self)
        other._roads = []
        for road, at, *_ in self._at(self.table(state.gains), state.roads):
            road.prepare(at)
            other._roads.append(road)
        return other

    def _at(self, table: Tabulated, roads: Array) -> Iterator[tuple[UnknownRoad, RoadState, Ints, list[int]]]:
        """Every stretch under a car of this response: its road, its numbers, where these stand among those of all
        roads, and the runs that its drives are of."""
        for road, part, parts in zip(self._roads, self._parts, self.stretches, strict=True):
            own = roads[part]
            at = RoadState(np.zeros(len(table.slopes)), float(own[0]), float(own[1]), np.append(0.0, own[2:-1]),
                           float(np.exp(own[-1])))
            yield road.with_car(table), at, part, [run for run, _ in parts]

    def prior_terms(self, logs: Array, moves: int, roads: Array, waviness_off: float = 0.3,
                    place_off_m: float = 0.05) -> tuple[Array, Array]:
        """How far a state's numbers are from what they usually are (m,), and the precision of that (m,): of the car's,
        of so many moves of effects, which are free, and of the roads'.

        waviness_off, place_off_m    how far stretches of a road usually are off in their waviness, and their places
                                     from those of the whole way (judgements)
        """
        off, precision = np.zeros(self.count), np.zeros(self.count)
        for part in self._parts:
            off[part[1]] = roads[part[1]] - STANDARD_WAVINESS
            precision[part[1]] = waviness_off**-2
            places = part[2:-1]
            off[places] = roads[places] - self._first[places]
            precision[places] = place_off_m**-2
        free = np.zeros(moves)
        return np.concatenate([logs, free, off]), np.concatenate([self.prior.deviations**-2, free, precision])

    def cost(self, state: RoadFitState) -> float:
        """What the state's numbers cost: squares of their deviations."""
        p = len(state.logs)
        off, precision = self.prior_terms(state.logs, 0, state.roads)
        return float(((state.logs / self.prior.deviations) ** 2).sum() + precision[p:] @ off[p:] ** 2)

    def gain(self, before: RoadFitState, after: RoadFitState) -> float:
        """By how much minus twice the log-likelihood falls from one state to another, the priors counted in: the
        integral of the slopes between them."""
        change, road_change = after.gains - before.gains, after.roads - before.roads
        total = 0.0
        nodes, weights = np.polynomial.legendre.leggauss(3)
        for node, weight in zip(0.5 * (nodes + 1), 0.5 * weights, strict=True):
            table = self.table(before.gains + node * change, change[None])
            slopes, _ = self.score_and_information(table, before.roads + node * road_change, information=False)
            total += weight * float(slopes[0] + slopes[1:] @ road_change)
        return (2 * total + self.cost(before) - self.cost(after)) / (1 + 1 / PROBES)

    def predicted_by_others(self, state: RoadFitState) -> Iterator[tuple[int, Array, Array]]:
        """Of every drive over every stretch: its run, what was read (n,), and what the other drives make one expect
        (n,)."""
        for road, at, _, runs in self._at(self.table(state.gains), state.roads):
            for number, run in enumerate(runs):
                yield run, road.measured[number], road.predicted(at, number)

    def predicted_by_each(self, state: RoadFitState) -> Iterator[tuple[int, int, Array, Array]]:
        """Of every two drives over a stretch, either way: the run, the one that predicts it, what was read (n,), and
        what the latter alone makes one expect (n,)."""
        for road, at, _, runs in self._at(self.table(state.gains), state.roads):
            for number, by in permutations(range(len(runs)), 2):
                yield runs[number], runs[by], road.measured[number], road.predicted(at, number, [by])

    def errors(self, state: RoadFitState) -> list[float]:
        """Of every run, rms(read - expected) / rms(read), the road being known from the other drives alone; nan for one
        that no other shares a stretch with."""
        drives = list(self.predicted_by_others(state))
        return [_error([one for one in drives if one[0] == run]) for run in range(len(self.runs))]

    def error(self, state: RoadFitState) -> float:
        """That error of all runs together."""
        return _error(list(self.predicted_by_others(state)))

    @property
    def size_mps2(self) -> float:
        """R.m.s. of what was read, by which errors are divided [m/s2]."""
        squares = sum(float((one**2).sum()) for road in self._roads for one in road.measured)
        return float(np.sqrt(squares / self.samples))

    @property
    def least_mps2(self) -> float:
        """The least that a model leaves: what two right simulations of a car differ by [m/s2]."""
        return DISCREPANCY * self.size_mps2

    @property
    def samples(self) -> int:
        """How many samples there are, of all drives."""
        return sum(len(drive.measured_mps2) for parts in self.stretches for _, drive in parts)

    def noise(self, state: RoadFitState) -> Noise:
        """The sensor's noise, under what each drive has that the others do not tell: that is more than noise where the
        road moves the car, so that it is asked only for noise that the recorder filtered."""
        left: dict[int, list[Array]] = {}
        for run, read, expected in self.predicted_by_others(state):
            left.setdefault(run, []).append(read - expected)
        runs = [_joined(self.runs[run], parts) for run, parts in left.items()]
        return sensor_noise([Bands(one) for one in runs], [one.measured_mps2 for one in runs],
                            self.least_mps2, fitted=False)

    def _start(self, nominal: Tabulated) -> Array:
        """Levels and noise from the spectra; places by trying them on the longest stretch."""
        first = np.zeros(int(self._parts[-1][-1]) + 1)
        noises = []
        for road, part in zip(self._roads, self._parts, strict=True):
            first[part[0]], noise = road.first_guess(np.zeros(0))
            first[part[1]] = STANDARD_WAVINESS
            noises.append(noise)
        first[-1] = np.log(max(np.median(noises), self.least_mps2))
        offsets = self._offsets(nominal, first)
        for part, parts in zip(self._parts, self.stretches, strict=True):
            own = [offsets[run] for run, _ in parts]
            first[part[2:-1]] = np.array(own[1:]) - own[0]
        return first

    def _offsets(self, nominal: Tabulated, first: Array) -> Array:
        """By how much each run's places are off [m] against those of the first run of the stretch that most runs share;
        where some are not over that one, by way of runs that share another stretch with both."""
        offsets: dict[int, float] = {}
        left = list(self._at(nominal, first))
        while left := [one for one in left if any(run not in offsets for run in one[-1])]:
            tied = [one for one in left if any(run in offsets for run in one[-1])]
            road, at, _, runs = max(tied or left, key=lambda one: len(one[-1]))
            offset = partial(road.offset, at)  # against the first run of the stretch
            if runs[0] not in offsets:
                known = next((number for number, run in enumerate(runs) if run in offsets), None)
                offsets[runs[0]] = 0.0 if known is None else offsets[runs[known]] - offset(known)
            for number, run in enumerate(runs):
                if run not in offsets:
                    offsets[run] = offsets[runs[0]] + offset(number)
        return np.array([offsets[run] for run in range(len(self.runs))])


def _error(drives: Sequence[tuple[int, Array, Array]]) -> float:
    return normalised_rms([read - expected for _, read, expected in drives], [read for _, read, _ in drives])


def _cut(runs: Sequence[Run], least_s: float, stretch_s: float = 10.0) -> list[list[tuple[int, Drive]]]:
    """Stretches of the way, of about ``stretch_s``, that at least two runs share, each for ``least_s`` or longer: of
    each stretch the runs, by number, and their drives."""
    ways = [np.maximum.accumulate(run.distance_m) for run in runs]
    begins, ends = (sorted(way[place] for way, place in zip(ways, places, strict=True))
                    for places in ([run.first for run in runs], [-1] * len(runs)))
    low, high = begins[min(1, len(begins) - 1)], ends[max(0, len(ends) - 2)]
    if len(runs) < 2 or not high > low:
        return []
    pace = float(np.median([np.median(run.speed_mps) for run in runs]))
    edges = np.linspace(low, high, max(1, round((high - low) / max(pace, 1e-3) / stretch_s)) + 1)
    found = []
    for start, end in pairwise(edges):
        parts = []
        for number, (run, way) in enumerate(zip(runs, ways, strict=True)):
            first, last = np.searchsorted(way, (start, end))
            first = max(int(first), run.first)
            if last - first >= least_s * run.rate_hz:
                part = slice(first, int(last))
                parts.append((number, Drive(run.rate_hz, run.measured_mps2[part], run.distance_m[part])))
        if len(parts) > 1:
            found.append(parts)
    return found


def _joined(run: Run, parts: Sequence[Array]) -> Run:
    """What was left in parts of a run, as a run."""
    left = np.concatenate([np.zeros(run.first), *parts])
    own = slice(len(left))
    return replace(run, measured_mps2=left, distance_m=run.distance_m[own], speed_mps=run.speed_mps[own])
