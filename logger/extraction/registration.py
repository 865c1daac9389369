"""A pass over a measured profile, laid on the profile's own distance.

Problem: a receiver's positions are off by metres, a model needs centimetres. Solution: the road itself shows it. A
model of the car is driven over the profile at the distances that the receiver gives. One shift of the whole pass is
found where what it should have felt and what it felt are most alike; then the two are compared window by window
(``lab.likelihood.lag``), and where a window was felt is one more observation for the smoother of the motion.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.extraction.along_track import Observations, TrackMotion, motion_of, place_std_m, speed_scale
from logger.lab.likelihood.lag import SLOWEST_MPS, lags, offset_by_correlation_m
from logger.profiles.track import Track
from logger.runs import RECEIVER_ERROR_LASTS_S, Run

Array = npt.NDArray[np.float64]

GPS_PLACE_M = 3.0
"""Standard error of a receiver's positions."""
_REACH_M = 30.0  # ten deviations of a receiver's place
_ROUNDS = 4
_AGREE_M, _FEWEST = 0.2, 4
"""So many windows or more were felt, and half of them lie so near to the motion: those of another road lie anywhere
within 0.3 s, half of them 0.75 m off or more at 5 m/s and above, and no motion that fits the speeds follows them."""
_LEAST_STD_M = 0.01  # of a window: no model of a car is exact


@dataclass(frozen=True, eq=False)
class Registered:
    """A pass on the profile's distance.

    motion         along the profile
    place_std_m    r.m.s. standard error of a place [m]
    by_road        whether the road was recognised; False: places are those of the receiver
    speed_scale    of the receiver's speeds over those on the profile, and its standard error; None: by those speeds
    """

    motion: TrackMotion
    place_std_m: float
    by_road: bool
    speed_scale: tuple[float, float] | None = None


Predict = Callable[[Array], Array]
"""What the sensor of a model records (n,) [m/s2] at these distances (n,) of the front tires [m]."""


def registered(speeds: Observations, places: Observations, time_s: Array, accel_mps2: Array, rate_hz: float,
               track: Track, predict: Predict) -> Registered:
    """Lay a pass on its profile.

    speeds, places    of the receiver: of the front tires, the latter by the profile's distance [m]
    time_s            (n,) of the readings, at ``rate_hz``, within the times of the fixes
    accel_mps2        (n,) what was read; 0 where nothing was
    """
    lasting = np.sqrt(max(1.0, RECEIVER_ERROR_LASTS_S * len(places.time_s) / max(np.ptp(places.time_s), 1.0)))
    weak = Observations(places.time_s, places.value, places.deviation * lasting)
    motion = motion_of(speeds, weak)
    by_road = _by_road(motion, speeds, time_s, accel_mps2, rate_hz, track, predict)
    motion, known = by_road or (motion, weak)
    std_m = place_std_m(motion, speeds, known)
    return Registered(motion, float(np.sqrt(np.mean(std_m**2))), by_road is not None,
                      None if by_road is None else speed_scale(motion, speeds, known))


def _by_road(motion: TrackMotion, speeds: Observations, time_s: Array, accel_mps2: Array, rate_hz: float, track: Track,
             predict: Predict) -> tuple[TrackMotion, Observations] | None:
    """The motion on the road as it was felt, and where that was; None where the road was not recognised."""
    distance_m = motion.distance_m(time_s)
    farther_m = offset_by_correlation_m(distance_m, accel_mps2, predict(distance_m), (track.start_m, track.end_m),
                                        _REACH_M)
    if farther_m is None:
        return None
    state = motion.state.copy()
    state[:, 0] += farther_m
    motion = TrackMotion(motion.time_s, state, motion.walk, motion.noise_mps)
    felt = _felt(motion, time_s, accel_mps2, rate_hz, track, predict)
    for _ in range(_ROUNDS):
        if len(felt.time_s) < _FEWEST:
            return None
        motion, known = motion_of(speeds, felt, motion), felt
        felt = _felt(motion, time_s, accel_mps2, rate_hz, track, predict)
    off_m = np.interp(known.time_s, time_s, motion.distance_m(time_s)) - known.value
    return (motion, known) if np.median(np.abs(off_m)) < _AGREE_M else None


def _felt(motion: TrackMotion, time_s: Array, accel_mps2: Array, rate_hz: float, track: Track, predict: Predict
          ) -> Observations:
    """Where those windows of the road were felt in which the car did what the profile asks."""
    distance_m, speed_mps = motion.distance_m(time_s), motion.speed_mps(time_s)
    run = Run("", rate_hz, accel_mps2, distance_m, speed_mps, track)
    found = lags([run], [predict(distance_m)])
    at_m = distance_m[0] + found.along_m
    kept = (found.speed_mps > SLOWEST_MPS) & np.isfinite(found.error_s) & (at_m >= track.start_m) & (
        at_m <= track.end_m)
    rising = distance_m + 1e-9 * np.arange(len(distance_m))
    deviation = np.hypot(found.error_s * found.speed_mps, _LEAST_STD_M)
    return Observations(np.interp(at_m, rising, time_s)[kept], (at_m - found.lag_m)[kept], deviation[kept])
