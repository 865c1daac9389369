"""Logs as arrays, against the reader that judges them row by row."""

from __future__ import annotations

import io
import zlib
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from logger.api.fleet import fleet_summarise
from logger.commands.main import main
from logger.fleet.dataset import Dataset
from logger.fleet.ingest import columns_of
from logger.store.log.row_format import HEADER, format_row, scan

from ..support.drives.fleet_town import drives, records, town

ROWS = [format_row(one) for one in records(drives(town(2, 200.0, 2), 1), 0)]


def checked(text: str) -> str:
    """A line with a check value that fits it."""
    return f"{text},{zlib.crc32(text.encode()):08x}"


def log_of(rows: list[str]) -> bytes:
    return "\n".join([HEADER, *rows, ""]).encode("ascii", "surrogateescape")


def with_field(name: str, text: str) -> str:
    fields = ROWS[3].split(",")[:-1]
    fields[HEADER.split(",").index(name)] = text
    return checked(",".join(fields))


HOSTILE = [
    with_field("segment", "99999999999"), with_field("segment", "1" * 40), with_field("drive", "-3000000000"),
    with_field("segment", "+4"), with_field("segment", ""), with_field("lat_deg", "95.0000000"),
    with_field("iri_m_per_km", "inf"), with_field("iri_m_per_km", "nan"), with_field("iri_m_per_km", "1e400"),
    with_field("iri_m_per_km", "9" * 300 + ".000"), with_field("duration_s", ""),
    with_field("t_utc", "2024-13-45T00:00:00.000Z"), with_field("t_utc", "9999-12-31T23:59:59.999Z"),
    with_field("iri_m_per_km", '"2.000"'), checked("1,2,3"), checked(""), "x" * 100_000, "", "\x00" * 50,
    ROWS[4] + ROWS[5], ROWS[6][:-1], HEADER,
]


def by_row(data: bytes) -> tuple[list[tuple[object, ...]], int]:
    rows = list(scan(io.BytesIO(data)))
    read = [one.record for one in rows if one.record is not None]
    far = [one for one in read if max(abs(one.segment), abs(one.drive)) >= 2**31]
    return ([(one.segment, one.utc_us or 0, one.lat_deg, one.iri_m_per_km, one.flags) for one in read
             if one not in far], sum(one.record is None for one in rows) + len(far))


def check(logs: list[bytes]) -> None:
    found = columns_of([(data, sha256(data).hexdigest()) for data in logs])
    for data, one in zip(logs, found, strict=True):
        rows, damaged = by_row(data)
        there = [(int(s), int(t), None if x != x else float(x), None if y != y else float(y),
                  tuple(f.split("|")) if f else ()) for s, t, x, y, f in zip(
                      *(one.columns[name] for name in ("segment", "utc_us", "lat_deg", "iri_m_per_km", "flags")),
                      strict=True)]
        assert (there, one.damaged_lines, one.sha256) == (rows, damaged, sha256(data).hexdigest())


@pytest.mark.parametrize("line", HOSTILE, ids=range(len(HOSTILE)))
def test_a_hostile_line_costs_itself_and_no_other(line: str) -> None:
    check([log_of(ROWS), log_of([*ROWS[:9], line, *ROWS[9:]]), log_of(ROWS[:7])])


def test_damage_anywhere_is_judged_as_row_by_row() -> None:
    random = np.random.default_rng(1)
    whole = log_of(ROWS)

    def changed(data: bytearray) -> None:
        data[random.integers(len(data))] = random.integers(256)

    def cut(data: bytearray) -> None:
        at = random.integers(len(data))
        del data[at : at + random.integers(1, 400)]

    def doubled(data: bytearray) -> None:
        at = random.integers(len(data))
        data[at:at] = data[max(at - 300, 0) : at]

    ways: list[Callable[[bytearray], None]] = [changed, cut, doubled]
    logs = []
    for _ in range(120):
        data = bytearray(whole)
        for way in random.choice(3, size=random.integers(0, 4)):
            if data:
                ways[way](data)
        logs.append(bytes(data))
    check([*logs, b"", b"\n", HEADER.encode(), whole])


def test_hostile_logs_are_refused_row_by_row_and_counted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number, line in enumerate(HOSTILE):
        (tmp_path / f"{number + 1:05d}-001.csv").write_bytes(log_of([*ROWS[:9], line, *ROWS[9:]]))
    expected = [by_row(path.read_bytes()) for path in sorted(tmp_path.glob("*.csv"))]
    assert main(["fleet", "ingest", str(tmp_path), "--to", str(tmp_path / "town"), "--car", "a"]) == 0
    assert f"Not used: {sum(damaged for _, damaged in expected)} damaged lines" in capsys.readouterr().out
    assert Dataset(tmp_path / "town").manifest.rows == sum(len({row[0] for row in rows}) for rows, _ in expected)


def test_an_iri_that_is_none_harms_no_other(tmp_path: Path) -> None:
    place = town(4, 200.0, 3)
    found = drives(place, 24)
    for number in range(24):
        rows = records(found, number)
        if number == 5:
            rows = [replace(one, iri_m_per_km=(0.0, -2.0)[at % 2]) for at, one in enumerate(rows)]
        log = tmp_path / "logs" / f"car{found.car[number]}" / f"{number + 1:05d}-001.csv"
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_bytes(log_of([format_row(one) for one in rows]))
    assert main(["fleet", "ingest", str(tmp_path / "logs"), "--to", str(tmp_path / "town"), "--car-folders"]) == 0
    summary = fleet_summarise(tmp_path / "town").found
    assert np.isfinite(summary.biases.log_std).all() and (summary.roads.iri_m_per_km > 0).all()
