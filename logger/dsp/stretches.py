"""Where samples follow each other of which something holds."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Bools = npt.NDArray[np.bool_]
Places = npt.NDArray[np.int64]


def stretches_of(mask: Bools) -> tuple[Places, Places]:
    """First places and ends (k,), half open, of the stretches in which a mask (n,) holds."""
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return edges[::2], edges[1::2]


def stretches_inside(mask: Bools) -> tuple[Places, Places]:
    """The same, without those that hold the first or the last place."""
    first, end = stretches_of(mask)
    inside = (first > 0) & (end < len(mask))
    return first[inside], end[inside]
