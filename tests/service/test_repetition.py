"""A sensor whose samples come more than once: found, said, flagged; and no other is taken for one."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from drivers.readings import AccelerationBlock
from logger.commands.status import advice
from logger.service.doubted_spans import WINDOW, Repetition

from ..support.drives.records import ride, rounded
from ..support.drives.replay import rows_of
from ..support.drives.serial_drives import BEGIN_S, drive_at, rows_at
from ..support.faults.sensors import Car
from ..support.slow import slow


def samples(seconds: float, rate_hz: float, step: float, written: int = 1, seed: int = 1) -> AccelerationBlock:
    """Of a ride on three axes, each of them written some times."""
    rng = np.random.default_rng(seed)
    axes = [rounded(ride(seconds / written, rng, 0.6, rate_hz) + 0.05 * rng.standard_normal(
        int(seconds / written * rate_hz)), step) for _ in "xyz"]
    accel = np.repeat(np.stack(axes, axis=1), written, axis=0)
    t_us = (np.arange(len(accel)) * 1e6 / rate_hz).astype(np.int64)
    return AccelerationBlock(t_us, accel, np.zeros(len(t_us), dtype=np.bool_), rate_hz)


def part(block: AccelerationBlock, begin: int, end: int) -> AccelerationBlock:
    return AccelerationBlock(block.t_us[begin:end], block.accel_mps2[begin:end], block.clipped[begin:end])


@pytest.mark.parametrize("step", [0.001, 0.01, 0.098, 0.613])
def test_no_honest_sensor_repeats(step: float) -> None:
    for seed in range(20):
        found = Repetition()
        found.take(samples(120, 100, step, seed=seed))
        assert (found.share, found.doubt) == (0.0, "")
        assert not found.spans.covers(0, 10**9)


def test_any_cut_into_blocks_finds_the_same() -> None:
    block = samples(100, 100, 0.001, 2)
    whole, cut = Repetition(), Repetition()
    whole.take(block)
    ends = [0, 7, 1000, WINDOW, WINDOW + 1, 5000, len(block)]
    for begin, end in pairwise(ends):
        cut.take(part(block, begin, end))
    assert whole.share == cut.share == pytest.approx(0.5, abs=0.01)
    assert (whole.spans.during(block.t_us) == cut.spans.during(block.t_us)).all()
    assert whole.spans.during(block.t_us).all()


def test_it_ends_when_the_repeats_do() -> None:
    found = Repetition()
    bad, good = samples(60, 100, 0.001, 2), samples(100, 100, 0.001)
    found.take(bad)
    assert "50 of 100 samples repeat" in found.doubt
    later = AccelerationBlock(good.t_us + 60_000_000, good.accel_mps2, good.clipped)
    found.take(later)
    assert found.doubt == ""
    assert not found.spans.during(later.t_us[3 * WINDOW:]).any()
    assert found.spans.during(bad.t_us).all()


@pytest.mark.parametrize("step", [0.001, 0.613])
def test_it_ends_on_a_coarse_sensor_that_rightly_repeats_some(step: float) -> None:
    found = Repetition()
    bad, good = samples(60, 100, 0.001, 4), samples(600, 100, step)
    found.take(bad)
    assert found.doubt
    found.take(AccelerationBlock(good.t_us + 60_000_000, good.accel_mps2, good.clipped))
    assert found.doubt == ""


def twice(data: bytes, number: int, last: bytes) -> tuple[bytes, int, bytes]:
    """Lines with every second one replaced by the one before it."""
    out = b""
    for line in data.splitlines(keepends=True):
        out += last if number % 2 else line
        last = line if number % 2 == 0 else last
        number += 1
    return out, number, last


@pytest.mark.slow
def test_rows_of_repeated_lines_are_flagged_and_have_no_figures() -> None:
    drive = drive_at(100)
    events, number, last = [], 0, b""
    for event in drive.events:
        if event.source == "nmea" or not event.data.endswith(b"\n"):
            events.append(event)
            continue
        data, number, last = twice(event.data, number, last)
        events.append(event._replace(data=data))
    rows = rows_of(drive.header, events).records
    late = [row for row in rows if row.speed_mps and row.t_us > drive.start_us + (BEGIN_S + 25) * 1_000_000]
    assert len(late) > 100
    assert all("repeated" in row.flags for row in late)
    assert all(row.iri_m_per_km is None and row.a_w_mps2 is None and row.comfort == "" for row in late)


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [100, *slow(200, 400)])
def test_no_row_of_a_sound_sensor_is_flagged(rate_hz: int) -> None:
    assert not any("repeated" in row.flags for row in rows_at(rate_hz)[1].records)


def test_status_says_so_and_what_to_do(tmp_path: Path) -> None:
    car = Car(tmp_path, serial=True)
    car.speed_mps = 15.0
    sent, line = 0, b""

    def sample(second: float) -> bytes:
        nonlocal sent, line
        lines = b""
        while sent < second * 100:
            if sent % 2 == 0:
                line = b"0.01,%.3f,%.3f\r\n" % (0.1 * car.rng.random(), 1 + 0.1 * car.rng.random())
            lines += line
            sent += 1
        return lines

    car.sample = sample
    status = car.drive(50)
    assert status.accelerometer.state == "doubtful"
    assert "samples repeat the one before" in " ".join(advice(status))
