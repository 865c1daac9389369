"""What is said of how samples come: in bursts, by a clock that drifts, at another rate; and when they are dated."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from drivers.sample_clock import DatedSamples, UndatedSamples

SECONDS = 60


def dated(taken_us: npt.NDArray[np.float64], burst: int) -> tuple[DatedSamples, float, float]:
    """Samples that come ``burst`` at a time, each burst up to 3 ms late: the queue, and of the dated ones, without the
    first half, the r.m.s. error and the greatest age [ms], [s]."""
    samples = DatedSamples(100, 0.02)
    rng = np.random.default_rng(4)
    found, age_s = [], []
    for end in range(burst, len(taken_us) + 1, burst):
        now_us = int(taken_us[end - 1] + rng.uniform(0, 3000))
        samples.add(UndatedSamples(False, np.full(burst, now_us), np.ones((burst, 3)), np.zeros(burst, bool),
                            np.ones(burst, bool)))
        times_us = samples.take().t_us
        found.append(times_us)
        if len(times_us):
            age_s.append((now_us - times_us[0]) / 1e6)
    times_us = np.concatenate(found)
    error_us = (times_us - taken_us[: len(times_us)])[len(times_us) // 2 :]
    return samples, float(np.sqrt(np.mean(error_us**2))) / 1e3, max(age_s[len(age_s) // 2 :])


def even(rate_hz: float) -> npt.NDArray[np.float64]:
    return np.arange(SECONDS * rate_hz) * (1e6 / rate_hz) + 5e6


@pytest.mark.slow
@pytest.mark.parametrize("burst", [1, 10])
def test_nothing_is_said_of_samples_that_come_as_they_are_taken(burst: int) -> None:
    samples, error_ms, _ = dated(even(100.2), burst)
    assert (samples.doubt("Look."), samples.note) == ("", "")
    assert error_ms < 1


@pytest.mark.parametrize("burst", [25, 40])
def test_bursts_that_do_no_harm_are_reported_and_dated_in_time(burst: int) -> None:
    samples, error_ms, age_s = dated(even(100), burst)
    assert samples.doubt("Look.") == ""
    assert "at a time" in samples.note and "nothing needs to be done" in samples.note
    assert samples.burst_s == pytest.approx(burst / 100, rel=0.1)
    assert error_ms < 1
    assert age_s < 1.9  # what is older than 2 s is given up


@pytest.mark.parametrize("burst", [50, 100, 200])
def test_bursts_that_come_too_late_are_a_doubt_with_advice(burst: int) -> None:
    samples, _, age_s = dated(even(100), burst)
    assert age_s > 1.9
    assert f"{burst / 100:.1g} s at a time" in samples.doubt("Look.")
    assert "three times a second" in samples.doubt("Look.")


def test_a_clock_that_drifts_is_reported_and_followed() -> None:
    rate_hz = 100 * (1 + 0.012 * np.linspace(0, 1, 6000))
    samples, error_ms, _ = dated(np.cumsum(1e6 / rate_hz), 5)
    assert samples.doubt("Look.") == ""
    assert "drifts: 100." in samples.note
    assert error_ms < 1


def test_another_rate_is_reported_with_what_it_may_mean() -> None:
    samples, error_ms, _ = dated(even(147), 5)
    assert "147.0 samples a second where 100 are expected" in samples.note
    assert "lost on the way" in samples.note
    assert error_ms < 1
