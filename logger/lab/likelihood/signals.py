"""Quantised, clipped and missing readings, as residuals that a likelihood can use.

Problem. A sensor may round to steps that are larger than its noise. Taken as noise of step / sqrt(12), as it is where
the noise blurs the steps, such rounding hides what the readings hold: within its step a reading says nothing, at the
edge of one very much. Samples that were clipped are bounds, and some are missing.

Solution. Given a model's prediction, the bounds of a rounded reading say where the acceleration with the sensor's noise
was: the mean of a normal variable around the prediction, truncated to the step. The distance of that mean from the
prediction, over the noise's variance, is the slope of the logarithm of the likelihood of the bounds; divided by the
share of the information that rounding leaves (1 - truncated variance / variance, on average), it is a residual like any
other: its mean follows the prediction one to one, and its variance is the inverse of the information that the bounds
hold (the score and its variance; R. A. Fisher, Proc. Camb. Phil. Soc. 22, 1925). A likelihood of residuals with free
levels can use it, and loses nothing to first order. The noise and the constant offset of the record are the most likely
ones; under a model that is far off the noise is estimated large, and rounding is noise then.

Clipped and missing samples have residuals as ``Run.residual`` says; derivatives are zero there.

Several measured signals of one run, each with its own noise.

Problem: a travel sensor and an accelerometer on a wheel have other units and other noise than the sensor on the body,
and one distance error for all of them. Solution: signals are joined, one after the other; each has bands of its own
(``whittle``), so that its level is free, and whitened signals are joined again. Whatever works on whitened columns, the
elimination of the distance error above all, need not know how many signals there were.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from logger.arrays import Array, Bools
from logger.comfort.uncertain_ride import BLURRED_FROM_STEPS
from logger.lab.likelihood.whittle import Bands, Whitener
from logger.runs import CLIPPED, READING, Run, normalised_rms

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_ON_STEPS = 0.02
"""Readings farther from whole steps were levelled, filtered or resampled after they were rounded. A judgement: files
write a step of 0.01 g to a thousandth or better."""
_LEAST_SHARE = 1e-3
"""Rounding that leaves a smaller share of the information is taken to leave this: nearly all readings are of one
step."""
_LEAST_NOISE, _MOST_NOISE = 0.01, 3.0  # steps: ends of the search for the most likely noise
_ROUNDS = 8  # of noise and offset in turn; they end earlier where neither moves by a thousandth of a step


@dataclass(frozen=True, eq=False)
class Readings:
    """The readings of a run.

    mps2     values (n,) that predictions are compared with [m/s2]
    share    of the information that rounding leaves: the sensor's noise has this share of the variance of the residuals
             of right predictions; 1 where nobody knows
    """

    run: Run
    mps2: Array
    share: float = 1.0

    @staticmethod
    def of(run: Run) -> Readings:
        """Readings with their rounding taken as noise."""
        return Readings(run, run.measured_mps2)

    @property
    def rounding_is_noise(self) -> bool:
        """Whether rounding is taken as noise."""
        return self.mps2 is self.run.measured_mps2

    def residual(self, prediction: Array) -> Array:
        """Readings minus a prediction (n,), or more signals joined to it, as ``Run.residual`` [m/s2]."""
        return self.run.residual(prediction, self.mps2)

    def without_insensitive_samples(self, columns: Array, prediction: Array) -> Array:
        """Derivatives of a prediction (n,), or of more signals joined to it, (n,) or (m, n), zero where the readings
        would not change with it."""
        return columns if self.run.usable is None else np.asarray(columns * self.sensitive(prediction))

    def sensitive(self, prediction: Array) -> Bools:
        """Whether the readings would change with a prediction (n,), or more signals joined to it, at each sample."""
        usable, run = self.run.usable, self.run
        if usable is None:
            return np.ones(len(prediction), dtype=bool)
        reached = (usable == CLIPPED) & (run.residual(run.main(prediction)) == 0)
        return np.concatenate([run.read & ~reached, *(run.read for _ in run.signals)])[: len(prediction)]

    def given(self, prediction: Array) -> Readings:
        """The readings taken for bounds, given a prediction (n,), or more signals joined to it; with their rounding as
        noise where noise blurs their steps, or they lie on no steps or on one only."""
        prediction, step = self.run.main(prediction), self.run.facts.step_mps2
        if not step or not self._whole.any():
            return Readings.of(self.run)
        residual = (self.run.measured_mps2 - prediction)[self._whole]
        read = self.run.measured_mps2[self._whole]
        steps = (read - read[0]) / step
        if not steps.any() or np.abs(steps - np.round(steps)).max() > _ON_STEPS:
            return Readings.of(self.run)
        noise, offset = _most_likely_noise(residual, step, self.run.facts.noise_mps2 or 0.0)
        if noise > BLURRED_FROM_STEPS * step:
            return Readings(self.run, self.run.measured_mps2, noise**2 / (noise**2 + step**2 / 12))
        mean, variance = _truncated(residual - offset, step, noise)
        found = self.run.measured_mps2.copy()
        share = max(_LEAST_SHARE, float(np.mean(1 - variance / noise**2)))
        found[self._whole] = prediction[self._whole] + mean / share
        return Readings(self.run, found, share)

    @cached_property
    def _whole(self) -> Bools:
        """Samples (n,) that count and are readings."""
        found = np.arange(self.run.count) >= self.run.first
        return found if self.run.usable is None else found & (self.run.usable == READING)


def error_with_rounding_noise(readings: Sequence[Readings], residuals: Sequence[Array]) -> float:
    """Normalised r.m.s. error of the sensor's acceleration by residuals (n,) per run, or more signals joined to them,
    rounding being taken as noise."""
    counted = [(one.run.main(residual) + (one.run.measured_mps2 - one.mps2) * one.run.read)[one.run.first:]
               for one, residual in zip(readings, residuals, strict=True)]
    return normalised_rms(counted, [one.run.kept_readings_mps2 for one in readings])


def _truncated(residual: Array, step: float, noise: float) -> tuple[Array, Array]:
    """Mean and variance (k,) of normal noise that is known to lie within half a step of residuals (k,)."""
    from logger.estimation.normal_distribution import within

    return within(np.zeros_like(residual), np.full_like(residual, noise**2), residual - 0.5 * step,
                  residual + 0.5 * step)


def _most_likely_noise(residual: Array, step: float, least: float) -> tuple[float, float]:
    """Most likely standard deviation of the noise, no less than ``least``, and offset [m/s2] of rounded readings with
    these residuals (k,)."""
    from scipy.optimize import minimize_scalar
    from scipy.special import ndtr

    def negative_log_likelihood(log_noise: float) -> float:
        near = np.abs(residual - offset)
        noise = step * np.exp(log_noise)
        inside = ndtr((0.5 * step - near) / noise) - ndtr((-0.5 * step - near) / noise)
        return -float(np.log(np.maximum(inside, 1e-300)).mean())

    ends = np.log([max(_LEAST_NOISE, min(least / step, 0.9 * _MOST_NOISE)), _MOST_NOISE])
    noise, offset = step, float(residual.mean())
    for _ in range(_ROUNDS):
        before = noise, offset
        noise = step * float(np.exp(minimize_scalar(negative_log_likelihood, bounds=tuple(ends), method="bounded").x))
        mean, variance = _truncated(residual - offset, step, noise)
        offset += float(mean.mean() / max(_LEAST_SHARE, np.mean(1 - variance / noise**2)))
        if max(abs(noise - before[0]), abs(offset - before[1])) < 1e-3 * step:
            break
    return noise, offset


def bands_of(run: Run) -> JointBands:
    """The bands of all that was measured in a run."""
    return JointBands([Bands(run), *(Bands(run, index) for index in range(len(run.signals)))])


def deviance(bands: Sequence[JointBands], residuals: Sequence[Array]) -> float:
    """Minus twice the log-likelihood of residuals (n,) of several runs, without its constant."""
    return sum(one.deviance(residual) for one, residual in zip(bands, residuals, strict=True))


def deviance_standard_error(bands: Sequence[JointBands], residuals: Sequence[Array], others: Sequence[Array]) -> float:
    """Standard error of the difference of the deviances of two models of some runs, by their residuals (n,) per run.

    A likelihood takes the lines of a spectrum for so many independent witnesses. Where neither model is right they are
    not: what both leave may stand in a few lines near one tone, and two models that differ there alone differ by much
    in a likelihood. So the difference is judged by how the parts of its lines scatter (Q. H. Vuong, Econometrica 57,
    1989, for models of which neither holds the other)."""
    variance = 0.0
    for one, left, right in zip(bands, residuals, others, strict=True):
        parts = one.whitener(right).line_deviances(right) - one.whitener(left).line_deviances(left)
        variance += len(parts) * float(parts.var())
    return float(np.sqrt(variance))


class JointBands:
    """The bands (b,) of all signals of one run. Methods as of ``Bands``, of the signals joined."""

    def __init__(self, each: Sequence[Bands]) -> None:
        self.each = list(each)
        self.freedom = np.concatenate([one.freedom for one in each])
        self.floor = np.concatenate([one.floor for one in each])

    def parts(self, joined: Array) -> list[Array]:
        """Signals that are joined (..., (1 + s) n), one by one (..., n)."""
        return np.split(joined, len(self.each), axis=-1)

    def power(self, residual: Array) -> Array:
        return np.concatenate([one.power(part) for one, part in zip(self.each, self.parts(residual), strict=True)])

    def levels(self, residual: Array) -> Array:
        return np.concatenate([one.levels(part) for one, part in zip(self.each, self.parts(residual), strict=True)])

    def deviance(self, residual: Array) -> float:
        return sum(one.deviance(part) for one, part in zip(self.each, self.parts(residual), strict=True))

    def whitener(self, residual: Array) -> JointWhitener:
        return JointWhitener([one.whitener(part) for one, part in zip(self.each, self.parts(residual), strict=True)])

    def scatter_whitener(self, residual: Array, carried: Array) -> JointWhitener:
        ends = np.cumsum([len(one.freedom) for one in self.each])[:-1]
        return JointWhitener([one.scatter_whitener(part, own) for one, part, own in zip(
            self.each, self.parts(residual), np.split(carried, ends), strict=True)])

    def flat_whitener(self, samples: Array) -> JointWhitener:
        return JointWhitener([one.flat_whitener(part) for one, part in zip(
            self.each, self.parts(samples), strict=True)])


@dataclass(frozen=True, eq=False)
class JointWhitener:
    """Whitens all signals of one run. Methods as of ``Whitener``, of the signals joined."""

    each: list[Whitener]

    @property
    def kept(self) -> int:
        return sum(one.kept for one in self.each)

    def __call__(self, samples: Array) -> Array:
        parts = np.split(samples, len(self.each), axis=-1)
        return np.concatenate([one(part) for one, part in zip(self.each, parts, strict=True)], axis=-1)

    def products(self, rows: csr_array) -> Array:
        n = rows.shape[1] // len(self.each)
        return sum((one.products(rows[:, place * n : (place + 1) * n]) for place, one in enumerate(self.each)),
                   np.zeros((rows.shape[0], rows.shape[0])))

    def line_deviances(self, samples: Array) -> Array:
        parts = np.split(samples, len(self.each), axis=-1)
        return np.concatenate([one.line_deviances(part) for one, part in zip(self.each, parts, strict=True)])

    def adjoint(self, white: Array) -> Array:
        kept = np.cumsum([one.kept for one in self.each])[:-1]
        return np.concatenate([one.adjoint(np.ascontiguousarray(part)) for one, part in zip(
            self.each, np.split(white, kept, axis=-1), strict=True)], axis=-1)

    def in_time(self, samples: Array) -> Array:
        parts = np.split(samples, len(self.each), axis=-1)
        return np.concatenate([one.in_time(part) for one, part in zip(self.each, parts, strict=True)], axis=-1)


@dataclass(frozen=True, eq=False)
class SignalResiduals:
    """Residuals of one signal in the runs that have it, or of the acceleration of one sensor; runs whose readings have
    other steps or another range are of another sensor.

    name         of the signal; empty: the sensor's acceleration
    runs, bands, residuals (n,), shares    of each run; the last as of ``Readings``
    size         r.m.s. of what was measured in all
    """

    name: str
    runs: list[Run]
    bands: list[Bands]
    residuals: list[Array]
    shares: list[float]
    size: float


def by_signal(readings: Sequence[Readings], bands: Sequence[JointBands],
              residuals: Sequence[Array]) -> list[SignalResiduals]:
    """Residuals of joined signals ((1 + s) n,), per run, by signal and sensor."""
    found: dict[tuple[str, float | None, float | None], list[tuple[Run, Bands, Array, float, Array]]] = {}
    for one, own, residual in zip(readings, bands, residuals, strict=True):
        run = one.run
        counts = run.read & (np.arange(run.count) >= run.first)
        names = ["", *(signal.name for signal in run.signals)]
        measured = [run.measured_mps2, *run.more]
        for name, band, part, of in zip(names, own.each, own.parts(residual), measured, strict=True):
            sensor = (None, None) if name else (run.facts.step_mps2, run.facts.range_mps2)
            found.setdefault((name, *sensor), []).append((run, band, part, 1.0 if name else one.share, of[counts]))
    return [SignalResiduals(
        name, [row[0] for row in rows], [row[1] for row in rows], [row[2] for row in rows], [row[3] for row in rows],
        float(np.sqrt(np.mean(np.concatenate([row[4] for row in rows])**2)))) for (name, *_), rows in found.items()]
