"""Cutting a drive into windows of travelled distance.

Samples come on a uniform time grid, each with the distance the car had travelled; a window is the half-open
stretch [k W, (k + 1) W) of that distance. Filters run before this and keep their state, so a window only sums.
Where the speed is unknown there is no distance: such stretches are cut by time and their windows are `blind`.
Samples taken while the car stands belong to no average. A window that does not reach from one multiple of W to
the next (start or end of a drive, a break) is `partial`.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from math import nan, sqrt

import numpy as np

from logger.arrays import Array, Bools, Rows, Whole
from logger.units import US_PER_S

GOOD_SHARE = 0.8


@dataclass(frozen=True)
class GridSamples(Rows):
    """Filtered samples on the time grid, arrays (n,).

    reading_mps2 is the vertical reading with gravity in it, before any filter; accel_mps2 the same without gravity;
    weighted_mps2 that through the frequency weighting, running_rms_mps2 the running r.m.s. of it. present: the
    accelerometer delivered it (False: missing); interpolated: rebuilt from its neighbours over a short hole; settled:
    the filters have forgotten their start.

    each_mps2: (n, k) the readings that the estimate of the road is made of, from the sample on up to the next: the
    reading itself, or all where the sensor is read k times per sample; each_usable and each_at_end: the reading is one,
    and 1 for one at the top of the range, -1 at the bottom, else 0.
    """

    t_us: Whole
    reading_mps2: Array
    accel_mps2: Array
    weighted_mps2: Array
    running_rms_mps2: Array
    present: Bools
    interpolated: Bools
    settled: Bools
    clipped: Bools
    each_mps2: Array
    each_usable: Bools
    each_at_end: Array


@dataclass(frozen=True)
class Window:
    """What one window holds. Figures are nan when too few of its samples are good.

    ``number`` counts windows of distance from where the distance is 0, blind ones from the start of their stretch.
    """

    t_us: int
    duration_s: float
    start_m: float | None
    end_m: float | None
    leg: int
    number: int
    speed_mps: float
    samples: int
    clipped: int
    accel_rms_mps2: float
    a_w_mps2: float
    mtvv_mps2: float
    vdv_mps175: float
    peak_mps2: float
    flags: frozenset[str]

    def without_figures(self) -> "Window":
        """The window as if too few of its samples were good."""
        return replace(self, accel_rms_mps2=nan, a_w_mps2=nan, mtvv_mps2=nan, vdv_mps175=nan, peak_mps2=nan)


class _Open:
    """The window being filled."""

    def __init__(self, key: tuple[bool, int, int], t_us: int, start_m: float | None, whole: bool) -> None:
        self.key = key
        self.t_us = t_us
        self.start_m = start_m
        self.whole = whole
        self.last_m: float | None = start_m
        self.stood = False
        self._count = self._good = self._clipped = self._absent = self._interpolated = self._unsettled = 0
        self._bridged = 0
        self._accel_square = self._square = self._fourth = self._speed_sum_mps = 0.0
        self._peak_mps2 = self._running_mps2 = 0.0

    def add(self, part: GridSamples, speed_mps: Array, bridged: Bools) -> None:
        """Sum more samples of this window."""
        good = part.present & part.settled
        weighted = part.weighted_mps2[good]
        squares = weighted * weighted
        accel = part.accel_mps2[good]
        self._count += len(part)
        self._good += len(weighted)
        self._accel_square += float(accel @ accel)
        self._square += float(squares.sum())
        self._fourth += float(squares @ squares)
        self._clipped += int(np.count_nonzero(part.clipped))
        self._absent += int(np.count_nonzero(~part.present))
        self._interpolated += int(np.count_nonzero(part.interpolated))
        self._unsettled += int(np.count_nonzero(~part.settled & part.present))
        self._bridged += int(np.count_nonzero(bridged))
        self._speed_sum_mps += float(speed_mps.sum())
        if len(weighted):
            self._peak_mps2 = max(self._peak_mps2, float(np.abs(weighted).max()))
            self._running_mps2 = max(self._running_mps2, float(part.running_rms_mps2[good].max()))

    def close(self, end_m: float | None, step_s: float, complete: bool) -> Window | None:
        """The finished window; None when nothing is known of it: neither a sample nor a place."""
        count, good = self._count, self._good
        blind = self.key[0]
        if count == 0 or (blind and self._absent == count):
            return None
        known = good >= GOOD_SHARE * count
        return Window(t_us=self.t_us, duration_s=count * step_s, start_m=self.start_m, end_m=end_m, leg=self.key[1],
                      number=self.key[2], speed_mps=nan if blind else self._speed_sum_mps / count, samples=good,
                      clipped=self._clipped, accel_rms_mps2=sqrt(self._accel_square / good) if known else nan,
                      a_w_mps2=sqrt(self._square / good) if known else nan,
                      mtvv_mps2=self._running_mps2 if known else nan,
                      vdv_mps175=(self._fourth * step_s) ** 0.25 if known else nan,
                      peak_mps2=self._peak_mps2 if known else nan, flags=frozenset(self._flags(blind, complete)))

    def _flags(self, blind: bool, complete: bool) -> list[str]:
        found = {
            "clipped": self._clipped > 0,
            "gap": self._absent + self._interpolated > 0,
            "unsettled": self._unsettled > 0,
            "gps_lost": blind or self._bridged > 0,
            "blind": blind,
            "stationary": self.stood,
            "partial": not (complete and self.whole),
        }
        return [word for word, holds in found.items() if holds]


class WindowCutter:
    """Fills windows from consecutive samples and hands out the finished ones.

    window_m    length of a window [m]
    blind_s     length of a window where the distance is unknown [s]
    step_us     time step of the sample grid [us]
    """

    def __init__(self, window_m: float, blind_s: float, step_us: int) -> None:
        self._window_m = window_m
        self._blind_us = round(blind_s * US_PER_S)
        self._step_us = step_us
        self._open: _Open | None = None
        self._blind_anchor_us = 0
        self._stretch: tuple[bool, int] | None = None

    def oldest_open(self) -> tuple[int, float] | None:
        """Start of the window being filled, as time [us] and distance [m] (-inf when it has none)."""
        if self._open is None:
            return None
        start_m = self._open.start_m
        return self._open.t_us, start_m if start_m is not None else float("-inf")

    def push_known(
        self, samples: GridSamples, distance_m: Array, speed_mps: Array, bridged: Bools, leg: int
    ) -> list[Window]:
        """Samples of one leg, each with its travelled distance [m] and speed [m/s]."""
        finished = self._enter((False, leg))
        index = np.floor(distance_m / self._window_m).astype(np.int64)
        moving = speed_mps > 0.0
        standing = np.unique(index[~moving])
        if not moving.all():
            samples, index = samples.of(moving), index[moving]
            distance_m, speed_mps, bridged = distance_m[moving], speed_mps[moving], bridged[moving]
        if self._open is not None and self._open.key[2] in standing:
            self._open.stood = True
        for low, high in runs_of_equal(index):
            number = int(index[low])
            window = self._open
            if window is None or window.key[2] != number:
                start_m = number * self._window_m
                finished += self._close(start_m, complete=True)
                near_start_m = 2.0 * float(speed_mps[low]) * self._step_us / US_PER_S
                whole = float(distance_m[low]) - start_m <= near_start_m
                first_m = start_m if whole else float(distance_m[low])
                window = self._open = _Open((False, leg, number), int(samples.t_us[low]), first_m, whole)
                window.stood = bool(number in standing)
            window.add(samples.of(slice(low, high)), speed_mps[low:high], bridged[low:high])
            window.last_m = float(distance_m[high - 1])
        return finished

    def push_blind(self, samples: GridSamples) -> list[Window]:
        """Samples without a known distance."""
        if not len(samples):
            return []
        finished = self._enter((True, -1))
        if self._open is None:
            self._blind_anchor_us = int(samples.t_us[0])
        index = (samples.t_us - self._blind_anchor_us) // self._blind_us
        for low, high in runs_of_equal(index):
            number = int(index[low])
            window = self._open
            if window is None or window.key[2] != number:
                finished += self._close(None, complete=True)
                window = self._open = _Open((True, -1, number), int(samples.t_us[low]), None, whole=True)
            count = high - low
            window.add(samples.of(slice(low, high)), np.zeros(count), np.zeros(count, dtype=np.bool_))
        return finished

    def break_off(self) -> list[Window]:
        """Close the window being filled where it stands."""
        end_m = self._open.last_m if self._open is not None else None
        self._stretch = None
        return self._close(end_m, complete=False)

    def _enter(self, stretch: tuple[bool, int]) -> list[Window]:
        if self._stretch == stretch:
            return []
        finished = self.break_off() if self._stretch is not None else []
        self._stretch = stretch
        return finished

    def _close(self, end_m: float | None, complete: bool) -> list[Window]:
        if self._open is None:
            return []
        window = self._open.close(end_m, self._step_us / US_PER_S, complete)
        self._open = None
        return [window] if window is not None else []


def runs_of_equal(index: Whole) -> list[tuple[int, int]]:
    """Stretches of equal values, as half-open index pairs."""
    if not len(index):
        return []
    edges = [0, *(np.flatnonzero(np.diff(index)) + 1).tolist(), len(index)]
    return list(pairwise(edges))
