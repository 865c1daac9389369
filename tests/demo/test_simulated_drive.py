"""Simulated drives: bytes against another parser, motion against scipy, and the shipped drive against its plan."""

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pynmeagps import NMEAParseError, NMEAReader
from scipy import signal

import logger.demo
from drivers.dump import open_dump
from logger.roads import iso8608
from logger.roads.iri import iri
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.models import half_car

from ..support.drives import simulated_drive
from ..support.drives.simulated_drive import (
    LEAD_M,
    PLAN,
    SPACING_M,
    DemoDrive,
    DrivePlan,
    Reception,
    RoadStretch,
    record,
    simulate_drive,
)

RAV4 = read_vehicle(vehicle_file("rav4-2009"))
SHIPPED = Path(logger.demo.__file__).parent / "drive.dump.gz"
SHORT = DrivePlan(speed_knots=((0, 10), (10, 10), (20, 15), (30, 15)),
                  stretches=(RoadStretch(100, 50), RoadStretch(1, 200)))


@pytest.fixture(scope="module")
def shipped() -> DemoDrive:
    return simulate_drive(PLAN, RAV4)


def sentences(drive: DemoDrive) -> list[tuple[int, bytes]]:
    """Every whole sentence and when its first byte arrived; UBX frames are cut out by their length."""
    stream = b"".join(event.data for event in drive.events if event.source == "nmea")
    times = np.repeat([event.t_us for event in drive.events if event.source == "nmea"],
                      [len(event.data) for event in drive.events if event.source == "nmea"])
    found, at = [], 0
    while at < len(stream):
        if stream[at: at + 2] == b"\xb5\x62":
            at += 8 + int.from_bytes(stream[at + 4: at + 6], "little")
            continue
        end = stream.find(b"\n", at) + 1
        if not end:  # the recording stops in a sentence
            break
        found.append((int(times[at]), stream[at:end]))
        at = end
    return found


def test_what_ships_is_what_the_plan_makes(shipped: DemoDrive, tmp_path: Path) -> None:
    record(shipped, tmp_path / "drive.dump.gz")
    assert gzip.decompress((tmp_path / "drive.dump.gz").read_bytes()) == gzip.decompress(SHIPPED.read_bytes())
    assert SHIPPED.stat().st_size < 400_000
    with open_dump(SHIPPED) as dump:
        assert dump.header == shipped.header
        assert list(dump) == shipped.events
        assert not dump.torn_tail


def test_the_shipped_drive_holds_what_it_promises(shipped: DemoDrive) -> None:
    motion = shipped.motion
    assert 4000 < motion.distance_m[-1] < 6000
    assert 24 < motion.speed_mps.max() <= 25
    assert max(np.abs(motion.forward_mps2).max(), np.abs(motion.left_mps2).max()) < 2.2
    standing = motion.time_s[(motion.speed_mps < 0.01) & (motion.time_s > 20) & (motion.time_s < 300)]
    assert np.ptp(standing) == pytest.approx(20, abs=1.5)
    roughness = shipped.road.iri(np.arange(0, motion.distance_m[-1], 100.0))
    assert roughness.min() < 3.05  # class A ...
    assert roughness.max() > 12.19  # ... to D
    bump = PLAN.bumps[0]
    assert np.interp(bump.at_m, motion.distance_m, motion.speed_mps) < 6
    over = (motion.distance_m > bump.at_m) & (motion.distance_m < bump.at_m + 8)
    assert np.abs(shipped.accel_mps2[over]).max() > 3


def test_receiver_bytes_are_good_nmea_at_the_right_place_and_time(shipped: DemoDrive) -> None:
    motion, good, bad, fixed = shipped.motion, 0, 0, {}
    for t_us, line in sentences(shipped):
        try:
            message = NMEAReader.parse(line)
        except NMEAParseError:
            bad += 1
            continue
        good += 1
        time_s = (t_us - shipped.start_us) / 1e6
        if message.msgID != "RMC":
            continue
        fixed[time_s] = message.status == "A"
        if message.status != "A":
            assert (message.lat, message.lon) == ("", "")
            continue
        utc_us = np.datetime64(f"{message.date}T{message.time}", "us").astype(int)
        fix_s = (utc_us - shipped.utc_offset_us - shipped.start_us) / 1e6
        assert time_s - fix_s == pytest.approx(0.165, abs=0.045)
        north_m = (message.lat - np.interp(fix_s, motion.time_s, motion.lat_deg)) * 111_195
        east_m = (message.lon - np.interp(fix_s, motion.time_s, motion.lon_deg)) * 111_195 * np.cos(np.radians(38.99))
        assert np.hypot(north_m, east_m) < 4
        assert message.spd * 1852 / 3600 == pytest.approx(np.interp(fix_s, motion.time_s, motion.speed_mps), abs=0.25)
    assert bad == 1
    assert good > 1300
    times = np.array(list(fixed))
    lost = times[~np.array(list(fixed.values()))]
    gaps = [lost[lost < 20], lost[(lost > 100) & (lost < 130)], lost[lost > 130]]
    assert [len(gap) for gap in gaps] == [8, 4, 25]


def test_chunks_split_and_join_sentences(shipped: DemoDrive) -> None:
    chunks = [event.data for event in shipped.events if event.source == "nmea"]
    assert sum(chunk.startswith(b"$") for chunk in chunks) < len(chunks) / 4
    assert any(b"\r\n$" in chunk for chunk in chunks)
    assert sum(chunk.count(b"\xb5\x62\x01\x22") for chunk in chunks) > 20


def test_sensor_bytes_are_six_bits_and_on_time(shipped: DemoDrive) -> None:
    events = [event for event in shipped.events if event.source == "bma220"]
    raw = np.frombuffer(b"".join(event.data for event in events), np.uint8)
    assert not (raw & 3).any()
    counts = np.where(raw > 127, raw.astype(int) - 256, raw).reshape(-1, 3) / 4
    assert np.mean(counts, axis=0) == pytest.approx(np.array(PLAN.offset_mps2) / 0.6129 + [0, 0, 16], abs=0.15)
    late_us = np.array([event.t_us for event in events]) - shipped.start_us - 10_000 * np.arange(len(events))
    assert late_us.min() >= 0
    assert np.median(late_us) < 100
    assert 800 < late_us.max() < 2100
    assert [event.t_us for event in shipped.events] == sorted(event.t_us for event in shipped.events)


def test_one_plan_is_one_drive() -> None:
    first, again = simulate_drive(SHORT, RAV4), simulate_drive(SHORT, RAV4)
    assert first.events == again.events
    assert simulate_drive(replace(SHORT, seed=2), RAV4).events != first.events


def test_body_moves_as_scipy_says() -> None:
    """At constant speed, below the recorder's cut-off: the whole chain of road, wheels, patch and steps once more."""
    drive = simulate_drive(replace(SHORT, speed_knots=((0, 12.5), (20, 12.5))), RAV4)
    profile_m = np.arange(len(drive.road.elevation_m)) * SPACING_M - LEAD_M
    time = drive.motion.time_s
    patch = np.linspace(-0.125, 0.125, 51)
    wheels = np.stack([
        np.interp(12.5 * time[:, None] + place + patch, profile_m, drive.road.elevation_m).mean(axis=1)
        for place in (0.0, -2.94)
    ], axis=1)
    a, b = half_car(RAV4).state_space()
    _, accel, _ = signal.lsim(signal.StateSpace(a, b, a[4:5], b[4:5]), wheels - wheels[0], time, interp=True)
    low = signal.butter(4, 30, fs=1000, output="sos")
    mine, theirs = (signal.sosfiltfilt(low, x)[5000:-500] for x in (drive.accel_mps2, accel))
    assert np.std(mine - theirs) < 0.01 * np.std(theirs)


def test_road_has_the_roughness_of_its_stretches() -> None:
    plan = replace(SHORT, speed_knots=((0, 20), (200, 20)), stretches=(RoadStretch(2000, 30), RoadStretch(1, 480)))
    drive = simulate_drive(plan, RAV4)
    smooth, rough = drive.road.iri([0, 2000, 4000])
    assert smooth == pytest.approx(iso8608.iri_from_gd_n0(30), rel=0.06)
    assert rough == pytest.approx(iso8608.iri_from_gd_n0(480), rel=0.06)
    first = round(LEAD_M / SPACING_M)
    alone = iri(drive.road.elevation_m[first: first + round(2000 / SPACING_M) + 1], SPACING_M)
    assert smooth == pytest.approx(alone, rel=0.01)
    assert drive.motion.distance_m[-1] == pytest.approx(4000, abs=0.1)


def test_lines_carry_the_same_acceleration() -> None:
    plan = replace(SHORT, sensor="lines", noise_mps2=0.0, rate_hz=100)
    drive = simulate_drive(plan, RAV4)
    assert drive.header.accelerometer["driver"] == "pasco"
    chunks = [event.data for event in drive.events if event.source == "pasco"]
    assert any(not chunk.endswith(b"\n") for chunk in chunks)
    lines = b"".join(chunks).split(b"\n")[:-1]
    z = np.array([[float(word) for word in line.split(b",")] for line in lines])[:, 2] * 9.80665 - 9.80665
    due = drive.accel_mps2[10 * np.arange(len(z))]
    assert len(z) > 2950
    assert np.std(z - due) < 0.02 * np.std(due)


def test_reception_and_sensor_are_as_planned(tmp_path: Path) -> None:
    plan = replace(SHORT, reception=Reception(first_fix_s=5, lost=((12, 15),), latency_s=0.4))
    drive = simulate_drive(plan, RAV4)
    status = [line.split(b",")[2] for _, line in sentences(drive) if line[3:6] == b"RMC"]
    assert b"".join(status) == b"V" * 5 + b"A" * 7 + b"V" * 3 + b"A" * 14
    record(drive, tmp_path / "plain.dump")
    with open_dump(tmp_path / "plain.dump") as dump:
        assert list(dump) == drive.events
    with pytest.raises(ValueError, match="bma220 or lines"):
        simulate_drive(replace(SHORT, sensor="adxl"), RAV4)


def test_the_maker_writes_the_file_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["simulated_drive", str(tmp_path / "drive.dump.gz")])
    simulated_drive.main()
    assert (tmp_path / "drive.dump.gz").stat().st_size == pytest.approx(SHIPPED.stat().st_size, rel=0.05)
