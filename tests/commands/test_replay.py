"""``ridelog replay`` and ``ridelog demo`` as a person runs them."""

from __future__ import annotations

import csv
import errno
import gzip
import json
import os
import re
import subprocess
import zlib
from datetime import datetime
from pathlib import Path

import pytest

from drivers.disk import FileSystem
from drivers.dump import DumpHeader, DumpWriter, Event
from logger.commands.main import main
from logger.estimation.drive_spectra import spectra_of_fields

from ..support.command import called

PATIENCE_S = 60
DRIVEN_MPS2 = 0.1  # noise of the demo's sensor
CONTRACT = (
    "segment,t_utc,t_s,distance_start_m,distance_end_m,lat_deg,lon_deg,speed_mps,iri_m_per_km,iri_std_m_per_km,"
    "iri_rms_m_per_km,a_w_mps2,mtvv_mps2,vdv_mps175,crest_factor,comfort,iri_class,flags"
)


def call(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=PATIENCE_S)


def rows(folder: Path) -> list[str]:
    return [line for path in sorted(folder.glob("*.csv")) for line in path.read_text().splitlines()[1:]]


@pytest.fixture(scope="module")
def replayed(ridelog: Path, short_dump: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A folder with the logs of the short drive, and what the command printed as it made them."""
    folder = tmp_path_factory.mktemp("replayed")
    done = call(ridelog, "replay", short_dump, "--out", folder, "--rate", "0", "--json")
    assert done.returncode == 0, done.stderr
    return folder, done.stdout


@pytest.mark.slow
def test_demo_ends_with_logs_a_summary_and_a_page(ridelog: Path, tmp_path: Path) -> None:
    done = call(ridelog, "demo", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "Roughest places" in done.stdout
    assert "GPS delay: 0." in done.stdout
    assert re.search(r"Sensor's noise: 0\.\d+ ± 0\.\d+ m/s2, learned over 1 drive\n", done.stdout)
    assert str(tmp_path / "out") in done.stdout
    assert (tmp_path / "out" / "report.html").read_text().startswith("<!doctype html>")
    assert len(made := rows(tmp_path / "out")) > 400
    assert not any("speed_doubtful" in row for row in made)  # speed and places agree
    assert call(ridelog, "verify", tmp_path / "out").returncode == 0


def test_rows_are_as_the_format_says(replayed: tuple[Path, str]) -> None:
    folder, reported = replayed
    outcome = json.loads(reported)
    (log,) = sorted(folder.glob("*.csv"))
    assert outcome["files"] == [log.name]
    text = log.read_text()
    header = text.splitlines()[0].split(",")
    assert ",".join(header[:18]) == CONTRACT
    assert header[-1] == "crc32"
    for line in text.splitlines()[1:]:
        body, _, check = line.rpartition(",")
        assert check == f"{zlib.crc32(body.encode()):08x}"
    assert outcome["receiver"]["delay_s"] is None  # a minute and a half: too short
    assert outcome["receiver"]["unknown_because"] == "not enough driving yet"
    assert outcome["receiver"]["mounting"] == []
    noise = outcome["noise"]
    assert noise["noise_drives"] == 1
    assert abs(noise["noise_mps2"] - DRIVEN_MPS2) < 2 * noise["noise_std_mps2"] < 2 * DRIVEN_MPS2
    records = list(csv.DictReader(text.splitlines()))
    assert outcome["rows"] == len(records)
    assert [int(record["segment"]) for record in records] == list(range(1, len(records) + 1))
    sidecar = json.loads(log.with_suffix(".json").read_text())
    assert sidecar["sensor"]["verified"] is True
    kept = spectra_of_fields(sidecar["drive_spectra"])
    driven = [float(row["speed_mps"]) for row in csv.DictReader(log.read_text().splitlines()) if row["speed_mps"]]
    assert len(kept) > 10 and min(driven) < kept.speed_mps.mean() < max(driven)


@pytest.mark.slow
def test_the_rate_changes_nothing_but_the_time_it_takes(
    ridelog: Path, short_dump: Path, replayed: tuple[Path, str], tmp_path: Path
) -> None:
    assert call(ridelog, "replay", short_dump, "--out", tmp_path, "--rate", "40").returncode == 0
    assert rows(replayed[0]) == rows(tmp_path)


@pytest.mark.slow
def test_a_recording_that_was_cut_gives_what_it_holds(
    ridelog: Path, short_dump: Path, replayed: tuple[Path, str], tmp_path: Path
) -> None:
    text = gzip.decompress(short_dump.read_bytes())
    cut = tmp_path / "cut.dump"
    cut.write_bytes(text[: len(text) * 2 // 3])
    done = call(ridelog, "replay", cut, "--out", tmp_path / "out")
    assert done.returncode == 0
    assert "cut short" in done.stdout
    kept = rows(tmp_path / "out")
    assert len(kept) > 20
    # The last seconds could not wait for what the road behind the cut would have shown of them.
    both = [(one.split(","), other.split(",")) for one, other in zip(kept, rows(replayed[0]), strict=False)]
    same = [pair for pair in both if float(pair[0][2]) < float(both[-1][0][2]) - 8.0]
    assert len(same) > 15
    assert [one[2:-1] for one, _ in same] == [other[2:-1] for _, other in same]
    # Rows from before the date was known are dated when their file is finished, by what was known of the clocks then.
    apart_s = [abs((datetime.fromisoformat(one[1]) - datetime.fromisoformat(other[1])).total_seconds())
               for one, other in same]
    assert max(apart_s) < 0.01
    assert not any(apart_s[3:])


def test_an_unverified_profile_is_named_in_every_log(tmp_path: Path) -> None:
    dump = tmp_path / "raw.dump"
    writer = DumpWriter(dump, DumpHeader(None, {"driver": "pasco", "profile": "ps2119"}, {"baud": 9600}, "rav4-2009"))
    frame = (4096).to_bytes(2, "little") * 2 + (4424).to_bytes(2, "little")
    for count in range(3000):
        writer.write(Event(1_000_000 + 10_000 * count, "pasco", frame))
    writer.close()
    done = called("replay", dump, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    (sidecar,) = (tmp_path / "out").glob("*-001.json")
    sensor = json.loads(sidecar.read_text())["sensor"]
    assert sensor["profile"] == "ps2119"
    assert sensor["verified"] is False


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", ":1: expected"),
        (b"hello\n", ":1: expected"),
        (
            b'# ridelog-dump 1 {"start_utc": null, "accelerometer": {"driver": "bma220"}, "gps": {}, '
            b'"vehicle": "cart"}\n',
            "cart",
        ),
        (
            b'# ridelog-dump 1 {"start_utc": null, "accelerometer": {"driver": "bma220"}, "gps": {}, '
            b'"vehicle": "rav4-2009"}\n1.000000 bma220 0000\n2.000000 bma220 000040\n',
            ":2: expected 3 bytes",
        ),
        (
            b'# ridelog-dump 1 {"start_utc": null, "accelerometer": {"driver": "bma220", "range_g": 3}, "gps": {}, '
            b'"vehicle": "rav4-2009"}\n',
            "range",
        ),
    ],
)
def test_bad_recordings_are_refused_in_one_line(tmp_path: Path, content: bytes, said: str) -> None:
    dump = tmp_path / "bad.dump"
    dump.write_bytes(content)
    done = called("replay", dump, "--out", tmp_path / "out")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert said in done.stderr
    assert not done.stdout


def test_no_such_recording(tmp_path: Path) -> None:
    done = called("replay", tmp_path / "none.dump", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "none.dump" in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_disk_that_is_full_is_named(
    short_dump: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: FileSystem, descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(FileSystem, "sync", full)
    with pytest.raises(OSError, match="No space left") as refused:
        main(["replay", str(short_dump), "--out", str(tmp_path)])
    assert refused.value.filename == str(tmp_path)


def test_a_report_never_replaces_a_device(replayed: tuple[Path, str], tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    done = called("report", replayed[0], "--out", tmp_path / "folder")
    assert done.returncode == 2
    assert "expected the name of a file" in done.stderr


@pytest.mark.parametrize("command", ["replay", "extract"])
def test_readings_at_another_rate_than_the_header_says_are_refused(command: str, short_dump: Path, tmp_path: Path
                                                                   ) -> None:
    head, rest = gzip.decompress(short_dump.read_bytes()).decode().split("\n", 1)
    begin, said = head.split("{", 1)[0], json.loads(head[head.index("{"):])
    said["accelerometer"]["oversample"] = 4
    dump = tmp_path / "often.dump"
    dump.write_text(f"{begin}{json.dumps(said)}\n{rest}", "utf-8")
    done = called(command, dump, "--out", tmp_path / "out")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (f"ridelog: {dump}:1: expected readings at 400 Hz, as 'oversample': 4 says, found them at "
                           "about 100 Hz\n")
