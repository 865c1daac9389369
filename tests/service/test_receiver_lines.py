"""Receivers whose line is too slow, or that send seldom, or in parts, from bytes to rows, against a known drive."""

from __future__ import annotations

from datetime import datetime
from statistics import fmean

import pytest

from logger.report.placed import placed

from ..support.drives.lines import (
    SATELLITES,
    Receiver,
    drive,
    gga,
    gll,
    off_m,
    off_mps,
    off_s,
    rmc,
    rmc_gga_and,
    vtg,
    zda,
)
from ..support.drives.replay import core_for
from ..support.slow import slow


def by_and_by(utc: datetime, t_s: float) -> list[str]:
    return rmc_gga_and(18 if t_s % 40 < 15 else 2)(utc, t_s)


def place_time_speed_apart(utc: datetime, t_s: float) -> list[str]:
    return [gll(utc, t_s), vtg(t_s), zda(utc)]


def speed_first(utc: datetime, t_s: float) -> list[str]:
    return [vtg(t_s), gll(utc, t_s), zda(utc)]


def two_rates(utc: datetime, t_s: float) -> list[str]:
    return [gga(utc, t_s), *([rmc(utc, t_s)] if round(t_s) % 3 == 0 else [])]


def minimum_alone(utc: datetime, t_s: float) -> list[str]:
    return [rmc(utc, t_s), *[SATELLITES] * 16]


@pytest.mark.parametrize("receiver", [
    Receiver(rmc_gga_and(14)),
    *slow(Receiver(rmc_gga_and(8), baud=4800), Receiver(rmc_gga_and(4), every_s=0.1, baud=38400),
          Receiver(minimum_alone, buffer_bytes=1024), Receiver(by_and_by),
          Receiver(rmc_gga_and(14), jumps=((-1, 2), (40, -2)))),
    *slow(Receiver(rmc_gga_and(2), jumps=((-1, 1), (40, -1)))),
    *slow(Receiver(rmc_gga_and(2), every_s=2)),
    *slow(Receiver(rmc_gga_and(2), every_s=5), Receiver(two_rates)),
    *slow(Receiver(place_time_speed_apart), Receiver(speed_first)),
], ids=["full", "full at 4800", "full at 10 Hz", "full with RMC alone, a small buffer", "full now and then",
        "full, and its clock jumps by 2 s", "its clock jumps by 1 s", "each 2 s", "each 5 s", "speed each 3 s", "GLL",
        "VTG before GLL"])
def test_rows_have_the_place_and_time_of_their_instant(receiver: Receiver) -> None:
    header, events = drive(receiver)
    core, rows = core_for(header)
    for event in events:
        core.feed(event)
    core.finish()
    driven = [row for row in rows.records if row.lat_deg is not None]
    assert len(driven) > 110
    assert all(placed(row) for row in driven if row.distance_end_m != row.distance_start_m)
    assert max(abs(off_m(row)) for row in driven) < 1.5
    assert fmean(abs(off_mps(row)) for row in driven) < 0.3
    jumped_us = max((at_s for at_s, _ in receiver.jumps), default=0) * 1e6 + 6e6
    assert max(abs(off_s(row)) for row in driven if row.t_us > jumped_us) < 0.1


def test_a_full_line_is_reported_with_what_to_do() -> None:
    header, events = drive(Receiver(rmc_gga_and(14)), 40.0)
    core, _ = core_for(header)
    for event in events:
        core.feed(event)
    assert "carries 960 bytes a second, and it has" in core.gps_doubt
    assert "late (rows use the times in the sentences)" in core.gps_doubt
    assert "Raise the baud rate" in core.gps_doubt
    sends = float(core.gps_doubt.split("it has ")[1].split()[0])
    texts = rmc_gga_and(14)(datetime(2026, 5, 4), 0.0)
    assert sends == pytest.approx(sum(len(text) + 6 for text in texts), rel=0.03)


@pytest.mark.slow
def test_where_nobody_knows_how_late_fixes_are_rows_say_so() -> None:
    def heard_late(utc: datetime, t_s: float) -> list[str]:
        return rmc_gga_and(14 if t_s < 30 else 2)(utc, t_s)

    header, events = drive(Receiver(heard_late, begun_s=20.0))
    core, rows = core_for(header)
    for event in events:
        core.feed(event)
        if event.t_us == 25_000_000:
            assert "flagged gps_late" in core.gps_doubt
    core.finish()
    driven = [row for row in rows.records if row.lat_deg is not None]
    sure = [row for row in driven if "gps_late" not in row.flags]
    assert min(off_m(row) for row in driven) < -20
    assert len(sure) > 60
    assert max(abs(off_m(row)) for row in sure) < 1.5
    assert not any(placed(row) for row in driven if "gps_late" in row.flags)


@pytest.mark.slow
def test_a_lost_fix_of_a_receiver_that_sends_each_two_seconds_is_a_loss() -> None:
    def with_a_hole(utc: datetime, t_s: float) -> list[str]:
        return [] if 30 < t_s < 35 else rmc_gga_and(2)(utc, t_s)

    header, events = drive(Receiver(with_a_hole, every_s=2.0))
    core, rows = core_for(header)
    for event in events:
        core.feed(event)
    core.finish()
    lost = [row.t_us / 1e6 for row in rows.records if "gps_lost" in row.flags and row.lat_deg is not None]
    assert 29 < min(lost) < 31
    assert 35 < max(lost) < 37
