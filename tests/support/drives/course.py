"""Motion by scipy's LSODA with plain numbers: what is asked for one time after another costs no array each time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.integrate import odeint
from scipy.interpolate import CubicSpline

Array = npt.NDArray[np.float64]


class Course(CubicSpline):
    """A spline through values at even times from 0 on, quick for a single time (a ``float``)."""

    def __init__(self, rate_hz: float, values: Array) -> None:
        super().__init__(np.arange(len(values)) / rate_hz, values)
        self.rate_hz, self.pieces = rate_hz, self.c.T.tolist()

    def __call__(self, t: Any, nu: int = 0) -> Any:
        if not isinstance(t, float) or nu > 1:
            return super().__call__(t, nu)
        piece = min(max(int(t * self.rate_hz), 0), len(self.pieces) - 1)
        a, b, c, d = self.pieces[piece]
        x = t - piece / self.rate_hz
        return (3 * a * x + 2 * b) * x + c if nu else ((a * x + b) * x + c) * x + d


def integrated(rates: Callable[[float, list[float]], Sequence[float]], states: int, time_s: Array, rtol: float,
               atol: float, longest_s: float) -> Array:
    """States (states, n) from rest at times; ``rates`` of a time and the states; no step is longer than one given."""
    return np.asarray(odeint(lambda y, t: rates(t, y.tolist()), np.zeros(states), time_s, rtol=rtol, atol=atol,
                             hmax=longest_s, mxstep=100_000)).T
