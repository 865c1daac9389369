"""Damping from how fast the peaks of a free vibration shrink: the logarithmic decrement (Eq 5.2 of Blum 2015).

Two peaks give a number without an error. Here the line through the logarithms of all peaks above the noise gives both.
The record must hold one vibration: others are cut out around the strongest by Fourier transform first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from logger.modal.mode import Array, FoundMode, ModalResult

_BAND = (0.6, 1.4)  # of the strongest frequency
_FADED = 0.1  # of the first peak: what is below is left to the noise
_FEWEST_PEAKS = 4


@dataclass(frozen=True)
class Decrement:
    """Damping ratio and frequency [Hz] with standard deviations; times (n,) [s] and heights (n,) of the peaks used."""

    damping_ratio: float
    damping_std: float
    frequency_hz: float
    frequency_std_hz: float
    peak_s: Array
    peak_height: Array


def damping_of_two_peaks(first: float, later: float, cycles: int) -> float:
    """Eq 5.2: ln(first / later) / 2 pi cycles, for light damping."""
    return float(np.log(first / later) / (2 * np.pi * cycles))


def log_decrement(samples: Array, rate_hz: float) -> Decrement:
    """The strongest vibration of a free decay (n,).

    ValueError when fewer than four peaks rise above a tenth of the first.
    """
    wave, strongest_hz = _alone(samples, rate_hz)
    top = np.flatnonzero((wave[1:-1] > wave[:-2]) & (wave[1:-1] >= wave[2:]) & (wave[1:-1] > 0)) + 1
    edge = rate_hz / strongest_hz  # the cut rings at both ends
    top = top[(top > edge) & (top < len(wave) - edge)]
    faded = np.flatnonzero(wave[top] < _FADED * wave[top].max(initial=0.0)) if len(top) else np.empty(0, int)
    top = top[:faded[0]] if len(faded) else top
    if len(top) < _FEWEST_PEAKS:
        raise ValueError(f"expected at least {_FEWEST_PEAKS} peaks of one vibration, found {len(top)}")
    below, peak, above = wave[top - 1], wave[top], wave[top + 1]
    shift = 0.5 * (below - above) / (below - 2 * peak + above)
    height, time_s = peak - 0.25 * (below - above) * shift, (top + shift) / rate_hz
    (decrement, decrement_std), (period_s, period_std_s) = _slope(-np.log(height)), _slope(time_s)
    damped_hz = 1 / period_s
    ratio = decrement / np.hypot(2 * np.pi, decrement)
    return Decrement(float(ratio), float(decrement_std / (2 * np.pi)), float(damped_hz / np.sqrt(1 - ratio**2)),
                     float(period_std_s * damped_hz**2), time_s, height)


def decrement_mode(samples: Array, rate_hz: float) -> ModalResult:
    """The same as the only mode of a record of one channel. ValueError as ``log_decrement``."""
    found = log_decrement(samples, rate_hz)
    mode = FoundMode(found.frequency_hz, found.damping_ratio, found.frequency_std_hz, found.damping_std,
                     np.ones(1, np.complex128))
    return ModalResult((mode,), (), 0, f"logarithmic decrement (Eq 5.2) over {len(found.peak_s)} peaks")


def _alone(samples: Array, rate_hz: float) -> tuple[Array, float]:
    seen = np.fft.rfft(samples - samples.mean())
    frequency_hz = np.fft.rfftfreq(len(samples), 1 / rate_hz)
    strongest_hz = float(frequency_hz[1 + np.abs(seen[1:]).argmax()])
    inside = (frequency_hz > _BAND[0] * strongest_hz) & (frequency_hz < _BAND[1] * strongest_hz)
    return np.fft.irfft(np.where(inside, seen, 0), len(samples)), strongest_hz


def _slope(values: Array) -> tuple[float, float]:
    """Of the line through values at 0, 1, 2, ..., with its standard deviation."""
    index = np.arange(len(values)) - (len(values) - 1) / 2
    power = (index**2).sum()
    slope = (index @ values) / power
    left = values - values.mean() - slope * index
    return float(slope), float(np.sqrt((left**2).sum() / (len(values) - 2) / power))
