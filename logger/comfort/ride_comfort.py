"""How a recorded ride feels: its axes weighted as they belong together, and the figures of each (ISO 2631-1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.bounds import time_hint
from logger.comfort.iso2631 import AxisFigures, axis_figures
from logger.dsp.weightings.weighting import Weighting

Array = npt.NDArray[np.float64]

LOWEST_RATE_HZ = 80.0
LEAST_TAKEN_HZ = 40.0
"""Below, what a record shows ends within the 4 to 12.5 Hz that Wk counts most, or close above."""
SHORTEST_S = 1.0
# Rounded times make an 80 Hz record look a little slower.
_RATE_ROUNDING = 1e-3
_STILL = 1e-12
"""Of the level: a constant that was laid on another grid differs from itself by some parts in 1e15."""


@dataclass(frozen=True)
class RideComfort:
    """Figures by axis, and what each was weighted by: ``z`` always, ``x`` and ``y`` where all three are combined.

    weighted_mps2  (n,) the weighted vertical acceleration
    daily_hours    hours a day of such riding, for the health values
    left_out       an axis was recorded and not combined
    taken_hz       samples a second that were taken, where they were laid on another grid; None: ``rate_hz``
    seen_to_hz     nothing above it was recorded, as somebody says [Hz]; None: nobody does
    """

    rate_hz: float
    daily_hours: float
    axes: dict[str, AxisFigures]
    by: dict[str, Weighting]
    weighted_mps2: Array
    left_out: bool
    taken_hz: float | None = None
    seen_to_hz: float | None = None

    @property
    def weighting(self) -> Weighting:
        return self.by["z"]

    @property
    def vertical(self) -> AxisFigures:
        return self.axes["z"]

    @property
    def health_factors(self) -> dict[str, float]:
        """By axis (ISO 2631-1 clause 7.2.3); empty where the weighting is none of health."""
        if self.weighting.health_factor is None:
            return {}
        return {axis: k for axis in "xyz" if axis in self.by and (k := self.by[axis].health_factor) is not None}

    @property
    def unseen_from_hz(self) -> float | None:
        """Where the record ends and the weighting does not [Hz]; None when the record holds all that counts."""
        rate_hz = self.rate_hz if self.taken_hz is None else min(self.rate_hz, self.taken_hz)
        end_hz = rate_hz / 2 if self.seen_to_hz is None else min(rate_hz / 2, self.seen_to_hz)
        return end_hz if end_hz < self.weighting.counts_up_to_hz else None


def ride_comfort(
    accel_mps2: dict[str, Array | None], rate_hz: float, weighting: Weighting, horizontal: Weighting | None,
    daily_hours: float | None = None, taken_hz: float | None = None, seen_to_hz: float | None = None,
) -> RideComfort:
    """Weigh the axes of a record that belong together and take their figures.

    accel_mps2     (n,) by axis, ``z``, ``x`` and ``y``; None: not recorded
    weighting      of ``z``; ``horizontal`` that of the others beside it, None: they are not combined with it
    daily_hours    None: as long as the record
    taken_hz       of a record that was laid on this grid, the rate at which its samples were taken [Hz]
    seen_to_hz     what the record's facts say [Hz]; None: nothing

    ValueError for fewer than 80 samples a second, fewer than 40 that were taken, or less than 1 s.
    """
    vertical = accel_mps2["z"]
    assert vertical is not None
    duration_s = len(vertical) / rate_hz
    if rate_hz < LOWEST_RATE_HZ * (1.0 - _RATE_ROUNDING):
        raise ValueError(f"expected at least {LOWEST_RATE_HZ:g} samples a second, found {rate_hz:.4g}"
                         f"{time_hint(rate_hz)}")
    if taken_hz is not None and taken_hz < LEAST_TAKEN_HZ:
        raise ValueError(f"expected at least {LEAST_TAKEN_HZ:g} samples a second that were taken, found {taken_hz:.4g}")
    if duration_s < SHORTEST_S:
        raise ValueError(f"expected at least {SHORTEST_S:g} s, found {duration_s:.3g} s")
    weighted_mps2 = _weighed(weighting, vertical, rate_hz)
    axes, by = {"z": axis_figures(weighted_mps2, rate_hz)}, {"z": weighting}
    others = {axis: accel for axis, accel in accel_mps2.items() if axis != "z" and accel is not None}
    combined = horizontal is not None and len(others) == len("xy")
    if horizontal is not None and combined:
        for axis, accel in others.items():
            axes[axis], by[axis] = axis_figures(_weighed(horizontal, accel, rate_hz), rate_hz), horizontal
    hours = daily_hours if daily_hours is not None else duration_s / 3600.0
    return RideComfort(rate_hz, hours, axes, by, weighted_mps2, bool(others) and not combined, taken_hz,
                       seen_to_hz)


def _weighed(weighting: Weighting, accel_mps2: Array, rate_hz: float) -> Array:
    """(n,); nothing at all of an axis that stands still: what a filter makes of a constant is its rounding."""
    if np.ptp(accel_mps2) <= _STILL * np.abs(accel_mps2).max():
        return np.zeros(len(accel_mps2))
    return weighting.weigh(accel_mps2, rate_hz)
