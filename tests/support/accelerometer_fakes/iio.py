"""An accelerometer as the Linux kernel shows it: a tree of files like sysfs, and a FIFO as its character device.

What a write does is done when time passes: the kernel's side looks at the files then.
"""

from __future__ import annotations

import json
import os
import select
import shutil
import struct
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from drivers.accelerometers.iio import IioConfig
from drivers.hardware import Machine

from .fake import Clock, DataSheet, Example, Fake

SCALE = 0.009580  # +-2 g with 12 bits
BITS, SHIFT = 12, 4


def described(kind: str, polled: bool = False) -> bytes:
    """What the kernel says of a device whose x, y, z are of one kind (``scan_elements/in_accel_x_type``)."""
    return json.dumps({
        "begins": True, "name": "fakecel", "polled": polled, "scale": dict.fromkeys("xyz", f"{SCALE:.6f}"),
        "channels": [] if polled else [[f"in_accel_{axis}", index, kind] for index, axis in enumerate("xyz")],
        "offset": dict.fromkeys("xyz", "0"), "matrix": "", "clock": "", "rate_hz": "100", "buffer": "1",
    }).encode()


class FakeIio(Fake):
    """A chip of 12 bits with a buffer of its own driver and a data-ready trigger.

    Change before it is opened: ``tree`` names the files and their texts (None: not there); ``buffered`` False: none of
    what a buffer needs; ``packed`` makes a scan of raw x, y, z and the time [ns].
    """

    name = "iio"
    variants = (IioConfig(device="fakecel"), IioConfig(device="fakecel", rate_hz=100, scale_mps2=0.038320))
    wrong = r"no IIO accelerometer is called 'fakecel'; there are: bmi999 \(iio:device1\)"

    examples = (  # Documentation/ABI/testing/sysfs-bus-iio: (raw >> shift) times scale, least significant byte first
        Example(IioConfig(), b"s" + bytes.fromhex("0010" "00f0" "f07f"), (256 * SCALE, -256 * SCALE, 2047 * SCALE),
                clipped=True, first=described("le:s12/16>>4")),
        Example(IioConfig(), b"s" + bytes.fromhex("0100" "ff00" "fff0"), (256 * SCALE, -256 * SCALE, -16 * SCALE),
                first=described("be:s16/16>>0")),
        Example(IioConfig(), b"p1 -2 1024", (SCALE, -2 * SCALE, 1024 * SCALE), first=described("", polled=True)),
    )

    def __init__(self, folder: Path, clock: Clock, settings: Any = None, buffered: bool = True) -> None:
        super().__init__(folder, clock, settings)
        self.root = folder / "root"
        self.device = self.root / "sys/bus/iio/devices/iio:device1"
        self.node = self.root / "dev/iio:device1"
        self.tree: dict[str, str | None] = {
            "name": "fakecel", "in_accel_scale": f"{SCALE:.6f}",
            "in_accel_scale_available": "0.009580 0.019160 0.038320",
            "sampling_frequency": "100", "sampling_frequency_available": "12.5 25 50 100 200 400",
            "in_accel_x_raw": "0", "in_accel_y_raw": "0", "in_accel_z_raw": "0", "in_temp_raw": "7",
        }
        if buffered:
            self.tree |= {
                "current_timestamp_clock": "realtime", "buffer/enable": "0", "buffer/length": "2",
                "trigger/current_trigger": "", "../trigger0/name": "fakecel-dev1", "../trigger1/name": "other",
                **{f"scan_elements/in_accel_{axis}_{what}": text for index, axis in enumerate("xyz") for what, text in
                   (("en", "0"), ("index", str(index)), ("type", f"le:s{BITS}/16>>{SHIFT}"))},
                "scan_elements/in_temp_en": "1", "scan_elements/in_temp_index": "3",
                "scan_elements/in_temp_type": "le:s16/16>>0",
                "scan_elements/in_timestamp_en": "0", "scan_elements/in_timestamp_index": "4",
                "scan_elements/in_timestamp_type": "le:s64/64>>0",
            }
        self.wall_offset_ns = 1_700_000_000_000_000_000
        self.next_us = float(clock.now_us)
        self.clock_error = 0.0
        self.taken = 0
        self.writer: int | None = None
        self.is_there = False

    @property
    def sheet(self) -> DataSheet:
        """A step that the settings do not name is finer than the noise; one that several readings blur is noise."""
        step_mps2, each = self.settings.scale_mps2 or 0.0, self.settings.rate_hz // 100
        noise_mps2 = float(np.hypot(self.settings.noise_mps2, step_mps2 / (12 * each) ** 0.5 if each > 1 else 0.0))
        return DataSheet(self.settings.rate_hz, 0.0 if each > 1 else step_mps2, (0.99 * noise_mps2, 1.01 * noise_mps2),
                         (1 << (BITS - 1)) * (self.settings.scale_mps2 or SCALE))

    @property
    def state(self) -> dict[Any, Any]:
        return {name: self.text(name) for name in ("in_accel_scale", "sampling_frequency", "buffer/enable")}

    def machine(self) -> Machine:
        if not self.is_there:
            self._appear()
        return Machine(self.clock, self.clock.sleep, wait_readable=self._wait_readable, root=self.root)

    def text(self, name: str) -> str:
        """Of a file of the tree; it is asked for at every sample, so by the shortest way."""
        try:
            descriptor = os.open(f"{self.device}/{name}", os.O_RDONLY)
        except OSError:
            return ""
        try:
            return os.read(descriptor, 4096).decode().strip()
        finally:
            os.close(descriptor)

    def advance(self, now_us: int) -> None:
        if not self.is_there:
            return
        if self.text("buffer/enable") != "1" or not self.text("trigger/current_trigger"):
            self.next_us = float(now_us)
            if "in_accel_x_raw" in self.tree:
                for axis, count in zip("xyz", self._counts(now_us), strict=True):
                    self._put(f"in_accel_{axis}_raw", str(count))
            return
        interval_us = 1e6 / float(self.text("sampling_frequency")) / (1 + self.clock_error)
        while self.next_us <= now_us:
            self._scan(round(self.next_us))
            self.next_us += interval_us

    def packed(self, counts: list[int], time_ns: int) -> bytes:
        """x, y, z in the upper 12 of 16 bits, 2 bytes of nothing, the time where it is asked for."""
        data = struct.pack("<3h", *(count << SHIFT for count in counts))
        if self.text("scan_elements/in_temp_en") == "1":
            data += b"\x07\x00"
        if self.text("scan_elements/in_timestamp_en") == "1":
            data = data.ljust(8, b"\xee") + time_ns.to_bytes(8, "little", signed=True)
        return data

    def unplug(self) -> None:
        self.is_there = False
        shutil.rmtree(self.root / "sys")
        self.node.unlink(missing_ok=True)
        if self.writer is not None:
            os.close(self.writer)
            self.writer = None

    def plug(self) -> None:
        self._appear()

    def lose_settings(self) -> None:
        """The kernel binds its driver again, and another program reads it."""
        self._put("in_accel_scale", f"{SCALE:.6f}")
        self._put("sampling_frequency", "50")

    def replace_by_another(self) -> None:
        self.tree["name"] = "bmi999"
        if self.is_there:
            self._put("name", "bmi999")

    def _appear(self) -> None:
        """The kernel has bound its driver."""
        self.is_there = True
        self.next_us = float(self.clock.now_us)
        self.device.mkdir(parents=True)
        for name, text in self.tree.items():
            if text is not None:
                self._put(name, text)
        self.node.parent.mkdir(exist_ok=True)
        os.mkfifo(self.node)
        self.writer = os.open(self.node, os.O_RDWR | os.O_NONBLOCK)

    def _put(self, name: str, text: str) -> None:
        path = self.device / name
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT)
        os.pwrite(descriptor, text.ljust(12).encode() + b"\n", 0)  # as one piece, as a read of sysfs gives it
        os.close(descriptor)

    def _counts(self, t_us: int) -> list[int]:
        scale = float(self.text("in_accel_scale") or SCALE)
        most = 1 << (BITS - 1)
        return [min(max(round(value / scale), -most), most - 1) for value in self.accel(t_us).tolist()]

    def _scan(self, t_us: int) -> None:
        offset_ns = 0 if self.text("current_timestamp_clock") == "monotonic" else self.wall_offset_ns
        self.taken += 1
        with suppress(BlockingIOError):  # a full buffer drops what comes
            assert self.writer is not None
            os.write(self.writer, self.packed(self._counts(t_us), 1000 * t_us + offset_ns))

    def _wait_readable(self, descriptor: int, timeout_s: float) -> bool:
        until_us = self.clock.now_us + round(timeout_s * 1e6)
        while not select.select([descriptor], [], [], 0)[0]:
            if self.clock.now_us >= until_us:
                return False
            self.clock.sleep(0.0005)
        return True


FAKE = FakeIio
