"""Whether a single frequency stands out of a spectrum."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

NEIGHBOURS = 15
"""An ordinate is held against so many on either side, or more: their mean is then known to a quarter."""


def periodogram(samples: Array) -> Array:
    """Power of evenly spaced samples (n,) at each frequency of their transform (n // 2 + 1,), tapered (Hann)."""
    return np.asarray(np.abs(np.fft.rfft(samples * np.hanning(len(samples)))) ** 2)


def strongest_line(power: Array, among: Bools | None = None, reach: int = 0, gap: int = 3) -> tuple[int, float] | None:
    """The frequency that stands out most of a periodogram, by its number in it, and how probable one so loud would be
    by chance (at most; above 1 for many quiet ones): the ratio of its power to the mean of its neighbours is F(2, 2 m)
    in noise, the best of so many.

    power         (f,) of any unit
    among         (f,) which frequencies are asked, of those with so many neighbours; None: all
    reach, gap    neighbours are so many on either side (``NEIGHBOURS`` at least), the nearest of which are left out

    None where no frequency that is asked has power around it.
    """
    reach = max(NEIGHBOURS, reach)
    around = np.ones(2 * reach + 1)
    around[reach - gap : reach + gap + 1] = 0.0
    level = np.convolve(power, around / around.sum(), mode="same")
    number = np.arange(len(power))
    whole = (number >= reach) & (number < len(power) - reach) & (level > 0)
    asked = np.flatnonzero(whole if among is None else whole & among)
    if not len(asked):
        return None
    ratio = power[asked] / level[asked]
    # A Hann taper makes neighbours alike: they count for 1 + 2 (2/3)^2 + 2 (1/6)^2 fewer.
    worth = around.sum() / 1.94
    return int(asked[ratio.argmax()]), len(asked) * float((1 + ratio.max() / worth) ** -worth)
