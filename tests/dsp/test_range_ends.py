"""Samples that stand at an end of the range, distinguished from the crests of a ride."""

from __future__ import annotations

import numpy as np
import pytest

from logger.dsp.repeated_samples import range_ends

from ..support.drives.records import FINE_HZ, ride, rounded


@pytest.mark.slow
def test_no_ride_and_no_sine_has_an_end() -> None:
    false = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        rate_hz = rng.choice([100, 200, 1000])
        values = ride(20, rng, 10 ** rng.uniform(-1, 0.7), rate_hz)
        values = rounded(values + rng.choice([0, 0.05]) * rng.standard_normal(len(values)),
                         rng.choice([0, 1e-3, 0.0383, 0.098, 0.613]))
        false += [seed] if range_ends(values) else []
    for f_hz in np.arange(0.5, 49, 0.37):
        for step in (0, 1e-4, 0.01, 0.1, 0.6):
            wave = 1.2 * np.sin(2 * np.pi * f_hz * np.arange(6000) / 100 + np.pi / 4)
            false += [f_hz] if range_ends(rounded(wave, step)) else []
    assert false == []


@pytest.mark.parametrize(("low", "high"), [(-3.0, 3.0), (-9.0, 3.0), (-2.5, 9.0)])
def test_ends_are_found_where_they_are(low: float, high: float) -> None:
    values = rounded(np.clip(ride(60, np.random.default_rng(1), 1.5)[:: FINE_HZ // 200], low, high), 0.01)
    found = {one.at: one.samples for one in range_ends(values)}
    assert found == {end: np.count_nonzero(np.abs(values - end) < 0.004) for end in (low, high) if abs(end) < 9}
