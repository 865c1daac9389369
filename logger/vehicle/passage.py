"""A drive over a road, laid out in fine steps of time: what passes under each wheel, and what a recorder keeps.

Problem: a nonlinear car has to be stepped finely, and fits step it hundreds of times over the same road, of which only
what changed should be computed again; and a recorder's filter, a sensor's own dynamics and a late clock lie between the
body and each sample. Solution: a ``Passage`` holds the elevations under the wheels, exact means over each step as in
``simulate``, for the last few places that wheels stood at; everything linear behind the body, down to the recorder's
filter and the choice of one step in ten, is one product in frequency; and the motions of the last few bodies are held
as well, since many a sensor is tried on one body.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from logger.profiles.track import Way, WheelTracks, under_surface
from logger.vehicle.simulate import FINE_RATE_HZ, recorder_taps
from logger.vehicle.structure import Structure

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

# The car comes to the first sample over so much road, at the speed it has there, and drives on after the last one. Both
# are as long as the acceleration may be late against the position or early, the latter with the half of the recorder's
# filter that looks ahead, down to 50 samples a second.
APPROACH_S = 2.0
_TAIL_S = 2.5
# What rings in a sensor at the end of a transform has died down so much later, before it comes round to the beginning.
_REST_S = 1.0
_KEPT_PLACES, _KEPT_BODIES = 3, 6
_EVEN = 1e-3


class Passage:
    """One drive: N samples at an even rate.

    track         the road, or the rig
    rate_hz       samples a second
    distance_m    (N,) where the front tires stand at each sample [m]; on a rig 0
    fine_hz       at least so many steps a second
    run           which one it is of the runs that are looked at together, from 0 on

    ValueError unless there are two or more finite distances.
    """

    def __init__(self, track: WheelTracks, rate_hz: float, distance_m: Array, fine_hz: float = FINE_RATE_HZ,
                 run: int = 0) -> None:
        if distance_m.ndim != 1 or len(distance_m) < 2 or not np.isfinite(distance_m).all():
            raise ValueError("expected two or more finite distances")
        self.track, self.rate_hz, self.distance_m = track, rate_hz, distance_m
        self.count = len(distance_m)
        self.steps = max(1, int(np.ceil(fine_hz / rate_hz - _EVEN)))
        self.step_s = 1 / (rate_hz * self.steps)
        self._lead, self._tail = round(APPROACH_S * rate_hz), round(_TAIL_S * rate_hz)
        pace_m, ahead_m = distance_m[1] - distance_m[0], distance_m[-1] - distance_m[-2]
        way = np.concatenate([distance_m[0] + pace_m * np.arange(-self._lead, 0), distance_m,
                              distance_m[-1] + ahead_m * np.arange(1, self._tail + 1)])
        way_m = finer(way, self.steps)
        self._way = Way(way_m, np.asarray((np.arange(len(way_m)) - self._lead * self.steps) * self.step_s), run)
        coarse = len(way) + round(_REST_S * rate_hz)
        self._coarse = smooth_length(coarse)
        f_hz = np.arange(self._coarse // 2) * rate_hz / self._coarse
        self._s = np.asarray(2j * np.pi * f_hz, dtype=complex)
        self._recorder = _recorder(self._coarse, self.steps)
        self._known: dict[tuple[Hashable, ...], tuple[Array, Array]] = {}
        self._bodies: dict[Hashable, Complex] = {}

    @property
    def time_s(self) -> Array:
        """When the samples are taken (N,), the first at 0 [s]."""
        return np.arange(self.count) / self.rate_hz

    @property
    def speed_mps(self) -> Array:
        """How fast the car is at the samples (N,) [m/s]."""
        return np.asarray(np.gradient(self.distance_m, 1 / self.rate_hz))

    @property
    def way(self) -> Way:
        """Where the front tires are at the fine instants, and when."""
        return self._way

    def under_wheels(self, structure: Structure) -> tuple[Array, Array]:
        """Elevations under the wheels at the fine instants (M, w) and their means in each step (M - 1, w) [m], counted
        from where the front left wheel begins."""
        place = (structure.contact_patch_m, *structure.behind_m, *np.sign(structure.left_m), structure.surface)
        known = self._known.get(place)  # another thread may take it out at any time
        if known is None:
            elevation, mean = under_surface(self.track, structure.surface).under_wheels(self._way, structure)
            level = elevation[0, 0]
            known = elevation - level, mean - level
            self._known = dict([*self._known.items()][-_KEPT_PLACES + 1 :]) | {place: known}
        return known

    def recorded(self, fine: Array, factor: Callable[[Complex], Complex]) -> Array:
        """What the recorder keeps of an acceleration at the fine instants (M,): samples (N,); or of several signals
        (c, M), of which it is the first: (c, N).

        factor    of what lies between the body and the recorder, by s (f,) [1/s]
        """
        return self._kept(self._transform(fine), factor)

    def recorded_of(self, body: Hashable, accelerations: Callable[[], Array],
                    factor: Callable[[Complex], Complex]) -> Array:
        """The same of a body that may have passed before; ``accelerations`` are asked only if it has not.

        body    equal for two bodies that move alike on this passage
        """
        transform = self._bodies.get(body)
        if transform is None:
            transform = self._transform(accelerations())
            self._bodies = dict([*self._bodies.items()][-_KEPT_BODIES + 1 :]) | {body: transform}
        return self._kept(transform, factor)

    def _transform(self, fine: Array) -> Complex:
        return np.asarray(np.fft.rfft(fine, self._coarse * self.steps)[..., : len(self._s)] * self._recorder)

    def _kept(self, transform: Complex, factor: Callable[[Complex], Complex]) -> Array:
        if transform.ndim == 1:
            behind = transform * factor(self._s)
        else:
            behind = np.concatenate([transform[:1] * factor(self._s), transform[1:]])
        return np.fft.irfft(behind, self._coarse)[..., self._lead : self._lead + self.count]

    def sampled(self, fine: Array) -> Array:
        """Fine instants (M, ...) at the samples (N, ...), as they are."""
        return fine[self._lead * self.steps :: self.steps][: self.count]


@lru_cache(maxsize=32)
def _recorder(count: int, steps: int) -> Array:
    """The gain of the recorder's filter, which chooses one of so many steps, at the frequencies of ``count`` samples
    (count / 2,)."""
    taps = recorder_taps(steps)
    centred = np.zeros(count * steps)
    half = len(taps) // 2
    centred[: half + 1], centred[-half:] = taps[half:], taps[:half]
    return np.asarray(np.fft.rfft(centred)[: count // 2].real / steps)


def finer(distance: Array, steps: int) -> Array:
    """Distances ``steps`` times as dense: cubics with the slopes that the neighbours give."""
    slope = np.gradient(distance)
    along = np.arange(steps) / steps
    rise = np.diff(distance)[:, None]
    first, last = slope[:-1, None], slope[1:, None]
    curve = distance[:-1, None] + along * (first + along * (3 * rise - 2 * first - last
                                                            + along * (first + last - 2 * rise)))
    return np.append(curve.ravel(), distance[-1])


def smooth_length(least: int) -> int:
    """An even number from ``least`` on that has no prime factor above 5, so that transforms are quick."""
    best = 2 ** int(np.ceil(np.log2(least)))
    for fives in range(4):
        for threes in range(6):
            odd = 5**fives * 3**threes
            best = min(best, odd * 2 ** max(1, int(np.ceil(np.log2(least / odd)))))
    return best
