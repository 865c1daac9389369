"""Runs: what is written comes back, and what is refused is named with its line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from logger.api.inputs import run_on_road as read_run
from logger.errors import BadInput
from logger.profiles.track import Track
from logger.store.formats.drive_file import read_speeds, write_drive, write_profile

HEADER = "t_s,accel_z_mps2,speed_mps,distance_m"
TRACK = Track(0.1, np.linspace(0, 1, 21) ** 2, 4.0)
TWO = Track(0.1, np.stack([TRACK.elevation_m, -TRACK.elevation_m], axis=1))


def columns(count: int = 50, rate_hz: float = 100.0) -> dict[str, np.ndarray]:
    t_s = 3 + np.arange(count) / rate_hz
    rng = np.random.default_rng(1)
    return {"t_s": t_s, "accel_z_mps2": rng.standard_normal(count), "speed_mps": 10 + rng.standard_normal(count),
            "distance_m": 1000 + 10 * t_s}


@pytest.mark.parametrize("rate_hz", [100.0, 128.0, 1000.0])
@pytest.mark.parametrize("track", [TRACK, TWO], ids=["one", "two"])
def test_a_run_comes_back(tmp_path: Path, track: Track, rate_hz: float) -> None:
    written = columns(rate_hz=rate_hz)
    place = {"lat_deg": np.linspace(39, 39.01, 50), "lon_deg": np.linspace(-77, -77.01, 50)}
    write_drive(tmp_path / "drive.csv", written | {"wheel_front_mps2": np.zeros(50)} | place)
    write_profile(tmp_path / "profile.csv", track)
    run = read_run(tmp_path)
    assert run.path == tmp_path
    for found, name in ((run.time_s, "t_s"), (run.accel_z_mps2, "accel_z_mps2"), (run.speed_mps, "speed_mps"),
                        (run.distance_m, "distance_m")):
        assert found == pytest.approx(written[name], rel=1e-9)
    assert run.lat_deg == pytest.approx(place["lat_deg"], abs=1e-7)
    assert run.lon_deg == pytest.approx(place["lon_deg"], abs=1e-7)
    assert (run.track.start_m, run.track.spacing_m) == pytest.approx((track.start_m, 0.1))
    assert run.track.elevation_m == pytest.approx(track.elevation_m, abs=0.5e-7)


def test_the_header_is_that_of_the_contract(tmp_path: Path) -> None:
    write_drive(tmp_path / "drive.csv", columns())
    lines = (tmp_path / "drive.csv").read_text().splitlines()
    assert lines[0] == HEADER
    assert len(lines) == 51
    assert lines[2].startswith("3.01,")


def test_times_rounded_to_milliseconds_come_back_even(tmp_path: Path) -> None:
    t_s = np.arange(700) / 128
    rows = "".join(f"\n{t:.3f},0,1,{t:.3f}" for t in t_s)
    (tmp_path / "drive.csv").write_text(HEADER + rows)
    write_profile(tmp_path / "profile.csv", TRACK)
    run = read_run(tmp_path)
    assert run.time_s == pytest.approx(t_s, abs=1e-3)
    assert np.ptp(np.diff(run.time_s)) < 1e-12
    assert run.lat_deg is None
    assert run.lon_deg is None


GOOD = [f"{k / 100:.2f},0.1,10,{k / 10:.1f}" for k in range(30)]


def spoilt(line: int, row: str) -> str:
    return "\n".join([HEADER, *GOOD[: line - 2], row, *GOOD[line - 1:]])


@pytest.mark.parametrize(("text", "complaint"), [
    ("", ":1: expected a header with t_s,accel_z_mps2,speed_mps,distance_m[,lat_deg,lon_deg][,usable], each once, f"),
    ("t_s,accel_z_mps2,speed_mps\n0,0,0", ":1: expected a header with t_s"),
    (HEADER + ",lat_deg\n0,0,0,0,1", ":1: expected a header with t_s"),
    (HEADER + ",speed_mps\n0,0,0,0,1", ":1: expected a header with t_s"),
    (HEADER, ":2: expected numbers below the header, found nothing"),
    (HEADER + "\n0,0,0,0", ":3: expected at least two samples"),
    (spoilt(7, "0.05,x,10,0.5"), ":7: expected a number for accel_z_mps2, found 'x'"),
    (spoilt(7, "0.05,0.1,,0.5"), ":7: expected a number for speed_mps, found nothing"),
    (spoilt(7, "0.05,0.1,10"), ":7: expected 4 fields"),
    (spoilt(7, "0.04,0.1,10,0.5"), ":7: expected a time after 0.04 s, found 0.04"),
    (spoilt(7, "0.055,0.1,10,0.5"), ":7: expected samples evenly 0.01 s apart, found a step of 0.015 s"),
    (spoilt(7, "0.05,2e6,10,0.5"), ":7: expected accel_z_mps2 within 1e6 m/s2, found 2e+06"),
    (spoilt(7, "0.05,0.1,200,0.5"), ":7: expected speed_mps within 150 m/s, found 200"),
])
def test_what_is_no_drive_is_refused_with_its_line(tmp_path: Path, text: str, complaint: str) -> None:
    write_profile(tmp_path / "profile.csv", TRACK)
    (tmp_path / "drive.csv").write_text(text)
    with pytest.raises(BadInput) as refused:
        read_run(tmp_path)
    assert str(refused.value).startswith(f"{tmp_path / 'drive.csv'}{complaint}")


def test_what_is_missing_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"none: expected a folder with drive\.csv and profile\.csv"):
        read_run(tmp_path / "none")
    with pytest.raises(BadInput, match=r"drive\.csv: expected a readable file"):
        read_run(tmp_path)
    write_drive(tmp_path / "drive.csv", columns())
    with pytest.raises(BadInput, match=r"expected a run with the profile"):
        read_run(tmp_path)


def test_speeds(tmp_path: Path) -> None:
    path = tmp_path / "speeds.csv"
    path.write_text("speed_mps,note,t_s\n0,,0\n10,,4.5\n10,,60\n")
    time_s, speed_mps = read_speeds(path)
    assert (time_s.tolist(), speed_mps.tolist()) == ([0.0, 4.5, 60.0], [0.0, 10.0, 10.0])


@pytest.mark.parametrize(("text", "complaint"), [
    ("t_s\n0\n1", ":1: expected a header with t_s,speed_mps, each once"),
    ("t_s,speed_mps\n0,1", ":3: expected at least two samples"),
    ("t_s,speed_mps\n0,1\n1,1\n1,2", ":4: expected a time after 1 s, found 1"),
    ("t_s,speed_mps\n0,1\n1,-1\n", ":3: expected a speed of 0 or more, found -1"),
    ("t_s,speed_mps\n0,1\n1,151\n", ":3: expected speed_mps within 150 m/s, found 151"),
])
def test_what_are_no_speeds_is_refused_with_its_line(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "speeds.csv"
    path.write_text(text)
    with pytest.raises(BadInput) as refused:
        read_speeds(path)
    assert str(refused.value).startswith(f"{path}{complaint}")
