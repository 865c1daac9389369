"""A serial sensor that keeps another rate, or whose line loses samples: right, or flagged, and said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from logger.commands.status import advice

from ..support.drives.replay import rows_of
from ..support.drives.serial_drives import (
    SPEED_MPS,
    drive_at,
    evenly_lost,
    mean_iri,
    randomly_lost,
    rows_at,
    rows_without,
    same_rows,
    without_lines,
)
from ..support.faults.sensors import Car
from ..support.slow import release, slow

WHOLE_ROWS = 185


@pytest.mark.parametrize("rate_hz", [*slow(100, 104, 96, 150, 800), *release(98, 120, 200, 400)])
def test_a_sensor_of_another_rate_gives_the_same_iri_and_loses_nothing(rate_hz: int) -> None:
    expected, _ = mean_iri(rows_at(100)[1])
    rows = rows_at(rate_hz)[1]
    found, count = mean_iri(rows)
    assert found == pytest.approx(expected, rel=0.03)
    assert count > WHOLE_ROWS - 5
    assert not any("gap" in row.flags for row in rows.records[3:])


def test_a_sensor_that_is_too_slow_gives_no_iri() -> None:
    rows = rows_at(80)[1]
    figures = [row for row in rows.records if row.iri_m_per_km is not None or row.a_w_mps2 is not None]
    assert figures == []
    assert all("gap" in row.flags for row in rows.records if row.speed_mps)


@pytest.mark.slow
@pytest.mark.parametrize(("rate_hz", "share"), [
    (100, 0.1), (200, 0.05), (150, 0.01), *release((100, 0.03), (100, 0.02), (150, 0.1), (400, 0.05))
])
def test_rows_with_many_lost_lines_are_right_or_flagged(rate_hz: int, share: float) -> None:
    pairs = same_rows(rows_at(rate_hz, share)[1], rows_at(100)[1])
    assert len(pairs) < WHOLE_ROWS / 4
    found, expected = np.mean(pairs, axis=0) if len(pairs) >= 5 else (0, 0)
    assert found == pytest.approx(expected, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [*release(200), 250])
def test_single_lines_lost_by_a_fast_sensor_are_seen(rate_hz: int) -> None:
    """A step of 5 ms or less: seen where the arrivals jitter less. Beside it, chance leaves 0.6 % of error."""
    pairs = []
    for seed in range(1, 6):
        pairs += same_rows(rows_without(rate_hz, frozenset(randomly_lost(rate_hz, 0.01, seed))), rows_at(100)[1])
    found, expected = np.mean(pairs, axis=0)
    assert len(pairs) > 140
    assert found == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(("rate_hz", "every", "count"), [
    *slow((100, 100, 1), (104, 50, 1), (200, 100, 2), (100, 25, 1), (98, 50, 1)),
    *release((100, 50, 1), (100, 100, 2), (125, 50, 1), (150, 50, 1), (150, 100, 2)),
])
def test_rows_with_lines_lost_at_even_intervals_are_right_or_flagged(rate_hz: int, every: int, count: int) -> None:
    """They look like a slower sensor."""
    rows = rows_without(rate_hz, evenly_lost(rate_hz, every, count))
    pairs = same_rows(rows, rows_at(100)[1])
    found, expected = np.mean(pairs, axis=0) if len(pairs) >= 5 else (0, 0)
    assert found == pytest.approx(expected, rel=0.02)
    assert sum("gap" in row.flags for row in rows.records) > 0.4 * len(rows.records)


@pytest.mark.slow
def test_one_line_in_a_hundred_lost_shows_where_it_was() -> None:
    lost = randomly_lost(100, 0.01)
    drive, rows = rows_at(100, 0.01)
    driven = [row for row in rows.records if row.speed_mps and not set(row.flags) & {"partial", "unsettled", "slow"}]
    hit, found = 0, 0
    for row in driven:
        begin = (row.t_us - drive.start_us) / 10_000
        if any(begin <= number < begin + row.samples for number in lost):
            hit += 1
            found += "gap" in row.flags
    assert hit > 50
    assert found > 0.9 * hit
    clean = [row for row in driven if "gap" not in row.flags]
    assert len(clean) > 40  # and not everywhere
    found, expected = np.mean(same_rows(rows, rows_at(100)[1]), axis=0)
    assert found == pytest.approx(expected, rel=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(("second", "count"), [(47.37, 1), *slow((31.0, 1), (66.6, 2), (80.0, 7))])
def test_a_single_line_that_is_lost_shows(second: float, count: int) -> None:
    drive = drive_at(100)
    first = round(second * 100)
    rows = rows_of(drive.header, without_lines(drive.events, set(range(first, first + count))))
    flagged = [row for row in rows.records if "gap" in row.flags]
    assert 1 <= len(flagged) <= 2
    lost_us = drive.start_us + first * 10_000
    assert any(abs(row.t_us + row.duration_s * 5e5 - lost_us) < 400_000 for row in flagged)


@pytest.mark.parametrize(("rate_hz", "share", "says"), [
    (80, 0.0, ("80 samples a second", "100")),
    (100, 0.02, ("lost",)),
    *slow((100, 0.1, ("samples a second", "lost"))),
])
def test_status_says_which_rate_was_seen_and_what_to_do(
    tmp_path: Path, rate_hz: int, share: float, says: tuple[str, ...]
) -> None:
    lost = randomly_lost(rate_hz, share)
    car = Car(tmp_path, serial=True)
    car.speed_mps = SPEED_MPS
    sent = 0

    def sample(second: float) -> bytes:
        nonlocal sent
        lines = b""
        while sent < second * rate_hz:
            lines += b"" if sent in lost else b"0.01,0.02,%.3f\r\n" % (1 + 0.1 * car.rng.random())
            sent += 1
        return lines

    car.sample = sample
    status = car.drive(40)
    assert status.accelerometer.state == "doubtful"
    reported = " ".join(advice(status))
    for words in says:
        assert words in reported
    assert "baud" in reported
    rate_hz, share, lost, sent = 100, 0.0, set(), round(car.now_s * 100)
    status = car.drive(25)
    assert status.accelerometer.state == "ok"
    assert advice(status) == ["Nothing: all is well."]


@pytest.mark.slow
@pytest.mark.parametrize(("burst", "says", "state"), [(30, "nothing needs to be done", "ok"),
                                                      (100, "send each sample at once", "doubtful")])
def test_status_says_that_samples_come_in_bursts(tmp_path: Path, burst: int, says: str, state: str) -> None:
    """A bridge that keeps a burst of lines and sends them together."""
    car = Car(tmp_path, serial=True)
    car.speed_mps = SPEED_MPS
    sent = 0

    def sample(second: float) -> bytes:
        nonlocal sent
        lines = b""
        while sent + burst < second * 100:
            lines += b"".join(b"0.01,0.02,%.3f\r\n" % (1 + 0.1 * car.rng.random()) for _ in range(burst))
            sent += burst
        return lines

    car.sample = sample
    status = car.drive(40)
    reported = " ".join(advice(status))
    assert f"{burst / 100:.1g} s at a time" in reported
    assert says in reported
    assert status.accelerometer.state == state
    row = status.last_window
    assert row is not None
    assert row.iri_m_per_km is None if state == "doubtful" else "gap" not in row.flags
