"""Lags of a measurement behind a model, window by window: a late clock, a wrong place and a wrong speed are
distinguished, with the numbers that they have."""

from __future__ import annotations

from dataclasses import astuple, replace
from functools import cache

import numpy as np
import numpy.typing as npt
import pytest

from logger.lab.likelihood.lag import WINDOW_S, Trend, constant_lag, lag_drift, lags, offset_by_lag_m
from logger.runs import Run
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose

from ...support.lab.runs_with_residual import CAR, RATE_HZ, a_run, measuring
from ...support.lab.secret_runs import FINE_HZ, NOISE_MPS2

Array = npt.NDArray[np.float64]


@cache
def driven(lasts_s: float = 30.0, speeds_mps: tuple[float, ...] = (8.0, 20.0)) -> tuple[list[Run], list[Array]]:
    """Drives and what a model predicts of them."""
    runs = [a_run(f"run{i}", speed, lasts_s, i) for i, speed in enumerate(speeds_mps)]
    return runs, SimulatedRuns(runs, FINE_HZ).predict(compose(CAR))


def recorded(runs: list[Run], predictions: list[Array], late_s: float = 0.0, late_m: float = 0.0,
             seed: int = 1) -> list[Run]:
    """Measurements of what the model predicts, so much later, with noise."""
    rng = np.random.default_rng(seed)
    return [measuring(run, np.interp(run.time_s - late_s - late_m / run.speed_mps, run.time_s, one)
                      + rng.normal(0, NOISE_MPS2, run.count)) for run, one in zip(runs, predictions, strict=True)]


@pytest.mark.parametrize("late_s", [0.03, -0.045, 0.25])
def test_a_late_clock_is_one_time(late_s: float) -> None:
    runs, predictions = driven()
    time, _, is_time = constant_lag(lags(recorded(runs, predictions, late_s=late_s), predictions))
    assert is_time
    assert time.value == pytest.approx(late_s, abs=max(5 * time.error, 1e-3))
    assert time.error < 2e-3 and time.p_value < 1e-6


@pytest.mark.parametrize("late_m", [0.25, -0.4])
def test_a_wrong_place_is_one_length(late_m: float) -> None:
    runs, predictions = driven()
    _, length, is_time = constant_lag(lags(recorded(runs, predictions, late_m=late_m), predictions))
    assert is_time is False
    assert length.value == pytest.approx(late_m, rel=0.05)


def test_at_one_speed_a_time_and_a_length_are_the_same() -> None:
    run = a_run("run", 12.0, 20.0, 3, swing=0.02)
    predictions = SimulatedRuns([run], FINE_HZ).predict(compose(CAR))
    assert constant_lag(lags(recorded([run], predictions, late_s=0.03), predictions))[2] is None


@pytest.mark.parametrize("share", [0.01, -0.02])
def test_a_wrong_speed_grows_along_the_way(share: float) -> None:
    """The model is driven over more road than the car was."""
    runs, predictions = driven()
    truth = [replace(run, distance_m=(1 - share) * run.distance_m) for run in runs]
    measured = SimulatedRuns(truth, FINE_HZ).predict(compose(CAR))
    found = lag_drift(lags(recorded(runs, measured), predictions))
    assert found.value == pytest.approx(share, rel=0.05)
    assert found.p_value < 1e-6


def test_where_nothing_is_off_there_is_neither_and_chance_says_so_honestly() -> None:
    runs, predictions = driven()
    found = []
    for seed in range(30):
        windows = lags(recorded(runs, predictions, seed=seed), predictions)
        found += [lag_drift(windows).p_value, constant_lag(windows)[0].p_value]
    assert sum(one < 0.02 for one in found) <= 5  # of 60, with a probability below 0.001 for more
    assert np.mean(found) == pytest.approx(0.5, abs=0.15)


def test_the_error_of_each_window_holds() -> None:
    runs, predictions = driven()
    off = []
    for seed in range(10):
        windows = lags(recorded(runs, predictions, seed=seed), predictions)
        off.append(windows.lag_s / windows.error_s)
    assert np.sqrt(np.mean(np.concatenate(off) ** 2)) == pytest.approx(1.0, abs=0.25)


def test_windows_say_where_they_are() -> None:
    runs, predictions = driven()
    windows = lags(recorded(runs, predictions), predictions)
    assert set(windows.run.tolist()) == {0, 1}
    for number, run in enumerate(runs):
        inside = windows.along_m[windows.run == number]
        assert (np.diff(inside) > 0).all() and inside[-1] < np.ptp(run.distance_m)
        assert len(inside) == int((run.count - run.first) / RATE_HZ / WINDOW_S)
    assert windows.lag_m == pytest.approx(windows.lag_s * windows.speed_mps)


def test_a_car_that_is_farther_and_farther_ahead_is_followed() -> None:
    """By more than a window reaches at once, as its lags are looked for beside the last one."""
    runs, _ = driven()
    run = runs[0]
    ahead_m = 0.02 * (run.distance_m - run.distance_m[0])
    truth = SimulatedRuns([replace(run, distance_m=run.distance_m + ahead_m)], FINE_HZ).predict(compose(CAR))
    model = SimulatedRuns([run], FINE_HZ).predict(compose(CAR))
    (measured,) = recorded([run], truth)
    until_last_window = slice(run.first, -700)
    followed = offset_by_lag_m(measured, model[0])[until_last_window]
    assert followed == pytest.approx(ahead_m[until_last_window], abs=0.3) and followed[-1] > 3.0  # of 4.8 m in all


def is_unknown(trend: Trend) -> bool:
    return bool(np.isnan(astuple(trend)).all())


def test_what_is_not_alike_or_too_short_tells_nothing() -> None:
    runs, predictions = driven()
    noise = [measuring(run, np.random.default_rng(i).normal(0, 1, run.count)) for i, run in enumerate(runs)]
    windows = lags(noise, predictions)
    time, length, rather = constant_lag(windows)
    assert is_unknown(lag_drift(windows)) and is_unknown(time) and is_unknown(length) and rather is None
    assert not offset_by_lag_m(noise[0], predictions[0]).any()
    short, model = driven(6.0, (8.0,))
    few = lags(recorded(short, model), model)
    assert is_unknown(lag_drift(few))
    assert lags([], []).run.size == 0
