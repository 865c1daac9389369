"""What instruments say, after decoding: frozen readings with their time beside them.

Times are integer microseconds of the monotonic clock (``t_us``): the resolution of a recorded dump,
so that a drive that was recorded and one that is replayed carry the very same times.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

STANDARD_GRAVITY_MPS2 = 9.80665

UNREAD_CHIP = "readings arrive, but none that can be used: check the wires of its bus, and its supply"
"""What to do where a chip's bytes become no samples: there is no other language that they could be in."""


@dataclass(frozen=True)
class AccelerationBlock:
    """Some consecutive samples of a three-axis accelerometer, oldest first.

    t_us          (n,) int64, monotonic time of each sample [us]
    accel_mps2    (n, 3) float64, specific force along the sensor's X, Y, Z [m/s2]; gravity is in it
    clipped       (n,) bool, an axis stood at the end of its range in that sample
    rate_hz       samples per second, where the instrument finds it out [Hz]; None: as the settings say
    """

    t_us: npt.NDArray[np.int64]
    accel_mps2: npt.NDArray[np.float64]
    clipped: npt.NDArray[np.bool_]
    rate_hz: float | None = None

    def __len__(self) -> int:
        return len(self.t_us)


@dataclass(frozen=True)
class Fix:
    """One epoch of a GPS receiver. What the receiver did not say is None, never zero.

    t_us              monotonic arrival of the first byte of the epoch's first sentence [us]
    valid             the receiver vouches for position and speed (rule in ``drivers.nmea``)
    utc_us            time of the fix, microseconds since 1970-01-01 UTC; None while the date is unknown or refused
    time_of_day_us    time of the fix within its UTC day [us]; None when not said
    may_wait          its line has not paused in the seconds before: it may come late by what waits to be sent
    """

    t_us: int
    valid: bool
    utc_us: int | None
    time_of_day_us: int | None
    lat_deg: float | None
    lon_deg: float | None
    speed_mps: float | None
    course_deg: float | None
    altitude_m: float | None
    satellites: int | None
    hdop: float | None
    may_wait: bool = False
