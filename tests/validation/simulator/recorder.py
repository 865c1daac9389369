"""From the motion of the car to the columns of a run: sensor, anti-alias filter, sampling, noise, rounding.

Problem: a recorder keeps nothing above half its sampling rate and adds errors of its own; a simulator that samples its
fine steps every 10 ms lets stick-slip and stops fold back into the band.

Solution: the mean acceleration over every fine step, (v[k+1] - v[k]) / h, counts as its value at mid-step. The sensor's
own dynamics act on this fine signal. A Kaiser-windowed sinc (flat to 38 Hz, 70 dB down at 50 Hz), evaluated at whatever
instants are wanted, filters and samples it in one sum, so that a delay need not be a whole number of steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

Array = NDArray[np.float64]

RATE_HZ = 100
HUNDREDTH_G_MPS2 = 0.0980665
REACH_S = 0.19  # half the length of the anti-alias filter
_CUTOFF_HZ = 44.0
_FINER = 5
_KAISER_BETA = 6.76  # 70 dB (Kaiser, 1974)


@dataclass(frozen=True)
class Sensor:
    """What stands between the body and the recorder; the defaults pass everything."""

    mount_hz: float = 0.0
    mount_zeta: float = 0.0
    cutoff_hz: float = 0.0
    order: int = 1
    gain: float = 1.0
    delay_s: float = 0.0
    clip_mps2: float = np.inf
    drift: float = 0.0  # of the gain, in a minute: a sensor does not know how long a run will last
    engine_mps2: float = 0.0
    engine_hz: float = 0.0
    engine_wander: float = 0.0
    engine_phase: float = 0.0
    held_mps2: float = np.inf  # a loose sensor leaves its seat where the body falls away faster
    soft_mps2: float = np.inf  # tanh saturates towards it
    offset_mps2: float = 0.0  # at the start; it decays
    offset_s: float = 1.0


@dataclass(frozen=True)
class Noise:
    """White noise and rounding; ``step_mps2`` 0 rounds only as the file does. ``filtered``: the noise arises before the
    anti-alias filter, and goes through it."""

    white_mps2: float
    step_mps2: float
    filtered: bool = False

    def add(self, clean: Array, rng: np.random.Generator) -> Array:
        noisy = clean + self.white_mps2 * self._unit(clean.size, rng)
        return self.step_mps2 * np.round(noisy / self.step_mps2) if self.step_mps2 else noisy

    def _unit(self, count: int, rng: np.random.Generator) -> Array:
        """Noise whose density in the band is that of white noise of deviation 1."""
        if not self.filtered:
            return rng.standard_normal(count)
        step_s = 1 / (_FINER * RATE_HZ)
        reach = int(np.ceil(REACH_S / step_s))
        fine = np.sqrt(_FINER) * rng.standard_normal(_FINER * count + 2 * reach)
        return band_limited(fine, -reach * step_s, step_s, np.arange(count) / RATE_HZ)


@njit(cache=True, error_model="numpy")
def _filter_and_sample(fine, first_s, step_s, at_s, window, cutoff_hz, reach_s):
    out = np.zeros(at_s.size)
    half = (window.size - 1) / 2
    for i in range(at_s.size):
        low = max(0, int(np.ceil((at_s[i] - reach_s - first_s) / step_s)))
        high = min(fine.size - 1, int(np.floor((at_s[i] + reach_s - first_s) / step_s)))
        total = 0.0
        turn = 2 * np.pi * cutoff_hz * step_s
        lag = first_s + low * step_s - at_s[i]
        angle = 2 * np.pi * cutoff_hz * lag
        c, s, re, im = np.cos(turn), np.sin(turn), np.cos(angle), np.sin(angle)
        for j in range(low, high + 1):
            lag = first_s + j * step_s - at_s[i]
            place = half + lag / reach_s * half
            cell = min(int(place), window.size - 2)
            taper = window[cell] + (place - cell) * (window[cell + 1] - window[cell])
            tap = taper * (im / lag if abs(lag) > 1e-9 else 2 * np.pi * cutoff_hz)
            total += tap * fine[j]
            re, im = c * re - s * im, s * re + c * im
        out[i] = total * step_s / np.pi
    return out


def band_limited(fine: Array, first_s: float, step_s: float, at_s: Array) -> Array:
    """A fine signal, first sample at ``first_s``, filtered and taken at ``at_s``; silence beyond its ends."""
    window = np.kaiser(4001, _KAISER_BETA)
    return _filter_and_sample(fine, first_s, step_s, at_s, window, _CUTOFF_HZ, REACH_S)


def _through(numerator: list[float], denominator: list[float], signal: Array, step_s: float) -> Array:
    """A continuous filter on a signal that is straight between its samples: exact at the samples."""
    b, a, _ = cont2discrete((numerator, denominator), step_s, method="foh")
    return lfilter(b.ravel(), a, signal)


@njit(cache=True, error_model="numpy")
def _loose(body_mps2, held_mps2, step_s):
    """The acceleration of a mass that is held down on the body by a constant force and lands without a bounce."""
    out = body_mps2.copy()
    gap = apart = 0.0
    flies = False
    for k in range(body_mps2.size):
        if not flies and body_mps2[k] < -held_mps2:
            flies, gap, apart = True, 0.0, 0.0
        if flies:
            apart += (-held_mps2 - body_mps2[k]) * step_s
            gap += apart * step_s
            out[k] = -held_mps2
            if gap <= 0:
                out[k], flies = body_mps2[k] - apart / step_s, False
    return out


def sense(acceleration: Array, step_s: float, sensor: Sensor, first_s: float) -> Array:
    """The sensor's output from the acceleration [m/s2] of the place where it is mounted, both fine."""
    signal = acceleration
    at = first_s + step_s * np.arange(signal.size)
    if sensor.engine_mps2:
        slow = sensor.engine_wander * np.sin(2 * np.pi * 0.05 * at)
        phase = 2 * np.pi * sensor.engine_hz * (at + slow) + sensor.engine_phase
        signal = signal + sensor.engine_mps2 * np.sqrt(2) * np.sin(phase)
    if np.isfinite(sensor.held_mps2):
        signal = _loose(signal, sensor.held_mps2, step_s)
    if sensor.mount_hz:
        omega = 2 * np.pi * sensor.mount_hz
        signal = _through([2 * sensor.mount_zeta * omega, omega**2],
                          [1.0, 2 * sensor.mount_zeta * omega, omega**2], signal, step_s)
    if sensor.cutoff_hz:
        omega = 2 * np.pi * sensor.cutoff_hz
        below = [1.0, omega] if sensor.order == 1 else [1.0, np.sqrt(2) * omega, omega**2]
        signal = _through([below[-1]], below, signal, step_s)
    gain = sensor.gain
    if sensor.drift:
        gain = gain * (1 + sensor.drift * np.maximum(at, 0.0) / 60.0)
    if np.isfinite(sensor.soft_mps2):
        signal = sensor.soft_mps2 * np.tanh(signal / sensor.soft_mps2)
    if sensor.offset_mps2:
        signal = signal + sensor.offset_mps2 * np.exp(-np.maximum(at, 0.0) / sensor.offset_s)
    return np.clip(gain * signal, -sensor.clip_mps2, sensor.clip_mps2)


def record(rates_mps: Array, step_s: float, first_s: float, sensor: Sensor, at_s: Array) -> Array:
    """Noise-free recorded acceleration [m/s2] at ``at_s`` from the rates (N + 1,) [m/s] of the sensor's place."""
    acceleration = np.diff(rates_mps) / step_s
    middle_s = first_s + 0.5 * step_s
    sensed = sense(acceleration, step_s, sensor, middle_s)
    return band_limited(sensed, middle_s, step_s, at_s - sensor.delay_s)
