"""Rows of a segment log: written as the format says, read back, refused when any byte is wrong."""

from __future__ import annotations

import io
import math
import zlib
from dataclasses import fields, replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.records import WindowRecord
from logger.store.log.row_format import (
    COLUMNS,
    HEADER,
    LARGEST,
    LINE_BYTES,
    SHORTEST_ROW_BYTES,
    BadRow,
    LogColumn,
    format_row,
    parse_row,
    read_log,
    scan,
)

RECORD = WindowRecord(
    segment=123, drive=2, t_us=1_234_567_890, utc_us=1_783_160_100_250_999, duration_s=0.456789,
    distance_start_m=1000.125, distance_end_m=1007.745, lat_deg=-50.08765432, lon_deg=14.4212345, speed_mps=16.7,
    iri_m_per_km=2.345, iri_std_m_per_km=0.6, iri_rms_m_per_km=2.3449999, a_w_mps2=0.43212, mtvv_mps2=0.9,
    vdv_mps175=1.234, crest_factor=3.2, comfort="a_little_uncomfortable", iri_class="A", accel_rms_mps2=0.6543,
    samples=46, clipped_samples=1, flags=("clipped", "gap"), a_w_std_mps2=0.02, mtvv_std_mps2=0.03,
    vdv_std_mps175=0.04, a_w_raw_mps2=0.5, mtvv_raw_mps2=0.95, vdv_raw_mps175=1.3, iri_level_std_m_per_km=0.3,
    iri_common_std_m_per_km=0.1, iri_place_std_m_per_km=0.25,
)
BODY = ("123,2026-07-04T10:15:00.250Z,1234.567890,1000.125,1007.745,-50.0876543,14.4212345,16.700,2.345,0.600,"
        "2.345,0.4321,0.9000,1.2340,3.200,a_little_uncomfortable,A,clipped|gap,2,0.456789,0.6543,46,1,"
        "0.0200,0.0300,0.0400,0.5000,0.9500,1.3000,0.300,0.100,0.250")
UNKNOWN = replace(
    RECORD, utc_us=None, distance_start_m=None, distance_end_m=None, lat_deg=None, lon_deg=None, speed_mps=None,
    iri_m_per_km=None, iri_std_m_per_km=None, iri_rms_m_per_km=None, a_w_mps2=None, mtvv_mps2=None, vdv_mps175=None,
    crest_factor=None, accel_rms_mps2=None, comfort="", iri_class="", flags=(),
    a_w_std_mps2=None, mtvv_std_mps2=None, vdv_std_mps175=None, a_w_raw_mps2=None, mtvv_raw_mps2=None,
    vdv_raw_mps175=None, iri_level_std_m_per_km=None, iri_common_std_m_per_km=None, iri_place_std_m_per_km=None,
)
CONTRACT = ("segment,t_utc,t_s,distance_start_m,distance_end_m,lat_deg,lon_deg,speed_mps,iri_m_per_km,"
            "iri_std_m_per_km,iri_rms_m_per_km,a_w_mps2,mtvv_mps2,vdv_mps175,crest_factor,comfort,iri_class,flags,")

maybe = st.none() | st.floats(-LARGEST, LARGEST, width=32)
records = st.builds(
    WindowRecord, segment=st.integers(0, 10**9), drive=st.integers(0, 10**6), t_us=st.integers(-10**6, 10**15),
    utc_us=st.none() | st.integers(0, 4_000_000_000_000_000), duration_s=st.floats(0, 1e4),
    distance_start_m=maybe, distance_end_m=maybe, lat_deg=st.none() | st.floats(-90, 90),
    lon_deg=st.none() | st.floats(-180, 180), speed_mps=maybe, iri_m_per_km=maybe,
    iri_std_m_per_km=maybe, iri_rms_m_per_km=maybe, a_w_mps2=maybe, mtvv_mps2=maybe, vdv_mps175=maybe,
    crest_factor=maybe, comfort=st.sampled_from(["", "uncomfortable"]), iri_class=st.sampled_from(["", "C"]),
    accel_rms_mps2=maybe, samples=st.integers(0, 10**6), clipped_samples=st.integers(0, 10**6),
    flags=st.lists(st.sampled_from(["gap", "slow", "time_unset"]), unique=True).map(tuple),
    a_w_std_mps2=maybe, mtvv_std_mps2=maybe, vdv_std_mps175=maybe, a_w_raw_mps2=maybe, mtvv_raw_mps2=maybe,
    vdv_raw_mps175=maybe, iri_level_std_m_per_km=maybe, iri_common_std_m_per_km=maybe, iri_place_std_m_per_km=maybe,
)


def checked(body: str) -> str:
    return f"{body},{zlib.crc32(body.encode()):08x}"


def log_of(rows: list[str]) -> bytes:
    return "".join(f"{line}\n" for line in [HEADER, *rows]).encode()


def intact(data: bytes) -> list[str]:
    return [row.text for row in scan(io.BytesIO(data)) if row.record is not None]


def damaged(data: bytes) -> int:
    return sum(row.record is None for row in scan(io.BytesIO(data)))


def test_header_begins_as_the_format_says_and_ends_in_the_check() -> None:
    assert HEADER.startswith(CONTRACT)
    assert HEADER.endswith(",crc32")
    names = set(HEADER.replace("t_utc", "utc_us").replace(",t_s,", ",t_us,").split(","))
    assert names == {field.name for field in fields(WindowRecord)} | {"crc32"}


def test_row_by_hand() -> None:
    assert format_row(RECORD) == checked(BODY)


def test_row_of_what_is_not_known_by_hand() -> None:
    assert format_row(UNKNOWN) == checked("123,,1234.567890" + "," * 16 + "2,0.456789,,46,1" + "," * 9)
    assert parse_row(format_row(UNKNOWN)) == UNKNOWN


def test_times_are_exact_on_both_sides_of_zero() -> None:
    for t_us, text in [(0, "0.000000"), (-1, "-0.000001"), (-1_500_000, "-1.500000"), (10**15, "1000000000.000000")]:
        row = format_row(replace(RECORD, t_us=t_us))
        assert row.split(",")[2] == text
        assert parse_row(row).t_us == t_us


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_none_are_never_written(value: float) -> None:
    record = replace(RECORD, a_w_mps2=value, lat_deg=value)
    assert format_row(record) == format_row(replace(RECORD, a_w_mps2=None, lat_deg=None))
    with pytest.raises(ValueError, match="duration_s"):
        format_row(replace(RECORD, duration_s=value))


@pytest.mark.parametrize("value", [2 * LARGEST, -2 * LARGEST, 1e300, 3e38])
@pytest.mark.parametrize("column", [column for column in COLUMNS if column.largest], ids=lambda column: column.name)
def test_what_no_row_can_hold_is_written_as_unknown_and_refused_when_read(column: LogColumn, value: float) -> None:
    values = format_row(RECORD).split(",")[:-1]
    values[COLUMNS.index(column)] = f"{value:.{7 if 'deg' in column.name else 3}f}"
    with pytest.raises(BadRow, match=r"expected|finite"):
        parse_row(checked(",".join(values)))
    if column.name == "duration_s":
        with pytest.raises(ValueError, match="duration_s"):
            format_row(replace(RECORD, duration_s=value))
    else:
        row = format_row(replace(RECORD, **{column.attribute: value}))
        assert row == format_row(replace(RECORD, **{column.attribute: None}))


@pytest.mark.parametrize("day", ["9999-12-31", "0001-01-01", "1969-12-31", "2200-01-01"])
def test_a_date_of_another_age_is_refused_and_never_written(day: str) -> None:
    with pytest.raises(BadRow, match="expected UTC"):
        parse_row(checked(BODY.replace("2026-07-04", day)))
    for utc_us in (-1, 8_000_000_000_000_000, -(10**18), 10**18):
        assert format_row(replace(RECORD, utc_us=utc_us)) == format_row(replace(RECORD, utc_us=None))


@settings(max_examples=100)
@given(record=records)
def test_round_trip(record: WindowRecord) -> None:
    row = format_row(record)
    again = parse_row(row)
    assert format_row(again) == row
    assert again.t_us == record.t_us
    assert again.utc_us == (None if record.utc_us is None else record.utc_us // 1000 * 1000)
    assert (again.segment, again.drive, again.samples, again.flags) == (
        record.segment, record.drive, record.samples, record.flags)
    for name, half_a_step in [("lat_deg", 0.51e-7), ("distance_end_m", 0.51e-3), ("a_w_mps2", 0.51e-4)]:
        before, after = getattr(record, name), getattr(again, name)
        assert (before is None) == (after is None)
        if before is not None:
            assert after == pytest.approx(before, abs=half_a_step, rel=1e-15)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        (BODY + ",7", "columns"),
        (BODY.replace("T10", " 10"), "expected UTC"),
        (BODY.replace("-07-04", "-13-04"), "month"),
        (BODY.replace("1234.567890", "1234.56789"), "six decimals"),
        (BODY.replace("16.700", "nan"), "finite"),
        (BODY.replace("16.700", "fast"), "fast"),
        (BODY.replace("0.456789", ""), "float"),
    ],
)
def test_right_check_of_wrong_fields_is_refused(body: str, expected: str) -> None:
    with pytest.raises(BadRow, match=expected):
        parse_row(checked(body))


@pytest.mark.parametrize("row", ["", ",", "1,2", checked(BODY)[:-1], checked(BODY) + "0", checked(BODY)[:-8] + "E9"])
def test_wrong_check_is_refused(row: str) -> None:
    with pytest.raises(BadRow, match="crc32"):
        parse_row(row)


@settings(max_examples=100)
@given(text=st.text(max_size=80))
def test_any_text_is_a_row_or_refused(text: str) -> None:
    with pytest.raises(BadRow):
        parse_row(text)


def test_cut_at_every_byte_keeps_the_whole_rows() -> None:
    rows = [format_row(replace(RECORD, segment=n)) for n in range(3)]
    whole = log_of(rows)
    ends = [len(log_of(rows[:n])) - 1 for n in range(1, 4)]
    for cut in range(len(whole)):
        kept = sum(end <= cut for end in ends)
        assert intact(whole[:cut]) == rows[:kept]


@pytest.mark.slow
def test_any_wrong_byte_costs_its_own_row_only() -> None:
    rows = [format_row(replace(RECORD, segment=n)) for n in range(3)]
    whole = log_of(rows)
    for place in range(len(whole)):
        hit = whole[:place].count(b"\n") - 1  # -1: the header
        newline = whole[place:place + 1] == b"\n"
        left = [row for n, row in enumerate(rows) if n != hit or newline]
        for wrong in (whole[place] ^ 0x01, whole[place] ^ 0x20, whole[place] ^ 0x80, 0x00, ord("\n")):
            if wrong == whole[place]:
                continue
            data = whole[:place] + bytes([wrong]) + whole[place + 1:]
            assert intact(data) == left
            assert damaged(data) >= 1


def test_missing_header_shows_and_costs_no_row() -> None:
    data = f"{format_row(RECORD)}\n".encode()
    assert intact(data) == [format_row(RECORD)]
    assert damaged(data) == 1


def test_endless_line_is_read_in_pieces() -> None:
    data = log_of([]) + b"x" * 3 * LINE_BYTES + b"\n" + f"{format_row(RECORD)}\n".encode()
    assert intact(data) == [format_row(RECORD)]
    assert damaged(data) == 4


@settings(max_examples=100)
@given(data=st.binary(max_size=300))
def test_random_bytes_are_damage(data: bytes) -> None:
    assert intact(data) == []
    assert intact(log_of([]) + data) == []


def test_read_log(tmp_path: Path) -> None:
    path = tmp_path / "00001-001.csv"
    path.write_bytes(log_of([format_row(RECORD), "damaged", format_row(UNKNOWN)]) + b"12,torn")
    content = read_log(path)
    assert content.records == (parse_row(format_row(RECORD)), UNKNOWN)
    assert content.damaged_lines == 2


def test_no_row_is_shorter_than_one_of_which_nothing_is_known() -> None:
    unknown = {column.attribute: None for column in COLUMNS}
    counts = {"segment": 1, "t_us": 0, "comfort": "", "iri_class": "", "flags": (), "drive": 1, "duration_s": 0.0,
              "samples": 0, "clipped_samples": 0}
    shortest = format_row(WindowRecord(**(unknown | counts)))
    assert len(shortest) + 1 == SHORTEST_ROW_BYTES
