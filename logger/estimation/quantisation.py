"""Quantisation: readings rounded to coarse steps, as readings with Gaussian noise that hold as much information.

Problem. A BMA220 at +-2 g rounds to 0.61 m/s2, more than a smooth road shakes a car. Its error is not noise: a reading
that stays on one step says that the acceleration stayed within it, one that toggles says that it is at the edge; taken
as noise of step / sqrt(12), the first reads as no road and the second as a rough one, depending on where gravity
happens to lie between two steps.

Solution. Expectation propagation (Minka 2001; Rasmussen and Williams, Gaussian Processes for Machine Learning, 3.6).
What all other readings say of one acceleration is a Gaussian; with the bounds of its own reading it is a truncated
one, whose mean and variance are known; the Gaussian reading that would have led to the same mean and variance takes
its place. A few rounds with the solution of the whole stretch settle it. A reading at the end of the range is a bound
on one side only.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import log, sqrt

import numpy as np

from logger.arrays import Array, Bools
from logger.estimation.car_response import SteadyMotion
from logger.estimation.normal_distribution import density, distribution, within
from logger.estimation.sensor_noise import Sensor
from logger.estimation.time_grid import neighbours

_KEPT = 0.3  # of the last round, so that rounds do not overshoot
_TRIALS = 12
_EVENING_ROUNDS, _NEARLY_EVEN = 6, 0.01
_LEAST_WAY = 0.5  # of a step in that, which would not end otherwise
_LEAST_SLOPE = 1e-6  # of others with even readings, where no reading says anything of another
# In readings that say the same: wide enough to be a mean, and short beside the ringing of a lone bump. By dense algebra
# 3 to 16 are as good, but a bump of 5 cm on a flat road reads 9 % too rough with 4, and 18 % and more with 6 to 8.
_MEDIUM_REACH = 4.0
_EDGES_APART = 0.25  # of a step: by integration, 1 to 8 reads on one step are right within 6 % of a deviation then
_MOST_OWN = 0.9  # of what a solution knows of an acceleration, from its own reading


@dataclass(frozen=True)
class GaussianReadings:
    """As Gaussian readings: values [m/s2] and variances [(m/s2)2], both (t,)."""

    value_mps2: Array
    variance: Array


def bounds(reading_mps2: Array, at_end: Array, step_mps2: float) -> tuple[Array, Array]:
    """Bounds of what was rounded; ``at_end`` (t,) is 1 for a reading at the top of the range, -1 at the bottom."""
    low = np.where(at_end < 0, -np.inf, reading_mps2 - 0.5 * step_mps2)
    high = np.where(at_end > 0, np.inf, reading_mps2 + 0.5 * step_mps2)
    return low, high


def unexplained(fitted_mps2: Array, low: Array, high: Array, noise_variance: float) -> float:
    """Variance by which a solution misses its bounds (t,) more than noise would [(m/s2)2]: it is not settled yet, or
    the car is not the one in the file. Without it such a solution would take every bound that it misses for a sharp
    reading, and settle ever less."""
    missed = np.maximum(np.maximum(low - fitted_mps2, fitted_mps2 - high), 0.0)
    return max(float(np.mean(missed**2)) - noise_variance, 0.0) if len(missed) else 0.0


def cavity(motion: SteadyMotion, variance: Array) -> tuple[Array, Array]:
    """Variance (t,) that all other readings leave of each acceleration, where some say much and some little
    [(m/s2)2], and the variance (t,) of even readings that say as much about it; ``variance`` (t,) is that of the
    readings.

    Sharp readings side by side say little more than one. About each place the readings are even ones of precision p
    that change to their own, w: C is the covariance that even ones leave, c its value at lag 0, and t = (w - p) /
    (1 + (w - p) c) what one such change does whatever it is. Without its own, a reading finds the medium's c, less
    sum of t(s) C(s)^2 over the others s, the second order of log det(1 + C (w - p)) in t. The first order is nothing,
    because p is chosen so that the mean of t about a place is 0.
    Source: the coherent potential approximation (Soven, Physical Review 156, 1967) and its correction by pairs, with
    the precisions as disorder.
    """
    precision = 1 / variance
    log_trials = np.linspace(log(float(variance.min())), log(float(variance.max()) * 1.001), _TRIALS)
    # 1 / remaining - 1 / trial: what even readings say of an acceleration less what its own one does
    log_others = log_trials - np.log(1 / motion.resolved_per_reading(np.exp(log_trials)) - 1)
    log_others += _LEAST_SLOPE * log_trials
    covariance = motion.covariance_left(1 / float(precision.mean()))
    alike = (covariance / covariance[0]) ** 2
    about = neighbours(len(variance), _MEDIUM_REACH * float(alike.sum()))
    about = about / about[0]
    medium = np.maximum(np.fft.irfft(np.fft.rfft(precision) * about, len(variance)), precision.min())
    for _ in range(_EVENING_ROUNDS):
        others = np.exp(np.interp(-np.log(medium), log_trials, log_others))
        left = 1 / (1 / others + medium)
        change = (precision - medium) / (1 + (precision - medium) * left)
        shared = np.fft.irfft(np.fft.rfft(change) * about, len(variance))
        step = shared / np.maximum(1 + shared * left, _LEAST_WAY)
        if np.abs(step).max() < _NEARLY_EVEN * medium.min():
            break
        medium = np.maximum(medium + step, precision.min())
    alike[0] = 0.0
    pairs = np.fft.irfft(np.fft.rfft(change * left) * np.fft.rfft(alike).real, len(variance))
    less = pairs * others / left
    others = np.where(less > 0, others / (1 + np.abs(less)), others * (1 + np.abs(less)))  # to that order, positive
    return others, np.exp(np.interp(np.log(others), log_others, log_trials))


def cavity_of_reads(motion: SteadyMotion, variance: Array, relative: Array) -> tuple[Array, Array]:
    """The same (y,) for readings (y,), some of each sample (t,), of a motion whose variance is ``relative`` there (t,).

    Reads of one sample say nearly the same, which is no small disorder: they count as one reading of all they say."""
    reads = len(variance) // len(relative)
    own = 1 / variance
    of_sample = own.reshape(-1, reads).sum(axis=1)
    others, even = (relative * row for row in cavity(motion, 1 / (of_sample * relative)))
    return 1 / (np.repeat(1 / others, reads) + (np.repeat(of_sample, reads) - own)), np.repeat(even * reads, reads)


def without_own(readings: GaussianReadings, fitted_mps2: Array, fitted_variance: Array | float,
                same: Array | int = 1) -> tuple[Array, Array]:
    """What all other readings say of each acceleration: mean [m/s2] and variance [(m/s2)2], (t,); as ``improved``."""
    taken_out = np.minimum(same / readings.variance, _MOST_OWN / fitted_variance)
    others = 1 / fitted_variance - taken_out
    return (fitted_mps2 / fitted_variance - readings.value_mps2 * taken_out) / others, 1 / others


def standing_for(reading_mps2: Array, usable: Bools, sensor: Sensor) -> Array:
    """For how many reads of its sample, each (t, k), each (t k,) stands in ``improved``: for all where they are on one
    step, and the noise leaves its edges apart; each by itself is right where they toggle, or more noise does that."""
    reads = reading_mps2.shape[1]
    alike = usable.all(axis=1) & (np.ptp(reading_mps2, axis=1) < 0.5 * sensor.step_mps2)
    alike &= sensor.noise_rms_mps2 < _EDGES_APART * sensor.step_mps2
    return np.repeat(np.where(alike, reads, 1), reads)


@lru_cache(maxsize=8)
def _largest_of(count: int) -> tuple[float, float]:
    """Mean and standard deviation of the largest of so many standard normal numbers."""
    u = np.linspace(-9.0, 9.0, 1801)
    weight = count * density(u) * distribution(u) ** (count - 1)
    weight /= weight.sum()
    mean = float(weight @ u)
    return mean, sqrt(float(weight @ (u - mean) ** 2))


def improved(readings: GaussianReadings, low: Array, high: Array, expected: Array, others: Array,
             noise_variance: float, beside: float = 0.0, same: Array | None = None, reads: int = 1
             ) -> GaussianReadings:
    """One round.

    low, high           (t,) bounds of each reading [m/s2]
    expected, others    (t,) of each acceleration by all readings but those that it stands for, as ``without_own``
    noise_variance      of a reading before it is rounded [(m/s2)2]
    beside              of what moves all ``reads`` of a sample alike: they tell no more of the road than one
    same                (t,) 1, or ``reads`` where it stands for all of its sample. They are one bound, not so many: the
                        largest of their noises keeps below the upper one, the smallest above the lower one. Each by
                        itself, its others would have the bound already, and what toggles little would be known the
                        better, the more often it is read (Minka, Power EP, Microsoft Research 2004)
    """
    own, deviation, count = 1 / readings.variance, sqrt(noise_variance), np.ones(len(low)) if same is None else same
    mean_largest, scatter = _largest_of(reads)
    inward = np.where(count > 1, mean_largest * deviation, 0.0)
    noise = np.where(count > 1, scatter**2, 1.0) * noise_variance
    spread = others + noise + beside
    mean, variance = within(expected, spread, low + inward, high - inward)
    precision = np.maximum(1 / variance - 1 / spread, 1e-9 / spread)
    value = (mean / variance - expected / spread) / precision
    new = 1 / (count * (1 / precision + noise) + reads * beside)
    total = (1 - _KEPT) * new + _KEPT * own
    return GaussianReadings(((1 - _KEPT) * value * new + _KEPT * readings.value_mps2 * own) / total, 1 / total)
