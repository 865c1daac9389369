"""What the box wrote: segment logs as arrays, and recorded dumps with their events and samples."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drivers.dump import DumpHeader, open_dump
from drivers.errors import DriverError
from drivers.readings import GPS, Event, Fix
from logger.api.shown import Shown, table
from logger.arrays import Array, Bools
from logger.errors import BadInput, as_bad_input
from logger.printable import word
from logger.records import WindowRecord
from logger.units import US_PER_S

if TYPE_CHECKING:
    from logger.chart_data import Chart


@dataclass(frozen=True, eq=False, repr=False)
class Log(Mapping[str, npt.NDArray[Any]], Shown):
    """The intact rows of segment logs, n of them, one per window of the road; ``log["iri_m_per_km"]`` is a column.

    columns          (n,) by name, as in the file: numbers with NaN where they are not known, words in ``comfort`` and
                     ``iri_class``; ``t_s`` is monotonic, ``utc_s`` counts from 1970 on
    flags            n sets of words that say why something is not known, or doubtful
    damaged_lines    that were left out
    """

    path: Path
    columns: Mapping[str, npt.NDArray[Any]]
    flags: tuple[frozenset[str], ...]
    damaged_lines: int
    _text: str

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        return self.columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)

    def flagged(self, *words: str) -> Bools:
        """(n,) which rows carry any of these flags; without words: any flag at all."""
        return np.array([bool(one & set(words) if words else one) for one in self.flags], dtype=bool)

    def __repr__(self) -> str:
        return self._text

    def charts(self) -> Sequence[Chart]:
        """The IRI over the rows' distances."""
        from logger.chart_data import Curves, Line

        at_m = np.nancumsum(self["distance_end_m"] - self["distance_start_m"])
        known = np.isfinite(self["iri_m_per_km"])
        if not known.any():
            return []
        return [Curves("Roughness", "distance [m]", "IRI [m/km]", (
            Line("IRI", at_m[known], self["iri_m_per_km"][known], np.nan_to_num(self["iri_std_m_per_km"][known])),))]


_WORDS = ("comfort", "iri_class")
_NUMBERS = tuple(one.name for one in fields(WindowRecord) if one.name not in ("t_us", "utc_us", "flags", *_WORDS))


def read_log(path: Path | str) -> Log:
    """Read segment logs: one file, or all in a folder at any depth, in the order of writing; open ones too.

    Raises BadInput where there is no log, or none that can be read. Damage is counted, not raised.

    >>> log = read_log(folder)
    >>> log["iri_m_per_km"].shape == log["speed_mps"].shape
    True
    >>> moving = ~log.flagged("stationary", "slow")
    """
    from logger.report.summary import screen, summarise
    from logger.store.log.log_reader import find_logs, read_logged

    place = Path(path)
    files = [logged for log in find_logs(place) if (logged := read_logged(log, place)) is not None]
    rows = [row for file in files for row in file.records]
    if not rows:
        raise BadInput(f"{path}: expected a log with at least one intact row")
    columns: dict[str, npt.NDArray[Any]] = {
        "t_s": np.array([row.t_us for row in rows]) / US_PER_S,
        "utc_s": np.array([row.utc_us for row in rows], dtype=np.float64) / US_PER_S,
        **{name: np.array([getattr(row, name) for row in rows], dtype=np.float64) for name in _NUMBERS},
        **{name: np.array([getattr(row, name) for row in rows]) for name in _WORDS},
    }
    return Log(place, columns, tuple(frozenset(row.flags) for row in rows), sum(one.damaged_lines for one in files),
               screen(summarise(rows), "utf-8").rstrip())


@dataclass(frozen=True, eq=False, repr=False)
class Samples(Shown):
    """The m samples of an accelerometer.

    t_s           (m,) monotonic time [s]
    accel_mps2    (m, 3) specific force along the sensor's X, Y, Z; gravity is in it [m/s2]
    clipped       (m,) an axis stood at the end of its range
    """

    t_s: Array
    accel_mps2: Array
    clipped: Bools

    def __repr__(self) -> str:
        rows = [("samples", len(self.t_s), ""), ("clipped", int(self.clipped.sum()), "")]
        if not len(self.t_s):
            return table("Samples", rows)
        means = " ".join(f"{mean:.3g}" for mean in self.accel_mps2.mean(axis=0))
        return table("Samples", [*rows, ("time", float(np.ptp(self.t_s)), "s"), ("mean of X, Y, Z", means, "m/s2")])


@dataclass(frozen=True, eq=False, repr=False)
class Dump(Shown):
    """A recorded drive as bytes.

    header       what the recording says about itself
    events       (time [us], source, bytes), oldest first
    torn_tail    the recording was cut off in its last line; all before it is here
    """

    path: Path
    header: DumpHeader
    events: tuple[Event, ...]
    torn_tail: bool

    def samples(self) -> Samples:
        """The accelerometer's samples, decoded by its driver. BadInput for a header that names what cannot be."""
        from logger.service.wiring import config_for_dump, instrument

        with as_bad_input(self.path, DriverError):
            config = config_for_dump(self.header, None, "rav4-2009", place=f"{self.path}:1").accelerometer
            decoder = instrument(config).decoder
            for event in self.events:
                if event.source == config.driver:
                    decoder.feed(event.t_us, event.data)
            decoder.flush()
        block = decoder.take()
        return Samples(block.t_us / US_PER_S, block.accel_mps2, block.clipped)

    def fixes(self) -> list[Fix]:
        """What the GPS said, epoch by epoch."""
        from drivers.nmea import NmeaDecoder

        decoder = NmeaDecoder()
        return [fix for event in self.events if event.source == GPS for fix in decoder.feed(event.t_us, event.data)]

    def __repr__(self) -> str:
        sources = {name: sum(event.source == name for event in self.events)
                   for name in dict.fromkeys(event.source for event in self.events)}
        lasts_s = (self.events[-1].t_us - self.events[0].t_us) / US_PER_S if self.events else 0.0
        return table(f"Dump {self.path}", [
            ("accelerometer", self.header.accelerometer["driver"], ""), ("vehicle", word(self.header.vehicle), ""),
            ("began", self.header.start_utc or "not known", "UTC" if self.header.start_utc else ""),
            ("time", lasts_s, "s"), *((f"events of {name}", count, "") for name, count in sources.items()),
            ("cut off", "yes" if self.torn_tail else None, "")])


def read_dump(path: Path | str) -> Dump:
    """Read a recorded dump, ``.dump`` or ``.dump.gz``, whole.

    Raises BadInput (``file:line: expected ...``) for one that cannot be read, or is damaged.

    >>> dump = read_dump(recording)
    >>> dump.samples().accel_mps2.shape[1], len(dump.fixes()) > 0
    (3, True)
    """
    with as_bad_input(kind=DriverError), open_dump(path) as reader:
        return Dump(Path(path), reader.header, tuple(reader), reader.torn_tail)
