"""The part of a residual's power that grows with the motion: what a car does grows with how much it is shaken, what a
sensor adds does not. In each band the power, block by block, is regressed on that of the model's motion (weighted least
squares, as of gamma distributed powers); the intercept is noise, of whatever colour.
"""

from __future__ import annotations

import numpy as np

from logger.arrays import Array

SURE_SIGMA = 2.0
_WORTH = 0.947  # of a block with Hann's taper that overlaps the next by half, over one that does not (P. D. Welch 1967)


def steady_power(power: Array, motion: Array) -> Array:
    """The part of the mean power (b,) that surely does not grow with the motion's, by powers (blocks, b) of both: what
    grows is taken to be ``SURE_SIGMA`` standard errors more than it is found to be."""
    grows, errors = growing_power(power, motion)
    return np.maximum(power.mean(axis=0) - np.maximum(grows, 0.0) - SURE_SIGMA * errors, 0.0)


def growing_power(power: Array, motion: Array) -> tuple[Array, Array]:
    """The part of the mean power (b,) that grows with the motion's, and its standard error (b,), by powers (blocks, b)
    of both."""
    grows, errors = np.zeros(power.shape[1]), np.full(power.shape[1], np.inf)
    for band, (one, moved) in enumerate(zip(power.T, motion.T, strict=True)):
        if len(one) < 4 or not np.ptp(moved) > 0 or not one.mean() > 0:
            continue
        # Counted from the mean, motion that hardly varies is no near copy of the ones.
        columns = np.column_stack([np.ones(len(one)), moved / moved.mean() - 1])
        expected = np.full(len(one), one.mean())
        for _ in range(6):
            weights = expected**-2
            inverse = np.linalg.inv(columns.T @ (weights[:, None] * columns))
            found = inverse @ (columns.T @ (weights * one))
            expected = np.maximum(columns @ found, 0.1 * one.mean())
        spread = float(weights @ (one - columns @ found) ** 2) / (_WORTH * len(one) - 2)
        grows[band], errors[band] = float(found[1]), float(np.sqrt(spread * inverse[1, 1] / _WORTH))
    return grows, errors
