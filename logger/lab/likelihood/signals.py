"""Several measured signals of one run, each with its own noise.

Problem: a travel sensor and an accelerometer on a wheel have other units and other noise than the sensor on the body,
and one distance error for all of them. Solution: signals are joined, one after the other; each has bands of its own
(``whittle``), so that its level is free, and whitened signals are joined again. Whatever works on whitened columns, the
elimination of the distance error above all, need not know how many signals there were.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.readings import Readings
from logger.lab.likelihood.whittle import Bands, Whitener
from logger.runs import Run

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def bands_of(run: Run) -> JointBands:
    """The bands of all that was measured in a run."""
    return JointBands([Bands(run), *(Bands(run, index) for index in range(len(run.signals)))])


def deviance(bands: Sequence[JointBands], residuals: Sequence[Array]) -> float:
    """Minus twice the log-likelihood of residuals (n,) of several runs, without its constant."""
    return sum(one.deviance(residual) for one, residual in zip(bands, residuals, strict=True))


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
