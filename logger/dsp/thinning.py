"""A whole record thinned: fewer samples a second of the same motion.

Problem: what a program looks at lies far below what a fast recorder took, and bands, noise and work grow with the rate.
Solution: all that lies above half the lower rate is taken out at once, by the record's transform (streams are thinned
by ``resample.Decimator``), so that white noise stays white up to there.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_MIRRORED = 100  # thinned samples, at each end


def thinned(samples: Array, factor: int) -> Array:
    """Every ``factor``-th of samples (n,), the first among them, of what lies below half of the lower rate.

    Both ends are continued by their mirror image about the last sample, as a transform takes a record for a circle.
    ValueError for a factor below 1.
    """
    from scipy.signal import resample

    if factor < 1:
        raise ValueError(f"cannot thin by {factor}")
    if factor == 1 or len(samples) <= factor:
        return samples[::factor]
    count = len(samples)
    before = min(_MIRRORED, (count - 1) // factor) * factor
    after = before + -(count + 2 * before) % factor
    around = np.pad(samples, (before, after), mode="reflect", reflect_type="odd")
    found = np.asarray(resample(around, len(around) // factor), float)
    return found[before // factor :][: -(-count // factor)]
