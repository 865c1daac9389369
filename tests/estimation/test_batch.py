"""What is done to a whole drive before and after the estimator, by hand and by known signals."""

from __future__ import annotations

import numpy as np
import pytest

from logger.estimation.batch import Windows, exact_iri, local_level, monotonic_distance, on_grid, score
from logger.estimation.sensor_noise import Sensor
from logger.roads.iri import rectified_slope

SENSOR = Sensor(0.1, 0.06)


def windows(iri: list[float], std: list[float]) -> Windows:
    count = len(iri)
    return Windows(10.0 * np.arange(count + 1), np.full(count, 9.0), np.array(iri), np.array(std), np.ones(count),
                   (frozenset(),) * count)


def test_a_drive_at_100_hz_is_left_as_it_is() -> None:
    accel, distance = np.arange(9.0), np.arange(9.0)
    assert on_grid(SENSOR, 100.000001, accel, distance) == (SENSOR, accel, distance)


@pytest.mark.parametrize("rate_hz", [80.0, 104.0, 1000 / 7, 250.0, 1000.0])
def test_waves_come_through_at_any_rate(rate_hz: float) -> None:
    def felt(t: np.ndarray) -> np.ndarray:
        return 3.0 * np.sin(2 * np.pi * 1.3 * t) + np.cos(2 * np.pi * 28.0 * t)

    t = np.arange(int(20 * rate_hz)) / rate_hz
    sensor, accel, distance = on_grid(SENSOR, rate_hz, felt(t), 12.0 * t)
    grid = np.arange(len(accel)) / 100
    assert len(accel) == int(t[-1] * 100 + 1e-6) + 1
    assert distance == pytest.approx(12.0 * grid, abs=1e-3)
    assert accel[50:-50] == pytest.approx(felt(grid)[50:-50], abs=0.02)
    assert sensor.noise_rms_mps2**2 == pytest.approx((0.1**2 + 0.06**2 / 12) * 100 / rate_hz)
    assert sensor.step_mps2 == 0


def test_noise_after_a_change_of_rate_is_as_strong_as_said() -> None:
    noise = 0.1 * np.random.default_rng(1).standard_normal(200_000)
    sensor, accel, _ = on_grid(Sensor(0.1, 0.0), 500.0, noise, np.arange(200_000.0))
    assert np.std(accel) == pytest.approx(sensor.noise_rms_mps2, rel=0.03)


def test_a_distance_that_jumps_is_laid_by_the_speed() -> None:
    t = np.arange(6000) / 100
    speed = 10 + 3 * np.sin(t)
    true = 10 * t + 3 * (1 - np.cos(t))
    corrected = true + 0.4 * np.where(t.astype(int) % 2 == 0, 1, -1)
    laid = monotonic_distance(corrected, 1.01 * speed, 100.0)
    assert (np.diff(laid) >= 0).all()
    assert laid[100:-100] == pytest.approx(true[100:-100], abs=0.02)
    assert np.abs(np.diff(laid)[100:-100] * 100 - speed[100:-101]).max() < 1.0


def test_exact_iri_counts_from_the_flat_road_before_the_profile() -> None:
    rng = np.random.default_rng(2)
    road = 0.05 * 0.1 * np.arange(2001) + np.cumsum(0.001 * rng.standard_normal(2001))
    edges_m = 990 + 20.0 * np.arange(20)
    found = exact_iri(edges_m, road, 0.1, 1000.0)
    padded = 1000 * rectified_slope(np.concatenate([np.full(1000, road[0]), road]), 0.1)[1000:]
    for begin_m, one in zip(edges_m, found, strict=False):
        low = round((begin_m - 1000) / 0.1)
        if begin_m < 1000 or begin_m + 20 > 1199.8:
            assert np.isnan(one)
        else:
            assert one == pytest.approx(padded[low: low + 200].mean())
    alone = 1000 * rectified_slope(road, 0.1)[100:300].mean()
    assert found[1] > alone + 1  # the car was shaken where the grade begins


def test_exact_iri_of_a_coarse_profile_is_that_of_straight_lines_between_its_samples() -> None:
    coarse = np.cumsum(np.random.default_rng(3).normal(0, 0.01, 101))
    fine = np.interp(np.arange(0, 200.01, 0.2), np.arange(0, 200.01, 2.0), coarse)
    edges_m = 20.0 * np.arange(10)
    assert exact_iri(edges_m, coarse, 2.0, 0.0) == pytest.approx(exact_iri(edges_m, fine, 0.2, 0.0), rel=0.02)


def test_exact_iri_of_a_drive_elsewhere_is_unknown() -> None:
    assert np.isnan(exact_iri(np.array([500.0, 510.0]), np.zeros(1000), 0.1, 0.0)).all()
    assert len(exact_iri(np.array([0.0]), np.zeros(1000), 0.1, 0.0)) == 0


def test_score_by_hand() -> None:
    found = windows([1.1, 2.0, 2.7, float("nan"), 9.0], [0.2, 0.2, 0.2, float("nan"), 0.2])
    exact = np.array([1.0, 2.0, 3.0, 4.0, float("nan")])
    scored = score(found, exact, np.ones(5, dtype=bool))
    assert scored is not None
    assert scored.windows == 3
    assert scored.r2 == pytest.approx(1 - (0.01 + 0 + 0.09) / 2.0)
    assert scored.bias == pytest.approx(-0.2 / 6)
    assert (scored.within_one, scored.within_two) == (pytest.approx(2 / 3), 1.0)
    assert score(found, exact, np.array([1, 0, 0, 1, 1], dtype=bool)) is None
    assert score(found, np.full(5, np.nan), np.ones(5, dtype=bool)) is None


def test_level_around_a_window_by_hand() -> None:
    iri = np.array([1.0, 2.0, float("nan"), 4.0, 5.0, 6.0])
    assert local_level(iri, 50.0) == pytest.approx([1.5, 1.5, 3.0, 4.5, 5.0, 5.5])
    assert local_level(iri, 200.0) == pytest.approx(iri, nan_ok=True)
    assert len(local_level(np.empty(0), 7.62)) == 0
