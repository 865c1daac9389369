"""What the bytes of an IIO buffer mean, from what the kernel says of it in sysfs.

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
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from drivers.errors import BadReply, shortened

AXES = ("x", "y", "z")
TIMESTAMP = "in_timestamp"
MONOTONIC = "monotonic"
_TYPE = re.compile(r"(be|le):([su])(\d{1,2})/(8|16|32|64)(?:X([01]))?(?:>>(\d{1,2}))?")
_MAX_CHANNELS = 64

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
        raise BadReply(f"an IIO description: expected what the kernel says of its device, found {_shown(error)}"
                       ) from None
    if not polled and len(axes) != len(AXES):
        raise BadReply("an IIO description: expected scans with in_accel_x, in_accel_y and in_accel_z")
    if rate_hz <= 0 or 0.0 in scale:
        raise BadReply("an IIO description: expected a rate and scales other than 0")
    return ScanLayout(name, polled, rate_hz, axes if len(axes) == len(AXES) else (), timestamp, scan_bytes, scale,
                      offset, matrix)


def _shown(error: Exception) -> str:
    return shortened(str(error))


def _number(text: object) -> float:
    value = float(str(text))
    if not np.isfinite(value) or abs(value) > 1e9:
        raise ValueError(text)
    return value


def _elements(channels: Any) -> tuple[dict[str, Element], int]:
    """Each channel's place in a scan, and the size of a scan."""
    placed: dict[str, Element] = {}
    position = largest = 0
    if len(channels) > _MAX_CHANNELS:
        raise ValueError("too many channels")
    ordered = sorted((int(index), str(name), str(kind)) for name, index, kind in channels)
    if any(before[0] == after[0] for before, after in pairwise(ordered)):
        raise ValueError("two channels at one place")
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
