"""Noise of a colour: whether a residual that is louder than white noise would be is the sensor's all the same.

Problem: the sensor's noise is read where no car moves the sensor, at the highest frequencies, and taken to be white.
Noise that falls or rises with frequency then looks like missing physics. Solution: what a car does grows with how much
it is shaken, and follows the road; what a sensor adds does neither. The residual's power in each band, block by block,
is regressed on that of the model's motion: its intercept is the noise, of whatever colour (weighted least squares, as
of gamma distributed powers). A residual is noise if hardly any of it may grow with the motion, the uncertainty of that
counted in, and none of the tests of a residual relates it to the road, to the car, to a time or to a place, or finds a
tone in it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.noise_floor import UNEXPLAINED, Noise
from logger.lab.likelihood.signals import JointBands
from logger.lab.likelihood.whittle import Bands
from logger.lab.residuals.unexplained import Shape

Array = npt.NDArray[np.float64]

COLOUR = frozenset({"whiteness", "frequency"})
"""Tests of a residual that only say that it has a colour."""
_UPPER_SIGMA = 2.0
"""What grows with the motion is taken to be so many standard errors more than it is found to be."""
_OVERLAP = 0.947  # blocks with Hann's taper that overlap by half are worth this share of their number (Welch 1967)
_ROUNDS = 6


def coloured_noise(every: Sequence[Bands | JointBands], shape: Shape) -> Noise | None:
    """The noise of a residual that has a colour; None where it may be more than that, or the runs do not show it.

    every    the bands of each run; those of one signal, the same in all runs, are asked for
    """
    bands = [one for one in every if isinstance(one, Bands)]
    if len(bands) < len(every) or len({one.edges_hz.tobytes() for one in bands}) > 1 or _is_related(shape):
        return None
    residuals = shape.residuals
    power, motion = (np.concatenate([one.block_powers(samples) for one, samples in zip(bands, some, strict=True)])
                     for some in (_whole(residuals.residual, bands), _whole(residuals.model, bands)))
    grows, error = growing_power(power, motion)
    freedom = np.sum([one.freedom for one in bands], axis=0)
    mean = float(freedom @ power.mean(axis=0)) / float(freedom.sum())
    may_grow = (max(float(freedom @ grows), 0.0) + _UPPER_SIGMA * float(np.linalg.norm(freedom * error))) / float(
        freedom.sum())
    if not mean - may_grow > mean / (1 + UNEXPLAINED) ** 2:
        return None
    level = mean - max(float(freedom @ grows) / float(freedom.sum()), 0.0)
    return Noise(float(np.sqrt(level)), float(np.sqrt(level / (2 * freedom.sum()))))


def growing_power(power: Array, motion: Array) -> tuple[Array, Array]:
    """The part of the mean power (b,) that grows with the motion's, and its standard error (b,), by powers (blocks, b)
    of both."""
    grows, errors = np.zeros(power.shape[1]), np.full(power.shape[1], np.inf)
    for band, (one, moved) in enumerate(zip(power.T, motion.T, strict=True)):
        if len(one) < 4 or not np.ptp(moved) > 0 or not one.mean() > 0:
            continue
        columns = np.column_stack([np.ones(len(one)), moved / moved.mean()])
        expected = np.full(len(one), one.mean())
        for _ in range(_ROUNDS):
            weights = expected**-2
            inverse = np.linalg.inv(columns.T @ (weights[:, None] * columns))
            found = inverse @ (columns.T @ (weights * one))
            expected = np.maximum(columns @ found, 0.1 * one.mean())
        spread = float(weights @ (one - columns @ found) ** 2) / (_OVERLAP * len(one) - 2)
        grows[band], errors[band] = float(found[1]), float(np.sqrt(spread * inverse[1, 1] / _OVERLAP))
    return grows, errors


def _is_related(shape: Shape) -> bool:
    """Whether a test relates a residual to anything but its own colour."""
    line = shape.line is not None and shape.line.found
    return line or any(one.name not in COLOUR for one in shape.tests.found)


def _whole(parts: Sequence[Array], bands: Sequence[Bands]) -> list[Array]:
    """Samples that count of each run, as of all of it."""
    return [np.concatenate([np.zeros(one.first), part]) for part, one in zip(parts, bands, strict=True)]
