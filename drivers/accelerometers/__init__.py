"""Accelerometers, one file each: the file is the whole registration (``drivers.catalogue``).

What a file has to offer stands in ``accelerometer.py``. Everything else, from the settings to the replay of a
recording, asks this catalogue, and knows no accelerometer by its name.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from drivers.catalogue import offers

if TYPE_CHECKING:
    from drivers.accelerometers.accelerometer import Accelerometer, SerialAccelerometer

DEFAULT = "bma220"  # The one that the settings mean when they name none


@cache
def accelerometers() -> Mapping[str, Accelerometer[Any]]:
    """Every accelerometer by the name that it has in settings and recordings."""
    return offers(__name__, "ACCELEROMETER")


def serial_accelerometers() -> Mapping[str, SerialAccelerometer[Any]]:
    """Those whose bytes come on a serial port."""
    from drivers.accelerometers.accelerometer import SerialAccelerometer

    return {name: kind for name, kind in accelerometers().items() if isinstance(kind, SerialAccelerometer)}


def line_reader() -> SerialAccelerometer[Any]:
    """The one that reads lines ``x,y,z`` in g from any serial port, as which another one's readings may be sent."""
    return next(kind for kind in serial_accelerometers().values() if kind.lines is not None)
