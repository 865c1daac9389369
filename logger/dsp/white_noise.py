"""Samples of a motion without the white noise of the sensor that took them.

Problem: who derives a velocity from a place that was read multiplies the sensor's noise by the frequency. 20 um of it
at 500 samples a second are 12 mm/s, and a damper that rubs looks as if its force rose over as much. Solution: noise is
as loud at all frequencies, what moves is not. A plateau at the bottom of the spectrum is noise; each frequency keeps
the share of its power that lies above it (N. Wiener, Extrapolation, Interpolation, and Smoothing of Stationary Time
Series, 1949). Where the spectrum has no plateau nothing is changed.

A hum is no plateau, and a record of a second shows none. But what answers the motion tells (``answered``): where a part
whose ends a bench moves pulls with far less than its stiffness and damping make of the samples, and not in step with
them either, they hold noise.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array, Complex
from logger.bounds import CONFLICT_SIGMA

_BANDS, _LEAST_BANDS = 32, 16
"""Of so many bands at least so many are equally loud where they are noise. Half: the spectrum of a random walk, as of a
road, is flat in its last third to what a record shows, being 1 / sin^2 of the frequency (pi at the rate)."""
_MOST_SHARE = 0.03
"""Of the whole deviation, that noise is of no sensor which measures what drives a rig: a louder plateau is a motion
that was made so, as white noise is on shakers. A judgement."""
_NEAR = 20
"""The power at a frequency is the mean of so many on either side, of half a period of the record each."""
_UNANSWERED, _IN_STEP, _FAR_LESS = 0.25, 0.5, 1e-3
"""Noise has less than so much of the answer's power that it would have as a motion, and less than that coherence with
it; with far less it is noise though a hum is coherent with its own trace: a thousandth of the power is lost at most.
Judgements. (A spring that a damper works through takes as much from a motion, but leaves it in step.)"""
EQUAL_SIGMA = 2.5
"""Bands are equally loud up to so many standard deviations of their difference: of 20 bands of noise one is louder by
chance in eight cases (normal distribution, one-sided)."""

OF_QUIETEST = (EQUAL_SIGMA + 2.0) / 2**0.5
"""The same where the first is the quietest of all: of twenty that is two of its own standard deviations below the
others by chance."""


def pooled(levels: Iterable[tuple[float, float]], power: float, freedom: float, louder: float = EQUAL_SIGMA
           ) -> tuple[float, float]:
    """Mean power of what has a power and so many degrees of freedom, and of the bands that are no louder.

    levels    power and degrees of freedom of each band, the quietest first
    louder    as ``EQUAL_SIGMA``, of the first band
    """
    for level, n in levels:
        if level > power * (1 + louder * np.sqrt(2 / n + 2 / freedom)):
            break
        power, freedom, louder = (power * freedom + level * n) / (freedom + n), freedom + n, EQUAL_SIGMA
    return power, freedom


@dataclass(frozen=True, eq=False)
class Denoised:
    """Samples (n,) without their white noise, its standard deviation, 0 where they show none, and the shares (n,) of
    their amplitudes that were kept, by frequency."""

    samples: Array
    deviation: float
    gain: Array

    def left(self, *draw: int) -> Array:
        """Noise (n,) like what is still in the samples, one draw of it by its numbers."""
        drawn = _spectrum(np.random.default_rng(draw).normal(0.0, self.deviation, len(self.samples)))
        return _odd_samples(drawn * np.sqrt(self.gain))


def answered(samples: Array, answer: Array, rate_hz: float, up_to_hz: float) -> Array:
    """Shares (n,) of the amplitudes of samples (n,), by frequency as ``Denoised``'s, that may be motion, given the
    force (n,) with which a spring and a damper, or what is like them, answer it; all of them above ``up_to_hz``."""
    count = len(samples)
    if not np.ptp(samples):
        return np.ones(count)
    f_hz = np.fft.rfftfreq(count, 1 / rate_hz)
    # The rate is windowed as the motion is: far from a loud tone the window's own trace times 2 pi i f is no rate. Its
    # differences over two samples make little of quick motions, so that of these less is taken for noise.
    moved, quick, found = (np.fft.rfft(np.hanning(count) * (one - np.linspace(one[0], one[-1], count)))
                           for one in (samples, rate_hz * np.gradient(samples), answer))
    stiff, damped = (float(np.vdot(one, found).real / np.vdot(one, one).real) for one in (moved, quick))
    expected = stiff * moved + damped * quick
    power, own, cross = (_local(one, _NEAR // 2) for one in (
        np.abs(expected) ** 2, np.abs(found) ** 2, expected.conj() * found))
    tiny = np.finfo(float).tiny
    share, in_step = own / (power + tiny), np.abs(cross) ** 2 / (power * own + tiny)
    is_noise = (share < _UNANSWERED) & ((in_step < _IN_STEP) | (share < _FAR_LESS)) & (f_hz < up_to_hz)
    gain = np.interp(np.arange(count) * rate_hz / (2 * (count - 1)), f_hz, np.where(is_noise, share, 1.0))
    line = np.linspace(samples[0], samples[-1], count)
    lost = _odd_samples(_spectrum(samples - line) * (1 - gain))
    return gain if lost.std() <= _MOST_SHARE * samples.std() else np.ones(count)


def without_white_noise(samples: Array, most: Array | None = None) -> Denoised:
    """Samples (n,) without their white noise, and no more of each frequency than ``most`` says (n,)."""
    count = len(samples)
    line = np.linspace(samples[0], samples[-1], count)
    spectrum = _spectrum(samples - line)
    as_they_are = Denoised(samples if most is None else line + _odd_samples(spectrum * most), 0.0, np.zeros(count))
    if count <= _BANDS * _NEAR:
        return as_they_are
    power = np.abs(spectrum)**2 / (2 * count)
    bands = np.array_split(power[1:], _BANDS)
    # A spectrum of an odd curve has one number at each frequency.
    levels = sorted((float(one.mean()), float(len(one))) for one in bands)
    noise, freedom = pooled(levels[1:], *levels[0], OF_QUIETEST)
    if freedom < _LEAST_BANDS * levels[0][1] or not 0 < noise <= _MOST_SHARE**2 * float(power[1:].mean()):
        return as_they_are
    local = _local(power, _NEAR)
    is_above = local > noise * (1 + CONFLICT_SIGMA * np.sqrt(2 / (2 * _NEAR + 1)))
    gain = np.where(is_above, 1 - noise / np.maximum(local, noise), 0.0)
    gain = gain if most is None else np.minimum(gain, most)
    return Denoised(line + _odd_samples(spectrum * gain), float(np.sqrt(noise)), gain)


def _local(values: Array | Complex, near: int) -> Array:
    """The mean of each of some values (k,) and of so many on either side."""
    return np.convolve(np.pad(values, near, mode="reflect"), np.full(2 * near + 1, 1 / (2 * near + 1)), mode="valid")


def _spectrum(samples: Array) -> Complex:
    """Spectrum (n,) of samples that go on oddly at both ends."""
    return np.fft.rfft(np.concatenate([samples, -samples[-2:0:-1]]))


def _odd_samples(spectrum: Complex) -> Array:
    """Samples (n,) of such a spectrum."""
    return np.fft.irfft(spectrum, 2 * (len(spectrum) - 1))[: len(spectrum)]
