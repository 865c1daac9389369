"""A recorded drive sent through real serial wires, and the rows that the service should make of it.

Problem. A replay proves the decoders and the pipeline, but not what lies before them in the car: serial ports,
adapters, threads, timing, the card. So the bytes of a recording are written to serial ports at the times at which they
came, for a service that listens at the other end of the wires, and its log is held against a replay of the same bytes
(``logger.service.hil.log_comparison``).

An accelerometer on an I2C bus is nothing that a serial port can stand in for. Its readings are sent as a bridge
microcontroller would send them, as lines ``x,y,z`` in g (profile ``lines``); nothing of a reading is lost but the flag
that it lies at the end of the range. The expected rows are made of the same lines.
"""

from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import Any

import numpy as np

from drivers.accelerometers import accelerometers, line_reader, serial_accelerometers
from drivers.accelerometers.accelerometer import Decoder, SerialAccelerometer
from drivers.dump import LATEST_US, DumpHeader, Event
from drivers.errors import BadReply, NotPresent, SettingsError
from drivers.hardware import BytePort
from drivers.readings import AccelerationBlock, RecordedWords
from logger.errors import BadInput, as_bad_input
from logger.estimation.receiver_delay import CarriedDelay
from logger.records import WindowRecord
from logger.service import wiring
from logger.service.config import AXES, Config
from logger.service.event_core import EventCore, KeptRows
from logger.service.learning import KnownNoise, delay_at_start
from logger.service.main_loop import EventMerger
from logger.service.signal_chain import Axis
from logger.units import STANDARD_GRAVITY_MPS2, US_PER_S

PROGRESS_EVERY_US = US_PER_S


@dataclass(frozen=True)
class Wired:
    """A recording as it goes through serial wires: its header and events, of a serial accelerometer and the GPS alone.

    bridged    title of the accelerometer whose bytes were turned into lines; empty: they go as they are
    """

    header: DumpHeader
    events: Iterator[Event]
    bridged: str


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
    kind = accelerometers()[sensor["driver"]]
    if isinstance(kind, SerialAccelerometer):
        return Wired(header, iter(events), bridged="")
    with as_bad_input(place, SettingsError):
        said = RecordedWords(sensor)
        settings = kind.recorded(said, kind.settings(), is_given=False)
        axis = said.name("vertical_axis", "+z", AXES)
    oversample = kind.readings(settings).oversample
    if oversample != 1:
        raise BadInput(f"{place}: expected a {kind.title} read 100 times a second, found oversample {oversample}")
    bridge = line_reader()
    lines: dict[str, Any] = {"driver": bridge.name, **(bridge.lines or {})}
    if "vertical_axis" in sensor:
        lines["vertical_axis"] = axis
    decoder = kind.decoder(settings, Axis.from_word(axis).column)
    return Wired(replace(header, accelerometer=lines), _as_lines(events, decoder), bridged=kind.title)


def send(events: Iterable[Event], ports: Mapping[str, BytePort], now_us: Callable[[], int],
         sleep: Callable[[float], None], progress: Callable[[float], None]) -> Sent:
    """Write each event to the port of its source at its time, the first one now.

    ``sleep`` takes seconds; ``progress`` is called about once a second with the time played [s]. A chunk that is late
    delays none of those that follow. Raises NotPresent for a port that has gone or takes nothing.
    """
    late_us = array("q")
    size_bytes = dict.fromkeys(ports, 0)
    first_us = played_us = shown_us = 0
    begun_us: int | None = None
    for event in events:
        if begun_us is None:
            begun_us, first_us = now_us(), event.t_us
        played_us = event.t_us - first_us
        due_us = begun_us + played_us
        while (wait_us := due_us - now_us()) > 0:
            sleep(wait_us / US_PER_S)
        late_us.append(-wait_us)
        try:
            ports[event.source].write(event.data)
        except OSError as error:
            raise NotPresent(f"the {event.source} port has gone: {error.strerror}") from error
        size_bytes[event.source] += len(event.data)
        if played_us - shown_us >= PROGRESS_EVERY_US:
            shown_us = played_us
            progress(played_us / US_PER_S)
    half, most, all_of_them = np.percentile(late_us, (50, 99, 100)) / 1000 if late_us else (0.0, 0.0, 0.0)
    return Sent(played_us / US_PER_S, size_bytes, (float(half), float(most), float(all_of_them)))


def expected_rows(recording: Wired, config: Config, place: str, receiver: CarriedDelay | None = None,
                  noise: KnownNoise | None = None) -> list[WindowRecord]:
    """The rows that a service with these settings makes of the recording; all have UTC when any has.

    receiver, noise    what the service knew of the receiver's delay and of the sensor's noise when it began; None: as
                       before any drive

    Raises BadInput for settings under which the service does not listen to what the wires bring.
    """
    sensor = config.accelerometer
    if not isinstance(sensor.kind, SerialAccelerometer):
        known = " or ".join(serial_accelerometers())
        raise BadInput(f"the service's settings: expected the driver {known}, whose bytes a serial "
                       f"port can carry, found {sensor.driver} (--config FILE names the settings)")
    for key, value in (sensor.kind.lines or {}).items() if recording.bridged else ():
        found = sensor.kind.header(sensor.settings).get(key)
        if found != value:
            raise BadInput(f"the service's settings: expected the {key} {value}, the form in which the "
                           f"bytes of the {recording.bridged} are sent, found {found}")
    config = wiring.config_for_dump(recording.header, config, None, place)
    instrument = wiring.instrument(config.accelerometer, noise)
    rows = KeptRows()
    # As the service began, not as the recording: the header's delay is that of another drive.
    belief = delay_at_start(config.gps, receiver)
    pipeline = wiring.pipeline(config, instrument, wiring.car_of(config), belief)
    core = EventCore(instrument.decoder, wiring.gps_decoder(config), pipeline, rows)
    for event in recording.events:
        core.feed(event)
    core.finish()
    return rows.dated()


def _first(events: Iterable[Event], length_us: int) -> Iterator[Event]:
    first_us: int | None = None

    def is_in(event: Event) -> bool:
        nonlocal first_us
        first_us = event.t_us if first_us is None else first_us
        return event.t_us - first_us < length_us

    return takewhile(is_in, events)


def _as_lines(events: Iterable[Event], decoder: Decoder) -> Iterator[Event]:
    """Readings of the decoder's events as lines of text, each at its time; other events as they are."""
    # A decoder gives each sample within this time: a clock that is recovered looks some seconds ahead.
    held_us = 10 * US_PER_S
    merger = EventMerger()
    taken_us: int | None = None
    for event in events:
        if event.source == decoder.name:
            with suppress(BadReply):
                decoder.feed(event.t_us, event.data)
        else:
            merger.add([event])
        taken_us = event.t_us if taken_us is None else taken_us
        if event.t_us - taken_us >= US_PER_S:
            taken_us = event.t_us
            merger.add(_lines(decoder.take()))
            yield from merger.until(event.t_us - held_us)
    decoder.flush()
    merger.add(_lines(decoder.take()))
    yield from merger.until(LATEST_US)


def _lines(block: AccelerationBlock) -> list[Event]:
    source = line_reader().name
    return [Event(t_us, source, b"%.4f,%.4f,%.4f\n" % tuple(row))
            for t_us, row in zip(block.t_us.tolist(), (block.accel_mps2 / STANDARD_GRAVITY_MPS2).tolist(), strict=True)]
