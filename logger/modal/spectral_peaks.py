"""Resonances as peaks of a spectrum: Fourier transforms of even segments, summed (5.5.1 of Blum 2015).

The transform of one long record is as rough as its noise. Summing those of equal segments smooths it, at the price of
resolution, and the scatter from segment to segment gives the errors. The sum here is of powers, with a Hann window. A
peak is a mode when it rises above its surroundings further than the highest of all bins would by chance; its damping is
measured by its width at half power, and only where that is several times the window's own: nearer to it the figure
would be that of the window, and the ragged top of a spectrum of few segments makes it too small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from logger.modal.mode import Array, FoundMode, ModalResult, Rejected, normalised

FEWEST_SEGMENTS = 4
_SHORTEST_SEGMENT = 64
_HANN_WIDTH_BINS = 1.44  # at half power (Harris, 1978)
_FALSE_ALARM = 1e-3
_AROUND_BINS = 40
_ALONE_BINS = 3
_CLEARLY_WIDER = 3.0
_DIP = 0.5  # between two peaks, of the lower one
_LEAST_SHARE = 1e-4  # of the highest peak: below that the window leaks


@dataclass(frozen=True)
class SummedSpectrum:
    """Mean power of each segment, summed over channels, (segments, bins); each channel's cross power with all others
    (bins, channels, channels) on average; spacing of the bins [Hz]."""

    power: Array
    cross: np.ndarray
    step_hz: float


def summed_spectrum(samples: Array, rate_hz: float, segments: int) -> SummedSpectrum:
    """Power spectra of equal segments of a record (samples, channels)."""
    length = len(samples) // max(segments, 1)
    if segments < FEWEST_SEGMENTS or length < _SHORTEST_SEGMENT:
        raise ValueError(f"expected {FEWEST_SEGMENTS} segments or more of {_SHORTEST_SEGMENT} samples or more, found "
                         f"{segments} of {length}")
    cut = samples[:segments * length].reshape(segments, length, -1)
    window = 0.5 - 0.5 * np.cos(2 * np.pi * (np.arange(length) + 0.5) / length)
    seen = np.fft.rfft((cut - cut.mean(axis=1, keepdims=True)) * window[:, None], axis=1)
    cross = np.einsum("sfi,sfj->fij", seen, seen.conj()) / segments
    return SummedSpectrum((np.abs(seen) ** 2).sum(axis=2), cross, rate_hz / length)


def peak_modes(samples: Array, rate_hz: float, segments: int = 8) -> ModalResult:
    """Modes of a record (samples, channels) as peaks of its summed spectrum."""
    spectrum = summed_spectrum(samples, rate_hz, segments)
    mean = spectrum.power.mean(axis=0)
    modes, rejected = [], []
    bins = _maxima(mean)
    factor = _chance_factor(segments, len(mean))
    for peak in bins:
        frequency, ratio = _peak(mean, peak, spectrum.step_hz)
        around = mean[max(1, peak - _AROUND_BINS):peak + _AROUND_BINS + 1]
        if mean[peak] < factor * np.median(around) or mean[peak] < _LEAST_SHARE * mean.max():
            rejected.append(Rejected(frequency, ratio, "no higher than chance makes of the noise around it"))
            continue
        left_out = (mean * segments - spectrum.power) / (segments - 1)
        each = np.array([_peak(one, peak, spectrum.step_hz) for one in left_out])
        spread = np.sqrt(((each - each.mean(axis=0)) ** 2).sum(axis=0) * (segments - 1) / segments)
        vector = np.linalg.eigh(spectrum.cross[peak])[1][:, -1]
        modes.append(FoundMode(frequency, ratio, float(spread[0]), float(spread[1]), normalised(vector)))
    how = f"peaks of the Fourier spectra of {segments} even segments, summed; bins {spectrum.step_hz:.3g} Hz apart"
    return ModalResult(tuple(modes), tuple(rejected), 0, how)


def _chance_factor(segments: int, bins: int) -> float:
    """How far above the middle the highest of so many bins of noise comes, but once in a thousand records."""
    from scipy.special import chdtri

    freedom = 2 * segments
    return float(chdtri(freedom, _FALSE_ALARM / bins) / chdtri(freedom, 0.5))


def _maxima(power: Array) -> list[int]:
    """Bins that are the highest nearby and parted from any higher one by a dip."""
    kept: list[int] = []
    for peak in np.argsort(power)[::-1].tolist():
        if not 0 < peak < len(power) - 1 or power[peak] < max(power[peak - 1], power[peak + 1]):
            continue
        far = all(abs(peak - other) > _ALONE_BINS for other in kept)
        if far and all(power[min(peak, other):max(peak, other)].min() < _DIP * power[peak] for other in kept):
            kept.append(peak)
    return sorted(kept)


def _peak(power: Array, near: int, step_hz: float) -> tuple[float, float]:
    """Frequency [Hz] and damping ratio of the highest bin near one; NaN for a ratio that the window hides."""
    first = max(1, near - _ALONE_BINS)
    peak = min(first + int(power[first:near + _ALONE_BINS + 1].argmax()), len(power) - 2)
    below, top, above = np.log(np.maximum(power[peak - 1:peak + 2], 1e-300))
    bend = below - 2 * top + above
    shift = 0.5 * (below - above) / bend if bend < 0 else 0.0
    half = np.exp(top - 0.25 * (below - above) * shift) / 2
    frequency = (peak + shift) * step_hz
    ends = []
    for way in (-1, 1):
        place = peak
        while 0 < place < len(power) - 1 and power[place] > half:
            place += way
        fall = max(power[place - way] - power[place], 1e-300)
        ends.append(place - way * float(np.clip((half - power[place]) / fall, 0.0, 1.0)))
    width = abs(ends[1] - ends[0])
    if width < _CLEARLY_WIDER * _HANN_WIDTH_BINS:
        return float(frequency), float("nan")
    return float(frequency), float(np.sqrt(width**2 - _HANN_WIDTH_BINS**2) * step_hz / (2 * frequency))
