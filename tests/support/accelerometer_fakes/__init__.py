"""Accelerometers that behave like the real ones, one file per registered name, each offering ``FAKE``."""

from __future__ import annotations

from functools import cache
from typing import Any

from drivers.catalogue import offers


@cache
def fakes() -> dict[str, Any]:
    """The class of each fake, by the name of its accelerometer."""
    return offers(__name__, "FAKE")
