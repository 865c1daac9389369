"""Recorded dumps into runs: what the box in a car recorded, as the lab reads it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drivers.dump import open_dump
from logger.api.extracted_runs import Extracted, Fixes, MeasuredProfile, Recorded, Tell, apart, folder_of, write_runs
from logger.errors import BadInput
from logger.runs import RecordFacts
from logger.service.config import Config
from logger.units import STANDARD_GRAVITY_MPS2, US_PER_S

if TYPE_CHECKING:
    from logger.service.wiring import Instrument


def name_of(dump: Path) -> str:
    """What the first run of a dump is called."""
    return folder_of(dump, dump.name.removesuffix(".gz").removesuffix(".dump"))


def extract_dump(dump: Path, out: Path, given: Config | None, measured: MeasuredProfile | None = None,
                 tell: Tell = lambda words: None, vehicle: str | None = None) -> Extracted:
    """Write the runs of a recorded dump into ``out/NAME``, ``out/NAME-2``, ...

    given       settings of that drive; None: the defaults, with what the recording's header says
    measured    the profile that was driven on; None: the runs have no profile
    vehicle     name or file of the car, instead of the one that settings or recording name

    Runs that were made of a dump of this name before are replaced.

    Raises BadInput for a dump of which nothing can be used, with the reason, and for a folder that holds the run of
    something else; DumpError for a dump that is damaged.
    """
    if out.exists() and not out.is_dir():
        raise BadInput(f"{out}: expected a folder")
    recorded, heard = _recorded(dump, given, vehicle, tell)
    fixes = recorded.fixes
    if not len(recorded.readings.time_s) or not recorded.readings.present.any():
        raise BadInput(f"{dump}: expected readings of the accelerometer, found none")
    if len(fixes.time_s) < 2:
        raise BadInput(f"{dump}: expected fixes with a speed and a place, found {heard} fixes, of which "
                       f"{len(fixes.time_s)} have both")
    return write_runs(recorded, dump, name_of(dump), out, measured, tell)


def _recorded(dump: Path, given: Config | None, vehicle: str | None, tell: Tell) -> tuple[Recorded, int]:
    """All of a dump, and how many fixes it holds."""
    from logger.estimation.drive_alignment import DriveAlignment
    from logger.estimation.receiver_delay import combined
    from logger.service import wiring
    from logger.service.drive_readings import DriveReadings
    from logger.service.event_core import EventCore
    from logger.service.main_loop import Player
    from logger.service.signal_chain import Axis
    from logger.service.wiring import check_recorded_rate
    from logger.store.formats.vehicle_file import read_model

    with open_dump(dump) as reader:
        config = wiring.config_for_dump(reader.header, given, vehicle, place=f"{dump}:1")
        sensor = wiring.instrument(config.accelerometer, wiring.noise_for_dump(reader.header, config, f"{dump}:1"))
        check_recorded_rate(dump, sensor)
        known = wiring.receiver_for_dump(reader.header, config, place=f"{dump}:1")
        axis = Axis.from_word(config.accelerometer.vertical_axis)
        kept = DriveReadings(wiring.signal_chain(config, sensor), DriveAlignment(axis.column, axis.sign), known.delay_s)
        core = EventCore(sensor.decoder, wiring.gps_decoder(config), kept, _NoRows())
        player = Player(core, 0.0, lambda played_s: tell(f"reading: {played_s / 60:.0f} min"))
        player.play(reader)
    receiver = known if known.std_s == 0.0 else combined(known, kept.alignment.estimate())
    receiver = replace(receiver, delay_s=max(0.0, receiver.delay_s))
    fixes = _fixes(kept, receiver.delay_s - known.delay_s)
    recorded = Recorded(kept.readings(), fixes, config, read_model(config.vehicle), _facts(sensor, config), receiver,
                        reader.torn_tail)
    return recorded, len(kept.fixes)


def _facts(sensor: Instrument, config: Config) -> RecordFacts:
    range_g = sensor.description.get("range_g")
    return RecordFacts(step_mps2=sensor.on_grid(sensor.sensor.noise_rms_mps2).step_mps2 or None,
                       range_mps2=range_g and range_g * STANDARD_GRAVITY_MPS2, noise_mps2=_noise_mps2(sensor, config))


def _noise_mps2(sensor: Instrument, config: Config) -> float | None:
    """Of the sensor, where the settings say it; None: whoever reads the run learns it from the readings."""
    if not isinstance(config.accelerometer.noise_mps2, float):
        return None
    return sensor.on_grid(sensor.sensor.noise_rms_mps2).noise_rms_mps2


class _NoRows:
    """Where no rows go."""

    def append(self, record: Any) -> None:
        """Nothing."""

    def rotate(self) -> None:
        """Nothing."""

    def set_clock_map(self, clock_map: Any) -> None:
        """Nothing."""

    def close(self) -> None:
        """Nothing."""


def _fixes(kept: Any, later_s: float) -> Fixes:
    """Fixes of a drive, ``later_s`` earlier than they were placed on the way [s]."""
    from logger.extraction.held_fixes import fix_times_s

    whole = [timed for timed in kept.fixes if timed.fix.valid and timed.fix.speed_mps is not None
             and timed.fix.lat_deg is not None and timed.fix.lon_deg is not None]
    placed_s, named_s, speed_mps, lat_deg, lon_deg = np.array([
        (timed.t_us / US_PER_S, np.nan if timed.fix.time_of_day_us is None else timed.fix.time_of_day_us / US_PER_S,
         timed.fix.speed_mps, timed.fix.lat_deg, timed.fix.lon_deg) for timed in whole], dtype=float).reshape(-1, 5).T
    time_s = fix_times_s(placed_s, named_s) - later_s
    return Fixes(time_s, speed_mps, lat_deg, lon_deg).part(apart(time_s))
