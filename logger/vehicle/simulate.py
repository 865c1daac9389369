"""The passage of a car over a road, or on a rig: what comes under its wheels, and what a recorder keeps of it."""

from collections.abc import Callable, Hashable
from copy import copy
from functools import lru_cache
from math import ceil
from typing import Any, TypeVar

import numpy as np

from logger.arrays import Array, Bools, Complex
from logger.bounds import EVEN_SAMPLES
from logger.dsp.filters import kaiser_half_length, low_pass_taps
from logger.dsp.resample import PASS_OF_RATE
from logger.profiles.track import Way, WheelTracks
from logger.vehicle.structure import AT_REST, Forces, Structure, pushed

FINE_RATE_HZ = 1000.0
"""A car is simulated in at least so many steps a second."""
STOP_OF_RATE = 0.5
"""The recorder's filter is flat below ``PASS_OF_RATE`` and silent above this share of its rate."""
STOP_DB = 80.0
_HALF_SAMPLES = ceil(kaiser_half_length(STOP_DB, 2 * np.pi * (STOP_OF_RATE - PASS_OF_RATE)))
# The recorder's gain is read off a transform of so many points of its filter at so many times its rate.
_GAIN_STEPS, _GAIN_GRID = 4, 16384


def recorder_taps(steps: int) -> Array:
    """The recorder's filter at ``steps`` times its rate: (2 h + 1,), symmetric, its sum 1."""
    return low_pass_taps(_HALF_SAMPLES * steps, steps, PASS_OF_RATE + STOP_OF_RATE, STOP_DB)


def resampled(samples: Array, factor: int) -> Array:
    """Every ``factor``-th of samples (n,) behind the recorder's filter at the lower rate; both ends are continued by
    their mirror image about the last sample."""
    taps = recorder_taps(factor)
    half = min(len(taps) // 2, len(samples) - 1)
    around = np.pad(samples, half, mode="reflect", reflect_type="odd")
    return np.asarray(np.convolve(np.pad(around, len(taps) // 2 - half, mode="edge"), taps, "valid")[::factor])


def recorder_gain(f_of_rate: Array) -> Array:
    """The size of the recorder's gain at shares of its rate (f,)."""
    gains = np.abs(np.fft.rfft(recorder_taps(_GAIN_STEPS), _GAIN_GRID))
    return np.interp(f_of_rate * _GAIN_GRID / _GAIN_STEPS, np.arange(len(gains)), gains)


def smooth(inputs: Array, means: Array) -> Array:
    """Elevations, or other inputs, again (N, w), from the means of two steps before and two after: what is quicker than
    these is gone.

    Right to fourth order. Read at the instants alone, an edge that passes between two of them, or the noise of a
    faster recorder, would come out of the recorder's filter at a frequency that it does not have.
    """
    found = inputs.copy()
    found[2:-2] = (7 * (means[1:-2] + means[2:-1]) - means[:-3] - means[3:]) / 12
    return found


# The car comes to the first sample over so much road, at the speed it has there, and drives on after the last one. Both
# are as long as the acceleration may be late against the position or early, the latter with the half of the recorder's
# filter that looks ahead, down to 50 samples a second.
APPROACH_S = 2.0
_TAIL_S = 2.5
# What rings in a sensor at the end of a transform has died down so much later, before it comes round to the beginning.
_REST_S = 1.0
# A derivative by each number of a half car (13), in two threads, begins and ends with the same body.
_KEPT_PLACES, _KEPT_BODIES = 2, 32
B = TypeVar("B")


class Passage:
    """One drive: N samples at an even rate.

    Problem: a nonlinear car has to be stepped finely, and fits step it hundreds of times over the same road, of which
    only what changed should be computed again; and a recorder's filter, a sensor's own dynamics and a late clock lie
    between the body and each sample. Solution: a ``Passage`` holds the elevations under the wheels and their exact
    means over the way of each step, so that corners within a step are neither missed nor folded down to low
    frequencies, for the last few places that wheels stood at; everything linear behind the body, down to the recorder's
    filter and the choice of one step in ten, is one product in frequency; and the motions of the last few bodies are
    held as well, since many a sensor is tried on one body. The recorder's filter passes what lies below 0.38 of its
    rate within 0.001 dB and lets nothing above half its rate through (80 dB down), without delay. A test bench samples
    the force of a part with the travel, at one instant, and a friction that turns round between two samples is in the
    record as it stands: that filter comes behind the bench's samples, where they are thinned.

    track         the road, or the rig
    rate_hz       samples a second
    distance_m    (N,) where the front tires stand at each sample [m]; on a rig 0
    fine_hz       at least so many steps a second
    run           which one it is of the runs that are looked at together, from 0 on
    is_free       it begins at the first sample, in any state (``begun_with``): nothing is known of what was before.
                  For the recorder's filter the record is continued there by its mirror image about the first sample
    of_bench      samples that a bench took for each one that was kept; 0: no bench did

    ValueError unless there are two or more finite distances.
    """

    begins = AT_REST
    """By how much the state (2 n,) that it begins in, then those of laws with a memory (k,), differ from rest; empty:
    not at all."""

    def __init__(self, track: WheelTracks, rate_hz: float, distance_m: Array, fine_hz: float = FINE_RATE_HZ,
                 run: int = 0, is_free: bool = False, of_bench: int = 0) -> None:
        if distance_m.ndim != 1 or len(distance_m) < 2 or not np.isfinite(distance_m).all():
            raise ValueError("expected two or more finite distances")
        self.track, self.rate_hz, self.distance_m = track, rate_hz, distance_m
        self.count = len(distance_m)
        self._of_bench, each = of_bench, max(of_bench, 1)
        self.steps = each * max(1, int(np.ceil(fine_hz / (rate_hz * each) - EVEN_SAMPLES)))
        self.step_s = 1 / (rate_hz * self.steps)
        # What a bench moved is taken to have come the way it goes, and no farther than that is known.
        known = self.count if is_free else self.count - 1 if of_bench else np.inf
        self._lead = int(min(round(APPROACH_S * rate_hz), known))
        self._mirrored = self._lead if is_free else 0
        # What nothing drives is not early against anything.
        self._tail = max(round((_TAIL_S - APPROACH_S * is_free) * rate_hz), len(recorder_taps(1)) // 2 + 1)
        before = self._lead - self._mirrored
        pace_m, ahead_m = distance_m[1] - distance_m[0], distance_m[-1] - distance_m[-2]
        way = np.concatenate([distance_m[0] + pace_m * np.arange(-before, 0), distance_m,
                              distance_m[-1] + ahead_m * np.arange(1, self._tail + 1)])
        way_m = finer(way, self.steps)
        self._way = Way(way_m, np.asarray((np.arange(len(way_m)) - before * self.steps) * self.step_s), run)
        coarse = len(way) + self._mirrored + round(_REST_S * rate_hz)
        self._coarse = smooth_length(coarse)
        f_hz = np.arange(self._coarse * (self.steps if of_bench else 1) // 2) * rate_hz / self._coarse
        self._s = np.asarray(2j * np.pi * f_hz, dtype=complex)
        self._recorder = _recorder(self._coarse, of_bench or self.steps)
        self._known: dict[Hashable, tuple[Array, Array]] = {}
        self._bodies: dict[Hashable, Complex] = {}
        self._beginnings: dict[Hashable, Any] = {}
        self._smooth: list[tuple[Array | None, Array]] = [(None, AT_REST)]
        self._driving: list[tuple[Array | None, Array, Bools]] = [(None, AT_REST, AT_REST > 0)]
        self._transformed: tuple[Array, Complex, Complex] | None = None
        self._cuts: dict[int, Passage] = {}

    @property
    def time_s(self) -> Array:
        """When the samples are taken (N,), the first at 0 [s]."""
        return np.arange(self.count) / self.rate_hz

    @property
    def speed_mps(self) -> Array:
        """How fast the car is at the samples (N,) [m/s]."""
        return np.asarray(np.gradient(self.distance_m, 1 / self.rate_hz))

    def cut(self, count: int) -> "Passage":
        """Its first samples."""
        if (found := self._cuts.get(count)) is None:
            found = self._cuts[count] = Passage(self.track, self.rate_hz, self.distance_m[:count], 1 / self.step_s,
                                                self._way.run, self._mirrored > 0, self._of_bench)
        return found

    def begun_with(self, state: Array) -> "Passage":
        """The same passage begun in a state that differs by this (2 n + k,) from the one at rest, as ``begins``."""
        found = copy(self)
        found.begins, found._bodies = state, {}
        return found

    def beginning_of(self, record_key: Hashable, find: Callable[[], B]) -> B:
        """How it begins with one of the last few cars, by its ``record_key``; found if it has not been yet."""
        known: B | None = self._beginnings.get(record_key)
        if known is None:
            known = find()
            self._beginnings = _with_newest(self._beginnings, record_key, known, _KEPT_BODIES)
        return known

    @property
    def way(self) -> Way:
        """Where the front tires are at the fine instants, and when."""
        return self._way

    def under_wheels(self, structure: Structure) -> tuple[Array, Array]:
        """Elevations under the wheels at the fine instants (M, w) and their means in each step (M - 1, w) [m], counted
        from where the front left wheel begins; then further inputs of the structure, forces last."""
        place = self.place_of(structure)
        known = self._known.get(place)  # another thread may take it out at any time
        if known is None:
            track = self.track.as_it_is(structure.surface, structure.actuators)
            elevation, mean = track.under_wheels(self._way, structure)
            heights = np.arange(elevation.shape[1]) < len(structure.wheels) * (not structure.held)
            level = elevation[0, 0] * heights
            known = elevation - level, mean - level
            self._known = _with_newest(self._known, place, known, _KEPT_PLACES)
        return known

    def place_of(self, structure: Structure) -> Hashable:
        """Equal for two structures under which the same comes. A rig's table is the same under all wheels of an axle,
        wherever that is."""
        wheels = np.sign(structure.behind_m) if self.track.timed else (
            structure.contact_patch_m, *structure.behind_m, *np.sign(structure.left_m), structure.surface)
        return (*wheels, structure.actuators, structure.on_base, structure.held)

    def means_and_rises(self, structure: Structure) -> Array:
        """The means of the inputs in each step, and by how much they rise in half of it (M - 1, 2 u): what steps a
        linear car."""
        return self.driving(structure)[0]

    def driving(self, structure: Structure) -> tuple[Array, Bools]:
        """``means_and_rises``, and which of them may be anything but 0 (2 u,): a road's inputs all."""
        inputs, mean = self.under_wheels(structure)
        found = self._driving[0]  # also of the same passage begun in another state
        if found[0] is not inputs:
            driving = np.empty((len(mean), 2 * mean.shape[1]))
            driving[:, :mean.shape[1]], rises = mean, driving[:, mean.shape[1]:]
            np.subtract(mean[2:], mean[:-2], out=rises[1:-1])
            rises[0], rises[-1] = mean[1] - (2 * inputs[0] - mean[0]), 2 * inputs[-1] - mean[-1] - mean[-2]
            rises /= 4
            moves = driving.any(axis=0) if structure.on_base else np.ones(driving.shape[1], bool)
            found = self._driving[0] = inputs, driving, np.asarray(moves)
        return found[1:]

    def smooth_inputs(self, structure: Structure) -> Array:
        """Those at the fine instants, ``smooth``."""
        inputs, means = self.under_wheels(structure)
        found = self._smooth[0]  # also of the same passage begun in another state
        if found[0] is not inputs:
            found = self._smooth[0] = inputs, smooth(inputs, means)
        return found[1]

    def transformed_inputs(self, structure: Structure) -> tuple[Complex, Complex]:
        """Transforms, behind the recorder's filter, of ``means_and_rises`` (2 u, f), and of the inputs (u, f)."""
        inputs, found = self.under_wheels(structure)[0], self._transformed
        if found is None or found[0] is not inputs:
            driving, smoothed = self.means_and_rises(structure), self.smooth_inputs(structure)
            found = self._transformed = inputs, self.transformed(driving.T), self.transformed(smoothed.T)
        return found[1:]

    @property
    def forces(self) -> Forces:
        """The parts that forces act on: on roads none."""
        return self.track.acts_on

    def driven(self, structure: Structure) -> Structure:
        """The structure with the forces of this passage as its last inputs."""
        return pushed(structure, self.forces)

    def recorded(self, fine: Array, factor: Callable[[Complex], Complex]) -> Array:
        """What the recorder keeps of an acceleration at the fine instants (M,): samples (N,); or of several signals
        (c, M), of which it is the first: (c, N).

        factor    of what lies between the body and the recorder, by s (f,) [1/s]
        """
        return self.kept(self.transformed(fine), factor)

    def recorded_of(self, body: Hashable, accelerations: Callable[[], Array],
                    factor: Callable[[Complex], Complex]) -> Array:
        """The same of a body that may have passed before; ``accelerations`` are asked only if it has not.

        body    equal for two bodies that move alike on this passage
        """
        transform = self._bodies.get(body)
        if transform is None:
            transform = self.transformed(accelerations())
            self._bodies = _with_newest(self._bodies, body, transform, _KEPT_BODIES)
        return self.kept(transform, factor)

    @property
    def s(self) -> Complex:
        """Where transforms are taken (f,) [1/s]."""
        return self._s

    def impulse(self, instant: int) -> Complex:
        """The transform (f,) of 1 at a fine instant and 0 at all others, behind the recorder's filter."""
        return np.asarray(self._recorder * np.exp(-self._s * (instant * self.step_s)))

    def transformed(self, fine: Array) -> Complex:
        """The transform (..., f) of signals at the fine instants (..., M) or at the first of them, behind the
        recorder's filter, but for samples of a bench."""
        if mirrored := self._mirrored * self.steps:
            fine = np.concatenate([2 * fine[..., :1] - fine[..., mirrored:0:-1], fine], axis=-1)
        found = np.fft.rfft(fine, self._coarse * self.steps)[..., : len(self._s)]
        return np.asarray(found if self._of_bench else found * self._recorder)

    def kept(self, transform: Complex, factor: Callable[[Complex], Complex]) -> Array:
        """The samples (..., N) of transforms (..., f); ``factor`` of those of the only signal, or of the first."""
        if transform.ndim == 1:
            behind = transform * factor(self._s)
        else:
            behind = np.concatenate([transform[..., :1, :] * factor(self._s), transform[..., 1:, :]], axis=-2)
        if self._of_bench:
            sampled = np.fft.irfft(behind, self._coarse * self.steps)[..., :: self.steps // self._of_bench]
            if self._of_bench == 1:
                return np.asarray(sampled[..., self._lead : self._lead + self.count])
            behind = np.fft.rfft(sampled)[..., : len(self._recorder)] * self._recorder
        return np.fft.irfft(behind, self._coarse)[..., self._lead : self._lead + self.count]

    def sampled(self, fine: Array) -> Array:
        """Fine instants (M, ...) at the samples (N, ...), as they are."""
        return fine[(self._lead - self._mirrored) * self.steps :: self.steps][: self.count]


def _with_newest(known: dict[Hashable, B], key: Hashable, newest: B, most: int) -> dict[Hashable, B]:
    """A dict of the last so many, with one more. Its other keys, which may be long, are not hashed again."""
    found = known | {key: newest}
    while len(found) > most:
        del found[next(iter(found))]
    return found


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
