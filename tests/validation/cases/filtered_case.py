"""Cases of the examination whose records somebody has low-passed before they came to the lab.

The filter is Butterworth's, run on the samples of the record (scipy): once, so that it delays, or forth and back. The
sensor's noise went through it, or arose behind it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt, sosfiltfilt

from ..simulator.recorder import RATE_HZ
from .random_case import Case, generator

Array = NDArray[np.float64]

CUTOFF_HZ, ORDERS = (8.0, 40.0), (2, 3, 4, 6, 8)
NEAR = 0.15
"""A cut-off that is named has to be so near the true one, as a share; of whatever order it was taken for, it is where
the amplitude has fallen by 3 dB."""
LOW_PASS = "sensor_bandwidth"


@dataclass(frozen=True)
class Filter:
    """What somebody did to the records."""

    cutoff_hz: float
    order: int
    causal: bool
    noise_behind: bool

    def __str__(self) -> str:
        return (f"{'causal' if self.causal else 'zero phase'}, order {self.order}, {self.cutoff_hz:.1f} Hz, noise "
                f"{'behind' if self.noise_behind else 'in front'}")

    def __call__(self, samples: Array) -> Array:
        sections = butter(self.order, self.cutoff_hz, fs=RATE_HZ, output="sos")
        return np.asarray(sosfilt(sections, samples) if self.causal else sosfiltfilt(sections, samples))


def draw_filter(kind: str, seed: int) -> Filter:
    """Causal ones and others take turns."""
    rng = generator(f"filtered {kind}", seed, None)
    return Filter(float(np.exp(rng.uniform(*np.log(CUTOFF_HZ)))), int(rng.choice(ORDERS)), seed % 2 == 0,
                  bool(rng.random() < 0.3))


def filtered(made: Case, by: Filter) -> Case:
    """A case with its records filtered."""
    rng = generator("noise behind a filter", made.seed, None)
    return replace(made, recordings=tuple(
        replace(run, accel_z_mps2=made.noise.add(by(run.clean_mps2), rng) if by.noise_behind else by(run.accel_z_mps2))
        for run in made.recordings))


def wrong_names(by: Filter, hidden: set[str], said: dict[str, dict[str, float]]) -> list[str]:
    """Names of a verdict (numbers by name) that neither the truth nor the filter accounts for."""
    return [name for name, numbers in said.items()
            if name not in hidden and not (name == LOW_PASS and by.causal
                                           and abs(numbers["cutoff_hz"] / by.cutoff_hz - 1) <= NEAR)]
