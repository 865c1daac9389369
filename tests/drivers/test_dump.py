"""Recorded dumps: exact times, tails cut anywhere, damage named by its line, memory that stays flat."""

from __future__ import annotations

import gzip
import json
import random
import subprocess
import sys
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.dump import (
    EVENT_BYTES,
    LATEST_US,
    LINE_BYTES,
    SOURCES,
    DumpHeader,
    DumpWriter,
    Event,
    intact_bytes,
    open_dump,
)
from drivers.errors import DumpError

HEADER = DumpHeader("2026-07-04T10:15:00Z", {"driver": "bma220", "range_g": 2}, {"baud": 9600}, "rav4-2009")
FIRST = ('# ridelog-dump 1 {"start_utc": "2026-07-04T10:15:00Z", "accelerometer": {"driver": "bma220", "range_g": 2},'
         ' "gps": {"baud": 9600}, "vehicle": "rav4-2009"}\n')
EVENTS = [
    Event(0, "bma220", b"\x00\x04\x40"),
    Event(10_000, "bma220", b"\xff\x04\x3c"),
    Event(10_000, "nmea", b"$GPRMC,,V,,,,"),
    Event(1_999_999, "nmea", b",,,,,N*53\r\n"),
    Event(86_400_000_001, "bma220", b"\x80\x80\x7c"),
]
LINES = [
    "0.000000 bma220 000440\n",
    "0.010000 bma220 ff043c\n",
    "0.010000 nmea 244750524d432c2c562c2c2c2c\n",
    "1.999999 nmea 2c2c2c2c2c4e2a35330d0a\n",
    "86400.000001 bma220 80807c\n",
]


def write(path: Path, events: list[Event], header: DumpHeader = HEADER) -> Path:
    writer = DumpWriter(path, header)
    for event in events:
        writer.write(event)
    writer.close()
    return path


def read(path: Path) -> tuple[list[Event], bool]:
    with open_dump(path) as reader:
        events = list(reader)
        return events, reader.torn_tail


def refusal(path: Path) -> str:
    with pytest.raises(DumpError) as caught:
        read(path)
    return str(caught.value)


def text_dump(path: Path, *lines: str) -> Path:
    path.write_text(FIRST + "".join(lines), "ascii")
    return path


def test_written_as_the_format_says(tmp_path: Path) -> None:
    path = write(tmp_path / "a.dump", EVENTS)
    assert path.read_text("ascii") == FIRST + "".join(LINES)


@pytest.mark.parametrize("name", ["a.dump", "a.dump.gz"])
def test_read_back(tmp_path: Path, name: str) -> None:
    path = write(tmp_path / name, EVENTS)
    with open_dump(path) as reader:
        assert reader.header == HEADER
        assert list(reader) == EVENTS
        assert not reader.torn_tail
    assert (path.read_bytes()[:2] == b"\x1f\x8b") == name.endswith(".gz")


def test_compression_is_recognised_by_the_first_bytes(tmp_path: Path) -> None:
    (tmp_path / "a.dump").write_bytes(gzip.compress((FIRST + LINES[0]).encode()))
    assert read(tmp_path / "a.dump") == (EVENTS[:1], False)


def test_joined_compressed_files_read_as_one(tmp_path: Path) -> None:
    path = tmp_path / "a.dump.gz"
    path.write_bytes(gzip.compress(FIRST.encode()) + gzip.compress("".join(LINES).encode()))
    assert read(path) == (EVENTS, False)


@settings(max_examples=50)
@given(times=st.lists(st.integers(0, LATEST_US), max_size=20), data=st.binary(min_size=1, max_size=40),
       source=st.sampled_from(SOURCES), packed=st.booleans())
def test_any_events_come_back_exactly(
    tmp_path_factory: pytest.TempPathFactory, times: list[int], data: bytes, source: str, packed: bool
) -> None:
    if source == "bma220":
        data = (data * 3)[:3]
    events = [Event(t_us, source, data) for t_us in sorted(times)]
    path = write(tmp_path_factory.mktemp("dump") / ("a.dump.gz" if packed else "a.dump"), events)
    assert read(path) == (events, False)
    text = gzip.decompress(path.read_bytes()) if packed else path.read_bytes()
    stamps = [line.split()[0] for line in text.decode().splitlines()[1:]]
    assert [Decimal(stamp) * 1_000_000 for stamp in stamps] == [event.t_us for event in events]


def test_cut_at_every_byte_gives_a_prefix(tmp_path: Path) -> None:
    whole = (FIRST + "".join(LINES)).encode()
    path = tmp_path / "cut.dump"
    for cut in range(len(FIRST), len(whole)):
        path.write_bytes(whole[:cut])
        lines = whole[len(FIRST):cut].count(b"\n")
        assert read(path) == (EVENTS[:lines], not whole[:cut].endswith(b"\n"))
    for cut in range(len(FIRST)):
        path.write_bytes(whole[:cut])
        assert refusal(path).startswith(f"{path}:1: expected")


def test_compressed_and_cut_at_every_byte_gives_a_prefix(tmp_path: Path) -> None:
    path = tmp_path / "a.dump.gz"
    writer = DumpWriter(path, HEADER)
    flushed = [(path.stat().st_size, 0)]
    for count, event in enumerate(EVENTS, 1):
        writer.write(event)
        writer.flush(sync=count == 2)
        flushed.append((path.stat().st_size, count))
    writer.close()
    whole = path.read_bytes()
    cut_path = tmp_path / "cut.dump.gz"
    for cut in range(flushed[0][0], len(whole)):
        cut_path.write_bytes(whole[:cut])
        events, torn = read(cut_path)
        at_least = max(count for size, count in flushed if size <= cut)
        assert len(events) >= at_least
        assert events == EVENTS[:len(events)]
        assert torn == (cut not in dict(flushed))


def test_damage_behind_the_last_flush_is_found(tmp_path: Path) -> None:
    """Cut anywhere, or with any byte since the last flush changed: what is intact ends with the flush before."""
    path = tmp_path / "a.dump.gz"
    writer = DumpWriter(path, HEADER)
    ends = [0, path.stat().st_size]
    for event in EVENTS:
        writer.write(event)
        writer.flush(sync=False)
        ends.append(path.stat().st_size)
    writer.close()
    whole = path.read_bytes()
    hurt_path = tmp_path / "hurt.dump.gz"
    for place in range(len(whole)):
        before = max(end for end in ends if end <= place)
        hurt_path.write_bytes(whole[:place])
        assert intact_bytes(hurt_path) == before
        after = min(end for end in ends if end > place)
        hurt = whole[:place] + bytes([whole[place] ^ 0x10]) + whole[place + 1:after]
        hurt_path.write_bytes(hurt)
        if intact_bytes(hurt_path) != before:  # some bits of gzip mean nothing to its content
            assert gzip.decompress(hurt) == gzip.decompress(whole[:after])


def test_a_long_recording_is_looked_at_from_its_end(tmp_path: Path) -> None:
    path = tmp_path / "a.dump.gz"
    writer = DumpWriter(path, HEADER)
    rng = random.Random(3)
    for count in range(30):
        writer.write(Event(count, "nmea", rng.randbytes(EVENT_BYTES)))
        writer.flush(sync=False)
    writer.close()
    size = path.stat().st_size
    assert intact_bytes(path) == size > 500_000
    for zeros in (100, 300_000, 2_000_000):
        with path.open("ab") as file:
            file.write(bytes(zeros))
        assert intact_bytes(path) == size


def test_what_was_flushed_can_be_read_while_recording(tmp_path: Path) -> None:
    for name in ("a.dump", "a.dump.gz"):
        writer = DumpWriter(tmp_path / name, HEADER)
        assert read(tmp_path / name)[0] == []
        for event in EVENTS[:3]:
            writer.write(event)
        writer.flush(sync=True)
        assert read(tmp_path / name)[0] == EVENTS[:3]
        writer.close()
        writer.close()


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("0.01 bma220 000440\n", "six decimals"),
        ("1 bma220 000440\n", "six decimals"),
        (".000001 bma220 000440\n", "six decimals"),
        ("-1.000000 bma220 000440\n", "six decimals"),
        ("1_0.000000 bma220 000440\n", "six decimals"),
        ("1e3.000000 bma220 000440\n", "six decimals"),
        ("9" * 30 + ".000000 bma220 000440\n", "six decimals"),
        ("9" * 5000 + ".000000 bma220 000440\n", "six decimals"),
        ("nan bma220 000440\n", "six decimals"),
        ("0.020000 radar 000440\n", "bma220, iio, pasco, nmea"),
        ("0.020000 bma220 00044\n", "pairs of hex digits"),
        ("0.020000 bma220 00 440\n", "<t_s> <source> <hex>"),
        ("0.020000 bma220 0004zz\n", "pairs of hex digits"),
        ("0.020000 nmea \n", "at least one byte"),
        ("0.020000 bma220 0004\n", "3 bytes"),
        ("0.020000 bma220\n", "<t_s> <source> <hex>"),
        ("\n", "<t_s> <source> <hex>"),
        ("0.009999 bma220 000440\n", "a time not before the last one, 0.010000"),
        ("0.020000 nmea " + "00" * 33_000 + "\n", f"at most {LINE_BYTES} bytes"),
    ],
)
def test_damage_in_the_middle_is_named_by_its_line(tmp_path: Path, line: str, expected: str) -> None:
    path = text_dump(tmp_path / "a.dump", LINES[0], LINES[1], line, LINES[4])
    with open_dump(path) as reader:
        events = iter(reader)
        assert [next(events), next(events)] == EVENTS[:2]
        with pytest.raises(DumpError) as caught:
            next(events)
    assert str(caught.value).startswith(f"{path}:4: expected ")
    assert expected in str(caught.value)
    assert len(str(caught.value)) < 300


def test_endless_line_is_refused(tmp_path: Path) -> None:
    path = text_dump(tmp_path / "a.dump", LINES[0], "0" * 3 * LINE_BYTES)
    assert refusal(path).startswith(f"{path}:3: expected a line of at most {LINE_BYTES} bytes")


@pytest.mark.parametrize(
    ("first", "expected"),
    [
        ("", "the first line of a recorded dump"),
        ("t_s,accel_z_mps2\n", "the first line of a recorded dump"),
        ("# ridelog-dump 2 {}\n", "dump version 1, found '2'"),
        ("# ridelog-dump 1 {\n", "a JSON object"),
        ("# ridelog-dump 1 []\n", "a JSON object"),
        ("# ridelog-dump 1 " + "[" * 50_000 + "\n", "a JSON object"),
        ("# ridelog-dump 1 {}\n", "'start_utc'"),
        (FIRST.replace('"2026-07-04T10:15:00Z"', '"yesterday"'), "'start_utc'"),
        (FIRST.replace('"2026-07-04T10:15:00Z"', "12"), "'start_utc'"),
        (FIRST.replace('"bma220"', '"bma999"'), "'accelerometer'"),
        (FIRST.replace('{"baud": 9600}', "9600"), "'gps'"),
        (FIRST.replace('"rav4-2009"', "null"), "'vehicle'"),
    ],
)
def test_header_is_checked(tmp_path: Path, first: str, expected: str) -> None:
    path = tmp_path / "a.dump"
    path.write_text(first + LINES[0])
    assert refusal(path).startswith(f"{path}:1: expected")
    assert expected in refusal(path)


def test_start_may_be_unknown(tmp_path: Path) -> None:
    header = DumpHeader(None, {"driver": "pasco", "profile": "lines"}, {"baud": 4800}, "x")
    with open_dump(write(tmp_path / "a.dump", [], header)) as reader:
        assert reader.header == header
    assert json.loads((tmp_path / "a.dump").read_text().split(" ", 3)[3])["start_utc"] is None


def test_missing_file_is_a_dump_error(tmp_path: Path) -> None:
    assert refusal(tmp_path / "none.dump").startswith(f"{tmp_path / 'none.dump'}: expected a recorded dump")


def test_damaged_compression_is_a_dump_error(tmp_path: Path) -> None:
    packed = bytearray(gzip.compress((FIRST + "".join(LINES)).encode()))
    packed[-6] ^= 0xFF  # inside the stored CRC
    (tmp_path / "a.dump.gz").write_bytes(packed)
    assert "expected undamaged gzip data" in refusal(tmp_path / "a.dump.gz")


_READ_AND_MEASURE = """
import sys, tracemalloc
from drivers.dump import open_dump
from drivers.errors import DumpError
tracemalloc.start()
try:
    with open_dump(sys.argv[1]) as reader:
        for _ in reader:
            pass
except DumpError:
    print(tracemalloc.get_traced_memory()[1])
"""


@pytest.mark.slow
@pytest.mark.parametrize("filler", [b"\x00", b"0.000000 nmea 00\n"])
def test_compressed_bomb_does_not_fill_the_memory(tmp_path: Path, filler: bytes) -> None:
    block = filler * (1 << 16)
    path = tmp_path / "bomb.dump.gz"
    with gzip.open(path, "wb") as bomb:
        bomb.write(FIRST.encode())
        for _ in range(2):
            bomb.write(block)
        bomb.write(b"\x00" * 50_000_000)
    # In a process of its own: tracemalloc counts what other threads allocate as well, such as those of the test runner.
    read = subprocess.run([sys.executable, "-c", _READ_AND_MEASURE, path], capture_output=True, text=True, check=True)
    assert int(read.stdout) < 1_500_000


@settings(max_examples=100)
@given(data=st.binary(max_size=200), packed=st.booleans())
def test_random_bytes_raise_nothing_else(
    tmp_path_factory: pytest.TempPathFactory, data: bytes, packed: bool
) -> None:
    path = tmp_path_factory.mktemp("dump") / "a.dump"
    path.write_bytes(gzip.compress(FIRST.encode() + data) if packed else FIRST.encode() + data)
    try:
        events, _ = read(path)
    except DumpError:
        return
    assert all(event.source in SOURCES and event.data for event in events)


@pytest.mark.parametrize(
    "event",
    [Event(5, "radar", b"x"), Event(5, "nmea", b""), Event(-1, "nmea", b"x"), Event(LATEST_US + 1, "nmea", b"x"),
     Event(5, "nmea", bytes(EVENT_BYTES + 1))],
)
def test_writer_refuses_what_no_reader_would_take(tmp_path: Path, event: Event) -> None:
    writer = DumpWriter(tmp_path / "a.dump", HEADER)
    with pytest.raises(ValueError, match="cannot be recorded"):
        writer.write(event)
    writer.write(Event(10, "nmea", bytes(EVENT_BYTES)))
    with pytest.raises(ValueError, match="after 10 us"):
        writer.write(Event(9, "nmea", b"x"))
    writer.close()
    assert read(tmp_path / "a.dump") == ([Event(10, "nmea", bytes(EVENT_BYTES))], False)


def test_writer_never_overwrites(tmp_path: Path) -> None:
    write(tmp_path / "a.dump", EVENTS)
    with pytest.raises(FileExistsError):
        DumpWriter(tmp_path / "a.dump", HEADER)
