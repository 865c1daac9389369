"""Spectral lines: the F test of the strongest ordinate of a periodogram."""

from __future__ import annotations

import numpy as np

from logger.arrays import Array, Bools

NEIGHBOURS = 15
"""An ordinate is compared with so many on either side, or more: the mean of thirty, of which a Hann taper leaves 15
independent, is known to a quarter."""


def periodogram(samples: Array) -> Array:
    """Power of evenly spaced samples (n,) at each frequency of their transform (n // 2 + 1,), tapered (Hann)."""
    return np.asarray(np.abs(np.fft.rfft(samples * np.hanning(len(samples)))) ** 2)


def strongest_line(power: Array, among: Bools | None = None, reach: int = 0) -> tuple[int, float] | None:
    """The strongest line of a periodogram: its number, and a bound on the probability of one so strong by chance (above
    1 for weak ones): the ratio of its power to the mean of its neighbours is F(2, 2 m) in noise, Bonferroni over all.

    power    (f,) of any unit
    among    which frequencies are tested, of those with enough neighbours (f,); None: all
    reach    neighbours on either side (``NEIGHBOURS`` at least), without the nearest three

    None where no frequency that is tested has power around it.
    """
    reach = max(NEIGHBOURS, reach)
    if len(power) <= 2 * reach:  # no frequency has so many neighbours
        return None
    around = np.ones(2 * reach + 1)
    around[reach - 3 : reach + 4] = 0.0
    level = np.convolve(power, around / around.sum(), mode="same")
    number = np.arange(len(power))
    whole = (number >= reach) & (number < len(power) - reach) & (level > 0)
    tested = np.flatnonzero(whole if among is None else whole & among)
    if not len(tested):
        return None
    ratio = power[tested] / level[tested]
    # A Hann taper correlates neighbours: independent ones are fewer by 1 + 2 (2/3)^2 + 2 (1/6)^2.
    independent = around.sum() / 1.94
    return int(tested[ratio.argmax()]), len(tested) * float((1 + ratio.max() / independent) ** -independent)
