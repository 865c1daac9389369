"""Events through the core into rows kept in memory, for tests."""

from __future__ import annotations

from collections.abc import Iterable

from drivers.dump import DumpHeader, Event
from logger.records import WindowRecord
from logger.service import wiring
from logger.service.config import Config
from logger.service.event_core import EventCore
from logger.service.pipeline import Pipeline
from logger.store.formats.vehicle_file import read_model
from logger.store.log.row_format import format_row
from logger.store.log.sidecar import ClockMap


class Rows:
    """A sink that keeps the rows as text, with a mark where the file was changed."""

    def __init__(self) -> None:
        self.rows: list[str] = []
        self.records: list[WindowRecord] = []

    def append(self, record: WindowRecord) -> None:
        self.rows.append(format_row(record))
        self.records.append(record)

    def rotate(self) -> None:
        self.rows.append("rotate")

    def set_clock_map(self, clock_map: ClockMap) -> None:
        self.rows.append(f"clock {clock_map.offset_us}")

    def close(self) -> None:
        self.rows.append("close")


def core_for(header: DumpHeader, config: Config | None = None) -> tuple[EventCore, Rows]:
    core, rows, _ = parts_for(header, config)
    return core, rows


def parts_for(header: DumpHeader, config: Config | None = None) -> tuple[EventCore, Rows, Pipeline]:
    config = wiring.config_for_dump(header, config, None)
    sensor = wiring.instrument(config.accelerometer, wiring.noise_for_dump(header, config))
    vehicle = wiring.car_of(config, read_model)
    rows = Rows()
    pipeline = wiring.pipeline(config, sensor, vehicle, wiring.receiver_for_dump(header, config))
    return EventCore(sensor.decoder, wiring.gps_decoder(config), pipeline, rows), rows, pipeline


def rows_of(header: DumpHeader, events: Iterable[Event], config: Config | None = None) -> Rows:
    core, rows = core_for(header, config)
    for event in events:
        core.feed(event)
    core.finish()
    return rows
