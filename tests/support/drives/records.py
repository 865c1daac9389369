"""Acceleration records as a recorder might write them, good and bad."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import butter, lfilter

FINE_HZ = 1000


def ride(seconds: float, rng: np.random.Generator, rms_mps2: float = 0.5, rate_hz: float = FINE_HZ) -> np.ndarray:
    """Body and wheels on a random road: bands about 1.5 and 11 Hz."""
    white = rng.standard_normal(int(seconds * rate_hz))
    bands = [lfilter(*butter(2, [f_hz - w_hz, f_hz + w_hz], "band", fs=rate_hz), white)
             for f_hz, w_hz in ((1.5, 0.5), (11, 3))]
    both = sum(band / band.std() for band in bands)
    return rms_mps2 * both / both.std()


def at(times_s: np.ndarray, fine: np.ndarray) -> np.ndarray:
    """A fine ride at other times [s]."""
    return np.interp(times_s, np.arange(len(fine)) / FINE_HZ, fine)


def rounded(values: np.ndarray, step: float) -> np.ndarray:
    return np.round(values / step) * step if step else values


def held(fine: np.ndarray, taken_s: np.ndarray, rate_hz: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Samples that were taken at some times and written, each until the next, ``rate_hz`` times a second."""
    t_s = np.arange(taken_s[0], taken_s[-1], 1 / rate_hz)
    return t_s, rounded(at(taken_s, fine), step)[np.searchsorted(taken_s, t_s + 1e-9, "right") - 1]


def write_record(path: Path, t_s: np.ndarray, **columns: np.ndarray) -> Path:
    """Columns by name after ``t_s``."""
    np.savetxt(path, np.column_stack([t_s, *columns.values()]), delimiter=",", comments="", fmt="%.7g",
               header=",".join(["t_s", *columns]))
    return path
