"""The pass band of a record: whether somebody has low-passed it, and at which frequency.

Problem: the lab takes a record for what the recorder's own filter left, flat to 0.38 of its rate. A phone's app, a
logger or an engineer may have filtered it once more. Then nothing is left above the cut-off, neither the car nor the
sensor's noise; a model that has both there seems to be wrong, and some effect imitates the loss.

Solution: the measured spectrum is fitted by a sum of four parts,

    S(f) = B(f) (c M(f) + N) + n,    B(f) = 1 / (1 + x^(2 m)),    x = tan(pi f / rate) / tan(pi cutoff / rate)

M the spectrum that the model predicts, c a gain, N white noise that went through the filter, n white noise that was
added behind it (no more than the quietest band of the record holds), and B Butterworth's low-pass as it is computed on
samples (S. Butterworth 1930; A. Oppenheim and R. Schafer, Discrete-Time Signal Processing, 7.2). Spectra know neither
phases nor places: distances that are off by metres do not matter here. The misfit is the mean absolute difference of
log S(f), with a filter and with B = 1: an effect that the model lacks bends a spectrum by some dB, here up, there down,
and no B compensates that; a filter takes away tens of dB, and with the right B the misfit is next to nothing. Nor may a
sensor on a bracket (``sensor_mount_resonance``) together with a longer contact patch (``tire_enveloping``) fit as well.

What is a filter, and what a slow sensor? No part of a car or of a sensor falls faster than with the fourth power of
the frequency in power (``sensor_bandwidth`` of second order, 12 dB an octave); a rubber mount or a tire's contact
patch fall less, or come back. So a B of order m = 3 or more is somebody's filter: above it nothing is compared. One
of lower order is left to the effects: its delay shows whether it is a sensor's.

Was the filter causal, or run forth and back, without delay (then m is the sum of both ways)? Near its cut-off the phase
of a causal one is off a straight line by half a radian and more. Over short windows, each aligned with the model, the
mean cross-spectrum is compared with both phases, whatever constant delay there is besides. Where a filter takes away 5
% of the amplitude the pass band ends: of a causal one sqrt(1 + x^(2 m)) - 1, of one that was run forth and back x^m.
What a causal filter does below that, a delay that grows towards the cut-off, is ``sensor_bandwidth`` of the order that
was found; what one without delay does there is within the tolerance of any recorder (``Tolerance.droop``).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from logger.arrays import Array, Bools, Complex
from logger.dsp.filters import butterworth
from logger.dsp.whole_record import in_band, reach
from logger.lab.likelihood.lag import WINDOW_S, lags
from logger.lab.likelihood.whittle import BLOCK_S, HIGHEST_OF_RATE
from logger.runs import NO_READING, READING, LowPass, Run

# Of the loudest power: below that, a spectrum by Hann's windows shows rounding and what leaks from louder frequencies
# (by Hann's window 110 dB, 60 of its lines away).
_LEAST_POWER = 1e-9
# Bands of log S: so wide, from the body's bounce on. Wide enough for four lines of a block each, narrow enough for six
# of them below 10 Hz, where the gain is estimated.
_WIDTH_HZ, _LOWEST_HZ = 1.5, 1.0
# The grid of filters: logarithmic step and lowest of the cut-offs, and the highest as a share of the rate. A finer one
# changes a cut-off by less than 2 %.
_CUTOFF_STEP, _LEAST_HZ, _MOST_OF_RATE = 0.04, 6.0, 0.45
# Orders: of usual filters, up to one of order 8 that was run forth and back.
_ORDERS = np.array([1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 12.0, 16.0])
# The grid of effects that imitate a filter: frequencies and damping ratios of a sensor on a spring, from the lowest
# that cuts off within the band to twice the highest ...
_RINGS_AT_HZ, _RINGS_WITH = np.geomspace(8.0, 80.0, 45), np.geomspace(0.02, 0.7, 9)
# ... and first zeros of a contact patch, which averages over its length: 12 Hz is 0.4 m at 5 m/s.
_NULLS_HZ = np.append(np.inf, np.geomspace(12.0, 120.0, 14))
# The grid of the spectrum itself: gains around the median ratio, and how many levels of noise up to the median
# spectrum.
_GAINS, _NOISES = np.array([0.4, 0.7, 1.0, 1.4, 2.0]), 8
STEEPEST_EFFECT = 2.5
"""A filter of a higher order is none that a car or a sensor has (``sensor_bandwidth`` has order 2 at most)."""
# Misfit of log S without a filter: so many times as much as with it, and so many dB more. Measured on 221 unfiltered
# runs with every effect, of which none was taken for filtered: where the difference is above 1 dB the factor is 3 at
# most; of runs that were filtered, at orders of 4 and more and half of 0.38 of the rate, it is 5 to 50.
_BETTER, _BETTER_DB = 3.5, 1.0
# A sensor on a spring, over tires that are longer than the model's, may fall as steeply for a while. Measured: their
# misfit is 0.2 to 0.87 of a filter's where they are the truth, and 0.97 to 20 of it where a filter is (the least with
# noise added behind the filter); of a run alone up to 1.4 where they are the truth.
_NO_WORSE = 0.9
# A run is consistent with the filter of another one if a cut-off within so much of its logarithm (orders within twice
# that) misfits by no more than without a filter, to a rounding of log S.
_SAME_CUTOFF, _SAME_MISFIT = 0.1, 0.02
_LOSS = 0.05  # of the amplitude, at which the pass band ends (a judgement)
_PHASES_UP_TO = 1.2  # times the cut-off: above, a filter of order 4 leaves less than half of the amplitude
_DELAYS_S = np.arange(-0.15, 0.15, 0.0005)  # a filter of order 8 at 6 Hz delays by 0.14 s; a step is 5 degrees at 30 Hz
LEAST_WIDTH_HZ = 3.0
"""A narrower band holds the body's bounce at most, and no model of a car can be distinguished from another."""


def is_steep(seen: LowPass) -> bool:
    """Whether a filter is none that a sensor has."""
    return seen.order > STEEPEST_EFFECT


def pass_band_end_hz(seen: LowPass, rate_hz: float) -> float:
    """Frequency up to which a filter leaves 95 % of the amplitude or more, at this sample rate [Hz]."""
    power = 1 / (2 * seen.order) if seen.causal else 1 / seen.order
    loss = (1 - _LOSS) ** -2 - 1 if seen.causal else _LOSS
    return float(rate_hz / np.pi * np.arctan(loss**power * np.tan(np.pi * seen.cutoff_hz / rate_hz)))


def detect_low_passes(runs: Sequence[Run], predictions: Sequence[Array]) -> list[LowPass | None]:
    """The low-pass that each run went through; None: none. Runs of one recorder share theirs, so that one for all is
    searched for first, and then one of each alone; a run that shows none has that of another with which it is
    consistent.

    predictions    (n,) per run, of a model that is about right; distance errors do not matter
    """
    fits = [_Fits(run, prediction) for run, prediction in zip(runs, predictions, strict=True)]
    common = _detect_low_pass(fits, runs[0].rate_hz, common=True)
    if common is not None and all(_is_consistent(one, common, runs[0].rate_hz) for one in fits):
        common = replace(common, causal=_is_causal(runs, predictions, common))
        return [common] * len(fits)
    each = [_detect_low_pass([one], runs[0].rate_hz, common=len(fits) == 1) for one in fits]
    found = [None if one is None else replace(one, causal=_is_causal([run], [prediction], one))
             for one, run, prediction in zip(each, runs, predictions, strict=True)]
    steep = [one for one in found if one is not None and is_steep(one)]
    return [one or next((other for other in steep if _is_consistent(fit, other, runs[0].rate_hz)), None)
            for one, fit in zip(found, fits, strict=True)]


def with_pass_bands(runs: Sequence[Run], predictions: Sequence[Array], low_pass_hz: float | None = None) -> list[Run]:
    """The runs filtered to their pass bands, which end where their facts say, where a low-pass was detected, and at
    ``low_pass_hz``.

    ValueError where nothing is left.
    """
    return [cut_to_pass_band(run, prediction, seen, low_pass_hz) for run, seen, prediction in
            zip(runs, detect_low_passes(runs, predictions), predictions, strict=True)]


def cut_to_pass_band(run: Run, prediction: Array, seen: LowPass | None, low_pass_hz: float | None = None) -> Run:
    """The run filtered to its pass band, given the low-pass that it went through, and a model's prediction (n,). What a
    rig does may all be slow, without any filter: a band that is asked for is taken there, however narrow, and what
    seems to be a filter below is none. Nor is one seen in a record that would lose most of its samples with its end.

    ValueError where nothing, or less than half of a rig's record, is left.
    """
    low_hz, high_hz = run.pass_band_hz
    if low_pass_hz is not None:
        high_hz = min(high_hz, low_pass_hz)
    end = reach(run.rate_hz)
    is_long = not run.timed or run.count - run.first >= 2 * end
    if run.timed and seen is not None and not (is_long and is_wide_enough(run, seen)):
        seen = None
    if seen is not None and is_steep(seen) and (ends_hz := pass_band_end_hz(seen, run.rate_hz)) < high_hz:
        high_hz, seen = ends_hz, replace(seen, ends_band=True)
    if high_hz - low_hz < LEAST_WIDTH_HZ and not run.timed:
        raise ValueError(f"{run.name}: expected a pass band of {LEAST_WIDTH_HZ:g} Hz or wider, found {low_hz:.3g} "
                         f"to {high_hz:.3g} Hz")
    cut = (low_hz, high_hz) if low_hz > 0 or high_hz < run.rate_hz / 2 else None
    if cut is not None and not is_long:
        raise ValueError(f"{run.name}: expected a record of {(2 * end + run.first) / run.rate_hz:.2g} s or longer "
                         f"where its band is cut, as the last {end / run.rate_hz:.2g} s are lost, found "
                         f"{run.count / run.rate_hz:.2g} s")
    there = replace(run, low_pass=seen, facts=replace(run.facts, pass_band_hz=cut),
                    usable=run.usable if cut is None else _without_its_end(run))
    residual = run.residual(prediction)
    outside = float(np.sqrt(np.mean((residual - there.in_band(residual))[run.first:] ** 2)))
    return replace(there, measured_mps2=there.in_band(run.measured_mps2), outside_mps2=outside)


def is_wide_enough(run: Run, seen: LowPass) -> bool:
    """Whether enough of a run is left below a filter that it went through."""
    low_hz, high_hz = run.pass_band_hz
    return min(high_hz, pass_band_end_hz(seen, run.rate_hz)) - low_hz > LEAST_WIDTH_HZ


def _without_its_end(run: Run) -> Array:
    """The use of each sample (n,) of a run whose band is cut, without its end: there a record that was filtered before
    and a model that was not are cut differently, because neither filter knows how the drive went on."""
    found = np.full(run.count, READING) if run.usable is None else run.usable.copy()
    found[max(run.first, run.count - reach(run.rate_hz)):] = NO_READING
    return found


@dataclass(frozen=True)
class ComparedBand:
    """The band in which some runs are compared.

    low_hz, high_hz    the lowest and the highest frequency, of the run that has least
    cutoff_hz          of the filter that ends the band there; None: it was asked for, or is the record's by its facts
    some               only some of the runs were filtered
    """

    low_hz: float
    high_hz: float
    cutoff_hz: float | None
    some: bool


def compared_band(runs: Sequence[Run]) -> ComparedBand | None:
    """The band in which runs are compared; None where all of each is."""
    cut = [run for run in runs if run.facts.pass_band_hz is not None]
    if not cut:
        return None
    least = min(cut, key=lambda run: run.pass_band_hz[1])
    filtered = [run.low_pass for run in cut if run.low_pass is not None and run.low_pass.ends_band]
    cutoff_hz = least.low_pass.cutoff_hz if least.low_pass is not None and least.low_pass.ends_band else None
    return ComparedBand(max(run.pass_band_hz[0] for run in cut), least.pass_band_hz[1], cutoff_hz,
                        0 < len(filtered) < len(runs))


def _detect_low_pass(fits: "Sequence[_Fits]", rate_hz: float, common: bool) -> LowPass | None:
    """The low-pass that some runs went through; None: none. ``common``: they are all the runs of one recorder."""
    plain = sum(one.plain * one.size for one in fits)
    at_most = plain - np.log(10) / 10 * _BETTER_DB * sum(one.size for one in fits)
    if at_most < 0 or not len(_cutoffs_hz(rate_hz)):
        return None
    table = sum((one.filtered * one.size for one in fits), np.zeros_like(fits[0].filtered))
    place = np.unravel_index(int(table.argmin()), table.shape)
    misfit = float(table[place])
    if misfit > min(at_most, plain / _BETTER):
        return None
    if sum(one.by_effects * one.size for one in fits) < (_NO_WORSE if common else _BETTER) * misfit:
        return None
    return LowPass(float(_cutoffs_hz(rate_hz)[place[0]]), float(_ORDERS[place[1]]))


def _is_causal(runs: Sequence[Run], predictions: Sequence[Array], seen: LowPass) -> bool:
    """Whether the phase of the measurement relative to the model is a causal filter's rather than a straight line."""
    rate_hz = runs[0].rate_hz
    f_hz = np.fft.rfftfreq(_window(rate_hz), 1 / rate_hz)
    cross, own, other = np.zeros(len(f_hz), complex), np.zeros(len(f_hz)), np.zeros(len(f_hz))
    for run, prediction in zip(runs, predictions, strict=True):
        for model, measured in _windows(run, prediction, seen.cutoff_hz):
            cross += model.conj() * measured
            own, other = own + np.abs(model) ** 2, other + np.abs(measured) ** 2
    coherence = np.divide(np.abs(cross) ** 2, own * other, out=np.zeros(len(f_hz)), where=own * other > 0)
    inside = (f_hz > _LOWEST_HZ) & (f_hz < _PHASES_UP_TO * seen.cutoff_hz)
    turned = (coherence * np.exp(1j * np.angle(cross)))[inside]
    delays = np.exp(2j * np.pi * f_hz[inside] * _DELAYS_S[:, None])

    def phase_match(filtered: Complex) -> float:
        return float((delays @ (turned * filtered.conj() / np.abs(filtered))).real.max())

    s = np.asarray(2j * np.pi * f_hz[inside], complex)
    highest = round(_ORDERS[-1]) // 2  # the steepest that was run forth and back has the order of both ways
    if seen.order > highest + 1:
        return False
    least = round(STEEPEST_EFFECT) + 1 if is_steep(seen) else 1
    orders = range(max(least, round(seen.order) - 1), min(round(seen.order) + 1, highest) + 1)
    causal = max(phase_match(butterworth(order, s, seen.cutoff_hz, sampled)) for order in orders
                 for sampled in (0.0, rate_hz))
    return causal > phase_match(np.ones_like(s))


def _windows(run: Run, prediction: Array, cutoff_hz: float) -> Iterator[tuple[Complex, Complex]]:
    """Spectra of the model and of the measurement in windows, the model shifted by the lag there."""
    found = lags([run], [in_band(prediction, run.rate_hz, 0.0, cutoff_hz)])
    size = _window(run.rate_hz)
    taper = np.hanning(size + 1)[:-1]
    f_hz = np.fft.rfftfreq(size, 1 / run.rate_hz)
    for middle, lag_s in zip(found.middle, found.lag_s, strict=True):
        first = int(middle) - size // 2
        steps = round(lag_s * run.rate_hz)
        if first < 0 or first - steps < 0 or max(first, first - steps) + size > run.count:
            continue
        model = np.fft.rfft(taper * prediction[first - steps : first - steps + size])
        late = np.exp(2j * np.pi * f_hz * (lag_s - steps / run.rate_hz))
        yield model, np.fft.rfft(taper * run.measured_mps2[first : first + size]) * late


def _window(rate_hz: float) -> int:
    """Samples in a window in which phases are estimated."""
    return round(WINDOW_S * rate_hz)


def _is_consistent(fits: "_Fits", seen: LowPass, rate_hz: float) -> bool:
    """Whether a run fits no worse with a filter of about this cut-off and order than without."""
    near = np.abs(np.log(_cutoffs_hz(rate_hz) / seen.cutoff_hz)) < _SAME_CUTOFF
    as_steep = np.abs(np.log(_ORDERS / seen.order)) < 2 * _SAME_CUTOFF
    return bool(fits.filtered[np.ix_(near, as_steep)].min() <= fits.plain + _SAME_MISFIT)


class _Fits:
    """Misfits of log S of a run, in the bands that hold anything: the tables of many only where somebody asks."""

    def __init__(self, run: Run, prediction: Array) -> None:
        (measured, nothing_measured), (model, nothing_predicted) = (
            _spectrum(run, one) for one in (run.measured_mps2, prediction))
        self._used = ~(nothing_measured & nothing_predicted)
        self._middles_hz = np.asarray(_LOWEST_HZ + _WIDTH_HZ * (np.arange(len(measured)) + 0.5), float)
        self._behind = 0.97 * measured.min()  # the quietest of so many bands lies a little below its mean
        gains = _GAINS * np.median((measured / model)[:6])  # up to 10 Hz
        through = np.append(0.0, np.geomspace(self._behind, np.median(measured[self._used]), _NOISES))
        self._made = (gains[:, None, None] * model + through[:, None]).reshape(-1, len(model))
        self._target = np.log(measured)
        self._rate_hz = run.rate_hz
        self.size = run.count - run.first
        """Samples of the run."""
        self.plain = float(self._misfit(self._made))
        """Without a filter."""

    def _misfit(self, power: Array) -> Array:
        off = np.abs(np.log(power + self._behind) - self._target)
        return np.asarray(off.sum(axis=-1).min(axis=-1) / self._used.sum())

    @cached_property
    def filtered(self) -> Array:
        """With each filter (cut-offs, orders)."""
        x = np.tan(np.pi * self._middles_hz / self._rate_hz) / np.tan(
            np.pi * _cutoffs_hz(self._rate_hz)[:, None, None] / self._rate_hz)
        return np.stack([self._misfit(self._made / (1 + x ** (2 * order))) for order in _ORDERS], axis=1)

    @cached_property
    def by_effects(self) -> float:
        """With the best of the effects that imitate a filter."""
        return min(float(self._misfit(self._made * one).min()) for one in _effects_alone(self._middles_hz))


def _effects_alone(f_hz: Array) -> Iterator[Array]:
    """Power gains (n, 1, b) at frequencies (b,) of the effects that imitate a filter, some at a time: a sensor on a
    spring or not, on tires whose contact patch averages over its length or not."""
    ratio = f_hz / _RINGS_AT_HZ[:, None, None]
    tires = np.sinc(f_hz / _NULLS_HZ[:, None, None]) ** 2
    for damping in 2 * _RINGS_WITH[:, None, None, None] * ratio:
        for rings in (1 + damping**2) / ((1 - ratio**2) ** 2 + damping**2):
            yield rings * tires
    yield tires


def _cutoffs_hz(rate_hz: float) -> Array:
    """Cut-offs of the grid at this sample rate [Hz]."""
    return np.asarray(np.exp(np.arange(np.log(_LEAST_HZ), np.log(_MOST_OF_RATE * rate_hz), _CUTOFF_STEP)))


def _spectrum(run: Run, samples: Array) -> tuple[Array, Bools]:
    """Mean powers in bands of one width (b,), by Welch's method [m2/s4], and which of them hold nothing."""
    kept = samples[run.first:]
    size = min(round(BLOCK_S * run.rate_hz), len(kept))
    taper = np.hanning(size + 1)[:-1]
    blocks = np.lib.stride_tricks.sliding_window_view(kept, size)[:: max(1, size // 2)]
    power = (np.abs(np.fft.rfft(blocks * (taper / np.sqrt((taper**2).mean())), axis=1)) ** 2).mean(axis=0) / size
    f_hz = np.fft.rfftfreq(size, 1 / run.rate_hz)
    edges = np.arange(_LOWEST_HZ, HIGHEST_OF_RATE * run.rate_hz + 0.1, _WIDTH_HZ)
    floor = _LEAST_POWER * power.max() + np.finfo(float).tiny
    # In a run of a second no line may lie in a band: it has the power of the nearest.
    inside = [np.flatnonzero((f_hz >= low) & (f_hz < high)) for low, high in pairwise(edges)]
    means = np.exp([np.log(power[one if len(one) else [np.abs(f_hz - low).argmin()]] + floor).mean()
                    for one, low in zip(inside, edges[:-1], strict=True)])
    return means, means < 2 * floor
