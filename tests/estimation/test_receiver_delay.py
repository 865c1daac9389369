"""The delay against drives whose delay is known (``tests/support/drives/braking_drives``)."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from logger.estimation.drive_alignment import DriveAlignment, angle_rad
from logger.estimation.receiver_delay import STRENGTHS, CarriedDelay, DelayEstimate, _log_likelihoods, combined

from ..support.drives.braking_drives import Instrument, Mounting, Receiver, SeenDrive, drive, fed

TOWN_S = 1200.0


@cache
def town() -> SeenDrive:
    """A usual drive; the delay is 0.15 s."""
    return drive("town", TOWN_S, Mounting(30.0, 4.0, -3.0), Receiver(), Instrument(), seed=5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("yaw_deg", "delay_s", "rate_hz"), [(0, 0.05, 1), (90, 0.4, 1), (-140, 0.2, 5), (175, 0.3, 10)])
def test_the_delay_and_forward_are_found_at_every_angle(yaw_deg: float, delay_s: float, rate_hz: float) -> None:
    receiver = Receiver(delay_s=delay_s, rate_hz=rate_hz, gaps_s=((300, 340),))
    seen = drive("town", TOWN_S, Mounting(yaw_deg, 5.0, -6.0), receiver, Instrument(), seed=int(yaw_deg) + 500)
    found = fed(seen).estimate()
    assert found.delay_s is not None
    assert found.std_s is not None
    assert found.forward is not None
    assert found.std_s < 0.03
    assert abs(found.delay_s - delay_s) < 2.5 * found.std_s
    level = found.forward - seen.upward * (found.forward @ seen.upward)
    assert angle_rad(level, seen.forward) < np.radians(2)
    assert found.gain == pytest.approx(1.0, abs=0.15)  # the body pitches when the car brakes


def test_likelihoods_are_those_of_dense_algebra() -> None:
    """A straight line with a prior as broad as a barn door stands for one that is free."""
    rng = np.random.default_rng(4)
    t_s, weight = np.sort(rng.uniform(0.0, 40.0, 30)), rng.uniform(0.2, 1.2, 30)
    residual = 0.2 * rng.standard_normal(30) + 11.0 - 0.03 * t_s
    since = t_s - t_s[0]

    def speed_covariance(hill_s: float) -> np.ndarray:
        """Of the integral of an acceleration of covariance (1 + u/T) exp(-u/T), by sums over small steps."""
        edges = np.linspace(0.0, since[-1], 1500)
        u = np.abs(edges[:-1, None] - edges[:-1]) / hill_s
        steps = np.clip(since[:, None] - edges[:-1], 0.0, edges[1])
        return steps @ ((1 + u) * np.exp(-u)) @ steps.T

    broad = np.stack([np.ones(30), t_s - t_s.mean()], axis=1) * 1e3
    hills = {hill_s: speed_covariance(hill_s) for hill_s in {one[3] for one in STRENGTHS}}
    expected = []
    for noise_mps, walk, hill_mps2, hill_s in STRENGTHS:
        covariance = (walk * np.minimum.outer(since, since) + hill_mps2**2 * hills[hill_s]
                      + np.diag(noise_mps**2 / weight) + broad @ broad.T)
        quadratic = residual @ np.linalg.solve(covariance, residual)
        expected.append(-0.5 * (np.linalg.slogdet(covariance)[1] + quadratic))
    found = _log_likelihoods(residual, t_s, STRENGTHS, weight)
    assert found - found.mean() == pytest.approx(np.array(expected) - np.mean(expected), abs=0.05, rel=2e-3)


def test_fixes_that_are_later_are_reported_to_be_later() -> None:
    seen = town()
    first, later = (fed(each).estimate() for each in (seen, replace(seen, fix_time_s=seen.fix_time_s + 0.07)))
    assert first.delay_s is not None
    assert later.delay_s is not None
    assert later.delay_s - first.delay_s == pytest.approx(0.07, abs=0.015)


@pytest.mark.slow
def test_the_unit_of_the_readings_does_not_matter() -> None:
    seen = town()
    one, other = fed(seen).estimate(), fed(replace(seen, accel=seen.accel / 9.8)).estimate()
    assert one.delay_s == pytest.approx(other.delay_s, abs=1e-6)
    assert one.gain == pytest.approx(9.8 * (other.gain or 0.0), rel=1e-6)


@pytest.mark.slow
def test_pieces_do_not_matter() -> None:
    one, other = fed(town(), chunk=1000).estimate(), fed(town(), chunk=37).estimate()
    assert one.delay_s == other.delay_s
    assert one.std_s == other.std_s


def test_an_even_drive_tells_no_delay_and_says_why() -> None:
    seen = drive("highway", TOWN_S, Mounting(), Receiver(), Instrument(), seed=1)
    found = fed(seen).estimate()
    assert found.delay_s is None
    assert found.std_s is None
    assert "too little braking" in found.reason


def test_a_car_that_stands_tells_nothing() -> None:
    seen = town()
    alignment = fed(replace(seen, fix_speed_mps=np.zeros(len(seen.fix_speed_mps))))
    assert alignment.estimate() == DelayEstimate(reason="not enough driving yet")


def test_a_sensor_that_does_not_feel_the_car_tells_nothing() -> None:
    seen = town()
    noise = np.random.default_rng(0).normal(0, 0.3, seen.accel.shape) + np.array([0, 0, 9.8])
    assert fed(replace(seen, accel=noise)).estimate().delay_s is None


def test_readings_with_holes_are_left_out() -> None:
    seen = town()
    there = (seen.time_s % 200) > 30
    found = fed(replace(seen, time_s=seen.time_s[there], accel=seen.accel[there])).estimate()
    assert found.delay_s is not None
    assert found.std_s is not None
    assert abs(found.delay_s - 0.15) < 2.5 * found.std_s


def test_memory_is_bounded() -> None:
    seen, alignment = town(), DriveAlignment(2, 1.0)
    for low in range(0, len(seen.time_s), 500):  # no fix ever comes
        alignment.take_readings(seen.time_s[low : low + 500], seen.accel[low : low + 500])
        assert alignment.kept_readings <= 2000


def test_drives_are_weighed_by_their_errors() -> None:
    first = combined(CarriedDelay(0.10, 0.10), DelayEstimate(0.16, 0.02), drift_s=0.0)
    assert first.delay_s == pytest.approx(0.10 + 0.06 * 0.01 / 0.0104)
    assert first.std_s == pytest.approx((1 / (1 / 0.01 + 1 / 0.0004)) ** 0.5)
    assert first.drives == 1
    assert combined(first, DelayEstimate(reason="an even drive")) == first
    assert combined(first, DelayEstimate(0.5, 0.02)) == CarriedDelay(0.5, 0.02, 1)  # another receiver
