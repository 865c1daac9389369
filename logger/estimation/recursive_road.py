"""Recursive estimation: what is known of road and sensor, carried from one block of readings to the next.

A block cannot be solved without the road's spectrum, its roughness from place to place, the noise, and what coarse
readings tell; none of them is known before it is solved. So each block is solved with what the one before it led to,
in a few steps from where that one ended, and the belief follows. The first block has none before it: it gets more
rounds. Where readings are bounds, they move with the road's level: how, is learned on the way (``level_response``).
"""

from collections import Counter
from copy import copy
from dataclasses import dataclass, replace
from math import exp, log, pi

import numpy as np

from logger.arrays import Array, Bools, Complex
from logger.bounds import UNUSUAL_SIGMA
from logger.estimation.car_response import steady_motion
from logger.estimation.iri_posterior import vehicle_error_variance
from logger.estimation.level_response import RAISED_EVERY, RISE, Answer, LevelResponse
from logger.estimation.other_motion import OtherMotion
from logger.estimation.quantisation import (
    GaussianReadings,
    bounds,
    cavity_of_reads,
    improved,
    standing_for,
    unexplained,
    without_own,
)
from logger.estimation.road_solver import Block, Solution
from logger.estimation.road_spectrum import COMMON_ROAD, RoadSpectrum, learned
from logger.estimation.roughness import RoadLevels, resolved_shares
from logger.estimation.scored_variances import ScoredVariances
from logger.estimation.sensor_noise import (
    NoiseBelief,
    NoiseLearner,
    Sensor,
    interval_evidence,
    noise_slope,
    parked_evidence,
    residual_evidence,
    with_noise,
)
from logger.estimation.time_grid import RATE_HZ, RoadSamples, between

_STEPS = 8
_FIRST_STEPS = 24
_FIRST_ROUNDS = 8
_COARSE_ROUNDS, _COARSE_STEPS = 2, 2
# Where steps hide the road, bounds and level follow one another slowly, and from below: so many more rounds, until the
# level moves by less than changes an IRI by 3 %, and the variances of bounds by less than 3 % (r.m.s.). Nowhere else do
# these move. With rounds counted, not measured, sections at 20 to 30 mph that steps hide read 11 to 14 % too smooth.
_MORE_ROUNDS, _LEVEL_RESTS, _BOUNDS_REST = 10, 0.06, 0.03
_LEAST_SHOWN = 1e-3
_SMOOTHEST_SOLVED = -6.0  # an IRI of 0.12: a bump on a smoother road takes more steps of the solver
_SETTLED_SAMPLES = 1000  # behind those that show the noise: their bounds have gone through ten rounds by then
_COMPARED_SAMPLES = 200  # of a block, at two levels of its road
_MOST_STEPS_PARKED = 8  # more is no stand: somebody works at the car, or the sensor is loose
# Solved with no less where the noise is learned: what readings say of a smaller one misleads. For 0.15 m/s2 at 8 g R2
# is 0.20 with none, 0.72 with this, 0.70 with 0.07; for 0.05 m/s2 at 4 g 0.73 with this, 0.62 with 0.07. Others agree.
_LEAST_SHARE_OF_STEP = 0.05
# Where readings toggle between two steps, twice the noise and twice the ride look alike. By how much more a ride is
# found if more noise is believed, as a share of it, and how many readings of a block on other steps halve that: chosen
# on drives with 0.6 and 1.6 times the true noise at 2 to 8 g. On 46 other drives its r.m.s. was 0.74, 0.37, 0.24, 0.13
# and 0.07 with none, 1 to 4, 5 to 19, 20 to 99 and more such readings in a block, where these say 0.70, 0.55, 0.22,
# 0.11 and 0.02.
_LIKE_NOISE, _HALVED_BY = 0.7, 6.0
# Of each cosine of the drift, and by how much the logarithm differs from drive to drive: roads are even or hilly, and a
# sensor that leans feels the brakes. A minute of a measured drive (comma2k19, 8 to 20 m/s) has 0.05 to 0.10 m/s2 r.m.s.
_COMMON_DRIFT, _DRIFT_LOG_STD = np.array([0.05**2]), 2.4
_MEDIAN_COST = pi / 2  # variance of a median over that of a mean


@dataclass(frozen=True)
class SolvedBlock:
    """road      (k,) rfft of the elevations on the block's grid [m]
    accel_mps2   (t,) what the car does on it, and what else moves it
    variance     (n,) of a reading, noise, rounding and the car's own error, as the place was felt [(m/s2)2]
    seen         (n,) 1 at the points of the grid that were driven over while there were readings, else 0
    relative_variance    (n,) of the road's innovations there, over that of a common road
    other_psd    (f,) spectrum of what else moves it, one-sided, at the block's frequencies [(m/s2)2/Hz]; None: nothing
    """

    road: Complex
    accel_mps2: Array
    variance: Array
    seen: Array
    relative_variance: Array
    other_psd: Array | None = None


class FollowedRoad:
    """One road after another, as one car and one sensor find them, on a distance grid of ``spacing_m``.

    sensor           of single readings, of which there may be several per sample: y of t samples
    vehicle_error    share that each axle's gain may be off, because no file fits a car
    noise            what is believed of the sensor's noise, which is then learned; None: the sensor's is right, but
    noise_log_std    for this standard error of its logarithm

    ``sensor`` then is as it is believed to be, and ``begun`` whether a block of this drive has been solved.
    """

    def __init__(self, sensor: Sensor, spacing_m: float, vehicle_error: float, noise: NoiseBelief | None = None,
                 noise_log_std: float = 0.0) -> None:
        self._vehicle_error, self._noise_log_std = vehicle_error, noise_log_std
        self._is_coarse, self._step_mps2 = sensor.is_coarse, sensor.step_mps2
        self._noise_is_all = self._is_coarse and noise is not None  # learned of bounds, it holds the car's own error
        self.sensor = sensor
        self._spacing_m = spacing_m
        self._other = OtherMotion()
        self._drift = ScoredVariances(_COMMON_DRIFT, _DRIFT_LOG_STD)
        self._spectrum, self._log_noise = COMMON_ROAD, 0.0  # of the variance, over the sensor's
        self._learner: NoiseLearner | None = None
        if noise is not None:
            usual = NoiseBelief.guessed(sensor.noise_rms_mps2)
            rounding_mps2 = 0.0 if self._is_coarse else self._step_mps2
            self._learner = NoiseLearner(noise.with_rounding(rounding_mps2), usual.with_rounding(rounding_mps2),
                                         self._step_mps2 - rounding_mps2)
            self._take_over()
        self.restart()

    def restart(self) -> None:
        """Another drive begins: spectrum and noise are taken along, all that belongs to places is not."""
        self.begun = False
        self._gaussian: GaussianReadings | None = None
        self._centre_mps2, self._accel_variance = 0.0, 0.0
        self._beside_road = 0.0  # variance of what is in readings beside road and noise, as bounds count it
        self._like_noise = 0.0
        self._other.restart()
        self._solved_last: tuple[Block, Complex] | None = None
        self._roughness = RoadLevels(self._spacing_m)
        self._response = LevelResponse()
        if self._is_coarse:
            self._roughness.curvature = self._response.curvature
        self._answer: Answer | None = None
        self._blocks = 0
        self._bounds_moved = 0.0  # root mean square change of their log variance by the last round
        self._unscored = 0
        self._parked: Counter[int] = Counter()
        self._parked_at_mps2 = 0.0

    def next_drive(self) -> None:
        """Time has passed since what was heard last: of the noise a little less is known."""
        if self._learner is not None:
            self._learner.next_drive()

    @property
    def noise_stretches(self) -> int:
        """From how many stretches the noise was learned."""
        return 0 if self._learner is None else self._learner.stretches

    @property
    def noise(self) -> NoiseBelief | None:
        """What is believed of the sensor's noise now; None where it is not learned."""
        if self._learner is None:
            return None
        belief = self._learner.belief
        return belief if self._is_coarse else belief.without_rounding(self._step_mps2)

    @property
    def noise_log_std(self) -> float:
        """Standard error of the logarithm of the sensor's noise."""
        belief = self.noise
        return self._noise_log_std if belief is None else belief.log_std

    @property
    def scale_log_std(self) -> float:
        """Share by which road and ride may be off because the noise is not known better."""
        return self._like_noise * self.noise_log_std

    def _take_over(self) -> None:
        """Go on with the noise that was learned. Where it blurs the steps, rounding is in it."""
        assert self._learner is not None
        noise_mps2, before = self._learner.belief.noise_rms_mps2, self.sensor.variance_mps2_2
        if self._is_coarse:
            noise_mps2 = max(noise_mps2, _LEAST_SHARE_OF_STEP * self._step_mps2)
        self.sensor = Sensor(noise_mps2, self._step_mps2 if self._is_coarse else 0.0)
        if not self._is_coarse:
            self._log_noise += log(before / self.sensor.variance_mps2_2)

    def move_on(self, fresh: RoadSamples) -> None:
        """The next block is without its oldest samples, and has these behind."""
        self._unscored += len(fresh)
        self._other.move_on(fresh.reading_mps2.size)
        if self._gaussian is None:
            return
        # What readings say of accelerations of which no other tells yet: they go on as they were.
        count = fresh.reading_mps2.size
        centre = np.full(count, self._centre_mps2)
        nothing = GaussianReadings(centre, np.full(count, np.inf))
        guess = self._bounded(nothing, fresh, centre, np.full(count, self._accel_variance), self._same(fresh))
        self._response.move_on(count)
        self._gaussian = GaussianReadings(np.concatenate([self._gaussian.value_mps2[count:], guess.value_mps2]),
                                          np.concatenate([self._gaussian.variance[count:], guess.variance]))

    def parked(self, reading_mps2: Array) -> None:
        """More readings (n,) of a car that has stood for a while. All of one stand share a level: what they say of the
        noise is taken as a whole, by ``driven_off``."""
        if self._learner is None or not self._is_coarse:
            return
        if not self._parked:
            self._parked_at_mps2 = float(reading_mps2[0])
        self._parked.update(np.rint((reading_mps2 - self._parked_at_mps2) / self._step_mps2).astype(int).tolist())

    def driven_off(self) -> None:
        """The stand is over."""
        if not self._parked:
            return
        assert self._learner is not None
        steps = np.arange(min(self._parked), max(self._parked) + 1, dtype=np.float64)
        if len(steps) <= _MOST_STEPS_PARKED:
            counts = np.array([self._parked[round(step)] for step in steps.tolist()], dtype=np.float64)
            self._learner.take(parked_evidence(steps, counts, self._learner.log_noise - log(self._step_mps2)))
            self._take_over()
        self._parked.clear()

    def take_off(self, change_mps2: Array) -> None:
        """From here on readings come with so much less (t,) of what is not the linear car's."""
        if self._gaussian is not None:
            change_mps2 = between(change_mps2, len(self._gaussian.value_mps2) // len(change_mps2))
            self._gaussian = replace(self._gaussian, value_mps2=self._gaussian.value_mps2 - change_mps2)

    def solved(self, block: Block, samples: RoadSamples, read: Bools, beyond_mps2: Array | float = 0.0,
               beyond_variance: float = 0.0, turns: int = 1, is_last: bool = True) -> SolvedBlock:
        """The block's road, while the belief follows; ``read`` (t,) says which samples count, ``beyond_mps2`` (t,)
        or one for all what was taken off the readings, ``beyond_variance`` how uncertain that is [(m/s2)2], ``turns``
        how often the block is solved, which share rounds and steps, and ``is_last`` whether this is the last time."""
        rounds, steps = (_COARSE_ROUNDS // turns, _COARSE_STEPS) if self._is_coarse else (1, _STEPS // turns)
        most = rounds + _MORE_ROUNDS // turns if self._is_coarse else rounds
        if not self.begun:
            rounds, most, steps = _FIRST_ROUNDS, _FIRST_ROUNDS, _FIRST_STEPS
        before = self._spectrum if self.begun else None
        self.begun = True
        seen = block.seen(read)
        for done in range(1, most + 1):
            begun_with = copy(self)
            result = self._round(block, samples, read, seen, steps, before, done == rounds, is_last, beyond_mps2,
                                 beyond_variance)
            if done >= rounds and self._roughness.moved < _LEVEL_RESTS and self._bounds_moved < _BOUNDS_REST:
                break
        self._blocks += is_last
        if self._answer is not None and is_last and before is not None and self._blocks % RAISED_EVERY == 0:
            raised = begun_with._raised_from(block, self._answer)
            raised._round(block, samples, read, seen, steps, before, False, False, beyond_mps2, beyond_variance)
            assert raised._answer is not None
            self._response.learn(block, self._answer, raised._answer,
                                 self._noise_slope(samples, self._answer, raised._answer))
            self._roughness.curvature = self._response.curvature
        return result

    def _raised_from(self, block: Block, answer: Answer) -> "FollowedRoad":
        """As before the round of ``answer``, with a level that is higher than in it and stays; learns nothing."""
        raised = copy(self)
        raised._other, raised._learner = copy(self._other), None
        raised._roughness = self._roughness.held_at(answer.log_variance + RISE)
        if self._gaussian is not None:
            raised._gaussian = self._response.readings_at(self._gaussian, RISE)
        raised._solved_last = block, self._response.waves_at(block, answer.waves, np.full(block.count, RISE))
        return raised

    def _round(
        self, block: Block, samples: RoadSamples, read: Bools, seen: Array, steps: int, before: RoadSpectrum | None,
        learns: bool, is_last: bool, beyond_mps2: Array | float, beyond_variance: float,
    ) -> SolvedBlock:
        """Solve with what is believed, then believe what the solution says; of the noise where it ``learns``, of how
        much roughness scatters once per block, the last time."""
        readings, reads = self._as_gaussian(samples), samples.reading_mps2.shape[1]
        each = np.repeat(read, reads) & samples.usable.ravel()
        first, spectrum = round(block.start_m / self._spacing_m), self._spectrum
        above_common = spectrum.log_level - COMMON_ROAD.log_level
        log_variance = self._roughness.solved_with(first, block.count)
        local = np.exp(np.maximum(log_variance, _SMOOTHEST_SOLVED) - above_common)
        there = _levelled(spectrum, local)
        beside_road = beyond_variance + self._other.variance_left
        if not self._noise_is_all:
            beside_road += vehicle_error_variance(block.car, block.mean_speed_mps, there, self._vehicle_error, RATE_HZ)
        variance = readings.variance
        if self._is_coarse:  # it was in a reading before it was rounded
            self._beside_road = beside_road
        else:
            variance = variance + beside_road
        weight = np.where(each, 1 / variance, 0.0)
        seen_share = block.seen_points(read) / block.count
        drift_variance = float(self._drift.values[0])
        start = None if self._solved_last is None else block.carried_over(*self._solved_last)
        solution = block.solve(readings.value_mps2 - self._other.motion_mps2, weight, spectrum, local,
                               drift_variance, steps, start)

        moving = np.repeat(block.moving, reads) & each
        mean_variance = 1 / float(weight[moving].mean()) if moving.any() else float(variance.mean())
        ratio, free, even_share = np.ones(block.count), np.inf, 1.0
        if self._is_coarse:
            motion = steady_motion(block.car, block.mean_speed_mps, self._spectrum, RATE_HZ, len(samples))
            residual = readings.value_mps2 - solution.fitted_mps2
            if learns and is_last:
                self._other.learn(residual, weight, motion)
            self._other.find(residual, weight)
            solution = replace(solution, fitted_mps2=solution.fitted_mps2 + self._other.motion_mps2)
            motion = self._other.beside(motion)
            relative = block.felt(local)  # motion as strong as where it was felt
            others, even = cavity_of_reads(motion, variance, relative)
            self._centre_mps2 = float(solution.drift_mps2[-1])
            self._accel_variance = motion.variance * float(relative[-1])
            if moving.any():
                # Where nothing was read it is as where it was.
                shown = np.maximum(block.about(moving.astype(np.float64)), _LEAST_SHOWN)
                ratio = block.about(np.where(moving, mean_variance / even, 0.0)) / shown
                ratio = np.where(shown > _LEAST_SHOWN, np.maximum(ratio, _LEAST_SHOWN), 1.0)
                even_share = float(ratio[seen > 0].mean())
                free = float((weight / (1 / others + weight))[moving].sum())
                free *= 1 / (1 + block.car.behind_m.max() / self._spacing_m / float(seen.sum()))
                taken_off = between(beyond_mps2, reads) if isinstance(beyond_mps2, np.ndarray) else beyond_mps2
                as_read = samples.reading_mps2.ravel() + taken_off
                beyond = _beyond_two(as_read[moving], self._step_mps2) / reads
                self._like_noise = _LIKE_NOISE * _HALVED_BY / (_HALVED_BY + beyond)

        left, slope, curvature = block.grid.drift_evidence(solution, drift_variance, even_share)
        if learns and is_last:
            self._drift.learn(np.array([slope]), np.array([curvature]))
        now, shares = spectrum, resolved_shares(np.log(local * ratio), solution.gain, seen)
        if learns or before is None:
            # A lone obstacle is no level: an innovation counts with at most some deviations that are expected there.
            most = UNUSUAL_SIGMA * np.sqrt(shares.points)
            white = np.clip(solution.innovations / np.sqrt(local), -most, most)
            power = np.abs(np.fft.rfft(white)) ** 2 / block.count
            # The level goes with the roughness along the block: two that follow the same slope would overshoot.
            now = learned(now, power, shares.waves, block.log_waves, seen_share, before)
        innovations, shares = exp(0.5 * above_common) * solution.innovations, shares.at_most(free, seen)
        self._roughness.learn(first, innovations, log_variance, shares, seen, learns and is_last and before is not None)
        found = self._roughness.at(first, block.count)
        level = COMMON_ROAD.log_level + float(seen @ found / seen.sum())
        self._spectrum = replace(now, log_level=level)
        self._solved_last = block, block.same_road(solution.waves, spectrum, self._spectrum)
        if self._is_coarse:
            improved_ones, expected, about = self._improved(readings, samples, each, solution, others + left)
            if learns and self._learner is not None:
                self._learn_from_bounds(expected, about, samples, moving)
            if moving.any():
                change = np.log(improved_ones.variance[moving] / readings.variance[moving])
                self._bounds_moved = float(np.sqrt(np.mean(change**2)))
            self._answer = Answer(improved_ones, moving, expected, about, solution.waves, innovations, log_variance,
                                  shares, seen)
            # Bounds and road go along with the level.
            rise = self._roughness.solved_with(first, block.count) - log_variance
            self._gaussian = self._response.readings_at(improved_ones, np.repeat(block.felt(rise), reads))
            self._solved_last = block, self._response.waves_at(block, self._solved_last[1], rise)
        else:
            residual = readings.value_mps2 - solution.fitted_mps2
            resolved_waves = 2 * seen_share * float(shares.waves.sum())
            slope, free = noise_slope(residual, weight, resolved_waves)
            self._log_noise = with_noise(self._log_noise, slope, free)
            if learns and self._learner is not None:
                self._learn_from_residual(slope, free, weight)
        return SolvedBlock(solution.road, (solution.fitted_mps2 - solution.drift_mps2)[::reads],
                           mean_variance / reads / ratio, seen, np.exp(found), self._other.psd)

    def _as_gaussian(self, samples: RoadSamples) -> GaussianReadings:
        """Of coarse ones first with rounding as if it were noise."""
        variance = self.sensor.variance_mps2_2 * exp(self._log_noise)
        return self._gaussian or GaussianReadings(
            samples.reading_mps2.ravel(), np.full(samples.reading_mps2.size, variance))

    def _improved(self, readings: GaussianReadings, samples: RoadSamples, read: Bools, solution: Solution,
                  others: Array) -> tuple[GaussianReadings, Array, Array]:
        """Another round for the bounds, with the variance (y,) that all other readings leave of each acceleration, and
        what they say of it, as ``without_own``; the readings that are ``read`` (y,) count."""
        low, high = self._bounds(samples)
        blurred = self.sensor.noise_rms_mps2**2 + self._beside_road
        others = others + unexplained(solution.fitted_mps2[read], low[read], high[read], blurred)
        fitted_variance = 1 / (1 / others + 1 / readings.variance)
        same = self._same(samples)
        apart = without_own(readings, solution.fitted_mps2, fitted_variance, same)
        return (self._bounded(readings, samples, *apart, same),
                *without_own(readings, solution.fitted_mps2, fitted_variance))

    def _bounded(self, readings: GaussianReadings, samples: RoadSamples, expected: Array, others: Array, same: Array
                 ) -> GaussianReadings:
        return improved(readings, *self._bounds(samples), expected, others, self.sensor.noise_rms_mps2**2,
                        self._beside_road, same, samples.reading_mps2.shape[1])

    def _same(self, samples: RoadSamples) -> Array:
        return standing_for(samples.reading_mps2, samples.usable, self.sensor)

    def _bounds(self, samples: RoadSamples) -> tuple[Array, Array]:
        return bounds(samples.reading_mps2.ravel(), samples.at_end.ravel(), self._step_mps2)

    def _noise_evidence(self, expected: Array, others: Array, samples: RoadSamples, usable: Bools, newest: int
                        ) -> tuple[Array, int]:
        """What readings in the middle of the block, which have settled, say of the noise, and how many they are."""
        assert self._learner is not None
        reads = samples.reading_mps2.shape[1]
        last = len(usable) - _SETTLED_SAMPLES * reads
        part = slice(max(last - newest * reads, 0), last)
        low, high = self._bounds(samples)
        inner = np.arange(len(usable))[part][(usable & np.isfinite(high - low))[part]]
        evidence = interval_evidence(expected[inner], others[inner] + self._beside_road, low[inner], high[inner],
                                     self._learner.log_noise)
        return evidence, len(inner)

    def _learn_from_bounds(self, expected: Array, others: Array, samples: RoadSamples, usable: Bools) -> None:
        """From each reading once."""
        assert self._learner is not None
        evidence, count = self._noise_evidence(expected, others, samples, usable, self._unscored)
        self._unscored = 0
        if count:
            now = int(np.argmin(np.abs(self._learner.log_noise - log(self.sensor.noise_rms_mps2))))
            self._believe(self._response.with_level(evidence, count, now))

    def _noise_slope(self, samples: RoadSamples, answer: Answer, raised: Answer) -> Array | None:
        """By how much the log evidence of a reading for noises rises with the road's log level; None: not learned."""
        if self._learner is None:
            return None
        (one, count), (other, _) = (
            self._noise_evidence(each.expected, each.others, samples, answer.moving, _COMPARED_SAMPLES)
            for each in (answer, raised))
        return (other - one) / max(count, 1) / RISE

    def _learn_from_residual(self, slope: float, free: float, weight: Array) -> None:
        """What a block says of the noise, as far as its readings are new: slope and freedom of ``noise_slope`` for a
        weight (t,). The car's own error, if it has one, counts as noise."""
        if not free:
            return
        share = min(self._unscored / len(weight), 1.0) / _MEDIAN_COST
        assert self._learner is not None
        at = -0.5 * log(float(weight.max()))
        self._believe(residual_evidence(2 * slope * share, free * share, at, self._learner.log_noise))

    def _believe(self, log_evidence: Array) -> None:
        assert self._learner is not None
        self._unscored = 0
        self._learner.take(log_evidence)
        self._take_over()

    def level_at(self, first: int, count: int) -> tuple[RoadSpectrum, float]:
        """The spectrum at points ``first`` ... ``first + count - 1`` of the distance grid, and the standard error of
        its log level."""
        variance = np.exp(self._roughness.at(first, count))
        there = replace(self._spectrum, log_level=COMMON_ROAD.log_level)
        return _levelled(there, variance), self._roughness.log_std(first, count)


def _beyond_two(reading_mps2: Array, step_mps2: float) -> int:
    """How many readings are on other steps than the two on which most are."""
    _, counts = np.unique(np.rint((reading_mps2 - reading_mps2.min()) / step_mps2), return_counts=True)
    return int(np.sort(counts)[:-2].sum())


def _levelled(spectrum: RoadSpectrum, relative_variance: Array) -> RoadSpectrum:
    """The spectrum about points (n,) that are rougher or smoother than it says."""
    return replace(spectrum, log_level=spectrum.log_level + log(float(relative_variance.mean())))
