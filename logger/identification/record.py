"""One run over a road, as fits read it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.profiles.track import Track

Array = npt.NDArray[np.float64]

SKIP_S = 2.0
"""What the beginning of a run is left out, as its past is not known [s]."""
_EVEN = 1e-3


@dataclass(frozen=True, eq=False)
class Record:
    """One run, evenly sampled: arrays (n,).

    time_s           [s]
    measured_mps2    the sensor, up positive, gravity removed, band-limited by the recorder [m/s2]
    distance_m       where the front tires stand on the track [m]
    speed_mps        [m/s]
    skip_s           how much of the beginning is left out of fits and errors [s]

    ValueError for arrays of different lengths, or nothing left after the beginning.
    """

    time_s: Array
    measured_mps2: Array
    distance_m: Array
    speed_mps: Array
    track: Track
    skip_s: float = SKIP_S

    def __post_init__(self) -> None:
        lengths = {len(one) for one in (self.time_s, self.measured_mps2, self.distance_m, self.speed_mps)}
        if len(lengths) != 1 or len(self.time_s) - self.first < 2:
            raise ValueError(f"record: expected columns of one length, longer than {self.skip_s:g} s")

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return float((len(self.time_s) - 1) / (self.time_s[-1] - self.time_s[0]))

    @property
    def first(self) -> int:
        """The first sample that is not left out."""
        return int(np.ceil(self.skip_s * self.rate_hz - _EVEN))

    @property
    def kept_mps2(self) -> Array:
        """What was measured, without the beginning."""
        return self.measured_mps2[self.first:]
