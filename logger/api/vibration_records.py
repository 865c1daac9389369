"""Vibration records of many sensors, and what is asked of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from logger.api.shown import Shown, table
from logger.chart_data import line
from logger.errors import BadInput
from logger.store.formats import channel_file

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.modal.mode import ModalResult

@dataclass(frozen=True, eq=False, repr=False)
class Channels(channel_file.ChannelRecord, Shown):
    """A record of c sensors, evenly sampled.

    names      of the channels
    start_s    time of the first sample [s]; ``rate_hz`` samples a second
    samples    (n, c), in any unit
    """

    def __repr__(self) -> str:
        deviations = self.samples.std(axis=0).tolist()
        return table("Channels", [
            ("time", len(self.samples) / self.rate_hz, "s"), ("rate", self.rate_hz, "Hz"),
            ("samples", len(self.samples), ""),
            *((f"{name}, standard deviation", one, "") for name, one in zip(self.names, deviations, strict=True))])

    def charts(self) -> Sequence[Chart]:
        """The channels over time."""
        from logger.chart_data import Curves

        time_s = self.start_s + np.arange(len(self.samples)) / self.rate_hz
        return [Curves("Channels", "time [s]", "reading", tuple(
            line(name, time_s, one) for name, one in zip(self.names, self.samples.T, strict=True)))]


def read_channels(path: Path | str, columns: Sequence[str] = ()) -> Channels:
    """Read a CSV record with ``t_s`` and one column per sensor: these columns, or all.

    Raises BadInput (``file:line: expected ..., found ...``) for anything else, and for a column that never moves.

    >>> read_channels(folder / "drive.csv", ["accel_z_mps2"]).samples.shape
    (1115, 1)
    """
    return Channels(**vars(channel_file.read_channels(path, columns)))


def make_channels(samples: Mapping[str, npt.ArrayLike], *, rate_hz: float, start_s: float = 0.0) -> Channels:
    """A record out of arrays (n,) by the names of their channels.

    rate_hz    samples a second; the first was taken at ``start_s`` [s]

    Raises BadInput for arrays of different lengths, values that are not finite, or fewer than two samples.

    >>> make_channels({"top": [0.0, 1.0, 0.0], "middle": [0.0, 0.5, 0.0]}, rate_hz=100.0).samples.shape
    (3, 2)
    """
    arrays = [np.asarray(one, dtype=np.float64) for one in samples.values()]
    if not arrays or arrays[0].ndim != 1 or any(one.shape != arrays[0].shape for one in arrays):
        raise BadInput("channels: expected arrays of one length and one axis")
    if not (len(arrays[0]) > 1 and rate_hz > 0 and np.isfinite(start_s) and np.isfinite(arrays).all()):
        raise BadInput("channels: expected two finite values or more in each, and a rate above 0 Hz")
    return Channels(tuple(samples), start_s, rate_hz, np.stack(arrays, axis=1))


@dataclass(frozen=True, eq=False)
class Found:
    """What was found, by which method; ``record``: of the sensors alone, the stretch that was looked at."""

    result: ModalResult
    method: str
    record: Channels


def name_of(given: channel_file.ChannelRecord | Path | str) -> str:
    """How a complaint names a record."""
    return "record" if isinstance(given, channel_file.ChannelRecord) else str(given)
