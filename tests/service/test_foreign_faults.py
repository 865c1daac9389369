"""The whole service while every call that its devices are reached by fails in every way: the other sensor goes on, rows
are written, ``status`` names the device and the cause, the file is finished. Calls: ``tests.support.faults.foreign``.
"""

from __future__ import annotations

import errno
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.dump import open_dump

from ..support.faults.foreign import NUMBERS, ROOT_VARIABLE
from ..support.slow import release
from .test_process import SerialDevice, Service, rows_in, write_config

ROOT = Path(__file__).parents[2]
EXPLAINED = {
    "serial": {errno.ENOENT, errno.ENODEV, errno.ENXIO, errno.EAGAIN, errno.EBUSY, errno.EACCES, errno.EPERM},
    "i2c": {errno.EREMOTEIO, errno.ENXIO, errno.ETIMEDOUT, errno.EBUSY},
    "iio": set(),
}
"""Errors that the program has words of its own for."""


class FaultyService(Service):
    """``ridelog run`` where calls fail."""

    def __init__(self, kind: str, work: Path) -> None:
        self.work, self.log, self.errors = work, work / "log", work / "stderr.txt"
        with self.errors.open("ab") as errors:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "tests.support.faults.foreign", kind, "run", "--config", work / "ridelog.yaml"],
                cwd=ROOT, stderr=errors, env=os.environ | {ROOT_VARIABLE: str(work / "root")})


@pytest.fixture
def receiver(short_dump: Path, tmp_path: Path) -> Iterator[SerialDevice]:
    """One that is heard for as long as a test may take: the drive goes on at its second speed."""
    with open_dump(short_dump) as reader:
        sentences = [event for event in reader if event.source == "nmea"]
    device = SerialDevice(tmp_path / "gps", [one for one in sentences if one.t_us - sentences[0].t_us > 7_000_000])
    yield device
    device.pull()


def iio_device(root: Path) -> None:
    """An accelerometer as the kernel shows it, without a buffer."""
    folder = root / "sys/bus/iio/devices/iio:device0"
    folder.mkdir(parents=True)
    for name, text in {"name": "still", "in_accel_scale": "0.009580", "in_accel_x_raw": "0", "in_accel_y_raw": "0",
                       "in_accel_z_raw": "1024"}.items():
        (folder / name).write_text(text + "\n")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["serial", "i2c", *release("iio")])
def test_no_error_of_any_call_of_a_device_ends_the_service(
        kind: str, receiver: SerialDevice, short_dump: Path, ridelog: Path, tmp_path: Path) -> None:
    write_config(tmp_path, f"'dump:{short_dump}'" if kind == "serial" else "1")
    if kind == "iio":
        iio_device(tmp_path / "root")
        text = (tmp_path / "ridelog.yaml").read_text()
        (tmp_path / "ridelog.yaml").write_text("accelerometer: {driver: iio}\n" + text.partition("\n")[2])
    faulty, other = ("gps", "accelerometer") if kind == "serial" else ("accelerometer", "gps")
    service = FaultyService(kind, tmp_path)
    try:
        status = service.wait_for(lambda status: status[faulty]["last_error"])
        assert status["storage"]["failures"] == 0
        service.wait_for(lambda status: status[faulty]["state"] == "ok" and status[faulty]["readings"] > 5)
        status = service.wait_for(lambda status: status["rows_written"] > 3)
        assert status[other]["state"] == "ok"
        assert status[other]["counters"]["faults"] == 0
        assert service.terminate() == 0
    finally:
        if service.process.poll() is None:
            service.kill()
    assert not list(service.log.glob("*.part"))
    assert len(rows_in(service.log, "*.csv")) > 3
    subprocess.run([ridelog, "verify", service.log], check=True, capture_output=True)
    said = service.errors.read_text()
    assert {number for number in NUMBERS if os.strerror(number) not in said} <= EXPLAINED[kind]
    left = dict(re.findall(r"'(\S+)': (\d+)", said.rpartition("faults left: ")[2]))
    assert len(left) > 4
    assert {call for call, count in left.items() if count != "0"} <= {"os.close", "Serial.close"}
    assert "Traceback" not in said
