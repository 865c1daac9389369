"""Noise of a colour: whether a residual that is louder than white noise would be is the sensor's all the same.

Problem: the sensor's noise is read where no car moves the sensor, at the highest frequencies, and taken to be white.
Noise that falls or rises with frequency then looks like missing physics. Solution: what a car does grows with how much
it is shaken, and follows the road; what a sensor adds does neither. A residual is noise if hardly any of its power may
grow with the motion (``growing_power``), the uncertainty of that counted in, and none of the tests of a residual
relates it to the road, to the car, to a time or to a place, or finds a tone in it; and if it falls or rises with
frequency throughout.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.noise_floor import SURE_SIGMA, NoiseLevel, growing_power
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.priors import UNUSUAL_SIGMA
from logger.lab.likelihood.signals import JointBands
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.residuals.removed import removed_from
from logger.lab.residuals.unexplained import Shape, shape_of

COLOUR = frozenset({"whiteness", "frequency"})
"""Tests of a residual that only say that it has a colour."""


def is_coloured_noise(posterior: Posterior, state: State) -> bool:
    """Whether what a fitted state leaves is noise of a colour, as ``coloured_noise`` finds it."""
    # That hardly any of it may grow with the motion is computed at once; tests of it take longer.
    bands = posterior.bands
    if _steady_noise(bands, posterior.residuals(state), state.predictions) is None:
        return False
    shape = shape_of(posterior, state, removed_from(posterior, state.predictions, state))
    return coloured_noise(bands, shape) is not None


def coloured_noise(every: Sequence[JointBands], shape: Shape) -> NoiseLevel | None:
    """The noise of a residual that has a colour, by the bands of each run; None where it may be more than that, or the
    runs do not show it."""
    if _is_related(shape):
        return None
    residuals = shape.residuals
    return _steady_noise(every, _whole(residuals.residual, every), _whole(residuals.model, every))


def _steady_noise(every: Sequence[JointBands], residual: Sequence[Array], model: Sequence[Array]
                  ) -> NoiseLevel | None:
    """The noise of residuals (n,) per run that fall or rise with frequency and surely do not grow with a model's motion
    (n,); None as well where there are several signals, or runs are compared in several bands."""
    bands = [one for run in every for one in run.each]
    if len(bands) > len(every) or len({one.edges_hz.tobytes() for one in bands}) > 1:
        return None
    power, motion = (np.concatenate([one.block_powers(samples) for one, samples in zip(bands, some, strict=True)])
                     for some in (residual, model))
    grows, error = growing_power(power, motion)
    freedom = np.sum([one.freedom for one in bands], axis=0)
    if not is_monotonic(power.mean(axis=0), freedom):
        return None
    mean = float(freedom @ power.mean(axis=0)) / float(freedom.sum())
    may_grow = (max(float(freedom @ grows), 0.0) + SURE_SIGMA * float(np.linalg.norm(freedom * error))) / float(
        freedom.sum())
    if not mean - may_grow > mean / (1 + UNEXPLAINED) ** 2:
        return None
    level = mean - max(float(freedom @ grows) / float(freedom.sum()), 0.0)
    return NoiseLevel(float(np.sqrt(level)), float(np.sqrt(level / (2 * freedom.sum()))))


def is_monotonic(levels: Array, freedom: Array) -> bool:
    """Whether levels (b,) with these degrees of freedom fall or rise with frequency throughout, as a sensor's noise
    does; a hum makes a hill. None may lie above the nearest levels that do (isotonic regression) by more than what
    counts as explained and ``UNUSUAL_SIGMA`` standard errors."""
    most = (1 + UNEXPLAINED) ** 2 * (1 + UNUSUAL_SIGMA * np.sqrt(2 / freedom))
    falling = rising_levels(levels[::-1], freedom[::-1])[::-1]
    return any(bool((levels <= most * nearest).all()) for nearest in (falling, rising_levels(levels, freedom)))


def rising_levels(levels: Array, weights: Array) -> Array:
    """The nearest levels (b,) that never fall: the largest of the least weighted means of what begins at or before each
    and ends at or after it (R. E. Barlow et al., Statistical Inference under Order Restrictions, 1972)."""
    weight, total = (np.concatenate([[0.0], np.cumsum(one)]) for one in (weights, weights * levels))
    count = len(levels)
    return np.array([max(min((total[end] - total[first]) / (weight[end] - weight[first])
                             for end in range(place + 1, count + 1)) for first in range(place + 1))
                     for place in range(count)])


def _is_related(shape: Shape) -> bool:
    """Whether a test relates a residual to anything but its own colour."""
    line = shape.line is not None and shape.line.found
    return line or any(one.name not in COLOUR for one in shape.tests.found)


def _whole(parts: Sequence[Array], bands: Sequence[JointBands]) -> list[Array]:
    """Samples that count of each run, as of all of it."""
    return [np.concatenate([np.zeros(one.each[0].first), part]) for part, one in zip(parts, bands, strict=True)]
