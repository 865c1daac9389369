"""Accelerometers that a driver of the Linux kernel reads (Industrial I/O), as its files in sysfs: what they say of
themselves, and how they are read.

A description holds the kernel's own texts, so that a recording can be decoded by them alone:

    name        of the chip
    polled      true: single raw values were read from sysfs; false: scans from the buffer
    channels    (name, index, type) of those in a scan, such as ("in_accel_x", 0, "le:s12/16>>4")
    scale, offset    texts for x, y, z: acceleration [m/s2] = (raw + offset) x scale
    matrix      nine numbers, row by row, from the chip's axes to those of the board; empty: the same
    clock       of the timestamps
    rate_hz     samples a second, as the kernel says
    buffer      1: it is on
    begins      the device has just been opened: samples may be missing before the next one

Source: Linux, Documentation/ABI/testing/sysfs-bus-iio (in_accel_*_raw, _scale, _offset, mount_matrix, scan_elements:
_en, _index, _type; current_timestamp_clock) and Documentation/iio/iio_devbuf.rst (alignment). Each channel is aligned
to its own size, and a scan to that of its largest channel (iio_compute_scan_bytes, drivers/iio/industrialio-buffer.c).

Problem: whether the kernel collects samples by itself depends on the chip's driver, on a trigger, and on who may write
to sysfs. Solution: the buffer is set up where that can be done, or taken as somebody has set it up; otherwise the raw
values are read one by one, and ``why_polled`` says what was missing.
"""

import errno
import json
import os
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from drivers.errors import BadReply, NotPresent, shortened, why_forbidden

AXES = ("x", "y", "z")
TIMESTAMP = "in_timestamp"
MONOTONIC = "monotonic"
_TYPE = re.compile(r"(be|le):([su])(\d{1,2})/(8|16|32|64)(?:X([01]))?(?:>>(\d{1,2}))?")

Integers = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Element:
    """Where a channel stands in a scan and how its number is written."""

    offset: int
    size: int
    big: bool
    signed: bool
    bits: int
    shift: int

    def values(self, scans: npt.NDArray[np.uint8]) -> Integers:
        """(n, scan) bytes to (n,) raw numbers."""
        columns = np.ascontiguousarray(scans[:, self.offset:self.offset + self.size])
        words = columns.view(f"{'>' if self.big else '<'}u{self.size}")[:, 0].astype(np.uint64)
        left = np.uint64(64 - self.bits - self.shift)
        words = words << left  # the number to the left of a 64-bit word, then back with its sign
        back = 64 - self.bits
        return (words.view(np.int64) >> back) if self.signed else (words >> np.uint64(back)).astype(np.int64)

    @property
    def range(self) -> tuple[int, int]:
        """Least and largest raw number."""
        if self.signed:
            return -(1 << (self.bits - 1)), (1 << (self.bits - 1)) - 1
        return 0, (1 << self.bits) - 1


@dataclass(frozen=True)
class ScanLayout:
    """A description, understood.

    axes         of x, y, z in a scan; empty where single values are read and the kernel does not give their type
    timestamp    of the instant of a scan [ns, monotonic]; None: the scan has none that can be used
    scan_bytes   size of a scan
    scale, offset, matrix    acceleration [m/s2] along the board's axes = matrix @ ((raw + offset) * scale)
    """

    name: str
    polled: bool
    rate_hz: float
    axes: tuple[Element, ...]
    timestamp: Element | None
    scan_bytes: int
    scale: tuple[float, ...]
    offset: tuple[float, ...]
    matrix: tuple[tuple[float, ...], ...]

    def accel_mps2(self, raw: Integers) -> npt.NDArray[np.float64]:
        """Raw numbers (n, 3) to accelerations (n, 3) [m/s2]."""
        along_chip = (raw + np.array(self.offset)) * np.array(self.scale)
        return np.asarray(along_chip @ np.array(self.matrix).T)

    def clipped(self, raw: Integers) -> npt.NDArray[np.bool_]:
        """(n, 3) -> (n,): an axis is at the end of its range, as far as the kernel gives it."""
        ends = np.array([axis.range for axis in self.axes] or [(-(1 << 62), 1 << 62)] * 3)
        return np.asarray(((raw <= ends[:, 0]) | (raw >= ends[:, 1])).any(axis=1))


def read_description(data: bytes) -> dict[str, Any]:
    """The JSON object of a description. BadReply for anything else."""
    try:
        description = json.loads(data)
    except (ValueError, RecursionError):
        description = None
    if not isinstance(description, dict):
        raise BadReply("an IIO description: expected a JSON object")
    return description


def understood(description: Mapping[str, Any]) -> ScanLayout:
    """What a description means. BadReply that names what cannot be."""
    try:
        polled = bool(description["polled"])
        rate_hz = _number(description["rate_hz"])
        elements, scan_bytes = _elements(description["channels"])
        axes = tuple(elements[f"in_accel_{axis}"] for axis in AXES if f"in_accel_{axis}" in elements)
        scale = tuple(_number(description["scale"][axis]) for axis in AXES)
        offset = tuple(_number(description["offset"][axis]) for axis in AXES)
        matrix = _matrix(description["matrix"])
        timestamp = elements.get(TIMESTAMP) if description["clock"] == MONOTONIC else None
        name = str(description["name"])
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BadReply(f"an IIO description: expected the kernel's description of its device, found "
                       f"{shortened(str(error))}") from None
    if not polled and len(axes) != len(AXES):
        raise BadReply("an IIO description: expected scans with in_accel_x, in_accel_y and in_accel_z")
    if rate_hz <= 0 or 0.0 in scale:
        raise BadReply("an IIO description: expected a rate and scales other than 0")
    return ScanLayout(name, polled, rate_hz, axes if len(axes) == len(AXES) else (), timestamp, scan_bytes, scale,
                      offset, matrix)


def _number(text: object) -> float:
    value = float(str(text))
    if not np.isfinite(value) or abs(value) > 1e9:
        raise ValueError(text)
    return value


def _elements(channels: Any) -> tuple[dict[str, Element], int]:
    """Each channel's place in a scan, and the size of a scan."""
    placed: dict[str, Element] = {}
    position = largest = 0
    most_channels = 64
    if len(channels) > most_channels:
        raise ValueError("too many channels")
    ordered = sorted((int(index), str(name), str(kind)) for name, index, kind in channels)
    if any(before[0] == after[0] for before, after in pairwise(ordered)):
        raise ValueError("two channels with one index")
    for _, name, kind in ordered:
        match = _TYPE.fullmatch(kind)
        if match is None:
            raise ValueError(f"the type {kind}")
        bits, size, shift = int(match[3]), int(match[4]) // 8, int(match[6] or 0)
        if not 1 <= bits <= 8 * size - shift:
            raise ValueError(f"the type {kind}")
        position += -position % size
        placed[name] = Element(position, size, match[1] == "be", match[2] == "s", bits, shift)
        position += size
        largest = max(largest, size)
    return placed, position + (-position % largest if largest else 0)


def _matrix(text: str) -> tuple[tuple[float, ...], ...]:
    if not text.strip():
        return ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    rows = tuple(tuple(_number(entry) for entry in row.split(",")) for row in text.split(";"))
    if [len(row) for row in rows] != [3, 3, 3]:
        raise ValueError(f"the mount matrix {text}")
    return rows


DEVICES = Path("sys/bus/iio/devices")
AUTO = "auto"
POLLED_HZ = 100
BUFFER_S = 2
_RATES = ("in_accel_sampling_frequency", "sampling_frequency")
_MATRICES = ("in_accel_mount_matrix", "in_mount_matrix", "mount_matrix")
_NOT_ALLOWED = (errno.EACCES, errno.EPERM, errno.EROFS)


def find_device(root: Path, wanted: str) -> Path:
    """The folder of the accelerometer with that name (of its chip, or of its folder); ``auto``: of the only one there.
    NotPresent, with what there is, where there is none or more than one."""
    found = {path: _name(path) for path in sorted((root / DEVICES).glob("iio:device*"))
             if (path / "in_accel_x_raw").exists() or (path / "scan_elements/in_accel_x_en").exists()}
    if not found:
        raise NotPresent("the kernel has no IIO accelerometer: check its overlay (/boot/firmware/config.txt), its "
                         "wires, and what the kernel says (dmesg)")
    chosen = [path for path, name in found.items() if wanted in (AUTO, name, path.name)]
    known = ", ".join(f"{name} ({path.name})" for path, name in found.items())
    if not chosen:
        raise NotPresent(f"no IIO accelerometer is called {wanted!r}; there are: {known}")
    if len(chosen) > 1:
        raise NotPresent(f"expected 'device' in the settings to name one of the IIO accelerometers: {known}")
    return chosen[0]


class IioDevice:
    """One device, set up. Raises NotPresent where it is gone, BadReply where it does not take a setting.

    why_polled    why the buffer is not used; empty: it is
    """

    def __init__(self, root: Path, wanted: str, rate_hz: int, scale_mps2: float | None) -> None:
        self._root = root
        self.path = find_device(root, wanted)
        self._rate_hz = rate_hz
        self._trigger: Path | None = None
        self._is_ours = False
        try:
            if scale_mps2 is not None:
                self._set_scale(scale_mps2)
            self.why_polled = self._start_buffer()
        except OSError as error:
            raise NotPresent(f"{self.path.name}: {error.strerror}") from error

    def describe(self) -> dict[str, Any]:
        """What the kernel says of it now (see this). NotPresent where it is gone."""
        if not self.path.exists():
            raise NotPresent(f"{self.path.name} has gone: the kernel no longer has it")
        try:
            return {
                "name": _name(self.path),
                "polled": bool(self.why_polled),
                "channels": self._channels(),
                "scale": {axis: self._of_axis(axis, "scale", "1") for axis in AXES},
                "offset": {axis: self._of_axis(axis, "offset", "0") for axis in AXES},
                "matrix": next((text for name in _MATRICES if (text := _text(self.path / name))), ""),
                "clock": _text(self.path / "current_timestamp_clock"),
                "rate_hz": str(POLLED_HZ) if self.why_polled else self._rate(),
                "buffer": _text(self.path / "buffer/enable"),
            }
        except OSError as error:
            raise NotPresent(f"{self.path.name} has gone: {error.strerror}") from error

    @property
    def node(self) -> Path:
        """Where the scans are read."""
        return self._root / "dev" / self.path.name

    def close(self) -> None:
        """Switch the buffer off if it was switched on here. Never raises."""
        if self._is_ours:
            with suppress(OSError):
                write(self.path / "buffer/enable", "0")

    def _start_buffer(self) -> str:
        """Let the kernel collect samples. Gives why it does not; empty: it does."""
        enable, scans = self.path / "buffer/enable", self.path / "scan_elements"
        if not (enable.exists() and all((scans / f"in_accel_{axis}_en").exists() for axis in AXES)):
            self._set_rate(self.path)
            return "its driver in the kernel has no buffer"
        runs = _text(enable) == "1"
        try:
            write(enable, "0")
            self._set_rate(self.path)
            for switch in sorted(scans.glob("*_en")):
                kept = {TIMESTAMP, *(f"in_accel_{axis}" for axis in AXES)}
                _set(switch, "1" if switch.name.removesuffix("_en") in kept else "0")
            with suppress(OSError):
                _set(self.path / "current_timestamp_clock", MONOTONIC)
            why = self._choose_trigger()
            if why:
                return why
            write(self.path / "buffer/length", str(BUFFER_S * self._rate_hz))
            write(enable, "1")
        except OSError as error:
            if error.errno in _NOT_ALLOWED:
                return "" if runs else "the service is not allowed to switch its buffer on"
            return f"its buffer cannot be switched on ({error.strerror})"
        self._is_ours = True
        return ""

    def _choose_trigger(self) -> str:
        """A trigger, where the driver wants one: its own, or else another. Gives why there is none."""
        current = self.path / "trigger/current_trigger"
        if not current.exists():
            return ""
        triggers = {_name(path): path for path in sorted((self._root / DEVICES).glob("trigger*"))}
        own = [name for name in triggers if name.startswith(f"{_name(self.path)}-dev")]
        chosen = _text(current) or next(iter([*own, *triggers]), "")
        if not chosen:
            return "there is no trigger for its buffer"
        _set(current, chosen)
        self._trigger = triggers.get(chosen)
        if self._trigger is not None:
            self._set_rate(self._trigger)
        return ""

    def _set_rate(self, folder: Path) -> None:
        """The least rate that is not below the one asked for, or else the highest, where it may be set."""
        for path in (folder / name for name in _RATES):
            if not path.exists():
                continue
            known = sorted(_numbers(_text(path.with_name(f"{path.name}_available"))))
            rate_hz = next((hz for hz in known if hz >= self._rate_hz), known[-1] if known else self._rate_hz)
            with suppress(OSError):
                _set(path, f"{rate_hz:g}")
            return

    def _set_scale(self, scale_mps2: float) -> None:
        path = self.path / "in_accel_scale"
        known = _numbers(_text(self.path / "in_accel_scale_available"))
        nearest = min(known, key=lambda value: abs(value - scale_mps2), default=scale_mps2)
        with suppress(OSError):
            _set(path, f"{nearest:.9f}".rstrip("0"))
        found = [value for axis in AXES for value in _numbers(self._of_axis(axis, "scale", ""))]
        if len(found) != len(AXES) or not all(abs(value / scale_mps2 - 1) < 0.01 for value in found):
            may = f"; it may be {', '.join(f'{value:g}' for value in known)}" if known else ""
            raise BadReply(f"{self.path.name}: expected the scale {scale_mps2:g} m/s2 of the settings (scale_mps2), "
                           f"found {self._of_axis('x', 'scale', 'none')}{may}")

    def _channels(self) -> list[list[str]]:
        """Name, index and type of the channels in a scan; where values are polled, of the axes, if they are named."""
        scans = self.path / "scan_elements"
        names = [switch.name.removesuffix("_en") for switch in sorted(scans.glob("*_en"))]
        if self.why_polled:
            names = [name for name in names if name.startswith("in_accel_")]
        else:
            names = [name for name in names if _text(scans / f"{name}_en") == "1"]
        return [[name, _text(scans / f"{name}_index"), _text(scans / f"{name}_type")] for name in names]

    def _of_axis(self, axis: str, what: str, otherwise: str) -> str:
        return _text(self.path / f"in_accel_{axis}_{what}") or _text(self.path / f"in_accel_{what}") or otherwise

    def _rate(self) -> str:
        """That of the trigger where it has one, else that of the device, else as it was asked for."""
        folders = [*([self._trigger] if self._trigger is not None else []), self.path]
        return next((text for folder in folders for name in _RATES if (text := _text(folder / name))),
                    str(self._rate_hz))


class ScanPort:
    """The character device of a buffer, as a ``BytePort`` that takes no writes. NotPresent when it cannot be opened."""

    def __init__(self, path: Path, wait_readable: Callable[[int, float], bool]) -> None:
        try:
            self._descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            hint = "another program reads it" if error.errno == errno.EBUSY else error.strerror
            if error.errno == errno.EPERM:
                hint = why_forbidden(error.errno, path, "r", "i2c")
            elif error.errno == errno.EACCES:
                hint = "not allowed; let the group i2c read it, by a udev rule as in docs/installation.md"
            raise NotPresent(f"{path}: {hint}") from error
        self._wait_readable = wait_readable

    def read(self, size: int, timeout_s: float) -> bytes:
        """What has been collected, waited for at most so long [s]. OSError when the device has gone."""
        if not self._wait_readable(self._descriptor, timeout_s):
            return b""
        try:
            data = os.read(self._descriptor, size)
        except BlockingIOError:
            return b""
        if not data:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        return data

    def write(self, data: bytes) -> int:
        """Nothing is written to it."""
        raise OSError(errno.EBADF, os.strerror(errno.EBADF))

    def close(self) -> None:
        os.close(self._descriptor)


def write(path: Path, text: str) -> None:
    """Write a setting. OSError as the kernel says."""
    path.write_text(text)


def _set(path: Path, text: str) -> None:
    """Write a setting where it is another one."""
    if _text(path) != text:
        write(path, text)


def _text(path: Path) -> str:
    """A setting's text; empty where the device has no such file or does not give it now."""
    try:
        return path.read_text(errors="replace").strip()
    except (FileNotFoundError, NotADirectoryError):
        return ""
    except OSError as error:
        if error.errno in (errno.EBUSY, errno.EINVAL, errno.EOPNOTSUPP):
            return ""
        raise


def _name(path: Path) -> str:
    return _text(path / "name") or path.name


def _numbers(text: str) -> list[float]:
    """The numbers of an ``_available`` file, without those that are none; a range gives its ends."""
    words = text.strip("[]").split()
    values = []
    for word in words:
        with suppress(ValueError):
            values.append(float(word))
    return [values[0], values[-1]] if text.startswith("[") and len(values) == 3 else values
