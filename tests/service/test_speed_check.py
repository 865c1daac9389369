"""A receiver whose speed and places disagree, or that tells no speed or a date of another age: flagged, and said."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from drivers.nmea import NmeaDecoder
from logger.commands.status import advice, screen
from logger.service.doubted_spans import SpeedCheck
from logger.service.timebase import TimedFix

from ..support.drives.receivers import town_drive
from ..support.faults.sensors import NOON, Car, checked, epoch
from ..support.slow import release, slow

ROLLOVER = timedelta(weeks=1024)


def driven(folder: Path, reported_mps: Callable[[float], float], seconds: float = 60) -> Car:
    """A car that drives at 15 m/s, by a receiver that says another speed."""
    car = Car(folder)
    car.speed_mps = 15.0
    car.receiver = lambda second: epoch(second, reported_mps(second), car.travelled_m)
    car.drive(seconds)
    return car


@pytest.mark.parametrize("factor", [*slow(0.0, 0.4, 1.6), *release(2.0, 3.6)])
def test_a_speed_that_is_not_that_of_the_places_gives_no_iri_and_is_said(tmp_path: Path, factor: float) -> None:
    car = driven(tmp_path, lambda second: 15.0 * factor)
    status = car.drive(1)
    assert status.gps.state == "doubtful"
    reported, *_ = advice(status)
    assert "speed and positions disagree" in reported
    assert "the car stands" not in screen(status, None)[0]
    known_s = 13 if factor < 1 else 0  # a speed that is too small shows after a hundred metres of difference
    rows = [row for row in car.rows.records if row.speed_mps and row.t_us > car.begin_us + known_s * 1e6]
    assert all("speed_doubtful" in row.flags for row in rows)
    assert not any(row.iri_m_per_km or row.iri_rms_m_per_km or row.iri_class for row in rows)
    assert any(row.a_w_mps2 is not None for row in rows) or factor == 0.0
    car.receiver = lambda second: epoch(second, car.speed_mps, car.travelled_m)
    status = car.drive(90)
    assert status.gps.state == "ok"
    last = car.rows.records[-1]
    assert "speed_doubtful" not in last.flags
    assert last.iri_rms_m_per_km is not None
    assert last.iri_m_per_km is not None


@pytest.mark.slow
@pytest.mark.parametrize("factor", [1.0, *release(0.93), 1.07])
def test_a_speed_that_is_a_little_off_is_believed(tmp_path: Path, factor: float) -> None:
    car = driven(tmp_path, lambda second: 15.0 * factor, 90)
    assert "speed_doubtful" not in car.flags()


@pytest.mark.slow
def test_a_parked_car_whose_place_wanders_is_believed(tmp_path: Path) -> None:
    car = Car(tmp_path)
    car.speed_mps = 0.0
    car.receiver = lambda second: epoch(second, 0.0, 30 * ((second // 20) % 3))
    status = car.drive(120)
    assert status.gps.state == "ok"
    assert "speed_doubtful" not in car.flags()


def doubted(drive: Iterator[TimedFix]) -> tuple[float, list[float]]:
    """Seconds driven until the receiver is doubted first, and the seconds at which it is."""
    check, driven_s, first_s = SpeedCheck(), 0, float("inf")
    times_us = []
    for timed in drive:
        check.take(timed)
        times_us.append(timed.t_us)
        driven_s += (timed.fix.speed_mps or 0.0) > 2.0
        first_s = min(first_s, driven_s) if check.doubt else first_s
    during = check.spans.during(np.array(times_us))
    return first_s, [t_us / 1e6 for t_us, is_doubtful in zip(times_us, during, strict=True) if is_doubtful]


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "found_s"), [(0.6, 40), (0.7, 60), (0.8, 120), (1.2, 150), (1.3, 90), (2.0, 30)])
def test_a_wrong_factor_of_the_speed_is_found_in_a_town(factor: float, found_s: float) -> None:
    assert np.median([doubted(town_drive(1200, seed, factor))[0] for seed in range(9)]) < found_s


@pytest.mark.slow
def test_a_good_receiver_is_not_doubted_in_queues_and_among_houses() -> None:
    assert sum(len(doubted(town_drive(3600, seed))[1]) for seed in range(40, 44)) == 0


def test_a_single_place_far_off_costs_nothing() -> None:
    assert [doubted(town_drive(900, seed, outlier_s=600))[1] for seed in range(50, 60)] == [[]] * 10


def test_a_receiver_that_tells_no_speed_is_reported(tmp_path: Path) -> None:
    car = Car(tmp_path)

    def places_alone(second: float) -> bytes:
        minutes = 60 * car.travelled_m / 111_195.0
        return checked(f"GPGGA,{NOON + timedelta(seconds=second):%H%M%S}.00,46{minutes:08.5f},N,00630.00000,E,1,09,0.9,"
                       "400.0,M,47.0,M,,")

    car.receiver = places_alone
    status = car.drive(30)
    assert status.gps.state == "doubtful"
    reported, *_ = advice(status)
    assert "RMC" in reported
    assert "no speed" in reported


@pytest.mark.slow
@pytest.mark.parametrize("turns", [1, 2])
def test_a_date_that_is_weeks_back_is_reported_with_the_setting(tmp_path: Path, turns: int) -> None:
    car = Car(tmp_path)
    car.receiver = lambda second: epoch(second, car.speed_mps, car.travelled_m, NOON - turns * ROLLOVER)
    status = car.drive(30)
    assert status.gps.state == "doubtful"
    reported, *_ = advice(status)
    assert f"week_rollovers: {turns}" in reported
    decoder = NmeaDecoder(week_rollovers=turns)
    fixes = decoder.feed(0, epoch(0, 1, 1, NOON - turns * ROLLOVER)) + decoder.flush()
    assert [fix.utc_us for fix in fixes] == [round(NOON.timestamp() * 1e6)]
    assert decoder.doubt == ""


def test_a_good_receiver_is_not_doubted(tmp_path: Path) -> None:
    status = Car(tmp_path).drive(40)
    assert status.gps.state == "ok"
    assert advice(status) == ["Nothing: all is well."]
