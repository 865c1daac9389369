"""What a wire brought: bytes, with their source and time."""

from __future__ import annotations

from typing import NamedTuple


class Event(NamedTuple):
    """Bytes from one source at one time.

    t_us      monotonic time [us]: when the read was made, or when the bytes arrived
    source    name of an accelerometer, or ``GPS``
    data      at least one byte
    """

    t_us: int
    source: str
    data: bytes


GPS = "nmea"
