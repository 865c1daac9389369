"""What stands under the wheels of a rig, given over time: a shaker, a bench car.

Problem: a rig has no road. Its recorder samples how high the table stood, at a rate of its own, and between two samples
the table moved smoothly: a straight line would take off a part of each quick motion (0.5 % at a twenty-fifth of the
rate). Solution: cubic splines through the samples, whose means over steps of time are exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from logger.profiles.track import Stance, Way

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Array = npt.NDArray[np.float64]

_CUBIC = 3


@dataclass(frozen=True, eq=False)
class Excitation:
    """Elevations under the wheels, evenly sampled in time; before and after them they stay where they are.

    rate_hz        samples a second
    elevation_m    (n,) under all wheels, or (n, 2) under the front and under the rear ones [m]
    start_s        when the first of them was, counted from the first sample of the record [s]

    ValueError for a rate that is not above 0, elevations that are not finite or of another shape, or fewer than four.
    """

    rate_hz: float
    elevation_m: Array
    start_s: float = 0.0

    timed = True
    two_tracks = False

    def __post_init__(self) -> None:
        shape = self.elevation_m.shape
        is_table = len(shape) in (1, 2) and shape[0] > _CUBIC and shape[1:] in ((), (2,))
        if not (0 < self.rate_hz < np.inf and is_table):
            raise ValueError(f"excitation: expected a rate and elevations of shape (n,) or (n, 2), four or more, found "
                             f"{self.rate_hz} and {shape}")
        if not np.isfinite(self.elevation_m).all():
            raise ValueError("excitation: expected finite elevations")

    @property
    def end_s(self) -> float:
        """When the last sample was, counted from the first of the record [s]."""
        return self.start_s + (len(self.elevation_m) - 1) / self.rate_hz

    def under_wheels(self, way: Way, stance: Stance) -> tuple[Array, Array]:
        """As ``WheelTracks``: whatever stands behind the front wheels is a rear wheel."""
        end_s, inside = self.end_s, np.clip(way.time_s, self.start_s, self.end_s)
        curves = self._curves(inside)
        integral = self._integrals(inside) + curves * (way.time_s - np.clip(way.time_s, self.start_s, end_s))[:, None]
        means = np.diff(integral, axis=0) / np.diff(way.time_s)[:, None]
        column = np.where(np.asarray(stance.behind_m) > 0, curves.shape[1] - 1, 0)
        return curves[:, column], means[:, column]

    def begun(self, later_s: float) -> Excitation:
        """The same for a record that begins so much later [s]."""
        return replace(self, start_s=self.start_s - later_s)

    def under_axle(self, way: Way, behind_m: float, patch_m: float) -> Array:
        """Elevations (M,) under an axle so far behind the front one [m]."""
        return np.asarray(self._curves(np.clip(way.time_s, self.start_s, self.end_s))[:, -1 if behind_m > 0 else 0])

    @cached_property
    def _curves(self) -> BSpline:
        from scipy.interpolate import make_interp_spline

        time_s = self.start_s + np.arange(len(self.elevation_m)) / self.rate_hz
        return make_interp_spline(time_s, self.elevation_m.reshape(len(time_s), -1), _CUBIC)

    @cached_property
    def _integrals(self) -> BSpline:
        return self._curves.antiderivative()
