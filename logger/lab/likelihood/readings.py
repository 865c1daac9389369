"""Readings as a likelihood takes them: what a model leaves of them, and which of them count.

Problem. A sensor may round to steps that are larger than its noise. Taken as noise of step / sqrt(12), as it is where
the noise blurs the steps, such rounding hides what the readings tell: within its step a reading says nothing, at the
edge of one very much. Samples that were clipped are bounds, and some are not there.

Solution. Beside a model's prediction, a rounded reading says by its bounds where the acceleration with the sensor's
noise was: the mean of a normal variable around the prediction, truncated to the step. How far that mean is from the
prediction is, over the noise's variance, the slope of the logarithm of the likelihood of the bounds; divided by the
share of the information that rounding leaves (1 - truncated variance / variance, on average), it is a residual like any
other: its mean follows the prediction one to one, and its variance is the inverse of the information that the bounds
hold (the score and its variance; R. A. Fisher, Proc. Camb. Phil. Soc. 22, 1925). So a likelihood of residuals with free
levels takes it, and loses nothing to first order. The noise and the constant offset of the record are the likeliest
ones; a model that is far off leaves much, the noise is found large then, and the readings stay what they are.

Clipped and missing samples leave residuals as ``Run.left_by`` says, and columns of slopes are zero there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from logger.runs import CLIPPED, READING, Bools, Run, normalised_rms

Array = npt.NDArray[np.float64]

BLURRED = 0.5
"""Noise of so many steps makes noise of rounding as well. What it leaves of rounding that goes with the acceleration is
at most exp(-2 pi^2 0.5^2) / pi = 0.2 % of a step (B. Widrow and I. Kollar, Quantization Noise, 2008); with a third of a
step it is 3.5 %, and on a smooth road standard errors are half as large again (``tests.benchmarks.rounded_lab``)."""
_ON_STEPS = 0.02
"""Readings that lie no nearer to steps were levelled, filtered or laid on other times after they were rounded."""
_LEAST_SHARE = 1e-3
"""Readings that keep less of their information stood on one step nearly always."""
_LEAST_NOISE, _MOST_NOISE = 0.01, 3.0  # steps, where the likeliest noise is looked for
_ROUNDS = 8
_LEAST_PROBABILITY = 1e-300


@dataclass(frozen=True, eq=False)
class Readings:
    """The readings of a run.

    mps2     (n,) values that predictions are compared with [m/s2]
    share    of the information of the same readings without rounding: the sensor's noise has this share of the
             variance of what right predictions leave; 1 where nobody knows
    """

    run: Run
    mps2: Array
    share: float = 1.0

    @staticmethod
    def of(run: Run) -> Readings:
        """As they were read."""
        return Readings(run, run.measured_mps2)

    @property
    def as_read(self) -> bool:
        """Whether rounding is taken as noise."""
        return self.mps2 is self.run.measured_mps2

    def left_by(self, prediction: Array) -> Array:
        """What a prediction (n,), or more signals joined to it, leaves [m/s2]."""
        return self.run.left_by(prediction, self.mps2)

    def without_deaf(self, columns: Array, prediction: Array) -> Array:
        """Slopes of a prediction (n,), or of more signals joined to it, (n,) or (m, n), zero where the readings would
        not change with it."""
        usable, run = self.run.usable, self.run
        if usable is None:
            return columns
        main = run.main(prediction)
        reached = (usable == CLIPPED) & (run.left_by(main) == 0)
        counts = np.concatenate([run.read & ~reached, *(run.read for _ in run.signals)])
        return np.asarray(columns * counts[: len(prediction)])

    def beside(self, prediction: Array) -> Readings:
        """The same readings with what their bounds say beside a prediction (n,), or more signals joined to it; as they
        were read, where noise blurs their steps, they lie on none or on one only."""
        prediction, step = self.run.main(prediction), self.run.facts.step_mps2
        if not step or not self._whole.any():
            return Readings.of(self.run)
        left = (self.run.measured_mps2 - prediction)[self._whole]
        read = self.run.measured_mps2[self._whole]
        steps = (read - read[0]) / step
        if not steps.any() or np.abs(steps - np.round(steps)).max() > _ON_STEPS:
            return Readings.of(self.run)
        noise, offset = _likeliest_noise(left, step, self.run.facts.noise_mps2 or 0.0)
        if noise > BLURRED * step:
            return Readings(self.run, self.run.measured_mps2, noise**2 / (noise**2 + step**2 / 12))
        mean, variance = _within(left - offset, step, noise)
        found = self.run.measured_mps2.copy()
        share = max(_LEAST_SHARE, float(np.mean(1 - variance / noise**2)))
        found[self._whole] = prediction[self._whole] + mean / share
        return Readings(self.run, found, share)

    @cached_property
    def _whole(self) -> Bools:
        """Samples (n,) that count and are readings."""
        found = np.arange(self.run.count) >= self.run.first
        return found if self.run.usable is None else found & (self.run.usable == READING)


def as_read_error(readings: Sequence[Readings], residuals: Sequence[Array]) -> float:
    """Normalised r.m.s. error of residuals (n,) per run, or more signals joined to them, of which the sensor's
    acceleration counts; those of rounded readings as they were read."""
    counted = [(one.run.main(left) + (one.run.measured_mps2 - one.mps2) * one.run.read)[one.run.first:]
               for one, left in zip(readings, residuals, strict=True)]
    return normalised_rms(counted, [one.run.kept_readings_mps2 for one in readings])


def _within(left: Array, step: float, noise: float) -> tuple[Array, Array]:
    """Mean and variance (k,) of noise that is known to lie within half a step of these (k,)."""
    from logger.estimation.normal_distribution import within

    return within(np.zeros_like(left), np.full_like(left, noise**2), left - 0.5 * step, left + 0.5 * step)


def _likeliest_noise(left: Array, step: float, least: float) -> tuple[float, float]:
    """Deviation of the noise, no less than ``least``, and the offset [m/s2] of rounded readings that a prediction
    leaves as these (k,)."""
    from scipy.optimize import minimize_scalar
    from scipy.special import ndtr

    def lack(log_noise: float) -> float:
        near = np.abs(left - offset)
        noise = step * np.exp(log_noise)
        inside = ndtr((0.5 * step - near) / noise) - ndtr((-0.5 * step - near) / noise)
        return -float(np.log(np.maximum(inside, _LEAST_PROBABILITY)).mean())

    ends = np.log([max(_LEAST_NOISE, min(least / step, 0.9 * _MOST_NOISE)), _MOST_NOISE])
    noise, offset = step, float(left.mean())
    for _ in range(_ROUNDS):
        before = noise, offset
        noise = step * float(np.exp(minimize_scalar(lack, bounds=tuple(ends), method="bounded").x))
        mean, variance = _within(left - offset, step, noise)
        offset += float(mean.mean() / max(_LEAST_SHARE, np.mean(1 - variance / noise**2)))
        if max(abs(noise - before[0]), abs(offset - before[1])) < 1e-3 * step:
            break
    return noise, offset
