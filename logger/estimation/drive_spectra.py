"""What a drive tells of its car, kept small: spectra of short blocks of nearly steady speed.

Problem: what a car's springs and dampers are shows in how it answers waves of the road at many speeds, over hours of
driving whose readings nobody keeps. Solution: the readings are cut into blocks of a few seconds, half over each other,
and of each that was driven at nearly one speed only the power in some forty bands is kept. A car answers a road within
a second or two, so that a block's spectrum is the road's mean level in it times the car's gain; what was changes from
block to block.

The expected power of a band is linear in the spectrum of the readings: ``expected`` has its weights, those of the Hann
window included, so that a resonance which is narrower than the window biases nothing.
"""

from base64 import b64decode, b64encode
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from struct import pack
from typing import Any
from zlib import compress, decompressobj, error

import numpy as np
import numpy.typing as npt

from logger.arrays import AT_ONCE, Array, Bools, Rows
from logger.bounds import MOVING_MPS
from logger.dsp.resample import PASS_OF_RATE

BLOCK_S = 4.0
"""Bodies bounce at 1 to 2 Hz with 0.2 of critical damping and more: half a hertz of resolution (1.5 / BLOCK_S) shows
it; and a road of 20 to 40 m in town, 100 m outside, has about one level."""
LOWEST_HZ, HIGHEST_HZ = 0.75, 30.0
"""Below it a driver brakes and turns; above it a car with wheels at 10 to 15 Hz passes next to nothing."""
STEADY = 0.1
"""Standard deviation of the speed in a block as a share of it: the wheelbase's interference fades by what is known of
it (``spread``), the level is a mean."""
IMPULSIVE = 5.0
"""Kurtosis of the readings of a block in which a pothole or a step outweighs the road: 3 is that of a Gaussian road of
one level, 0.6 its standard deviation in a block, 12 that of a block that a pothole of a quarter second doubles."""
_WIDENING = 0.06  # of a band above 4 Hz, as a share: a tenth of the width of a wheel's resonance
_FINE = 2  # points of the model's spectrum for each bin: the window's autocorrelation is as long as two blocks
DRIVE_SPECTRA = "drive_spectra"
"""In a sidecar: what is kept of the drives of a session so that their car can be learned of them."""
MOST_KEPT = 256
"""Blocks of a drive in its sidecar: some 8 kB. Nine minutes of steady driving know a car to a few per cent."""
_FORM, _FLOOR = 1, 1e-8  # of what is kept; the least power [m2/s4 per Hz], 25 dB below the noise of the finest sensor

INDEPENDENT = 1 / (1 + 2 * ((2 / 3) ** 2 + (1 / 6) ** 2)) / (1 + 2 * (1 / 6) ** 2)
"""Independent values in a bin of a block: neighbours under a Hann window are correlated by 2/3 and 1/6, blocks half
over each other by 1/6 (F. Harris, Proceedings of the IEEE 66, 1978)."""


@dataclass(frozen=True, eq=False)
class DriveSpectra(Rows):
    """Blocks (b,) of one drive or several.

    speed_mps    mean of each, the window's squares its weights
    spread       standard deviation of the speed in each as a share, with the same weights: a steady rise has half of
                 that of all samples alike
    power        (b, k) mean one-sided spectrum in each of ``bands`` [m2/s4 per Hz]; NaN: the recorder does not pass it
    noise        (b,) known part of the readings' noise, as a spectrum: its sensor's and its steps' [m2/s4 per Hz]; NaN:
                 not known
    drive        (b,) number of the drive that each is from
    """

    speed_mps: Array
    spread: Array
    power: Array
    noise: Array
    drive: npt.NDArray[np.intp]

    def part(self, chosen: Bools | slice) -> "DriveSpectra":
        """Some of the blocks."""
        found = self.of(chosen)
        return replace(found, drive=np.unique(found.drive, return_inverse=True)[1])


def joined(drives: Sequence[DriveSpectra]) -> DriveSpectra:
    """Several drives together."""
    begins = np.cumsum([0, *(int(one.drive.max(initial=-1)) + 1 for one in drives[:-1])])
    return DriveSpectra.joined([replace(one, drive=one.drive + begin)
                                for one, begin in zip(drives, begins, strict=True)])


@cache
def bands() -> tuple[tuple[int, int], ...]:
    """First bin and the one behind the last of each band; bins are 1 / BLOCK_S apart."""
    found, first = [], round(LOWEST_HZ * BLOCK_S)
    while first <= HIGHEST_HZ * BLOCK_S:
        end = first + max(1, round(_WIDENING * (first - 4.0 * BLOCK_S) + 0.5))
        found.append((first, end))
        first = end
    return tuple(found)


@cache
def middles_hz() -> Array:
    """Middle of each band (k,) [Hz]."""
    return np.array([(first + end - 1) / 2 for first, end in bands()]) / BLOCK_S


@cache
def counts() -> Array:
    """Bins in each band (k,)."""
    return np.array([float(end - first) for first, end in bands()])


@cache
def grid_hz() -> Array:
    """Frequencies (f,) at which a model's spectrum is asked for, even."""
    last = (bands()[-1][1] + 3) * _FINE
    return np.arange(1, last + 1) / (_FINE * BLOCK_S)


@cache
def expected() -> Array:
    """Weights (k, f) of a spectrum at ``grid_hz`` in the expected power of each band."""
    at = grid_hz() * BLOCK_S  # in bins
    weights = np.zeros((len(bands()), len(at)))
    for row, (first, end) in zip(weights, bands(), strict=True):
        for one in range(first, end):
            row += _hann_kernel(at - one) / _FINE
    return weights / counts()[:, None]


def _hann_kernel(bins: Array) -> Array:
    """Squared gain of a Hann window so many bins beside its middle; its integral is 1."""
    amplitude = 0.5 * np.sinc(bins) + 0.25 * (np.sinc(bins - 1) + np.sinc(bins + 1))
    return np.asarray(amplitude**2 / 0.375)


def drive_spectra(accel_mps2: Array, speed_mps: Array, usable: Bools, rate_hz: float, noise: float = np.nan,
                  passed_hz: float = np.inf) -> DriveSpectra:
    """The blocks of a drive: samples (n,), evenly spaced, of the acceleration, the speed, and whether there is a
    reading.

    noise        spectrum of the part of the readings' noise that is known [m2/s4 per Hz]
    passed_hz    the recorder passes what is below
    """
    return _of_drive(*_blocks(accel_mps2, speed_mps, usable, rate_hz, passed_hz)[1:], noise)


def _of_drive(speed_mps: Array, spread: Array, power: Array, noise: float) -> DriveSpectra:
    return DriveSpectra(speed_mps, spread, power, np.full(len(power), noise), np.zeros(len(power), np.intp))


def _blocks(accel_mps2: Array, speed_mps: Array, usable: Bools, rate_hz: float, passed_hz: float = np.inf
            ) -> tuple[Array, Array, Array, Array]:
    """When each block begins (b,) [s], its speed [m/s] and the speed's spread (b,), and power (b, k)."""
    length = round(BLOCK_S * rate_hz)
    begins = np.arange(0, len(accel_mps2) - length + 1, length // 2)
    taper = np.hanning(length + 1)[:-1]
    under_taper = taper**2 / float(taper @ taper)
    scale = 2 / (rate_hz * float(taper @ taper))
    firsts = np.array([first for first, _ in bands()])
    last = bands()[-1][1]
    passes = middles_hz() + counts() / (2 * BLOCK_S) <= min(PASS_OF_RATE * rate_hz, passed_hz)
    kept = [(np.empty(0), np.empty(0), np.empty(0), np.empty((0, len(firsts))))]
    for some in np.split(begins, range(AT_ONCE, len(begins), AT_ONCE)):
        rows = some[:, None] + np.arange(length)
        speeds = speed_mps[rows]
        mean = speeds.mean(axis=1)
        good = usable[rows].all(axis=1) & (mean > MOVING_MPS) & (speeds.std(axis=1) < STEADY * mean)
        mean = speeds @ under_taper
        spread = np.sqrt((speeds - mean[:, None]) ** 2 @ under_taper)
        readings = accel_mps2[rows[good]]
        own = readings - readings.mean(axis=1, keepdims=True)
        powers = scale * np.abs(np.fft.rfft(own * taper)) ** 2
        padded = np.zeros((len(powers), last + 1))
        padded[:, :min(powers.shape[1], last)] = powers[:, :last]
        power = np.add.reduceat(padded[:, :last], firsts, axis=1) / counts()
        square = (own**2).mean(axis=1)
        shakes = (square > 0) & ((own**4).mean(axis=1) < IMPULSIVE * square**2)
        power[:, ~passes] = np.nan
        kept.append((some[good][shakes] / rate_hz, mean[good][shakes], (spread[good] / mean[good])[shakes],
                     power[shakes]))
    begin_s, mean, spread, power = (np.concatenate(parts) for parts in zip(*kept, strict=True))
    return begin_s, mean, spread, power


class SpectraKeeper:
    """Keeps the blocks of a long drive in little memory, as samples come.

    Problem: a logger drives for years, and what it keeps of a drive is a few kB. Solution: at most ``MOST_KEPT``
    blocks; of more, every second one is let go of, and from then on every second, fourth, eighth one is kept. A power
    is kept in steps of 1 dB, which is little beside its scatter (a band is a sum of few squares).

    rate_hz    of the samples
    noise      spectrum of the part of the readings' noise that is known [m2/s4 per Hz]
    """

    def __init__(self, rate_hz: float, noise: float) -> None:
        self._rate_hz, self._noise = rate_hz, noise
        self._half = round(BLOCK_S * rate_hz) // 2
        self._waiting: list[tuple[Array, Array, Bools]] = []
        self._taken = self._seen = 0  # samples; blocks
        self._every = 1
        self._kept: list[bytes] = []
        self._felt = np.zeros(2)  # sum of the readings, and how many

    def push(self, accel_mps2: Array, speed_mps: Array, usable: Bools) -> None:
        """Samples (n,) that follow those before, gravity in them."""
        self._waiting.append((accel_mps2, speed_mps, usable))
        self._felt += accel_mps2[usable].sum(), usable.sum()
        if sum(len(one) for one, _, _ in self._waiting) >= 2 * self._half:
            self._take(keep=self._half)

    def break_off(self) -> None:
        """The next samples do not follow."""
        self._take(keep=0)

    def _take(self, keep: int) -> None:
        if not self._waiting:
            return
        accel, speed, usable = (np.concatenate(parts) for parts in zip(*self._waiting, strict=True))
        whole = len(accel) // self._half * self._half
        begin_s, *blocks = _blocks(accel[:whole], speed[:whole], usable[:whole], self._rate_hz)
        for begin, mean, spread, power in zip(begin_s, *blocks, strict=True):
            if self._seen % self._every == 0:
                self._kept.append(_packed(self._taken / self._rate_hz + begin, mean, spread, power))
            self._seen += 1
            if len(self._kept) > MOST_KEPT:
                self._kept, self._every = self._kept[::2], 2 * self._every
        gone = whole - keep if keep else len(accel)
        self._taken += gone
        self._waiting = [(accel[gone:], speed[gone:], usable[gone:])] if keep else []

    def fields(self) -> dict[str, Any]:
        """What is kept, as JSON; ``spectra_of_fields`` reads it. Empty before the first block."""
        if not self._kept:
            return {}
        return {"form": _FORM, "noise": self._noise, "every": self._every, "blocks": len(self._kept),
                "felt_mps2": round(float(self._felt[0] / self._felt[1]), 2),
                "data": b64encode(compress(b"".join(self._kept))).decode("ascii")}


def _packed(begin_s: float, speed_mps: float, spread: float, power: Array) -> bytes:
    """A block: begin [s], speed [cm/s] and spread [0.1 %] as unsigned numbers of two bytes, the last of one, and the
    power of each band in dB over ``_FLOOR`` as one byte."""
    levels = np.clip(np.round(10 * np.log10(np.maximum(power, _FLOOR) / _FLOOR)), 0, 255).astype(np.uint8)
    return pack("<HHB", int(begin_s) % 65536, min(round(100 * speed_mps), 65535), min(round(1000 * spread), 255)
                ) + levels.tobytes()


def spectra_of_fields(fields: Any) -> DriveSpectra:
    """The blocks that ``SpectraKeeper.fields`` holds. ValueError for what it cannot have written."""
    if not isinstance(fields, dict) or fields.get("form") != _FORM:
        raise ValueError("expected spectra in a form that this version knows")
    noise, data = fields.get("noise"), fields.get("data")
    if not isinstance(noise, float) or not isinstance(data, str) or not 0 <= noise < np.inf:
        raise ValueError("expected noise and data")
    size = 5 + len(bands())
    try:
        reader = decompressobj()
        raw = reader.decompress(b64decode(data, validate=True), MOST_KEPT * size + 1)
    except (error, ValueError):
        raise ValueError("expected data that can be unpacked") from None
    if not raw or len(raw) % size or len(raw) > MOST_KEPT * size:
        raise ValueError("expected whole blocks")
    rows = np.frombuffer(raw, np.uint8).reshape(-1, size)
    speed, spread = rows[:, 2] + 256.0 * rows[:, 3], rows[:, 4].astype(float)
    if speed.min() < 100 * MOVING_MPS - 1:
        raise ValueError("expected speeds of a car that drives")
    return _of_drive(speed / 100, spread / 1000, _FLOOR * 10 ** (rows[:, 5:] / 10), noise)
