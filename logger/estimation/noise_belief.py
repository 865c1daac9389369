"""What is believed of an accelerometer's noise: its logarithm with a standard error, and how a drive changes both.

Problem. No data sheet states the noise of a BMA220, and an estimate with a noise half as large as it is makes a smooth
road rough. Solution. Stretches of a drive each say by how much a larger noise would have made their readings more
probable: slope and information of the log evidence (``noise_evidence``, ``hyperparameters``). Their sum over stretches
that do not overlap is the drive's; a step of scoring per stretch follows it, and what was believed before is one more
stretch.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, hypot, inf, log, sqrt

UNKNOWN_LOG_STD = 1.0
"""Of a noise that was only guessed: by a factor of e up or down."""
LEAST_SHARE_OF_STEP = 0.1
"""Of a noise that bounds tell: below, the propagation is too rough, and a noise that is too small costs far more than
one that is too large."""
_FIRST_SHARE_OF_STEP = 1 / 3  # from above it is found sooner: noise that is taken for road roughens the road
# However long the drive: what road and car do that the model does not know, and how rough the propagation is where the
# noise does not blur the steps, as found on drives of known noise (tests/benchmarks/noise.py).
_MODEL_LOG_STD, _ROUGH_LOG_STD = 0.04, 0.0065
_BOUND_BELOW_SHARE_OF_STEP, _BOUND_LOG_STD = 0.15, 0.7  # there it says little more than that it is no larger
_WANDERED_LOG_STD = 0.05  # from drive to drive: temperature, supply
_FORGOTTEN_PER_STRETCH = 0.005
_FORGOTTEN_PER_STEP = 5.0  # what was told about another noise is no longer quite true of this one
_LARGEST_STEP = 0.3
_LEAST_SHARE = 0.05
_EXPECTED_STRETCHES = 4.0  # count as having scattered as they should


@dataclass(frozen=True)
class NoiseBelief:
    """log_mean    logarithm of the r.m.s. noise of one reading over 1 m/s2
    log_std        standard error of that: a share of the noise
    """

    log_mean: float
    log_std: float

    @classmethod
    def guessed(cls, noise_rms_mps2: float, step_mps2: float) -> NoiseBelief:
        """Where to begin when nothing better is known than a guess."""
        return cls(log(max(noise_rms_mps2, _FIRST_SHARE_OF_STEP * step_mps2)), UNKNOWN_LOG_STD)

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
        """Back from ``with_rounding``; a noise much below a step could not be told from its rounding."""
        share = max(1 - step_mps2**2 / 12 / self.noise_rms_mps2**2, _LEAST_SHARE)
        return NoiseBelief(self.log_mean + 0.5 * log(share), min(self.log_std / share, UNKNOWN_LOG_STD))

    def scaled(self, factor: float) -> NoiseBelief:
        """Of readings with ``factor`` times the noise."""
        return NoiseBelief(self.log_mean + log(factor), self.log_std)


@dataclass(frozen=True)
class NoiseScore:
    """Log evidence of a stretch as a function of the log noise: at ``log_noise`` it rises by ``slope``, and bends down
    by ``information``, 0 or more."""

    log_noise: float
    slope: float
    information: float


class NoiseLearner:
    """Follows the noise from stretch to stretch, from what was believed before.

    step_mps2    readings are bounds this wide [m/s2]; 0: they are not
    """

    def __init__(self, before: NoiseBelief, step_mps2: float) -> None:
        self._step_mps2 = step_mps2
        self._least = log(LEAST_SHARE_OF_STEP * step_mps2) if step_mps2 else -inf
        self._mean = max(before.log_mean, self._least)
        self._information = before.log_std**-2
        self._evidence = 0.0
        self._scatter = 0.0
        self._stretches = 0

    @property
    def stretches(self) -> int:
        """How many have been taken."""
        return self._stretches

    def take(self, score: NoiseScore) -> None:
        """One more stretch, which shares no reading with those before it."""
        slope = score.slope + score.information * (score.log_noise - self._mean)
        step = slope / (self._information + score.information)
        step = max(min(max(step, -_LARGEST_STEP), _LARGEST_STEP), self._least - self._mean)
        kept = (1 - _FORGOTTEN_PER_STRETCH) * exp(-_FORGOTTEN_PER_STEP * abs(step))
        self._information = max(kept * self._information, UNKNOWN_LOG_STD**-2) + score.information
        self._evidence = kept * self._evidence + score.information
        self._scatter = kept * self._scatter + slope**2
        self._mean += step
        self._stretches += 1

    @property
    def belief(self) -> NoiseBelief:
        """What is believed now. Where the slopes of the stretches scatter more than their information says, the
        standard error is larger by as much (White, Econometrica 50, 1982: the sandwich)."""
        own = self._information**-0.5
        if not self._stretches:
            return NoiseBelief(self._mean, own)
        expected = _EXPECTED_STRETCHES / self._stretches * self._evidence
        excess = (self._scatter + expected) / (self._evidence + expected)
        noise_mps2 = exp(self._mean)
        std = hypot(own * sqrt(max(excess, 1.0)), _MODEL_LOG_STD, _ROUGH_LOG_STD * (self._step_mps2 / noise_mps2)**2)
        if noise_mps2 < _BOUND_BELOW_SHARE_OF_STEP * self._step_mps2:
            std = max(std, _BOUND_LOG_STD)
        return NoiseBelief(self._mean, min(std, UNKNOWN_LOG_STD))
