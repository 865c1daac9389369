"""What the fuzzer has found, each as one example."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path

import pytest

from drivers.dump import open_dump
from drivers.errors import DriverError, SettingsError
from drivers.wire_profiles import ScaleCalibration, load_profile, shipped_profiles
from logger.errors import BadInput
from logger.records import WindowRecord
from logger.service.config import load_config
from logger.service.wiring import config_for_dump
from logger.store.formats.drive_file import read_speeds
from logger.store.formats.profile_file import read_profile
from logger.store.formats.record_checks import read_channels
from logger.store.formats.record_file import read_record
from logger.store.formats.vehicle_file import read_vehicle
from logger.store.integrity import verify
from logger.store.log.row_format import BadRow, format_row, parse_row

ERD = "ERDFILEV2.00\n1,-1,1,1,5,0.1\nXUNITS m\nUNITSNAMm\nEND\n"


def dump_settings(path: Path) -> None:
    with open_dump(path) as reader:
        config_for_dump(reader.header, None, None, f"{path}:1")


def header(**changes: str) -> str:
    fields = {"start_utc": "null", "accelerometer": '{"driver": "pasco"}', "gps": "{}", "vehicle": '"rav4-2009"'}
    return "# ridelog-dump 1 {" + ", ".join(f'"{key}": {value}' for key, value in (fields | changes).items()) + "}\n"


@pytest.mark.parametrize(("read", "text", "place"), [
    (load_profile, "a: " + "[" * 3000, ":1: "),
    (load_profile, "name: !!int ''\n", ":1: "),
    (load_profile, "a: 1\nname: !!bool x\n", ":2: "),
    (load_profile, "name: !!timestamp x\n", ":1: "),
    (load_profile, 'a: 1\nname: "\\UFFFFFFFFF"\n', ":2: "),
    (load_profile, "a: " + "1:" * 200 + "1.5\n", ":1: "),
    (load_profile, "a: &a {b: 1}\nc: {<<: *a}\n", ":2: "),
    (load_profile, "a: 1\na: 2\n", ":2: "),
    (load_profile, "framing: 1\n" + "k" * 5000 + ": 1\n", ":2: "),
    (load_config, "log: {directory: " + "a" * 300 + "}\n", ":1: "),
    (load_config, "a: 1\n", ":1: "),
    (load_config, "vehicle: " + "a" * 300 + ".yaml\n", ":1: "),
    (load_config, "vehicle: ./x" + " x" * 500 + "\n", ":1: "),
    (load_config, "accelerometer: {bma220: {i2c_bus: dump:" + "a" * 300 + "}}\n", ":1: "),
    (load_config, 'log: {directory: "a\\0b"}\n', ":1: "),
    (load_config, 'status_file: "\\ud800"\n', ":1: "),
    (load_config, "k" * 900 + ": 1\n", ":1: "),
    (load_config, "accelerometer: {driver: pasco, pasco: {calibration: {x: [5000, 0, 5000.0000001, 1e6], "
                  "y: [1, 0, 9, 1], z: [1, 0, 9, 1]}}}\n", ":1: "),
    (load_config, "accelerometer: {pasco: {calibration: {x: [1e300, 1, -1e300, 1.1], y: [1, 0, 9, 1], "
                  "z: [1, 0, 9, 1]}}}\n", ":1: "),
    (read_channels, "t_s,a\x17\n0,1\n0.01,1e300\n", ":1: "),
    (read_channels, "t_s," + "a" * 3000 + "\n0,1\n0.01,x\n", ":1: "),
    (read_vehicle, "name: !<x%0Ay> 1\n", ":1: "),
    (read_vehicle, 'a: 1\nb: "\\UFFFFFFFF"\n', ":2: "),
    (read_profile, "distance_m,elevation_m\n0,0\n1e300,0\n", ":3: "),
    (read_profile, "distance_m,elevation_m,\x1a" + "x" * 3000 + "\n0,0\n", ":1: "),
    (read_profile, ERD + "1_0 2 3\n", ":6: "),
    (read_profile, ERD.replace("0.1", "1e-320") + "1 2 3\n", ":2: "),
    (read_profile, ERD.replace("1,-1", "9" * 4000 + ",-1"), ":2: "),
    (read_profile, ERD.replace("-1,", "5,") + "1 2 3\n", ":2: "),
    (read_profile, ERD.replace("UNITSNAMm", "UNITSNAM\x9f"), ":2: "),
    (read_record, "t_s,accel_z_mps2\n0,0\n1e-310,0\n", ":3: "),
    (read_record, "t_s,accel_z_mps2\n-1e300,0\n1e300,0\n", ":2: "),
    (read_record, "t_s,accel_z_mps2" + ",ab\x18" * 500 + "\n0,0\n", ":2: "),
    (read_speeds, "t_s,speed_mps," + "c," * 100_000 + "\n0,0\n", ":1: "),
    (dump_settings, header(vehicle='"' + "a" * 300 + '"'), ":1: "),
    (dump_settings, header(accelerometer='{"driver": "pasco", "profile": "a\\u0000.yaml"}'), ":1: "),
    (dump_settings, header(accelerometer='{"driver": "bma220", "vertical_axis": "' + "x" * 3000 + '"}'), ":1: "),
    (dump_settings, "# ridelog-dump 1\x07" + "\x9f" * 900 + " {}\n", ":1: "),
])
def test_a_refusal_is_one_clear_line(
    tmp_path: Path, read: Callable[[Path], object], text: str, place: str
) -> None:
    path = tmp_path / "input.yaml"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises((BadInput, DriverError)) as caught:
        read(path)
    complaint = str(caught.value)
    assert complaint.startswith(f"{path}{place}")
    assert complaint.isprintable()
    assert len(complaint) < 600 + len(str(path))


def test_every_complaint_about_a_profile_names_its_line(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    text = (Path(load_profile.__code__.co_filename).parent / "profiles" / "ps2119.yaml").read_text()
    assert "ps2119" in shipped_profiles()
    path.write_text(text.replace("offsets: [0, 2, 4]", "offsets: [0, 2]"))
    line = 1 + path.read_text()[: path.read_text().index("offsets")].count("\n")
    with pytest.raises(SettingsError, match=rf"mine\.yaml:{line}: expected a list of 3 numbers, .* for 'offsets'"):
        load_profile(path)


@pytest.mark.parametrize("one_g_raw", [1e-320, 0.5, float("inf"), float("nan")])
def test_a_scale_is_a_number(one_g_raw: float) -> None:
    with pytest.raises(SettingsError, match="calibration"):
        ScaleCalibration((0, 0, 0), (1, 1, one_g_raw))


RECORD = WindowRecord(
    segment=7, drive=1, t_us=12_000_000, utc_us=None, duration_s=0.4, distance_start_m=45.72, distance_end_m=53.34,
    lat_deg=46.5, lon_deg=6.6, speed_mps=20.0, iri_m_per_km=3.21, iri_std_m_per_km=1.1, iri_rms_m_per_km=3.21,
    a_w_mps2=0.4, mtvv_mps2=0.5, vdv_mps175=0.6, crest_factor=3.0, comfort="", iri_class="B", accel_rms_mps2=0.7,
    samples=40, clipped_samples=0, flags=())


@pytest.mark.parametrize(("old", "new"), [
    ("7,", "0_7,"), ("7,", " 7,"), ("7,", "+7,"), ("7,", "9" * 400 + ","), ("12.000000", "012.000000"),
    ("12.000000", "-0.000000"), ("12.000000", "9" * 400 + ".000000"), ("45.720", "45.72"), ("45.720", "4.572e1"),
    ("45.720", "045.720"), ("45.720", "4_5.720"),
])
def test_a_row_is_only_taken_as_it_would_be_written(tmp_path: Path, old: str, new: str) -> None:
    """Also with the right check value: nobody but ridelog writes rows, and a number of 400 digits breaks arithmetic."""
    row = format_row(RECORD)
    assert parse_row(row) == RECORD
    body = row.rpartition(",")[0].replace(old, new, 1)
    forged = f"{body},{zlib.crc32(body.encode()):08x}"
    with pytest.raises(BadRow, match="expected"):
        parse_row(forged)
    path = tmp_path / "00001-000.csv"
    path.write_text(f"{row}\n{forged}\n{forged}\n")
    assert verify([path])[0].records_good == 1
