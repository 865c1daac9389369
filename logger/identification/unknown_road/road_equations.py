"""The equations of the most probable road, solved by conjugate gradients.

Drives y = B w + noise over a road of innovations w: (1 + B' B / variance) w = B' y / variance. B is never formed: a
drive is applied to a road, and back, by transforms. Preconditioned as if the drives were endless and their speeds even,
or by a factor of the matrix itself, taken nearby.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.identification.unknown_road.drive_operator import Crossing

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Preconditioner = Callable[[Array], Array]

MOST_ROUNDS, _AT_ONCE = 150, 256


@dataclass(frozen=True, eq=False)
class DrivesModel:
    """Drives over one road at one place of all numbers.

    crossings      the drives
    waves          (k,) for each: what makes a road as it lies under the drive out of innovations
    responses      (x, k) for each, and their derivatives (p, x, k)
    spectral       (k,) of the preconditioner for endless drives
    variance       of the noise [(m/s2)2]
    """

    crossings: list[Crossing]
    waves: list[Complex]
    responses: list[Complex]
    derivatives: list[Complex]
    spectral: Array
    variance: float

    def of(self, drives: Sequence[int]) -> DrivesModel:
        """Some of the drives."""
        return DrivesModel([self.crossings[one] for one in drives], [self.waves[one] for one in drives],
                           [self.responses[one] for one in drives], [self.derivatives[one] for one in drives],
                           self.spectral, self.variance)

    def readings(self, white: Array) -> list[Array]:
        """Readings (b, n) of each drive over roads of innovations (b, count)."""
        return [one.readings(one.under_axles(white, waves), response) for one, waves, response in
                zip(self.crossings, self.waves, self.responses, strict=True)]

    def back(self, readings: Sequence[Array], count: int) -> Array:
        """The transpose of ``readings`` (b, count), over the variance."""
        total = np.zeros((len(readings[0]), count))
        for one, part, waves, response in zip(self.crossings, readings, self.waves, self.responses, strict=True):
            total += one.back(part, waves, response)
        return total / self.variance

    def filtered(self, residual: Array) -> Array:
        """About what solves the equations for a residual (b, count), were the drives endless and their speeds even."""
        return np.asarray(np.fft.irfft(np.fft.rfft(residual) * self.spectral, residual.shape[1]))


def factored(model: DrivesModel, count: int) -> Preconditioner:
    """What solves the equations of a model, for those of a place nearby."""
    from scipy.linalg import cho_factor, cho_solve
    from scipy.linalg.blas import ssyrk

    normal = np.eye(count, dtype=np.float32, order="F")
    for one, waves, response in zip(model.crossings, model.waves, model.responses, strict=True):
        rows = np.concatenate([one.unit_readings(waves, response, first, min(first + _AT_ONCE, count))
                               for first in range(0, count, _AT_ONCE)])
        normal = ssyrk(1 / model.variance, rows.T, beta=1.0, c=normal, trans=1, lower=1, overwrite_c=1)
    factor = cho_factor(normal, lower=True, overwrite_a=True, check_finite=False)

    def condition(residual: Array) -> Array:
        # By a power of two, which rounds nothing: of single precision 1e39 is infinite, and 1e-46 is 0.
        scale = np.exp2(np.ceil(np.log2(np.abs(residual).max(axis=1, initial=np.finfo(float).tiny))))[:, None]
        solved = cho_solve(factor, (residual / scale).T.astype(np.float32), check_finite=False).T
        return np.asarray(solved, float) * scale

    return condition


def solve(model: DrivesModel, readings: Sequence[Array], count: int, solved: float, rounds: int | None = None,
          preconditioner: Preconditioner | None = None) -> tuple[Array, list[Array], int]:
    """Innovations (b, count) of the most probable roads, inv(C) times the readings (b, n) of each drive, and how many
    rounds that took.

    For all b at once, until what is left is ``solved`` of what it began with, or so many ``rounds``: slopes at
    neighbouring places can be compared only if they come from as many.
    """
    condition = model.filtered if preconditioner is None else preconditioner
    residual = model.back(readings, count)
    white = np.zeros_like(residual)
    unexplained = [one.copy() for one in readings]
    direction, before = np.zeros_like(residual), np.zeros(len(residual))
    first, done = None, 0
    while done < (MOST_ROUNDS if rounds is None else rounds):
        conditioned = condition(residual)
        size = (residual * conditioned).sum(axis=1)
        # A preconditioner of another place, or of few digits, may point uphill: then it goes down from there anew.
        uphill = size <= 0
        conditioned[uphill] = residual[uphill]
        size[uphill] = (residual[uphill] ** 2).sum(axis=1)
        first = size if first is None else first
        if rounds is None and (size <= solved**2 * first).all():
            break
        done += 1
        kept = np.divide(size, before, out=np.zeros_like(size), where=(before > 0) & ~uphill)
        direction = conditioned + kept[:, None] * direction
        image = model.readings(direction)
        curve = (direction**2).sum(axis=1) + sum((one**2).sum(axis=1) for one in image) / model.variance
        step = np.divide(size, curve, out=np.zeros_like(size), where=curve > 0)[:, None]
        white += step * direction
        for one, part in zip(unexplained, image, strict=True):
            one -= step * part
        residual -= step * (direction + model.back(image, count))
        before = np.where(size > np.finfo(float).tiny, size, 0.0)
    return white, [one / model.variance for one in unexplained], done
