"""Events through the core into rows kept in memory, for tests."""

from __future__ import annotations

from collections.abc import Iterable

from drivers.dump import DumpHeader, Event
from logger.records import WindowRecord
from logger.service import assemble
from logger.service.config import Config
from logger.service.core import Core
from logger.store.rotation import ClockMap
from logger.store.segment_log import format_row
from logger.store.vehicle_file import read_vehicle


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


def core_for(header: DumpHeader, config: Config | None = None) -> tuple[Core, Rows]:
    config = assemble.config_for_dump(header, config, None)
    sensor = assemble.instrument(config.accelerometer)
    vehicle = read_vehicle(config.vehicle)
    rows = Rows()
    return Core(sensor.decoder, assemble.gps_decoder(config), assemble.pipeline(config, sensor, vehicle), rows), rows


def rows_of(header: DumpHeader, events: Iterable[Event], config: Config | None = None) -> Rows:
    core, rows = core_for(header, config)
    for event in events:
        core.feed(event)
    core.finish()
    return rows
