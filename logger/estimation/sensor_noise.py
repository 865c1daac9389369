"""An accelerometer's reading: the acceleration, noise, and rounding to a step; and what a drive tells of the noise.

Problem. No data sheet states the noise of a BMA220, and an estimate with a noise half as large as it is makes a smooth
road rough. Solution. Stretches of a drive each say how probable a noise would have made their readings, for all noises
of a grid: readings that never leave a step rule out the large ones and distinguish small ones not apart, which no slope
and curvature at one noise can say. What was believed before is one more stretch.

Evidence is of coarse readings by their bounds, of others by what no road explains. Each coarse reading says that
acceleration plus noise lay between two bounds. What all other readings say of the acceleration is a Gaussian of mean m
and variance v (expectation propagation, ``quantisation``), so the reading had the probability

    Z = Phi((high - m) / sqrt(V)) - Phi((low - m) / sqrt(V)),  V = v + noise^2

Where the propagation has settled, the slope of its log evidence in a parameter of the likelihood is the sum of the
slopes of log Z with m and v held (Rasmussen and Williams, Gaussian Processes for Machine Learning, 3.6 and 5.5.2): at
the noise that the propagation was made with, the sum of log Z has the right slope, and it says what becomes of it far
from there, where a slope alone would mislead. The next stretches are solved again with the new noise.

A parked car needs no road: its readings are one level, anywhere within a step, and noise; what else shakes it, an
engine or people who get in, is in them too. So they are evidence against larger noises only.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, hypot, log, sqrt

import numpy as np

from logger.arrays import Array
from logger.dsp.resample import GRID_RATE_HZ, PASS_OF_RATE
from logger.estimation.normal_distribution import probability_between
from logger.estimation.scored_variances import LARGEST_STEP

NOISE_MPS2 = 0.05
"""Of a reading, where nobody says another [m/s2]; where it is to be learned, a guess to begin with."""
UNKNOWN_LOG_STD = 1.0
"""Of a noise that was only guessed: by a factor of e up or down."""
# However long the drive: what road and car do that the model does not know, and how rough the propagation is, in steps
# over noise. The most likely value for 44 drives of all kinds, with noise of 0.02 to 0.3 m/s2 at 2 to 8 g: 80 and 98 %
# are within one and two such errors. Powers of 1.5, 2, 2.5 and 3 are each less likely than 1.
_MODEL_LOG_STD, _ROUGH_LOG_STD = 0.04, 0.014
_WANDERED_LOG_STD = 0.05  # from drive to drive: temperature, supply
_LEAST_SHARE = 0.05
_EXPECTED_STRETCHES = 4.0  # count as having scattered as they should
_SPACING, _REACH = 0.1, 35  # of the grid in the log noise: a factor of 33 up and down
_FINER = 10
_LEVELS_PER_STEP = 64  # of the integral over a parked car's level: finer than _MOST_PARKED toggling readings show it
_MOST_PARKED = 1000
"""A stand counts as so many readings at most, ten seconds: in longer ones the level drifts and what shakes the car is
not independent from reading to reading, and their evidence would fall by more than a belief can follow."""
_LEAST_PROBABLE = 1e-30  # so that its logarithm is finite
_LEAST_PROBABILITY = 1e-6
"""Beyond 4.75 deviations: what is farther out is a hole that the solution has not found yet. Not nearer: where readings
toggle about one edge, the few on a third step, 3 to 4 deviations out where the noise is a third to a quarter of one,
are all that tells how much noise there is; were they no less probable with less noise, it would come out too small."""
# Of readings that are not coarse, block by block: how far the noise is from the sensor's.
_NOISE_DEVIATION = 0.5
_LEAST_LOG_NOISE = -2.0  # a sensor that hangs must not be taken for one without noise


@dataclass(frozen=True)
class Sensor:
    """noise_rms_mps2    white noise of one reading on the time grid, before rounding [m/s2], above 0
    step_mps2            step that readings are rounded to [m/s2]; 0: none
    """

    noise_rms_mps2: float
    step_mps2: float

    @property
    def is_coarse(self) -> bool:
        """The noise does not blur the steps: rounding is no noise that one could add, but a bound on either side."""
        return self.step_mps2 > 2 * self.noise_rms_mps2

    @property
    def variance_mps2_2(self) -> float:
        """Variance of noise and rounding, taken as one noise [(m/s2)2]."""
        return self.noise_rms_mps2**2 + self.step_mps2**2 / 12


@dataclass(frozen=True)
class NoiseBelief:
    """log_mean    logarithm of the r.m.s. noise of one reading over 1 m/s2
    log_std        standard error of that: a share of the noise
    """

    log_mean: float
    log_std: float

    @classmethod
    def guessed(cls, noise_rms_mps2: float) -> NoiseBelief:
        """Where to begin when nothing better is known than a guess."""
        return cls(log(noise_rms_mps2), UNKNOWN_LOG_STD)

    @property
    def noise_rms_mps2(self) -> float:
        """The noise [m/s2]."""
        return exp(self.log_mean)

    @property
    def std_mps2(self) -> float:
        """Its standard error [m/s2]."""
        return self.noise_rms_mps2 * self.log_std

    def next_drive(self) -> NoiseBelief:
        """The same at the next drive: a little less certain, never less than a guess."""
        return NoiseBelief(self.log_mean, min(hypot(self.log_std, _WANDERED_LOG_STD), UNKNOWN_LOG_STD))

    def with_rounding(self, step_mps2: float) -> NoiseBelief:
        """Of noise and rounding taken as one noise."""
        share = self.noise_rms_mps2**2 / (self.noise_rms_mps2**2 + step_mps2**2 / 12)
        return NoiseBelief(self.log_mean - 0.5 * log(share), self.log_std * share)

    def without_rounding(self, step_mps2: float) -> NoiseBelief:
        """Back from ``with_rounding``; a noise much below a step could not be distinguished from its rounding."""
        share = max(1 - step_mps2**2 / 12 / self.noise_rms_mps2**2, _LEAST_SHARE)
        return NoiseBelief(self.log_mean + 0.5 * log(share), min(self.log_std / share, UNKNOWN_LOG_STD))


class NoiseLearner:
    """Follows the noise from stretch to stretch, from what was believed before.

    usual        of such a sensor: to this a belief returns from drive to drive where nothing more is heard (stabilised
                 forgetting; Kulhavy and Zarrop, International Journal of Control 58, 1993). Within a drive nothing is
                 forgotten: a noise is a constant of the sensor
    step_mps2    readings are bounds this wide [m/s2]; 0: they are not

    ``log_noise`` (g,) are the noises that stretches are to be judged by: logarithms of m/s2; ``stretches`` is how many
    have been taken.
    """

    def __init__(self, before: NoiseBelief, usual: NoiseBelief, step_mps2: float) -> None:
        self._step_mps2 = step_mps2
        self.log_noise: Array = usual.log_mean + _SPACING * np.arange(-_REACH, _REACH + 1, dtype=np.float64)
        fine = np.arange(2 * _REACH * _FINER + 1, dtype=np.float64) / _FINER
        self._fine_log_noise = self.log_noise[0] + _SPACING * fine
        self._to_fine = _cubic(fine, len(self.log_noise))
        self._usual = _log_density(usual, self.log_noise)
        self._prior = _log_density(before, self.log_noise)
        self._evidence = np.zeros(len(self.log_noise))
        self._slopes = np.zeros(len(self.log_noise))
        self._squares = np.zeros(len(self.log_noise))
        self._heard = 0.0
        self.stretches = 0
        self._mean, self._std = before.log_mean, before.log_std

    def take(self, log_evidence: Array) -> None:
        """One more stretch, which shares no reading with those before it: how probable it is for each of
        ``log_noise`` (g,), as a logarithm and up to a constant."""
        slopes = np.gradient(log_evidence, _SPACING)
        self._evidence = self._evidence + log_evidence
        self._slopes = self._slopes + slopes
        self._squares = self._squares + slopes**2
        self._heard += 1
        self.stretches += 1
        at, _ = self._moments(1.0)
        self._mean, self._std = self._moments(self._excess(at))

    def next_drive(self) -> None:
        """Another drive begins: the noise may have wandered, as in ``NoiseBelief.next_drive``."""
        kept = self._std**2 / (self._std**2 + _WANDERED_LOG_STD**2)
        self._prior = kept * self._prior + (1 - kept) * self._usual
        self._evidence, self._slopes, self._squares = (
            kept * row for row in (self._evidence, self._slopes, self._squares))
        self._heard *= kept
        self._std = min(hypot(self._std, _WANDERED_LOG_STD), UNKNOWN_LOG_STD)

    def _excess(self, log_noise: float) -> float:
        """How much more the slopes of the stretches scatter at a noise than the bend of their evidence says that they
        should, at least 1: by so much less does all of it count (White, Econometrica 50, 1982)."""
        scatter = self._squares - self._slopes**2 / self._heard
        bend = -np.gradient(self._slopes, _SPACING)
        found, due = (max(float(np.interp(log_noise, self.log_noise, row)), 0.0) for row in (scatter, bend))
        expected = _EXPECTED_STRETCHES / self._heard * max(due, 1.0)
        return max((found + expected) / (due + expected), 1.0)

    def _moments(self, excess: float) -> tuple[float, float]:
        """Mean and standard error of the log noise."""
        belief = self._to_fine @ (self._prior + self._evidence / excess)
        weight = np.exp(belief - belief.max())
        weight /= weight.sum()
        mean = float(weight @ self._fine_log_noise)
        return mean, sqrt(float(weight @ (self._fine_log_noise - mean) ** 2))

    @property
    def belief(self) -> NoiseBelief:
        """What is believed now."""
        if not self.stretches:
            return NoiseBelief(self._mean, self._std)
        std = hypot(self._std, _MODEL_LOG_STD, _ROUGH_LOG_STD * self._step_mps2 / exp(self._mean))
        return NoiseBelief(self._mean, min(std, UNKNOWN_LOG_STD))


def _log_density(belief: NoiseBelief, log_noise: Array) -> Array:
    return np.asarray(-0.5 * ((log_noise - belief.log_mean) / belief.log_std) ** 2)


def _cubic(at: Array, count: int) -> Array:
    """Weights (a, count) that read a row at places ``at`` (a,) by the cubic through the four values about each."""
    first = np.clip(np.floor(at).astype(int) - 1, 0, count - 4)
    within = at - first
    weights = np.zeros((len(at), count))
    for node in range(4):
        others = [other for other in range(4) if other != node]
        share = np.prod([(within - other) / (node - other) for other in others], axis=0)
        weights[np.arange(len(at)), first + node] = share
    return weights


def interval_evidence(expected: Array, others: Array, low: Array, high: Array, log_noise: Array) -> Array:
    """Log evidence (g,) of coarse readings for noises (g,), given as logarithms of m/s2.

    expected, others    (n,) mean [m/s2] and variance [(m/s2)2] of each acceleration by all other readings
    low, high           (n,) bounds of each reading [m/s2]
    """
    deviation = np.sqrt(others + np.exp(2 * log_noise)[:, None])
    share = probability_between((low - expected) / deviation, (high - expected) / deviation)
    return np.asarray(np.log(np.maximum(share, _LEAST_PROBABILITY)).sum(axis=1))


def parked_evidence(steps: Array, counts: Array, log_noise: Array) -> Array:
    """Log evidence (g,) of a parked car's readings for noises (g,), given as logarithms of steps: at most that of
    smaller noises, which something else that shook the car may have joined.

    steps, counts    (k,) numbers of neighbouring steps, and how many readings were on each; a long stand is scaled down

    The level may have lain anywhere: Z = integral over the level of the product of each reading's probability.
    """
    levels = np.arange(steps.min() - 0.5, steps.max() + 0.5, 1 / _LEVELS_PER_STEP) + 0.5 / _LEVELS_PER_STEP
    noise, from_level = np.exp(log_noise)[:, None, None], steps - levels[:, None]
    share = probability_between((from_level - 0.5) / noise, (from_level + 0.5) / noise)
    weights = counts * min(1.0, _MOST_PARKED / counts.sum())
    by_level = np.log(np.maximum(share, _LEAST_PROBABLE)) @ weights
    most = by_level.max(axis=1)
    evidence = most + np.log(np.exp(by_level - most[:, None]).mean(axis=1))
    return np.asarray(np.maximum.accumulate(evidence[::-1])[::-1])


def residual_evidence(slope: float, free: float, at: float, log_noise: Array) -> Array:
    """Log evidence (g,) of residuals for noises (g,), given as logarithms of m/s2: that of ``free`` readings whose mean
    square makes it rise by ``slope`` at the log noise ``at`` (the scaled chi-squared distribution)."""
    off = log_noise - at
    return np.asarray(-free * off - 0.5 * (free + slope) * np.exp(-2 * off))


def with_noise(log_noise: float, slope: float, free: float) -> float:
    """One scoring step for the log of the noise variance over the sensor's, by ``noise_slope``."""
    if not free:
        return log_noise
    step = (slope - log_noise / _NOISE_DEVIATION**2) / (0.5 * free + _NOISE_DEVIATION**-2.0)
    return max(log_noise + float(np.clip(step, -LARGEST_STEP, LARGEST_STEP)), _LEAST_LOG_NOISE)


def noise_slope(residual_mps2: Array, weight: Array, resolved_waves: float) -> tuple[float, float]:
    """Slope of the log evidence in the log noise variance, and the readings that were free to show it (half of them
    are its curvature), 0 where there were too few; from the typical second: a pothole that is not explained yet is no
    noise.

    residual_mps2    (t,) readings less what the solution explains, 100 a second
    weight           (t,) that they had, with the noise of which the slope is asked
    resolved_waves   degrees of freedom that the road took: twice the sum of resolved shares over seen waves

    Only what recorders pass is looked at: noise that was thinned out to 100 Hz has nothing above.
    """
    band_share, second = 2 * PASS_OF_RATE, GRID_RATE_HZ  # of half the rate; its samples
    waves = np.fft.rfft(residual_mps2 * (weight > 0))
    waves[int(len(waves) * band_share):] = 0.0
    in_band = weight * np.fft.irfft(waves, len(weight)) ** 2
    seconds = len(weight) // second
    sums = in_band[-seconds * second:].reshape(seconds, second).sum(axis=1)
    counts = (weight[-seconds * second:] > 0).reshape(seconds, second).sum(axis=1)
    if not (counts > second // 2).any():
        return 0.0, 0.0
    typical = float(np.median((sums / np.maximum(counts, 1))[counts > second // 2]))
    in_band_count = band_share * float(np.count_nonzero(weight))
    free = max(in_band_count - resolved_waves, 1.0)
    excess = typical * in_band_count / (band_share * free) - 1
    return 0.5 * free * excess, free
