"""The noise floor: found where it is white, where it went through the recorder's filter, and never below accuracy; and
what is above it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import firwin

from logger.lab.likelihood.noise_floor import (
    UNEXPLAINED,
    excess_over_noise,
    floor_error,
    gain_of_full_explanation,
    sensor_noise,
    sensor_noise_of,
)
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.whittle import DISCREPANCY, Bands
from logger.runs import UNKNOWN, RecordFacts

from ...support.lab.noisy_runs import posterior_of
from ...support.lab.runs_with_residual import a_run, measuring

Array = npt.NDArray[np.float64]
LEVEL = 0.05


@cache
def predicted(samples: int) -> tuple[Posterior, State]:
    run = a_run("run", 12.0, samples / 100.0, 3)
    posterior = posterior_of([measuring(run, np.ones(run.count))])
    return posterior, posterior.start()


def leaving(*residuals: Array, facts: Sequence[RecordFacts] = ()) -> tuple[Posterior, State]:
    """A model that leaves these residuals (n,), each of a run."""
    runs, predictions = [], []
    for number, residual in enumerate(residuals):
        posterior, state = predicted(len(residual))
        (run,), (prediction,) = posterior.runs.runs, state.predictions
        measured = measuring(run, prediction + residual)
        runs.append(replace(measured, name=f"run{number}", facts=facts[number] if facts else UNKNOWN))
        predictions.append(prediction)
    there = posterior_of(runs)
    start = there.start()
    return there, replace(start, predictions=predictions)


def white(samples: int = 6000, seed: int = 1, level: float = LEVEL) -> Array:
    return np.random.default_rng(seed).normal(0, level, samples)


def filtered(samples: Array, cut_hz: float = 42.0) -> Array:
    return np.convolve(samples, firwin(101, cut_hz, fs=100.0), "same")


def in_band(samples: Array, low_hz: float, high_hz: float) -> Array:
    return np.convolve(samples, firwin(201, (low_hz, high_hz), fs=100.0, pass_zero=False), "same")


def a_band(samples: int) -> Bands:
    run = a_run("run", 12.0, samples / 100.0, 3)
    return Bands(run)


@pytest.mark.parametrize("cut_hz", [None, 42.0])
def test_noise_is_found_before_and_behind_the_recorders_filter(cut_hz: float | None) -> None:
    noise = white() if cut_hz is None else filtered(white(), cut_hz)
    posterior, state = leaving(noise)
    found = sensor_noise_of(posterior, state)
    assert found.deviation_mps2 == pytest.approx(LEVEL, rel=0.05)
    assert floor_error(posterior, found) == pytest.approx(found.deviation_mps2 / posterior.size_mps2)


def test_the_standard_error_of_white_noise_holds() -> None:
    bands = a_band(2200)
    found = [sensor_noise([bands], [white(2200, seed)], 0.0) for seed in range(60)]
    off = np.array([(one.deviation_mps2 - LEVEL) / one.standard_error_mps2 for one in found])
    assert np.sqrt((off**2).mean()) == pytest.approx(1.0, abs=0.3)


def test_no_noise_is_taken_for_less_than_simulations_are_accurate() -> None:
    posterior, state = leaving(white(level=1e-9))
    assert sensor_noise_of(posterior, state).deviation_mps2 == pytest.approx(DISCREPANCY * posterior.size_mps2)


def test_filtered_noise_is_not_taken_for_as_little_as_its_quietest_band() -> None:
    lows, found, bands = [], [], a_band(3000)
    for seed in range(12):
        noise = filtered(white(3000, seed))
        found.append(sensor_noise([bands], [noise], 0.0).deviation_mps2)
        lows.append(np.sqrt(min(bands.power(noise))))
    assert np.mean(lows) < 0.045
    assert np.mean(found) == pytest.approx(LEVEL, rel=0.02)


def test_what_is_louder_than_filtered_noise_is_no_noise() -> None:
    loud = in_band(white(12_000, 2, 0.1), 4.0, 20.0)
    found = sensor_noise([a_band(12_000)], [filtered(white(12_000) + loud)], 0.0)
    assert found.deviation_mps2 == pytest.approx(LEVEL, rel=0.05)


def test_where_no_fit_was_made_only_flat_noise_is_taken_for_noise_that_was_filtered() -> None:
    bands = [a_band(6000)]
    flat = sensor_noise(bands, [filtered(white())], 0.0, fitted=False)
    assert flat.deviation_mps2 == pytest.approx(LEVEL, rel=0.05)
    falling = np.convolve(filtered(white()), 0.8 ** np.arange(40), "same")
    assert sensor_noise(bands, [falling], 0.0, fitted=False).deviation_mps2 < 0.2 * np.std(falling)


@pytest.mark.parametrize(("share", "unexplained"), [(0.0, False), (0.3, False), (0.8, True), (2.0, True)])
def test_what_is_above_the_noise_is_recognised_by_its_share(share: float, unexplained: bool) -> None:
    """White noise and more of it in the bands below 20 Hz, about half of them."""
    more = in_band(white(6000, 2, share * LEVEL), 0.5, 20.0)
    posterior, state = leaving(white() + more)
    above = excess_over_noise(posterior, state, 1e-3)
    expected = np.sqrt(1 + share**2 * 19.5 / 37.0) - 1
    assert above == pytest.approx(expected, abs=0.04)
    assert (above > UNEXPLAINED) == unexplained
    assert (gain_of_full_explanation(posterior, state) > 0) == unexplained


@pytest.mark.slow
def test_noise_alone_is_hardly_ever_unexplained_however_short_a_run_is() -> None:
    """Beside a long one, which tells the noise."""
    times = 0
    for seed in range(40):
        posterior, state = leaving(white(500, seed), white(6000, seed + 100))
        times += excess_over_noise(posterior, state, 1e-3) > UNEXPLAINED
    assert times == 0


def test_each_sensor_has_a_noise_of_its_own() -> None:
    """A coarse, loud sensor beside a quiet one: neither leaves more than its noise; one kind of both would."""
    residuals = [white(level=0.25), white(seed=2)]
    posterior, state = leaving(*residuals, facts=[RecordFacts(range_mps2=20.0), RecordFacts(range_mps2=40.0)])
    assert excess_over_noise(posterior, state, 1e-3) < UNEXPLAINED
    noise = sensor_noise_of(posterior, state)
    assert noise.deviation_mps2 == pytest.approx(np.sqrt((0.25**2 + LEVEL**2) / 2), rel=0.05)
    assert gain_of_full_explanation(posterior, state) == 0
    posterior, state = leaving(*residuals)
    assert excess_over_noise(posterior, state, 1e-3) > UNEXPLAINED


def test_what_two_right_simulations_differ_by_is_not_above_the_noise() -> None:
    _, state = predicted(6000)
    signal = state.predictions[0]
    posterior, there = leaving(0.9 * DISCREPANCY * signal + white(level=1e-3 * float(signal.std())))
    assert excess_over_noise(posterior, there, 1e-3) < UNEXPLAINED


@pytest.mark.parametrize(("share", "unexplained"), [(0.012, False), (0.03, True)])
def test_what_a_calibrated_sensor_may_be_off_by_is_not_above_the_noise(share: float, unexplained: bool) -> None:
    """Its gain is known to half a per cent, and three of these are usual."""
    _, state = predicted(6000)
    signal = state.predictions[0]
    size = float(signal.std())
    posterior, there = leaving(share * size * (signal**2 / size**2 - 1) / np.sqrt(2) + white(level=1e-3 * size))
    assert (excess_over_noise(posterior, there, 1e-3) > UNEXPLAINED) == unexplained
