"""From jittered accelerometer samples to filtered ones on the time grid, and to a row's columns of comfort.

One vertical axis is taken, put on a uniform grid, decimated where the sensor was read faster, freed of gravity
by a high-pass, low-passed if the settings ask for it, and weighted for comfort. Holes are never hidden: samples
that the sensor did not deliver are `present = False`. Over a short hole the filters run on along a straight
line, so that one loose contact does not cost seconds of road; after a long one they start from rest and their output
is not `settled` until they have forgotten the start.

The comfort columns are what is known of the ride itself, with standard errors, beside the raw values. Where the
estimated road under a window says what the car did, the figures are those of that ride: the model of the car is in the
prior, the readings are bounds. Where there is none (no speed, the ends of a drive, a sensor whose noise blurs its
steps), the power of the noise is taken off the readings, which needs no model. Where neither is possible, the only
figure is the word that a bound allows.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, isfinite

import numpy as np
import numpy.typing as npt

from drivers.readings import AccelerationBlock
from logger.arrays import Array, Bools, Complex
from logger.bounds import LONGEST_HOLE_S
from logger.comfort.iso2631 import RunningRms, comfort_word
from logger.comfort.uncertain_ride import NO_FIGURES, NoiseFloor, RawFigures, RideFigures, Uncertain
from logger.dsp.filters import BlockFilter, SectionRows, butterworth_sos, frequency_response
from logger.dsp.fixed_point import FixedFilter
from logger.dsp.resample import GRID_RATE_HZ, Decimator, GridResampler, GridRun
from logger.dsp.weightings.weighting import DELAY_SAMPLES, Weighting
from logger.dsp.windows import GridSamples, Window
from logger.estimation.sensor_noise import NoiseBelief, Sensor
from logger.estimation.streaming import WindowEstimate
from logger.units import US_PER_S

GRID_STEP_US = US_PER_S // GRID_RATE_HZ
GRAVITY_CORNER_HZ = 0.2
SETTLING_S = 4.0
SILENCE_US = 2_000_000
START_MEAN_SAMPLES = 50
NEARLY = 1.02  # So much faster than the grid a sensor may be without a filter: what folds lies above 48 Hz
Times = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Axis:
    """Which axis of the sensor points up: column 0, 1, 2 for X, Y, Z, and its sign."""

    column: int
    sign: float

    @classmethod
    def from_word(cls, word: str) -> "Axis":
        """``+z``, ``-x``, ..."""
        return cls("xyz".index(word[-1]), -1.0 if word.startswith("-") else 1.0)


class SignalChain:
    """The filters between a sensor and the windows, as one stream.

    weighting     frequency weighting with stored sections for 100 Hz
    oversample    the sensor is read at this multiple of 100 Hz; one that finds out its own rate is put on the grid of
                  the next multiple above it
    low_pass_hz   corner of a second-order low-pass; None: not used
    coarse        the sensor's steps are larger than its noise: its readings are passed on as they were read, not
                  interpolated to the grid, and each of them
    make_filter   the arithmetic of the recursive filters: ``BlockFilter``, or ``FixedFilter.for_acceleration``
    """

    def __init__(self, axis: Axis, weighting: Weighting, oversample: int, low_pass_hz: float | None, coarse: bool,
                 make_filter: Callable[[SectionRows], BlockFilter | FixedFilter] = BlockFilter) -> None:
        self._axis, self._coarse, self._oversample = axis, coarse, oversample
        self._reads = oversample if coarse else 1
        self._resampler = GridResampler(GRID_RATE_HZ * oversample)
        self._decimator = Decimator(oversample)
        self._high_pass = make_filter(butterworth_sos("high", GRAVITY_CORNER_HZ, GRID_RATE_HZ))
        self._low_pass = make_filter(butterworth_sos("low", low_pass_hz, GRID_RATE_HZ)) if low_pass_hz else None
        self._weighting = make_filter(weighting.sections[GRID_RATE_HZ])
        self._running = RunningRms(GRID_RATE_HZ)
        self._unweighted: GridSamples | None = None
        self._early = DELAY_SAMPLES
        self._next_us: int | None = None
        self._last_mps2: float | None = None
        self._since_start = 0
        self._crowded = 0
        self.late_samples = 0

    @property
    def crowded_samples(self) -> int:
        """Samples left out because they came less than half a step after another: a sensor that is too fast."""
        return self._crowded + self._resampler.dropped

    def push(self, block: AccelerationBlock) -> list[GridSamples]:
        """More samples of the sensor; gives what is ready on the grid."""
        if not len(block):
            return []
        vertical = self._axis.sign * block.accel_mps2[:, self._axis.column]
        first = self._first_in_time(block.t_us)
        begun = self._take_rate(block.rate_hz) if block.rate_hz is not None else []
        return begun + self._thinned(self._resampler.push(block.t_us[first:], vertical[first:], block.clipped[first:]))

    def _take_rate(self, rate_hz: float) -> list[GridSamples]:
        """A sensor's own rate [Hz]. When it needs another grid, what was read so far comes to its end."""
        oversample = max(1, ceil(rate_hz / (GRID_RATE_HZ * NEARLY)))
        spacing_s = 1 / max(rate_hz, GRID_RATE_HZ) if oversample > 1 else None
        self._resampler.expect(spacing_s)
        if oversample == self._oversample:
            return []
        out = self._thinned(self._resampler.flush()) + self._filtered(self._decimator.flush())
        self._crowded += self._resampler.dropped
        self._oversample = oversample
        self._resampler = GridResampler(GRID_RATE_HZ * oversample)
        self._resampler.expect(spacing_s)
        self._decimator = Decimator(oversample)
        return out

    def advance(self, start_us: int, now_us: int) -> list[GridSamples]:
        """Let time pass. A sensor that has been silent for two seconds is missing from the grid up to then;
        ``start_us`` is when the drive began, for a sensor that has not spoken yet."""
        begun_us = self._next_us if self._next_us is not None else start_us
        missing_until_us = now_us - SILENCE_US
        if begun_us >= missing_until_us:
            return []
        out = self.flush()
        begun_us = self._next_us if self._next_us is not None else start_us
        if begun_us < missing_until_us:
            out.append(self._absent(begun_us, missing_until_us))
        return out

    def skip_to(self, t_us: int) -> list[GridSamples]:
        """Go on at ``t_us``, with no grid for the time before it: nothing at all was heard in it."""
        out = self.flush()
        self._next_us = t_us
        return out

    def flush(self) -> list[GridSamples]:
        """What is still inside, up to the last sample; the filters start from rest with the next one."""
        out = self._thinned(self._resampler.flush())
        out += self._filtered(self._decimator.flush())
        out += self._overdue()
        self._last_mps2 = None
        return out

    def _first_in_time(self, t_us: Times) -> int:
        """Index of the first sample that is not older than what has already been given up as missing."""
        if self._last_mps2 is not None or self._next_us is None:
            return 0
        first = int(np.searchsorted(t_us, self._next_us))
        self.late_samples += first
        return first

    def _thinned(self, runs: list[GridRun]) -> list[GridSamples]:
        return [part for run in runs for part in self._filtered(self._decimator.push(run))]

    def _filtered(self, runs: list[GridRun]) -> list[GridSamples]:
        out = []
        for run in runs:
            if run.new_start:
                out += self._restart(run)
            out += self._samples(run)
        return out

    def _restart(self, run: GridRun) -> list[GridSamples]:
        """Before the first run and between two: what is missing, and the state of the filters."""
        hole_us = run.t0_us - self._next_us if self._next_us is not None else 0
        if self._next_us is not None and self._last_mps2 is not None and hole_us <= LONGEST_HOLE_S * US_PER_S:
            return self._line(self._next_us, run.t0_us, self._last_mps2, float(run.values[0]))
        out = self._overdue()
        if self._next_us is not None:
            out.append(self._absent(self._next_us, run.t0_us))
        self._reset(float(np.mean(run.values[:START_MEAN_SAMPLES])))
        return out

    def _reset(self, level_mps2: float) -> None:
        self._high_pass.reset(level_mps2)
        self._weighting.reset(level_mps2)
        if self._low_pass is not None:
            self._low_pass.reset(level_mps2)
        self._running.reset()
        self._unweighted = None
        self._early = DELAY_SAMPLES
        self._since_start = 0

    def _line(self, begin_us: int, end_us: int, from_mps2: float, to_mps2: float) -> list[GridSamples]:
        t_us = _grid_us(begin_us, end_us)
        if not len(t_us):
            return []
        values = np.interp(t_us, [begin_us - GRID_STEP_US, end_us], [from_mps2, to_mps2])
        nowhere = np.zeros(len(t_us), dtype=np.bool_)
        return self._filter(t_us, values, values, nowhere, nowhere, nowhere, _unread(len(t_us), self._reads))

    def _absent(self, begin_us: int, end_us: int) -> GridSamples:
        t_us = _grid_us(begin_us, end_us)
        if len(t_us):
            self._next_us = int(t_us[-1]) + GRID_STEP_US
        zero = np.zeros(len(t_us))
        nowhere = np.zeros(len(t_us), dtype=np.bool_)
        return GridSamples(t_us, zero, zero, zero, zero, nowhere, nowhere, nowhere, nowhere,
                           *_unread(len(t_us), self._reads))

    def _samples(self, run: GridRun) -> list[GridSamples]:
        t_us = run.t0_us + GRID_STEP_US * np.arange(len(run.values), dtype=np.int64)
        everywhere = np.ones(len(t_us), dtype=np.bool_)
        reading = run.nearest if self._coarse else run.values
        each, each_clipped = reading[:, None], run.clipped[:, None]
        if self._reads > 1 and run.each is not None and run.each_clipped is not None:
            each, each_clipped = run.each, run.each_clipped
        own = each, np.isfinite(each), np.where(each_clipped, np.sign(each), 0.0)
        return self._filter(t_us, run.values, reading, everywhere, run.bridged, run.clipped, own)

    def _filter(self, t_us: Times, values: Array, reading: Array, present: Bools, interpolated: Bools, clipped: Bools,
                own: tuple[Array, Bools, Array]) -> list[GridSamples]:
        """Run the filters over more samples. The weighting is some whole samples behind; as many wait for it, and its
        first outputs belong to instants before the start."""
        self._next_us = int(t_us[-1]) + GRID_STEP_US
        self._last_mps2 = float(values[-1])
        if self._low_pass is not None:
            values = self._low_pass.process(values)
        accel = self._high_pass.process(values)
        settled = self._since_start + np.arange(len(values)) >= SETTLING_S * GRID_RATE_HZ
        self._since_start += len(values)
        weighted = self._weighting.process(values)
        blank = np.zeros(len(values))
        waiting = GridSamples(t_us, reading, accel, blank, blank, present, interpolated, settled, clipped, *own)
        early = min(self._early, len(weighted))
        self._early -= early
        weighted = weighted[early:]
        if self._unweighted is not None:
            waiting = GridSamples.joined([self._unweighted, waiting])
        self._unweighted = waiting.of(slice(len(weighted), None))
        return self._weighed(waiting.of(slice(len(weighted))), weighted)

    def _overdue(self) -> list[GridSamples]:
        """The samples that still wait for the weighting, at the end of a run: it is fed the last value once more."""
        waiting, self._unweighted = self._unweighted, None
        if waiting is None or self._last_mps2 is None:
            return []
        weighted = self._weighting.process(np.full(self._early + len(waiting), self._last_mps2))
        return self._weighed(waiting, weighted[self._early :])

    def _weighed(self, samples: GridSamples, weighted_mps2: Array) -> list[GridSamples]:
        if not len(samples):
            return []
        running = self._running.process(weighted_mps2)
        return [replace(samples, weighted_mps2=weighted_mps2, running_rms_mps2=running)]


def _grid_us(begin_us: int, end_us: int) -> Times:
    """Instants of the grid from ``begin_us`` to half a step before ``end_us``."""
    return np.arange(begin_us, end_us - GRID_STEP_US // 2, GRID_STEP_US, dtype=np.int64)


def _unread(count: int, reads: int) -> tuple[Array, Bools, Array]:
    """Of samples none of whose readings came: what ``GridSamples`` has of each."""
    return np.zeros((count, reads)), np.zeros((count, reads), dtype=np.bool_), np.zeros((count, reads))


def recorder_gain(low_pass_hz: float | None) -> Callable[[Array], Array]:
    """What the chain does to a body acceleration before its r.m.s. is taken: gain at frequencies (n,) [Hz]."""
    filters = [butterworth_sos("high", GRAVITY_CORNER_HZ, GRID_RATE_HZ)]
    if low_pass_hz:
        filters.append(butterworth_sos("low", low_pass_hz, GRID_RATE_HZ))

    def gain(f_hz: Array) -> Array:
        seen = f_hz < GRID_RATE_HZ / 2
        below_hz = np.where(seen, f_hz, 0.0)
        total = np.where(seen, 1.0, 0.0)
        for sos in filters:
            total = total * np.abs(frequency_response(sos, below_hz, GRID_RATE_HZ))
        return total

    return gain


def weighted_response(weighting: Weighting, low_pass_hz: float | None) -> Callable[[Array], Complex]:
    """What the chain makes of a body acceleration on its way to the comfort figures: complex response at frequencies
    (n,) from 0 to half the grid's rate [Hz], without the sections' delay."""
    def response(f_hz: Array) -> Complex:
        total = weighting.response(f_hz)
        if low_pass_hz:
            total = total * frequency_response(butterworth_sos("low", low_pass_hz, GRID_RATE_HZ), f_hz, GRID_RATE_HZ)
        return total

    return response


LEAST_WORD = "not_uncomfortable"


@dataclass(frozen=True)
class ComfortFigures:
    """``ride`` without the noise, the word for it, and whether it hides in noise and rounding."""

    ride: RideFigures
    word: str
    is_hidden: bool


NO_COMFORT = ComfortFigures(NO_FIGURES, "", False)


class ComfortColumns:
    """For one sensor, whose weighted white noise ``floor`` knows."""

    def __init__(self, floor: NoiseFloor, sensor: Sensor) -> None:
        self._floor = floor
        self._noise_mps2 = sensor.noise_rms_mps2
        self._is_coarse = sensor.is_coarse

    def of(self, window: Window, estimate: WindowEstimate | None, noise: NoiseBelief | None) -> ComfortFigures:
        """What can be said of a window. ``noise`` is what is believed of the sensor's; None: what the settings say."""
        if not isfinite(window.a_w_mps2):
            return NO_COMFORT
        noise_mps2, log_std = (noise.noise_rms_mps2, noise.log_std) if noise else (self._noise_mps2, 0.0)
        if not self._is_coarse:
            # What a drive shows of a fine sensor's noise holds what the car's model is wrong by: that is ride.
            noise_mps2 = min(noise_mps2, self._noise_mps2)
        ride = estimate.ride if estimate is not None else NO_FIGURES
        if not isfinite(ride.a_w.value):
            raw = RawFigures(window.samples, window.accel_rms_mps2, window.a_w_mps2, window.mtvv_mps2,
                             window.vdv_mps175)
            ride = self._floor.without(raw, noise_mps2, log_std)
        return ComfortFigures(ride, *word_of(ride.a_w, self._floor.most_hidden_mps2(noise_mps2)))


def word_of(a_w: Uncertain, most_hidden_mps2: float) -> tuple[str, bool]:
    """The comfort word of a weighted r.m.s. [m/s2], and whether the ride hides in the noise. A ride that does has the
    mildest word if its upper bound allows that, else none; ``most_hidden_mps2`` can hide between two steps."""
    reported_from_stds = 2.0  # A ride of fewer standard errors hides in the noise.
    is_known = isfinite(a_w.value)
    if is_known and a_w.value >= reported_from_stds * a_w.std:
        return comfort_word(a_w.value), False
    bound_mps2 = max(a_w.value + reported_from_stds * a_w.std if is_known else 0.0, most_hidden_mps2)
    return LEAST_WORD if comfort_word(bound_mps2) == LEAST_WORD else "", True
