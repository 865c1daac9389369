"""Whether a recording's readings came as often as its header says: at another rate all samples of the grid would be
holes, and every window would be flagged for it without a word on why."""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np

from drivers.dump import open_dump
from drivers.readings import GPS
from logger.errors import BadInput
from logger.service.signal_chain import GRID_RATE_HZ
from logger.service.wiring import Instrument


def check_recorded_rate(dump: Path, sensor: Instrument, looked_at: int = 2000, slower: float = 1.5) -> None:
    """Raise BadInput where the readings of a sensor that is read several times per sample came too seldom for that.

    looked_at    so many events
    slower       as many times as long between most readings is no busy bus, but another rate
    """
    if sensor.oversample == 1:
        return
    with open_dump(dump) as reader:
        times_us = np.array([t_us for t_us, source, _ in islice(reader, looked_at) if source != GPS], dtype=float)
    if len(times_us) < 2:
        return
    rate_hz, found_us = GRID_RATE_HZ * sensor.oversample, float(np.median(np.diff(times_us)))
    if found_us * rate_hz > slower * 1e6:
        raise BadInput(f"{dump}:1: expected readings at {rate_hz:g} Hz, as 'oversample': {sensor.oversample} says, "
                       f"found them at about {1e6 / found_us:.3g} Hz")
