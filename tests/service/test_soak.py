"""Half an hour of a car's day across New Year's midnight; ``tests/benchmarks/soak.py`` lets the whole day happen."""

from __future__ import annotations

from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

import pytest

from logger.store.log.disk_quota import RESERVE_BYTES

from ..support.drives.car_days import START_US, CarDay
from ..support.faults.soak import MAX_FILE_BYTES, soak


@pytest.mark.slow
def test_half_an_hour_of_driving_and_parking_leaves_what_it_should(tmp_path: Path) -> None:
    day = CarDay(2, datetime(2026, 12, 31, 23, 57, tzinfo=UTC), cycle_s=900)
    quota_bytes = RESERVE_BYTES + 300_000
    found = soak(day, tmp_path, quota_bytes)
    truth = day.truth()
    segments = [row.segment for row in found.rows]
    assert segments == list(range(1, len(segments) + 1))
    assert found.rows[-1].drive == truth.drives == 2
    assert found.known_m() == pytest.approx(truth.known_m, rel=0.005)
    assert found.blind_s() == pytest.approx(truth.blind_s, abs=10.0)
    assert max(found.utc_errors_s(day)) < 0.1
    years = [datetime.fromtimestamp((row.utc_us or 0) / 1e6, UTC).year for row in found.rows]
    assert [(a, b) for a, b in pairwise(years) if a != b] == [(2026, 2027)]
    assert all(check.ok for check in found.checks)
    assert found.rows_lost == 0
    assert max(found.log_bytes) < MAX_FILE_BYTES + 1000
    assert len(found.log_bytes) >= 4
    assert 200 < found.dump_s < 1200  # then the room is kept for the logs
    assert max(sample.folder_bytes for sample in found.samples) < quota_bytes
    assert len({sample.open_files for sample in found.samples}) <= 2
    assert found.gained(lambda sample: sample.blocks, START_US + 900_000_000) < 0.02 * found.samples[0].blocks
