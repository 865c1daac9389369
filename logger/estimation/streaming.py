"""Streaming estimation of the road and its IRI while the car drives: blocks of readings, a few seconds behind.

A block of 20 s is solved every 2 s (``road_solver``), with what was learned of road and sensor so far
(``recursive_road``). A stretch of road is taken from it once the car is ``LAG_S`` past it, because the rear axle, and
the body's slow swing, still depend on a road already driven; windows longer than 10 m are made of several stretches.
Splitting the readings differently changes nothing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from math import ceil, hypot, nan, sqrt

import numpy as np

from logger.arrays import Array, Bools, Complex
from logger.comfort.uncertain_ride import NO_FIGURES, RideFigures, RideSums
from logger.estimation.bent_forces import BentForces
from logger.estimation.car_response import LOG_WAVES, WAVE_NUMBERS_CPM, CarResponse, golden_car_on_grid
from logger.estimation.iri_posterior import (
    WindowIri,
    by_slope,
    reading_noise_psd,
    resolved_share,
    slope_knowledge,
    window_iri,
)
from logger.estimation.recursive_road import FollowedRoad, SolvedBlock
from logger.estimation.ride_posterior import RidePlace, RidePosterior
from logger.estimation.road_solver import ENTRY_S, Block, TimeGrid
from logger.estimation.road_spectrum import COMMON_ROAD, RoadSpectrum
from logger.estimation.sensor_noise import NoiseBelief, Sensor
from logger.estimation.time_grid import RATE_HZ, RoadSamples, between
from logger.units import COMMON_SPEED_MPS
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.linearise import KnownCar, MovedCar

BLOCK_SAMPLES = 2048
HOP_SAMPLES = 200
LAG_S = 4.0
BALANCED_LAG_S = 0.5 * ((BLOCK_SAMPLES - HOP_SAMPLES) / RATE_HZ - ENTRY_S)
"""Where nobody waits: a place then has as much of a block behind it as before it."""
FAINT_BELOW = 0.2
VEHICLE_ERROR = 0.05
SLOWEST_WAVE_HZ = 0.125  # what is slower cannot be distinguished from drift
_LONGEST_PIECE_M = 10.0
_REMEMBERED_M = 6.0
_SPACING_M = 0.155
_FIRST_SAMPLES = 1000
# Of a car whose laws are not linear: turns of road and forces in each block, and how far towards the forces each goes.
_TURNS, _FIRST_TURNS, _WAY = 2, 4, 0.5
_KEPT = 24  # of its answers to other roads at other speeds, some 0.4 MB each


@dataclass(frozen=True)
class WindowEstimate:
    """IRI of one window of travelled distance, [number, number + 1) windows from 0.

    iri_m_per_km        NaN when it is not known; ``flags`` say why: ``faint`` when the sensor hardly sees the road at
                        this speed, ``unsettled`` next to the start of the readings or a hole in them
    iri_std_m_per_km    its standard error [m/km], NaN likewise; of it:
    iri_level_std_m_per_km     the road's level is not known better; neighbours share this error
    iri_common_std_m_per_km    nor are the numbers of vehicle and sensor; all windows share it
    iri_place_std_m_per_km     nor is the place: what is gained at one end the neighbour loses
    resolved            share of the variance of the IRI's slope that the readings resolve, 0 to 1
    ride                figures of the weighted acceleration without noise and rounding; nan where they are not known
    """

    number: int
    iri_m_per_km: float
    iri_std_m_per_km: float
    resolved: float
    flags: frozenset[str]
    ride: RideFigures = NO_FIGURES
    iri_level_std_m_per_km: float = nan
    iri_common_std_m_per_km: float = nan
    iri_place_std_m_per_km: float = nan


@dataclass(frozen=True)
class RoadPiece:
    """Estimated elevations (p,) [m] at ``start_m + k spacing_m``; the last point is the next piece's first.

    The elevations of two pieces may differ by a slow wave that the readings do not resolve. Waves from ``shortest_m``
    to ``longest_m`` are resolved: the readings explain more than half of their variance; both are NaN if none is.
    """

    start_m: float
    spacing_m: float
    elevation_m: Array
    shortest_m: float
    longest_m: float


@dataclass(frozen=True)
class _Piece:
    """What a stretch of road that is at most 10 m long gave; ``missing`` says why nothing."""

    iri: WindowIri
    resolved: float
    missing: str = ""
    speed_mps: float = 0.0
    ride: RideSums | None = None


@dataclass(frozen=True)
class _Answers:
    """How the car answers the road, linear, and what follows from that."""

    response: CarResponse
    grid: TimeGrid
    bent: BentForces | None


class RoadEstimator:
    """Readings of a body accelerometer in, IRI of windows out, some seconds late.

    car          with its effects, and where its sensor sits
    sensor       noise and step of a reading
    window_m     length of a window [m]
    place_std_m  standard error of the distance: a window that lies elsewhere has another IRI
    vehicle_error    share that each axle's gain may be off: readings are not trusted beyond it, which keeps waves that
                 lift one axle while the other sinks from being made too much of
    on_road      is given each piece of estimated road
    late_std_s   standard error of the delay by which the distance is late: the faster, the further off
    noise        what is believed of the sensor's noise before, which is then learned; None: the sensor's is right
    ride_response    of the comfort weighting at frequencies (n,) [Hz], to compute the figures of the ride; None: not
    ride_ahead_m     a window's ride is what was felt with the front axle so far ahead of its place
    off              cars that it may be instead, each a standard error of the vehicle's numbers away, in directions
                     that have nothing to do with one another; of a car that nobody measured (not ``is_measured``) what
                     cars are like
    driven_share     way that was driven over what the distance says; windows are of that distance
    reads            readings of each sample; more than one only where the sensor is coarse
    noise_log_std    of a noise that is not learned: standard error of its logarithm
    lag_s            a stretch is taken once the car is so far past it, in whole hops

    ``road`` knows what was learned on the way.
    """

    def __init__(self, car: KnownCar, sensor: Sensor, window_m: float, place_std_m: float = 0.0,
                 vehicle_error: float = VEHICLE_ERROR, on_road: Callable[[RoadPiece], None] | None = None,
                 late_std_s: float = 0.0, noise: NoiseBelief | None = None,
                 ride_response: Callable[[Array], Complex] | None = None, ride_ahead_m: float = 0.0,
                 off: Sequence[KnownCar] = (), is_measured: bool = True, driven_share: float = 1.0, reads: int = 1,
                 noise_log_std: float = 0.0, lag_s: float = LAG_S) -> None:
        if reads > 1 and not sensor.is_coarse:
            raise ValueError("expected one reading per sample, as the noise blurs the steps")
        self._reads, self._lag = reads, HOP_SAMPLES * round(lag_s * RATE_HZ / HOP_SAMPLES)
        self._car, self._off, self._is_measured = car, tuple(off), is_measured
        self._driven_share = driven_share
        window_m, ride_ahead_m = window_m * driven_share, ride_ahead_m * driven_share
        self._takes_bounds = sensor.is_coarse
        self._place_std_m = place_std_m
        self._late_std_s = late_std_s
        self._pieces_per_window = ceil(window_m / _LONGEST_PIECE_M)
        self._piece_m = window_m / self._pieces_per_window
        self._points = ceil(self._piece_m / _SPACING_M)
        self._spacing_m = self._piece_m / self._points
        self._on_road = on_road
        self._ride = None if ride_response is None else RidePosterior(ride_response, BLOCK_SAMPLES, RATE_HZ)
        self.road = FollowedRoad(sensor, self._spacing_m, vehicle_error, noise, noise_log_std)
        self._kept: dict[LinearCar, _Answers] = {}
        self._answers = self._answers_on(COMMON_ROAD, COMMON_SPEED_MPS)
        self._ride_ahead_m = ride_ahead_m
        self._restart()

    def _answers_on(self, spectrum: RoadSpectrum, speed_mps: float) -> _Answers:
        """How the car answers such a road at such a speed; the last few are kept."""
        psd = spectrum.psd_of(LOG_WAVES)
        car = self._car.at(speed_mps, WAVE_NUMBERS_CPM, psd)
        if car in self._kept:
            return self._kept[car]
        response = CarResponse(car, [one.at(speed_mps, WAVE_NUMBERS_CPM, psd, car) for one in self._off],
                               self._is_measured)
        if len(self._kept) >= _KEPT:
            del self._kept[next(iter(self._kept))]
        self._kept[car] = _Answers(
            response, TimeGrid(response, BLOCK_SAMPLES, RATE_HZ, self._reads),
            BentForces(self._car, car, speed_mps, BLOCK_SAMPLES, RATE_HZ) if isinstance(self._car, MovedCar) else None)
        return self._kept[car]

    def _restart(self) -> None:
        self._waiting = RoadSamples.unread(0, 0.0, 0.0, self._reads)
        self._heard = 0
        self._samples: RoadSamples | None = None
        self.road.restart()
        self._next = 0
        self._beyond, self._beyond_variance = np.zeros(BLOCK_SAMPLES), 0.0
        self._gathered: list[_Piece] = []

    def push(self, reading_mps2: Array, usable: Bools, at_end: Array, distance_m: Array) -> list[WindowEstimate]:
        """More readings, arrays (n,) on an unbroken grid of 100 Hz; the first three (n, reads) where each sample has
        several, at even steps from the sample on.

        reading_mps2    up positive; gravity may be in it; anything where it is not usable
        usable          there is a reading
        at_end          1 where it is at the top of the sensor's range, -1 at the bottom, else 0
        distance_m      (n,) where the front axle is [m], not decreasing

        Returns the windows that have become certain, in order and without gaps, from the first whole one on.
        """
        return self._pushed(self._readable(reading_mps2, usable, at_end, self._driven_share * distance_m))

    def _pushed(self, more: RoadSamples) -> list[WindowEstimate]:
        waiting = RoadSamples.joined([self._waiting, more])
        estimates: list[WindowEstimate] = []
        taken = len(waiting) // HOP_SAMPLES * HOP_SAMPLES
        for low in range(0, taken, HOP_SAMPLES):
            estimates += self._hop(waiting.of(slice(low, low + HOP_SAMPLES)))
        self._waiting = waiting.of(slice(taken, None))
        return estimates

    def _readable(self, reading_mps2: Array, usable: Bools, at_end: Array, distance_m: Array) -> RoadSamples:
        """What is not usable may be any number, NaN too; it has no weight. Nor has what stands at an end of the range,
        unless readings are taken as bounds."""
        if not self._takes_bounds:
            usable = usable & (at_end == 0)
        shape = (len(distance_m), self._reads)
        return RoadSamples(np.where(usable, reading_mps2, 0.0).reshape(shape), usable.reshape(shape),
                           at_end.reshape(shape), distance_m)

    def finish(self) -> list[WindowEstimate]:
        """The end of a drive: the windows that were driven to their end. What is pushed later is another drive."""
        last = self._waiting if len(self._waiting) else self._samples
        estimates: list[WindowEstimate] = []
        if last is not None:
            count = self._lag + HOP_SAMPLES - len(self._waiting)
            after = RoadSamples.unread(count, float(last.distance_m[-1]), 0.0, self._reads)
            self._heard = _FIRST_SAMPLES
            estimates = self._pushed(after)
        self.road.driven_off()
        self._restart()
        return estimates

    def _hop(self, fresh: RoadSamples) -> list[WindowEstimate]:
        if self._samples is None:
            first_m, step_m = float(fresh.distance_m[0]), float(np.diff(fresh.distance_m).mean())
            self._samples = RoadSamples.unread(BLOCK_SAMPLES, first_m, step_m, self._reads)
            windows = ceil(first_m / (self._piece_m * self._pieces_per_window) - 1e-9)
            self._next = windows * self._pieces_per_window
        self._samples = RoadSamples.joined([self._samples.of(slice(len(fresh), None)), fresh])
        self._beyond = np.concatenate([self._beyond[len(fresh):], np.zeros(len(fresh))])
        self.road.move_on(fresh)
        self._look_whether_parked(fresh)
        self._heard += len(fresh)
        if not self.road.begun and self._heard < _FIRST_SAMPLES:
            return []
        passed_m = self._samples.distance_m[-1 - self._lag] + 1e-9
        begun = self._next
        while (self._next + 1) * self._piece_m <= passed_m:  # pieces that the car is far enough past
            self._next += 1
        return self._estimates(self._samples, range(begun, self._next)) if self._next > begun else []

    def _look_whether_parked(self, fresh: RoadSamples) -> None:
        """From the second hop of a stand on: in the first the car may still swing."""
        assert self._samples is not None
        both = self._samples.of(slice(-2 * len(fresh), None))
        if both.distance_m[-1] > both.distance_m[0]:
            self.road.driven_off()
        elif both.read.all() and not both.at_end.any():
            self.road.parked(fresh.reading_mps2[fresh.usable])

    def _estimates(self, samples: RoadSamples, due: Sequence[int]) -> list[WindowEstimate]:
        """Solve the block and take the pieces that are due."""
        block = Block(self._answers.grid, samples.distance_m, self._spacing_m, self._piece_m)
        read = samples.read & (np.arange(BLOCK_SAMPLES) >= round(ENTRY_S * RATE_HZ))
        if block.seen_points(read) < self._points:
            unread = [_nothing(self._why_none(samples, number)) for number in due]
            return [one for number, piece in zip(due, unread, strict=True) for one in self._window(number, piece)]
        if self._answers.bent is None:
            solved = self.road.solved(block, samples, read)
        else:
            block, solved = self._solved_in_turns(block, samples, read)
        slope = np.fft.irfft(solved.road * golden_car_on_grid(block.count, self._spacing_m), block.count)
        elevation = np.fft.irfft(solved.road, block.count)
        unseen = np.clip(1 - by_slope(solved.seen, self._spacing_m), 0.0, 1.0)
        # The slope remembers the road shortly before a place.
        log_relative = np.log(np.maximum(by_slope(solved.relative_variance, self._spacing_m),
                                         solved.relative_variance.min()))
        weighted = self._ride.weighted(solved.accel_mps2) if self._ride is not None else None
        estimates: list[WindowEstimate] = []
        for number in due:
            low = round((number * self._piece_m - block.start_m) / self._spacing_m)
            inside = slice(low, low + self._points + 1)
            speed_mps = samples.speed_mps(number * self._piece_m, (number + 1) * self._piece_m)
            if low < 0 or speed_mps is None:
                piece = _nothing(self._why_none(samples, number))
            else:
                variance = 1 / float(np.mean(1 / solved.variance[inside]))
                back = round(_REMEMBERED_M / self._spacing_m)
                level = self.road.level_at(number * self._points - back, back + self._points + 1)
                rise = log_relative[inside] + (COMMON_ROAD.log_level - level[0].log_level)
                piece = self._piece(slope[inside], unseen[inside], rise, speed_mps, variance, *level)
                if weighted is not None:
                    # Of a sample, which has that share of a reading's noise.
                    log_std = self.road.noise_log_std / self._reads
                    place = RidePlace(block.car, speed_mps, variance, *level, self.road.sensor, log_std,
                                      self.road.scale_log_std, solved.other_psd)
                    piece = replace(piece, ride=self._ride_sums(weighted, samples, block.moving, number, place))
                self._give_road(number, elevation[inside], speed_mps, variance, level[0])
            estimates += self._window(number, piece)
        return estimates

    def _driven(self, block: Block) -> Block:
        """The block, with the car as it is on this road at this speed."""
        there, _ = self.road.level_at(round(block.start_m / self._spacing_m), block.count)
        self._answers = self._answers_on(there, block.mean_speed_mps)
        return block.on(self._answers.grid)

    def _solved_in_turns(self, block: Block, samples: RoadSamples, read: Bools) -> tuple[Block, SolvedBlock]:
        """Road and forces beyond those of the linear car by turns: what these do to the readings is taken off them."""
        turns = _TURNS if self.road.begun else _FIRST_TURNS
        for turn in range(turns):
            block = self._driven(block)
            beyond = between(self._beyond, self._reads).reshape(-1, self._reads)
            linear = replace(samples, reading_mps2=samples.reading_mps2 - beyond)
            solved = self.road.solved(block, linear, read, beyond_mps2=self._beyond, turns=_TURNS,
                                       beyond_variance=self._beyond_variance, is_last=turn == turns - 1)
            there, _ = self.road.level_at(round(block.start_m / self._spacing_m), block.count)
            noise_psd = reading_noise_psd(1 / float(np.mean(1 / solved.variance)), RATE_HZ, block.mean_speed_mps)
            resolved = resolved_share(block.car, block.mean_speed_mps, there, noise_psd)
            assert self._answers.bent is not None
            psd = there.psd_of(LOG_WAVES)
            found, self._beyond_variance = self._answers.bent.reading(block.under(solved.road), psd, resolved)
            solved = replace(solved, accel_mps2=solved.accel_mps2 + self._beyond)
            change = _WAY * (found - self._beyond)
            self._beyond = self._beyond + change
            self.road.take_off(change)
        return block, solved

    def _ride_sums(
        self, weighted: Array, samples: RoadSamples, moving: Bools, number: int, place: RidePlace
    ) -> RideSums | None:
        """What was felt in a piece while the car moved; None where that is not in the block."""
        assert self._ride is not None
        begin_m = number * self._piece_m + self._ride_ahead_m
        inside = (samples.distance_m >= begin_m) & (samples.distance_m < begin_m + self._piece_m) & moving
        inside[:round(ENTRY_S * RATE_HZ)] = False
        return self._ride.sums(weighted, inside, ~samples.read, place) if inside.any() else None

    def _why_none(self, samples: RoadSamples, number: int) -> str:
        """The flag of a piece without an estimate: driven before the block began, or too slowly, or not read."""
        begin_m, end_m = number * self._piece_m, (number + 1) * self._piece_m
        gone = end_m <= samples.distance_m[0]
        return "unsettled" if gone or samples.speed_mps(begin_m, end_m) is not None else "faint"

    def _piece(self, slope: Array, unseen: Array, rise: Array, speed_mps: float, variance: float,
               spectrum: RoadSpectrum, log_level_std: float) -> _Piece:
        knowledge = slope_knowledge(self._answers.response, speed_mps, spectrum, variance, RATE_HZ, self._spacing_m,
                                    self._points + 1)
        resolved = knowledge.resolved * (1 - float(unseen.mean()))
        missing = "" if resolved >= FAINT_BELOW else "faint" if knowledge.resolved < FAINT_BELOW else "unsettled"
        iri = window_iri(slope, unseen, rise, knowledge, log_level_std, self._piece_m, self._misplaced_m(speed_mps))
        like_noise = iri.iri_m_per_km * self.road.scale_log_std
        iri = replace(iri, common_std_m_per_km=hypot(iri.common_std_m_per_km, like_noise))
        return _Piece(iri, resolved, missing, speed_mps)

    def _misplaced_m(self, speed_mps: float) -> float:
        """Standard error of a place [m]."""
        return hypot(self._place_std_m, self._late_std_s * speed_mps)

    def _window(self, number: int, piece: _Piece) -> list[WindowEstimate]:
        """The window that this piece completes. Errors of neighbouring pieces count as independent, but for those
        that they share."""
        self._gathered.append(piece)
        if len(self._gathered) < self._pieces_per_window:
            return []
        pieces, self._gathered = self._gathered, []
        resolved = sum(one.resolved for one in pieces) / len(pieces)
        flags = frozenset(one.missing for one in pieces if one.missing)
        ride = _joined_ride(pieces)
        if flags:
            return [WindowEstimate(number // self._pieces_per_window, nan, nan, resolved, flags, ride)]
        iri = [one.iri for one in pieces]
        own = sqrt(sum(one.own_std_m_per_km**2 for one in iri)) / len(iri)
        mean, level, common, scatter = (sum(getattr(one, name) for one in iri) / len(iri) for name in (
            "iri_m_per_km", "level_std_m_per_km", "common_std_m_per_km", "scatter"))
        mean_speed_mps = sum(one.speed_mps for one in pieces) / len(pieces)
        # Ends that happen to be alike do not make a place certain: what they differ by counts half, the other half is
        # what two such ends differ by along the window.
        change = sqrt((iri[-1].ends_with_m_per_km - iri[0].begins_with_m_per_km) ** 2 / 2 + scatter)
        misplaced = self._misplaced_m(mean_speed_mps) * change / (len(iri) * self._piece_m)
        std = hypot(own, level, common, misplaced)
        return [WindowEstimate(number // self._pieces_per_window, mean, std, resolved, flags, ride, level, common,
                               misplaced)]

    def _give_road(
        self, number: int, elevation: Array, speed_mps: float, variance: float, spectrum: RoadSpectrum
    ) -> None:
        if self._on_road is None:
            return
        noise_psd = reading_noise_psd(variance, RATE_HZ, speed_mps)
        seen = resolved_share(self._answers.response, speed_mps, spectrum, noise_psd) > 0.5
        resolved = WAVE_NUMBERS_CPM[seen & (WAVE_NUMBERS_CPM * speed_mps > SLOWEST_WAVE_HZ)]
        shortest_m, longest_m = (1 / resolved[-1], 1 / resolved[0]) if len(resolved) else (nan, nan)
        self._on_road(RoadPiece(number * self._piece_m, self._spacing_m, elevation, shortest_m, longest_m))


def _nothing(missing: str) -> _Piece:
    return _Piece(WindowIri(*[nan] * 7), 0.0, missing)


def _joined_ride(pieces: list[_Piece]) -> RideFigures:
    sums = [one.ride for one in pieces if one.ride is not None]
    return reduce(RideSums.plus, sums).figures(1 / RATE_HZ) if len(sums) == len(pieces) else NO_FIGURES
