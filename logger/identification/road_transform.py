"""The road under the wheels of one run, laid out in time and transformed.

Problem and solution are those of ``frequency_domain_model``: everything that a linear car answers to is here, and
nothing of the car but where its wheels stand. The profile's part is kept as long as neither the wheels nor the scale of
the speed move; what lies on it is laid out again each time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from logger.identification.unknown_inputs import SPEED_SCALE, RoadInput
from logger.profiles.track import Track, Way, WheelPath
from logger.runs import Run
from logger.vehicle.passage import finer, smooth_length
from logger.vehicle.simulate import FINE_RATE_HZ, recorder_taps
from logger.vehicle.structure import Structure

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

# The car has come to the first sample as fast as it goes there for so long [s].
_APPROACH_S = 3.0
# How long the road behind a record takes to come back to where it began [s].
_RETURN_S = 6.0
_ROUND_THE_END = 1e-4
_EVEN = 1e-3
# Over less than this a car stands, and the road has no slope [m].
_STANDING_M = 1e-9


class RoadInTime:
    """The road under the wheels of one record, transformed.

    s    (f,) where the transform is taken [1/s]
    """

    def __init__(self, record: Run) -> None:
        rate_hz = record.rate_hz
        self._track = record.track
        self._steps = int(np.ceil(FINE_RATE_HZ / rate_hz - _EVEN))
        fine_hz = rate_hz * self._steps
        lead, half = int(np.ceil(_APPROACH_S * rate_hz)), (len(recorder_taps(1)) - 1) // 2
        distance = record.distance_m
        pace_m = distance[1] - distance[0]
        ahead_m = distance[-1] - distance[-2]
        way = np.concatenate([distance[0] + pace_m * np.arange(-lead, 0), distance,
                              distance[-1] + ahead_m * np.arange(1, 2 * half)])
        self._way_m = finer(way, self._steps)
        self._time_s = (np.arange(len(self._way_m)) / self._steps - lead) / rate_hz
        self._count = smooth_length(len(way) + int(np.ceil(_RETURN_S * rate_hz)))
        self._kept = slice(lead + record.first, lead + len(distance))
        damping = -np.log(_ROUND_THE_END) * rate_hz / self._count
        f_hz = np.arange(self._count // 2) * rate_hz / self._count
        self.s = damping + 2j * np.pi * f_hz
        self._fading = np.exp(-damping * np.arange(self._count * self._steps) / fine_hz)
        self._growth = np.exp(damping * np.arange(self._count) / rate_hz)[self._kept]
        # The mean over a step is the road times this, and the recorder's filter follows.
        over = self.s / fine_hz
        taps = recorder_taps(self._steps)
        place = np.arange(len(taps)) - (len(taps) - 1) / 2
        fading_taps = np.zeros(self._count * self._steps)
        fading_taps[: len(taps)] = taps * np.exp(-damping * place / fine_hz)
        filtered = np.fft.rfft(fading_taps)[: len(f_hz)] * np.exp(2j * np.pi * f_hz * (len(taps) - 1) / 2 / fine_hz)
        self._filter = filtered * over / np.expm1(over) / self._steps
        self._known: dict[tuple[float, ...], Complex] = {}

    def under_wheels(self, structure: Structure, road: RoadInput) -> Complex:
        """Transforms (f, w) of the elevations under the wheels, counted from where they began [m s]."""
        under = self._profile(structure, road.speed_scale)
        for obstacle in road.obstacles.values():
            path = obstacle.path(structure.contact_patch_m)
            under = under + self._wheels(structure, road.speed_scale, [path, path])
        return under

    def by_input(self, structure: Structure, road: RoadInput, name: str) -> Complex:
        """Derivatives (f, w) of that by a number of the road's input, by its name for all runs."""
        patch_m = structure.contact_patch_m
        if name != SPEED_SCALE:
            part, _, leaf = name.partition(".")
            path = road.obstacles[part].slopes(patch_m)[leaf]
            return self._wheels(structure, road.speed_scale, [path, path])
        assert isinstance(self._track, Track)  # a rig has no speed
        under = self._wheels(structure, road.speed_scale, self._track.tire_paths(patch_m), by_scale=True)
        for obstacle in road.obstacles.values():
            path = obstacle.path(patch_m)
            under = under + self._wheels(structure, road.speed_scale, [path, path], by_scale=True)
        return under

    def _profile(self, structure: Structure, speed_scale: float) -> Complex:
        place = (speed_scale, structure.contact_patch_m, *structure.behind_m, *structure.left_m)
        if place not in self._known:
            if len(self._known) > 2:
                self._known.clear()
            _, means = self._track.under_wheels(Way(self._way_m / speed_scale, self._time_s), structure)
            self._known[place] = np.stack([self._transform(one) for one in means.T], axis=1)
        return self._known[place]

    def _wheels(self, structure: Structure, speed_scale: float, paths: Sequence[WheelPath],
                by_scale: bool = False) -> Complex:
        """Transforms of what the wheels meet on their paths, left and right, or of its derivative by the scale."""
        wheels = []
        for behind_m, left_m in zip(structure.behind_m, structure.left_m, strict=True):
            way = self._way_m / speed_scale
            path = paths[-1] if left_m < 0 else paths[0]
            elevation, means = path.step_means(way - behind_m)
            if by_scale:
                step = np.diff(way)
                slope = np.diff(elevation) / np.where(np.abs(step) < _STANDING_M, np.inf, step)
                middle, excess = (way[1:] + way[:-1]) / 2, (elevation[1:] + elevation[:-1]) / 2 - means
                means = -(middle * slope + excess) / speed_scale
            wheels.append(self._transform(means))
        return np.stack(wheels, axis=1)

    def samples(self, transform: Complex) -> Array:
        """The samples (..., n) of transforms (..., f), without the beginning."""
        return np.fft.irfft(transform, self._count)[..., self._kept] * self._growth

    def _transform(self, means: Array) -> Complex:
        rise = means - means[0]
        back = np.zeros(len(self._fading))
        back[: len(rise)] = rise
        rest = len(back) - len(rise)
        back[len(rise):] = rise[-1] * 0.5 * (1 + np.cos(np.pi * np.arange(rest) / rest))
        return np.fft.rfft(back * self._fading)[: len(self.s)] * self._filter
