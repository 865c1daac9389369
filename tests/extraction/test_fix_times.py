"""Fixes on the recorder's clock."""

from __future__ import annotations

import numpy as np

from logger.extraction.fix_times import fix_times_s


def arrived(count: int = 600, drift: float = 20e-6, seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """When fixes were true by the recorder's clock, when they came, and what time of day they name, over midnight."""
    rng = np.random.default_rng(seed)
    gps_s = 86_400 - 300.0 + np.arange(count)
    true_s = (gps_s - gps_s[0]) * (1 + drift) + 50
    return true_s, true_s + 0.2 + np.abs(rng.normal(0, 0.03, count)), gps_s % 86_400


def test_waits_are_taken_out_and_a_clock_that_drifts_is_followed() -> None:
    true_s, arrival_s, named_s = arrived()
    assert np.abs(fix_times_s(arrival_s, named_s, 0.2) - true_s).max() < 0.005


def test_a_wrong_time_is_placed_by_its_arrival() -> None:
    true_s, arrival_s, named_s = arrived()
    named_s[300] += 7.0
    found = fix_times_s(arrival_s, named_s, 0.2)
    assert np.abs(found - true_s).max() < 0.12
    assert found[300] == arrival_s[300] - 0.2


def test_without_times_the_arrival_has_to_do() -> None:
    _, arrival_s, named_s = arrived(5)
    assert np.allclose(fix_times_s(arrival_s, np.full(len(named_s), np.nan), 0.1), arrival_s - 0.1)
