"""Drifts that are made are found again, by their form and numbers; where there is none, none is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from logger.lab.residuals.unexplained import Drift, drift_of
from logger.profiles.track import Track
from logger.runs import RecordFacts, Run

NOISE_MPS2 = 0.03
Array = np.ndarray
RNG = np.random.default_rng(2007)


def a_run(lasts_s: float) -> Run:
    count = round(100 * lasts_s)
    return Run("one", 100.0, np.zeros(count), 0.1 * np.arange(count), np.full(count, 10.0), Track(0.1, np.zeros(9)))


def found_in(curve: Callable[[Array], Array], lasts_s: float = 50.0, seed: int = 2001) -> Drift:
    run = a_run(lasts_s)
    noise = np.random.default_rng(seed).normal(0, NOISE_MPS2, run.count)
    return drift_of(run, curve(run.time_s) + noise, NOISE_MPS2)


@pytest.mark.parametrize(("form", "curve", "size", "time_s"), [
    ("exponential", lambda t: 0.28 * np.exp(-t / 9), 0.28, 9.0),
    ("exponential", lambda t: 0.1 - 0.5 * np.exp(-t / 4), -0.5, 4.0),
    ("ramp", lambda t: 0.4 * t / 50 - 0.2, 0.4, None),
    ("step", lambda t: 0.28 * (t > 23), 0.28, 23.0),
    ("offset", lambda t: np.full(len(t), -0.05), -0.05, None),
])
def test_a_form_is_recognised_with_its_numbers(form: str, curve: Callable[[Array], Array], size: float,
                                               time_s: float | None) -> None:
    found = found_in(curve)
    assert found.form == form and found.found
    assert found.size_mps2 == pytest.approx(size, rel=0.08)
    assert found.time_s is None if time_s is None else found.time_s == pytest.approx(time_s, rel=0.1)
    time = a_run(50.0).time_s
    off = (found.curve_mps2 - curve(time))[(time > 2) & (np.abs(time - 23) > 0.5)]
    assert np.abs(off).max() < 0.03


def test_a_random_walk_is_followed() -> None:
    walk = np.cumsum(RNG.normal(0, 0.28 / np.sqrt(5000), 5000))
    found = found_in(lambda t: walk[: len(t)])
    assert found.form == "wander" and found.size_mps2 == pytest.approx(np.sqrt(np.mean(walk[200:] ** 2)), rel=0.1)
    assert np.std((found.curve_mps2 - walk)[200:]) < 0.2 * walk[200:].std()


@pytest.mark.slow
def test_noise_alone_hardly_ever_drifts() -> None:
    assert sum(found_in(np.zeros_like, 30.0, seed).found for seed in range(2000, 2099)) <= 1


def test_a_bounce_of_the_body_is_no_drift() -> None:
    assert not found_in(lambda t: 0.3 * np.sin(2 * np.pi * 1.1 * t) * (1 + np.sin(t / 5))).found


def test_what_is_not_compared_below_a_frequency_shows_no_drift() -> None:
    run = replace(a_run(30.0), facts=RecordFacts(pass_band_hz=(0.5, 40.0)))
    assert not drift_of(run, 0.5 * np.exp(-run.time_s / 5), NOISE_MPS2).found
