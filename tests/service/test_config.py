"""The settings file: what is documented is what loads, and what is wrong is named with its line."""

from dataclasses import fields, is_dataclass
from functools import reduce
from operator import xor
from pathlib import Path
from typing import Any

import pytest
import yaml

from logger.errors import BadInput
from logger.service.config import Config, find_config, load_config
from logger.service.wiring import gps_decoder
from logger.shipped import shipped, vehicle_file, vehicle_names
from logger.store.export.sticks import Pairing

SHIPPED = shipped("config") / "ridelog.yaml"


def load(tmp_path: Path, text: str) -> Config:
    path = tmp_path / "ridelog.yaml"
    path.write_text(text, encoding="utf-8")
    return load_config(path)


def names(section: Any) -> dict[str, Any]:
    """Names of a dataclass's fields, nested as they are."""
    shape = {field.name: names(getattr(section, field.name)) if is_dataclass(getattr(section, field.name)) else None
             for field in fields(section)}
    if "sections" in shape:  # the sections of the accelerometers stand beside the keys for all of them
        del shape["sections"]
        shape |= {name: names(settings) for name, settings in section.sections.items()}
    return shape


def keys(section: dict[str, Any], shape: dict[str, Any]) -> dict[str, Any]:
    """Keys of the file, as deep as the dataclasses go."""
    return {key: keys(value, shape[key]) if isinstance(shape.get(key), dict) else None
            for key, value in section.items()}


def test_the_shipped_file_documents_every_key_and_no_other() -> None:
    shape = names(Config())
    assert keys(yaml.safe_load(SHIPPED.read_text(encoding="utf-8")), shape) == shape


def test_the_shipped_file_says_the_defaults() -> None:
    assert load_config(SHIPPED) == Config()


def test_every_shipped_vehicle_is_found_by_name() -> None:
    assert "rav4-2009" in vehicle_names()
    assert all(vehicle_file(name).is_file() for name in vehicle_names())
    with pytest.raises(BadInput, match=r"'tank'.*rav4-2009"):
        vehicle_file("tank")


def test_what_is_left_out_takes_its_default(tmp_path: Path) -> None:
    config = load(tmp_path, "pipeline:\n  low_pass_hz: 15\n")
    assert config.pipeline.low_pass_hz == 15
    assert config.pipeline.window_m == 7.62
    assert config.gps == Config().gps


def test_pairing_is_read(tmp_path: Path) -> None:
    assert load(tmp_path, "vehicle_error: 0.05\n").pairing == Pairing("off", Path("/etc/ridelog/stick.key"))
    config = load(tmp_path, "pairing:\n  mode: key_file\n  key_file: my.key\n")
    assert config.pairing == Pairing("key_file", tmp_path / "my.key")
    with pytest.raises(BadInput, match=r"yaml:2: expected one of off, first_stick, key_file"):
        load(tmp_path, "pairing:\n  mode: maybe\n")


def test_paths_are_relative_to_the_file(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("", encoding="utf-8")
    (tmp_path / "drive.dump.gz").write_bytes(b"")
    config = load(tmp_path, "vehicle: mine.yaml\nlog: {directory: logs}\nstatus_file: /tmp/status.json\n"
                            "accelerometer: {bma220: {i2c_bus: 'dump:drive.dump.gz', bandwidth_hz: 64}}\n")
    assert config.vehicle == tmp_path / "mine.yaml"
    assert config.log.directory == tmp_path / "logs"
    assert config.status_file == Path("/tmp/status.json")
    assert config.accelerometer.sections["bma220"].i2c_bus == tmp_path / "drive.dump.gz"
    assert config.accelerometer.sections["bma220"].bandwidth_hz == 64


def test_an_unverified_profile_runs_only_when_that_is_accepted(tmp_path: Path) -> None:
    text = "accelerometer:\n  driver: pasco\n  pasco:\n    profile: ps2119\n"
    with pytest.raises(BadInput, match=r":4: .*not verified on hardware.*accept_unverified"):
        load(tmp_path, text)
    assert load(tmp_path, text + "    accept_unverified: true\n").accelerometer.sections["pasco"].accept_unverified
    assert load(tmp_path, text.replace("driver: pasco", "driver: bma220")).accelerometer.driver == "bma220"


def test_calibration_points_become_counts_at_0_and_1_g(tmp_path: Path) -> None:
    axis = {"x": "[4096, 0, 4424, 1]", "y": "[3768, -1, 4424, 1]", "z": "[5080, 3, 4752, 2]"}
    lines = "".join(f"      {name}: {points}\n" for name, points in axis.items())
    config = load(tmp_path, f"accelerometer:\n  pasco:\n    calibration:\n{lines}")
    assert config.accelerometer.sections["pasco"].calibration is not None
    assert config.accelerometer.sections["pasco"].calibration.zero_g_raw == pytest.approx((4096, 4096, 4096))
    assert config.accelerometer.sections["pasco"].calibration.one_g_raw == pytest.approx((4424, 4424, 4424))


@pytest.mark.parametrize(("text", "complaint"), [
    ("gsp: {}\n", r":1: expected one of the keys accelerometer, gps, .*'gsp'"),
    ("gps:\n  port: /dev/a\n  bridge: 3\n", r":3: expected one of the keys port, .*'bridge'"),
    ("gps:\n  baud: 9600\n  baud: 4800\n", r":3: expected each key once"),
    ("gps:\n  bridge_s: long\n", r":2: expected a number from 0 to 60, found 'long'"),
    ("gps:\n  bridge_s: 61\n", r":2: expected a number from 0 to 60"),
    ("gps:\n  earliest_date: yesterday\n", r":2: expected a date such as 1980-01-06, found 'yesterday'"),
    ("gps:\n  earliest_date: 1979-01-01\n", r":2: expected a date from 1980-01-06 on"),
    ("gps:\n  baud: 9601\n", r":2: expected one of 1200, .*'9601'"),
    ("gps:\n", r":1: expected a mapping"),
    ("\n\nlog:\n  record_dump: yes\n", r":4: expected true or false"),
    ("log:\n  max_file_bytes: 1.5\n", r":2: expected a whole number from 10000"),
    ("accelerometer:\n  vertical_axis: z\n", r":2: expected one of \+x, -x"),
    ("accelerometer:\n  bma220:\n    range_g: 3\n", r":3: expected one of 2, 4, 8, 16, found '3'"),
    ("accelerometer:\n  bma220:\n    bandwidth_hz: 100\n", r":3: expected auto or one of 32"),
    ("accelerometer:\n  bma220:\n    i2c_bus: /dev/i2c-1\n", r":3: expected the number of an I2C bus"),
    ("accelerometer:\n  bma220:\n    i2c_bus: dump:gone.dump\n", r":3: expected a recorded dump"),
    ("accelerometer:\n  pasco:\n    calibration:\n      x: [1, 0]\n      y: [1, 0, 2, 1]\n      z: [1, 0, 2, 1]\n",
     r":4: expected two different points"),
    ("accelerometer:\n  driver: pasco\n  pasco:\n    profile: nothing-like-it\n", r":4: .*nothing-like-it"),
    ("pipeline:\n  low_pass_hz: 60\n", r":2: expected null or a number from 1 to 45"),
    ("pipeline:\n  slow_mps: 1\n  stationary_mps: 2\n", r":3: expected stationary_mps to be less than slow_mps"),
    ("vehicle: tank\n", r":1: no vehicle 'tank'.*rav4-2009"),
    ("vehicle: ./tank.yaml\n", r":1: expected a vehicle's file"),
])
def test_wrong_settings_are_refused_with_their_line(tmp_path: Path, text: str, complaint: str) -> None:
    with pytest.raises(BadInput, match=rf"^{tmp_path}/ridelog\.yaml{complaint}"):
        load(tmp_path, text)


def test_the_file_that_is_given_is_the_one_that_is_read(tmp_path: Path) -> None:
    assert find_config(tmp_path / "my.yaml") == tmp_path / "my.yaml"
    with pytest.raises(BadInput, match="expected a readable file"):
        load_config(tmp_path / "my.yaml")


def test_a_status_file_that_is_a_device_is_refused(tmp_path: Path) -> None:
    config = tmp_path / "ridelog.yaml"
    config.write_text("status_file: /dev/null\n")
    with pytest.raises(BadInput, match=r"ridelog\.yaml:1: expected the name of a file"):
        load_config(config)


@pytest.mark.parametrize(("earliest", "is_known"), [("2019-01-01", True), ("2026-01-01", False)])
def test_dates_before_the_earliest_are_refused(tmp_path: Path, earliest: str, is_known: bool) -> None:
    """A sentence of 2019, as an old recording holds it."""
    decoder = gps_decoder(load(tmp_path, f"gps:\n  earliest_date: {earliest}\n"))
    text = "GNRMC,120000.00,A,4807.03800,N,01131.00000,E,10.0,,060419,,,A"
    check = reduce(xor, text.encode())
    decoder.feed(1_000_000, f"${text}*{check:02X}\r\n".encode())
    (fix,) = decoder.flush()
    assert (fix.utc_us is not None) is is_known
