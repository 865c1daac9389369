"""What is believed of an accelerometer's noise: its logarithm with a standard error, and how a drive changes both.

Problem. No data sheet states the noise of a BMA220, and an estimate with a noise half as large as it is makes a smooth
road rough. Solution. Stretches of a drive each say how probable a noise would have made their readings
(``noise_evidence``), for all noises of a grid: readings that never leave a step rule out the large ones and distinguish
small ones not apart, which no slope and curvature at one noise can say. What was believed before is one more stretch.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, hypot, log, sqrt

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

UNKNOWN_LOG_STD = 1.0
"""Of a noise that was only guessed: by a factor of e up or down."""
# However long the drive: what road and car do that the model does not know, and how rough the propagation is where the
# noise does not blur the steps, as found on drives of known noise (tests/benchmarks/noise.py).
_MODEL_LOG_STD, _ROUGH_LOG_STD = 0.04, 5e-4
_WANDERED_LOG_STD = 0.05  # from drive to drive: temperature, supply
_FORGOTTEN_PER_STRETCH = 0.005
_FORGOTTEN_PER_LOG = 5.0  # what was learnt of another noise is no longer quite true of this one
_LEAST_SHARE = 0.05
_EXPECTED_STRETCHES = 4.0  # count as having scattered as they should
_SPACING, _REACH = 0.1, 35  # of the grid in the log noise: a factor of 33 up and down
_FINER = 10


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

    def scaled(self, factor: float) -> NoiseBelief:
        """Of readings with ``factor`` times the noise."""
        return NoiseBelief(self.log_mean + log(factor), self.log_std)


class NoiseLearner:
    """Follows the noise from stretch to stretch, from what was believed before.

    usual        of such a sensor: to this a belief returns slowly where nothing more is heard (stabilised forgetting;
                 Kulhavy and Zarrop, International Journal of Control 58, 1993)
    step_mps2    readings are bounds this wide [m/s2]; 0: they are not

    ``log_noise`` (g,) are the noises that stretches are to be judged by: logarithms of m/s2.
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
        self._stretches = 0
        self._mean, self._std = before.log_mean, before.log_std

    @property
    def stretches(self) -> int:
        """How many have been taken."""
        return self._stretches

    def take(self, log_evidence: Array) -> None:
        """One more stretch, which shares no reading with those before it: how probable it is for each of
        ``log_noise`` (g,), as a logarithm and up to a constant."""
        slopes = np.gradient(log_evidence, _SPACING)
        self._prior = (1 - _FORGOTTEN_PER_STRETCH) * self._prior + _FORGOTTEN_PER_STRETCH * self._usual
        self._forget(_FORGOTTEN_PER_STRETCH)
        self._evidence = self._evidence + log_evidence
        self._slopes = self._slopes + slopes
        self._squares = self._squares + slopes**2
        self._heard += 1
        self._stretches += 1
        before = self._mean
        at, _ = self._moments(1.0)
        self._mean, self._std = self._moments(self._excess(at))
        self._forget(1 - exp(-_FORGOTTEN_PER_LOG * abs(self._mean - before)))

    def next_drive(self) -> None:
        """Another drive begins: the noise may have wandered, as in ``NoiseBelief.next_drive``."""
        kept = self._std**2 / (self._std**2 + _WANDERED_LOG_STD**2)
        self._prior = kept * self._prior + (1 - kept) * self._usual
        self._forget(1 - kept)
        self._std = min(hypot(self._std, _WANDERED_LOG_STD), UNKNOWN_LOG_STD)

    def _forget(self, share: float) -> None:
        self._evidence = (1 - share) * self._evidence
        self._slopes = (1 - share) * self._slopes
        self._squares = (1 - share) * self._squares
        self._heard *= 1 - share

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
        if not self._stretches:
            return NoiseBelief(self._mean, self._std)
        std = hypot(self._std, _MODEL_LOG_STD, _ROUGH_LOG_STD * (self._step_mps2 / exp(self._mean)) ** 3)
        return NoiseBelief(self._mean, min(std, UNKNOWN_LOG_STD))


def _log_density(belief: NoiseBelief, log_noise: Array) -> Array:
    density: Array = -0.5 * ((log_noise - belief.log_mean) / belief.log_std) ** 2
    return density


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
