"""``ridelog extract`` as a person runs it: dumps of a simulated drive whose truth is known, good ones and bad ones."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest
import yaml

from drivers.dump import DumpWriter, open_dump
from drivers.readings import GPS, Event
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle

from ..support.command import called
from ..support.drives.simulated_drive import (
    LEAD_M,
    SPACING_M,
    DemoDrive,
    DrivePlan,
    Reception,
    RoadStretch,
    record,
    simulate_drive,
)

PLAN = DrivePlan(
    speed_knots=((0, 0), (4, 0), (14, 13), (40, 11), (50, 14), (75, 12), (85, 0), (92, 0)),
    stretches=(RoadStretch(1200, 90),), reception=Reception(first_fix_s=2, latency_s=0.2), seed=11,
    offset_mps2=(0.1, 0.2, 0.15),
)
FROM_M, TO_M, ZERO_M = 100.0, 800.0, 4000.0
"""Of the drive: what was measured; and where the line's own distance begins."""


@pytest.fixture(scope="module")
def drive() -> DemoDrive:
    return simulate_drive(PLAN, read_vehicle(vehicle_file("rav4-2009")))


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory, drive: DemoDrive) -> Path:
    folder = tmp_path_factory.mktemp("field")
    record(drive, folder / "town.dump")
    (folder / "line.csv").write_text(line(drive))
    return folder


def line(drive: DemoDrive, mirrored: bool = False, scale: float = 1.0) -> str:
    at_m = SPACING_M * np.arange(len(drive.road.elevation_m)) - LEAD_M
    inside = (at_m >= FROM_M) & (at_m <= TO_M)
    at_m, height = at_m[inside], drive.road.elevation_m[inside]
    lat, lon = (np.interp(at_m, drive.motion.distance_m, one) for one in (drive.motion.lat_deg, drive.motion.lon_deg))
    if mirrored:
        lat, lon = lat[::-1], lon[::-1]
    rows = [f"{ZERO_M + scale * (one - FROM_M):.5f},{z:.6f}," + (f"{a:.8f},{b:.8f}" if number % 200 == 0 else ",")
            for number, (one, z, a, b) in enumerate(zip(at_m, height, lat, lon, strict=True))]
    return "\n".join(["distance_m,elevation_m,lat_deg,lon_deg", *rows]) + "\n"


def columns(run: Path) -> dict[str, np.ndarray]:
    table = np.genfromtxt(run / "drive.csv", delimiter=",", names=True)
    return {name: table[name] for name in table.dtype.names}


def test_a_dump_becomes_a_run_on_the_line_s_own_distance(place: Path, drive: DemoDrive, tmp_path: Path) -> None:
    done = called("extract", place / "town.dump", "--out", tmp_path, "--profile", place / "line.csv", "--json")
    assert done.returncode == 0, done.stderr
    (said,) = json.loads(done.stdout)["runs"]
    assert said["run"] == str(tmp_path / "town")
    assert said["by_road"] and said["gaps"] == 0
    found = columns(tmp_path / "town")
    true_m = np.interp(found["t_s"] - drive.start_us / 1e6, drive.motion.time_s, drive.motion.distance_m)
    off_m = found["distance_m"] - (true_m + ZERO_M - FROM_M)
    moving = found["speed_mps"] > 0.5
    assert np.sqrt(np.mean(off_m[moving] ** 2)) < 0.06
    assert said["place_std_m"] < 0.15
    assert (found["usable"] == 1).all()
    assert abs(found["accel_z_mps2"].mean()) < 0.02  # gravity and offset are gone, and nothing else was done
    assert len(np.unique(np.round(np.diff(np.unique(found["accel_z_mps2"])), 6))) == 1
    facts = yaml.safe_load((tmp_path / "town" / "run.yaml").read_text())
    assert facts["source"] == "town.dump"
    assert facts["sensor"]["step_mps2"] == pytest.approx(0.612916, abs=1e-6)
    assert facts["places"] == {"by": "road", "vehicle": "rav4-2009"}
    assert "noise_mps2" not in facts["sensor"]  # nobody measured it


@pytest.mark.slow
def test_a_line_whose_distance_is_too_long_is_said(place: Path, drive: DemoDrive, tmp_path: Path) -> None:
    (tmp_path / "line.csv").write_text(line(drive, scale=1.01))
    for profile, words in ((place / "line.csv", 0), (tmp_path / "line.csv", 1)):
        done = called("extract", place / "town.dump", "--out", tmp_path / "runs", "--profile", profile)
        assert done.returncode == 0, done.stderr
        assert done.stdout.count("is the profile's distance_m right?") == words
    said = yaml.safe_load((tmp_path / "runs" / "town" / "run.yaml").read_text())["receiver"]
    assert said["speed_scale"] == pytest.approx(1 / 1.01, abs=3 * said["speed_scale_std"])
    assert said["speed_scale_std"] < 0.002


@pytest.mark.slow
def test_the_lab_reads_what_was_extracted(place: Path, tmp_path: Path) -> None:
    assert called("extract", place / "town.dump", "--out", tmp_path, "--profile", place / "line.csv").returncode == 0
    done = called("compare", "--json", "--vehicle", "rav4-2009", tmp_path / "town")
    assert done.returncode == 0, done.stderr
    assert 0.2 < json.loads(done.stdout)["error"] < 0.8  # of a sensor with steps as large as the ride


def test_without_a_line_the_distance_begins_anywhere_and_the_way_is_right(
        place: Path, drive: DemoDrive, tmp_path: Path) -> None:
    done = called("extract", place / "town.dump", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "corrected for a GPS delay" in done.stdout
    found = columns(tmp_path / "town")
    true_m = np.interp(found["t_s"] - drive.start_us / 1e6, drive.motion.time_s, drive.motion.distance_m)
    assert np.ptp(found["distance_m"] - true_m) < 3.0
    assert not (tmp_path / "town" / "profile.csv").exists()


@pytest.mark.slow
def test_extracting_again_leaves_nothing_of_before(place: Path, tmp_path: Path) -> None:
    assert called("extract", place / "town.dump", "--out", tmp_path, "--profile", place / "line.csv").returncode == 0
    assert called("extract", place / "town.dump", "--out", tmp_path).returncode == 0
    assert sorted(one.name for one in (tmp_path / "town").iterdir()) == ["drive.csv", "run.yaml"]


def test_the_run_of_another_dump_is_never_written_over(place: Path, tmp_path: Path) -> None:
    (tmp_path / "town").mkdir()
    (tmp_path / "town" / "drive.csv").write_text("mine")
    done = called("extract", place / "town.dump", "--out", tmp_path)
    assert done.returncode == 2
    assert "expected an empty folder" in done.stderr
    assert (tmp_path / "town" / "drive.csv").read_text() == "mine"


def test_of_two_dumps_the_good_one_is_done(place: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.dump").write_text("no dump\n")
    done = called("extract", tmp_path / "bad.dump", place / "town.dump", "--out", tmp_path / "runs")
    assert done.returncode == 1
    assert "bad.dump:1" in done.stderr
    assert (tmp_path / "runs" / "town" / "drive.csv").exists()


def changed(place: Path, folder: Path, keep: object) -> Path:
    """The dump with only those events that a function keeps."""
    out = folder / "town.dump"
    with open_dump(place / "town.dump") as reader:
        writer = DumpWriter(out, reader.header)
        for event in reader:
            if keep(event):  # type: ignore[operator]
                writer.write(event)
        writer.close()
    return out


@pytest.mark.slow
def test_what_cannot_be_used_is_refused_in_one_line(place: Path, drive: DemoDrive, tmp_path: Path) -> None:
    (tmp_path / "mirrored.csv").write_text(line(drive, mirrored=True))
    header, *rows = line(drive).splitlines()
    (tmp_path / "bare.csv").write_text("\n".join([header, *(row.rsplit(",", 2)[0] + ",," for row in rows)]) + "\n")
    (tmp_path / "far.csv").write_text("\n".join([header, *(row.replace(",38.", ",39.") for row in rows)]) + "\n")
    (tmp_path / "typo.csv").write_text("\n".join([header, rows[0].replace(",-76", ",76"), *rows[1:]]) + "\n")
    (tmp_path / "file").write_text("")
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    dump = place / "town.dump"
    for words, said in (
        ((dump, "--profile", tmp_path / "mirrored.csv"), "from its end to its beginning"),
        ((dump, "--profile", tmp_path / "far.csv"), "the nearest fix is"),
        ((dump, "--profile", tmp_path / "bare.csv"), "two rows or more with lat_deg,lon_deg"),
        ((dump, "--profile", tmp_path / "typo.csv"), "no farther apart than their distances"),
        ((changed(place, tmp_path / "a", lambda one: one.source != GPS),), "fixes with a speed and a position"),
        ((changed(place, tmp_path / "b", lambda one: one.source == GPS),), "expected readings of the accelerometer"),
        ((dump, dump), "dumps of different names"),
    ):
        done = called("extract", *words, "--out", tmp_path / "runs")
        assert done.returncode == 2, done.stdout
        assert said in done.stderr
        assert len(done.stderr.splitlines()) == 1
    assert called("extract", dump, "--out", tmp_path / "file").returncode == 2


def without_speeds(data: bytes) -> bytes:
    """Sentences of a receiver that tells places alone: no VTG, and neither speed nor course in RMC."""
    found = []
    for sentence in data[data.find(b"$"):].decode("ascii", "replace").splitlines():
        words = sentence.lstrip("$").split("*")[0].split(",")
        if words[0].endswith("RMC"):
            words[7] = words[8] = ""
        if not words[0].endswith("VTG"):
            body = ",".join(words)
            found.append(f"${body}*{reduce(xor, body.encode()):02X}\r\n")
    return "".join(found).encode()


@pytest.mark.slow
def test_dumps_without_speeds_or_with_three_readings_are_refused_in_one_line(place: Path, tmp_path: Path) -> None:
    with open_dump(place / "town.dump") as reader:
        header, events = reader.header, list(reader)
    fixes, readings = ([one for one in events if (one.source == GPS) == is_fix] for is_fix in (True, False))
    middle = readings[len(readings) // 2 :][:3]
    second_s = sorted({one.t_us // 1_000_000 for one in fixes})
    silent = [Event(second * 1_000_000 + 999_999, GPS, without_speeds(b"".join(
        one.data for one in fixes if one.t_us // 1_000_000 == second))) for second in second_s]
    for name, kept, said in (
        ("silent", [*readings, *(one for one in silent if one.data)], "expected fixes with a speed and a position"),
        ("three", [*fixes, *middle], "expected 5 s and 30 m of driving with fixes and readings"),
        ("bare", middle, "expected fixes with a speed and a position"),
    ):
        writer = DumpWriter(tmp_path / f"{name}.dump", header)
        for event in sorted(kept, key=lambda one: one.t_us):
            writer.write(event)
        writer.close()
        done = called("extract", tmp_path / f"{name}.dump", "--out", tmp_path / "runs")
        assert done.returncode == 2, done.stdout
        assert said in done.stderr and len(done.stderr.splitlines()) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("length_m", "status", "said"), [
    (40, 2, "expected 5 s and 30 m of driving on the profile"), (150, 0, "s off the profile")])
def test_of_a_line_that_is_shorter_than_the_drive_the_part_on_it_is_used(
    place: Path, drive: DemoDrive, tmp_path: Path, length_m: int, status: int, said: str
) -> None:
    header, *rows = line(drive).splitlines()
    (tmp_path / "short.csv").write_text("\n".join([header, *rows[2800 : 2801 + round(length_m / SPACING_M)]]) + "\n")
    done = called("extract", place / "town.dump", "--out", tmp_path / "runs", "--profile", tmp_path / "short.csv")
    assert done.returncode == status
    assert said in done.stdout + done.stderr
    complaints = [line for line in done.stderr.splitlines() if not line.startswith("Wrote ")]
    assert len(complaints) == (status != 0)
    if status == 0:
        way_m = columns(tmp_path / "runs" / "town")["distance_m"]
        assert float(np.ptp(way_m)) == pytest.approx(length_m, abs=60)  # with a lead before and behind


@pytest.mark.slow
def test_a_serial_sensor_and_a_car_that_halts_for_long(tmp_path: Path) -> None:
    plan = replace(PLAN, sensor="lines", noise_mps2=0.02, speed_knots=(
        (0, 0), (3, 0), (12, 12), (35, 12), (45, 0), (380, 0), (390, 12), (420, 12), (425, 12)))
    record(simulate_drive(plan, read_vehicle(vehicle_file("rav4-2009"))), tmp_path / "halt.dump")
    done = called("extract", tmp_path / "halt.dump", "--out", tmp_path / "runs", "--json")
    assert done.returncode == 0, done.stderr
    assert [Path(one["run"]).name for one in json.loads(done.stdout)["runs"]] == ["halt", "halt-2"]


@pytest.mark.slow
def test_what_stands_where_nothing_was_read_does_not_matter(place: Path, tmp_path: Path) -> None:
    said = []
    for seed in (1, 2):
        out = tmp_path / str(seed)
        assert called("extract", place / "town.dump", "--out", out, "--profile", place / "line.csv").returncode == 0
        file = out / "town" / "drive.csv"
        header, *rows = file.read_text().splitlines()
        cells = [row.split(",") for row in rows]
        level, usable = (header.split(",").index(name) for name in ("accel_z_mps2", "usable"))
        rng = np.random.default_rng(seed)
        for at in range(500, len(cells) - 200, 60):
            for row in cells[at : at + 1 + at % 17]:
                row[level], row[usable] = f"{rng.normal(0, 3):.4f}", "0"
        file.write_text("\n".join([header, *map(",".join, cells)]) + "\n")
        done = called("compare", "--json", "--vehicle", "rav4-2009", out / "town")
        assert done.returncode == 0, done.stderr
        found = json.loads(done.stdout)
        assert len(found["runs"]) == 1
        said.append((found["error"], found["refitted"]["error"]))
    assert said[0] == pytest.approx(said[1], rel=1e-3)
