"""Acceleration records: what is read, and what is refused with its line."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.errors import BadInput
from logger.store.formats.record_file import read_record

HEADER = "t_s,accel_z_mps2"


def written(path: Path, header: str, rows: list[str], end: str = "\n") -> Path:
    path.write_bytes((end.join([header, *rows]) + end).encode())
    return path


def rows_at(rate_hz: float, count: int, decimals: int = 6) -> list[str]:
    return [f"{5 + k / rate_hz:.{decimals}f},{0.1 * k}" for k in range(count)]


def test_vertical_alone(tmp_path: Path) -> None:
    record = read_record(written(tmp_path / "a.csv", HEADER, rows_at(200.0, 50)))
    assert record.start_s == 5.0
    assert record.rate_hz == pytest.approx(200.0, rel=1e-6)
    assert record.duration_s == pytest.approx(0.25)
    np.testing.assert_allclose(record.accel_z_mps2, 0.1 * np.arange(50))
    assert record.accel_x_mps2 is None
    assert record.accel_y_mps2 is None


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_columns_by_name_in_any_order_among_others(tmp_path: Path, end: str) -> None:
    rows = [f"{k},,{2 * k},{k / 100:.2f},{3 * k}" for k in range(4)]
    header = "\ufeffaccel_y_mps2,note,accel_z_mps2,t_s,accel_x_mps2"
    record = read_record(written(tmp_path / "a.csv", header, rows, end))
    axes = [record.accel_x_mps2, record.accel_y_mps2, record.accel_z_mps2]
    np.testing.assert_array_equal(axes, np.outer((3, 1, 2), np.arange(4)))


@pytest.mark.parametrize(("rate_hz", "decimals"), [(80, 3), (100, 2), (128, 3), (512, 4), (1000, 3), (2000, 4)])
def test_times_as_people_round_them(tmp_path: Path, rate_hz: float, decimals: int) -> None:
    record = read_record(written(tmp_path / "a.csv", HEADER, rows_at(rate_hz, 3001, decimals)))
    assert record.rate_hz == pytest.approx(rate_hz, rel=1e-3)


GOOD = rows_at(100.0, 30)


def spoilt(**lines: str | None) -> list[str]:
    """GOOD with lines of the file replaced or, None, left out."""
    kept = {f"line{number}": row for number, row in enumerate(GOOD, start=2)} | lines
    return [row for row in kept.values() if row is not None]


@pytest.mark.parametrize(
    ("rows", "complaint"),
    [
        (spoilt(line4="5.02,abc"), r"a\.csv:4: expected a number for accel_z_mps2, found 'abc'"),
        (spoilt(line7="5.05,nan"), r"a\.csv:7: expected a number for accel_z_mps2, found 'nan'"),
        (spoilt(line9=","), r"a\.csv:9: expected a number for t_s, found nothing"),
        (spoilt(line31="5.2"), r"a\.csv:31: expected 2 fields \(t_s,accel_z_mps2\), found '5\.2'"),
        (spoilt(line5="5.03,1,2", line6="5.04"), r"a\.csv:5: expected 2 fields"),
        (spoilt(line12=None), r"a\.csv:12: expected samples evenly 0\.01 s apart, found a step of 0\.02 s"),
        (spoilt(line12="5.103,1"), r"a\.csv:12: expected samples evenly 0\.01 s apart, found a step of 0\.013 s"),
        (spoilt(line12="5.09,1"), r"a\.csv:12: expected a time after 5\.09 s, found 5\.09"),
        (spoilt(line12="5.1,2e6"), r"a\.csv:12: expected accel_z_mps2 within 1e6 m/s2, found 2e\+06"),
        (GOOD[:1], r"a\.csv:3: expected at least two samples, found the end"),
        ([], r"a\.csv:2: expected numbers below the header"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, rows: list[str], complaint: str) -> None:
    with pytest.raises(BadInput, match=complaint):
        read_record(written(tmp_path / "a.csv", HEADER, rows))


@pytest.mark.parametrize("header", ["x", "t_s", "time,accel", "t_s,accel_z_mps2,t_s", "t_s,accel_x_mps2"])
def test_headers_that_will_not_do(tmp_path: Path, header: str) -> None:
    with pytest.raises(BadInput, match=r"a\.csv:1: expected a header with t_s,accel_z_mps2\["):
        read_record(written(tmp_path / "a.csv", header, GOOD))


@given(data=st.binary(max_size=200))
@settings(max_examples=150)
def test_any_bytes_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.mktemp("bytes") / "a.csv"
    for head in (b"", HEADER.encode() + b"\n0.0,1\n"):
        path.write_bytes(head + data)
        try:
            record = read_record(path)
        except BadInput as refused:
            assert str(refused).startswith(f"{path}:")
        else:
            assert np.isfinite(record.accel_z_mps2).all()


def test_a_hundred_thousand_lines_take_no_time(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", HEADER, rows_at(1000.0, 100_000))
    started_s = time.perf_counter()
    assert len(read_record(path).accel_z_mps2) == 100_000
    assert time.perf_counter() - started_s < 1.0
