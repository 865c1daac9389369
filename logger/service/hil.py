"""A recorded drive sent through real serial wires, and the rows that the service should make of it.

Problem. A replay proves the decoders and the pipeline, but not what lies before them in the car: serial ports,
adapters, threads, timing, the card. So the bytes of a recording are written to serial ports at the times at which they
came, for a service that listens at the other end of the wires, and its log is held against a replay of the same bytes
(``logger.service.agreement``).

A BMA220 sits on an I2C bus, which no serial port can stand in for. Its readings are sent as a bridge microcontroller
would send them, as lines ``x,y,z`` in g (profile ``lines``); nothing of a reading is lost but the flag that it lies at
the end of the range. The expected rows are made of the same lines.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import Any

import numpy as np

from drivers.bma220 import Bma220Decoder
from drivers.dump import DumpHeader, Event
from drivers.ports import BytePort
from logger.errors import BadInput
from logger.records import WindowRecord
from logger.service import assemble
from logger.service.config import Config
from logger.service.core import Core
from logger.store.rotation import ClockMap
from logger.store.vehicle_file import read_vehicle
from logger.units import STANDARD_GRAVITY_MPS2, US_PER_S

BRIDGE_PROFILE = "lines"
PROGRESS_EVERY_US = US_PER_S


@dataclass(frozen=True)
class Wired:
    """A recording as it goes through serial wires: its header and events, of ``pasco`` and ``nmea`` alone.

    bridged    the accelerometer's bytes were turned into lines
    """

    header: DumpHeader
    events: Iterator[Event]
    bridged: bool


@dataclass(frozen=True)
class Sent:
    """What was sent.

    duration_s    from the first event to the last [s]
    size_bytes    by source
    late_ms       how long after its time a chunk was given to its port: half of them, 99 of 100, all at most [ms]
    """

    duration_s: float
    size_bytes: Mapping[str, int]
    late_ms: tuple[float, float, float]


def wired(header: DumpHeader, events: Iterable[Event], seconds: float | None, place: str) -> Wired:
    """The recording, or its first ``seconds``, for serial wires. Raises BadInput, beginning with ``place``, for a chip
    that was read more often than 100 times a second: that many lines the profile does not take."""
    if seconds is not None:
        events = _first(events, round(seconds * US_PER_S))
    sensor = header.accelerometer
    if sensor["driver"] != "bma220":
        return Wired(header, iter(events), bridged=False)
    if sensor.get("oversample", 1) != 1:
        raise BadInput(f"{place}: expected a BMA220 read 100 times a second, found oversample {sensor['oversample']}")
    lines: dict[str, Any] = {"driver": "pasco", "profile": BRIDGE_PROFILE}
    if "vertical_axis" in sensor:
        lines["vertical_axis"] = sensor["vertical_axis"]
    return Wired(replace(header, accelerometer=lines), _as_lines(events, sensor.get("range_g", 2)), bridged=True)


def send(
    events: Iterable[Event], ports: Mapping[str, BytePort], now_us: Callable[[], int],
    sleep: Callable[[float], None], progress: Callable[[float], None],
) -> Sent:
    """Write each event to the port of its source at its time, the first one now.

    ``sleep`` takes seconds; ``progress`` is called about once a second with the time played [s]. A chunk that is late
    delays none of those that follow. Raises ``OSError`` for a port that has gone or takes nothing.
    """
    late_us = array("q")
    size_bytes = dict.fromkeys(ports, 0)
    first_us = played_us = told_us = 0
    begun_us: int | None = None
    for event in events:
        if begun_us is None:
            begun_us, first_us = now_us(), event.t_us
        played_us = event.t_us - first_us
        due_us = begun_us + played_us
        while (wait_us := due_us - now_us()) > 0:
            sleep(wait_us / US_PER_S)
        late_us.append(-wait_us)
        ports[event.source].write(event.data)
        size_bytes[event.source] += len(event.data)
        if played_us - told_us >= PROGRESS_EVERY_US:
            told_us = played_us
            progress(played_us / US_PER_S)
    half, most, all_of_them = np.percentile(late_us, (50, 99, 100)) / 1000 if late_us else (0.0, 0.0, 0.0)
    return Sent(played_us / US_PER_S, size_bytes, (float(half), float(most), float(all_of_them)))


def expected_rows(recording: Wired, config: Config, place: str) -> list[WindowRecord]:
    """The rows that a service with these settings makes of the recording; all have UTC when any has.

    Raises BadInput for settings under which the service does not listen to what the wires bring.
    """
    sensor = config.accelerometer
    if sensor.driver != "pasco":
        raise BadInput("the service's settings: expected the driver pasco, whose bytes a serial port can "
                       f"bring, found {sensor.driver} (--config FILE names the settings)")
    if recording.bridged and sensor.pasco.profile != BRIDGE_PROFILE:
        raise BadInput(f"the service's settings: expected the profile {BRIDGE_PROFILE}, as which the bytes of the "
                       f"BMA220 are sent, found {sensor.pasco.profile}")
    config = assemble.config_for_dump(recording.header, config, None, place)
    instrument = assemble.instrument(config.accelerometer)
    rows = _Rows()
    pipeline = assemble.pipeline(config, instrument, read_vehicle(config.vehicle))
    core = Core(instrument.decoder, assemble.gps_decoder(config), pipeline, rows)
    for event in recording.events:
        core.feed(event)
    core.finish()
    return rows.dated()


class _Rows:
    """A log that is kept in memory."""

    def __init__(self) -> None:
        self._records: list[WindowRecord] = []
        self._clock: ClockMap | None = None

    def append(self, record: WindowRecord) -> None:
        self._records.append(record)

    def rotate(self) -> None:
        """There is but one."""

    def set_clock_map(self, clock_map: ClockMap) -> None:
        self._clock = clock_map

    def close(self) -> None:
        """Nothing to finish."""

    def dated(self) -> list[WindowRecord]:
        """The rows; those made before UTC was known get it, as in the files."""
        clock = self._clock
        if clock is None:
            return self._records
        return [record if record.utc_us is not None else replace(record, utc_us=record.t_us + clock.offset_us)
                for record in self._records]


def _first(events: Iterable[Event], length_us: int) -> Iterator[Event]:
    first_us: int | None = None

    def is_in(event: Event) -> bool:
        nonlocal first_us
        first_us = event.t_us if first_us is None else first_us
        return event.t_us - first_us < length_us

    return takewhile(is_in, events)


def _as_lines(events: Iterable[Event], range_g: int) -> Iterator[Event]:
    """Readings of the chip as lines of text; other events as they are."""
    decoder = Bma220Decoder(range_g)
    for byte in range(256):
        decoder.feed(byte, bytes((byte,) * 3))
    texts = [b"%.4f" % value for value in (decoder.take().accel_mps2[:, 0] / STANDARD_GRAVITY_MPS2).tolist()]
    for event in events:
        if event.source == "bma220":
            x, y, z = event.data
            yield Event(event.t_us, "pasco", b"%b,%b,%b\n" % (texts[x], texts[y], texts[z]))
        else:
            yield event
