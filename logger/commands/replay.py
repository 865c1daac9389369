"""Play a recorded dump through the same service code that runs in the car.

  ridelog replay drive.dump.gz --out again
  ridelog replay drive.dump.gz --out other-car --vehicle mycar.yaml

The rows that come out depend on the recording and the settings alone, whatever the rate.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivers.dump import open_dump
from logger.errors import BadInput
from logger.files import make_folder, note
from logger.printable import counted
from logger.service.config import Config, load_config

if TYPE_CHECKING:
    from logger.service.learning import NoiseLearning

LOWEST_RATE, HIGHEST_RATE = 0.01, 1e6


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog replay``."""
    parser.add_argument("dump", metavar="DUMP", type=Path, help="recorded drive (.dump or .dump.gz)")
    parser.add_argument("--out", metavar="DIR", type=Path, required=True, help="folder for the segment logs")
    parser.add_argument("--rate", metavar="N", type=float, default=0.0, help="1: real time; 0 (default): at full speed")
    parser.add_argument("--config", metavar="FILE", type=Path, help="settings of that drive")
    parser.add_argument("--vehicle", metavar="NAME|FILE", help="instead of the vehicle that the recording names")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog replay``."""
    if args.rate != 0 and not LOWEST_RATE <= args.rate <= HIGHEST_RATE:
        raise BadInput(f"--rate {args.rate:g}: expected 0, or a number from {LOWEST_RATE:g} to {HIGHEST_RATE:g}")
    config = load_config(args.config) if args.config else None
    outcome = replay(args.dump, args.out, config, args.rate, args.vehicle, quiet=args.json)
    if args.json:
        print(json.dumps(outcome.as_json()))
    else:
        print(outcome.text())
    return 0


@dataclass(frozen=True)
class Outcome:
    """What a replay made: the folder, the files in it, the rows as a summary, how fast it went, and what the drive
    showed of the receiver's delay, of which the rows took ``known``, of the sensor's noise, and
    which setting would suit it better."""

    directory: Path
    files: list[Path]
    rows: int
    duration_s: float
    wall_s: float
    torn_tail: bool
    summary: Any
    receiver: dict[str, Any]
    known: Any
    noise: NoiseLearning
    better: str
    notices: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """Named fields, SI units in the names."""
        from logger.report.summary import summary_json

        return {
            "directory": str(self.directory),
            "files": [path.name for path in self.files],
            "rows": self.rows,
            "played_s": self.duration_s,
            "wall_s": self.wall_s,
            "torn_tail": self.torn_tail,
            "receiver": self.receiver,
            "noise": self.noise.fields(),
            "better_setting": self.better or None,
            "notices": list(self.notices),
            "summary": summary_json(self.summary),
        }

    def text(self) -> str:
        """For a person."""
        from logger.report.summary import screen
        from logger.service.learning import drive_words

        lines = [screen(self.summary, sys.stdout.encoding or "ascii")]
        if self.torn_tail:
            lines.append("The recording was cut short; everything before the cut was played.")
        lines += [*drive_words(self.receiver, self.known), f"Sensor's noise: {self.noise.words()}"]
        if self.better:
            lines.append(f"Sensor's settings: {self.better}")
        lines += self.notices
        lines.append(f"Logs: {self.directory} ({counted(len(self.files), 'file')}, {counted(self.rows, 'row')})")
        return "\n".join(lines)


def replay(dump: Path, out: Path, given: Config | None, rate: float, vehicle: str | None, quiet: bool) -> Outcome:
    """Play ``dump`` into logs below ``out``. Progress goes to stderr unless ``quiet``."""
    from logger.service import wiring
    from logger.service.event_core import EventCore
    from logger.service.learning import NoiseLearning, drive_fields
    from logger.service.main_loop import Player
    from logger.service.wiring import check_recorded_rate
    from logger.store.log.atomic_file import FolderLock
    from logger.store.log.log_writer import SegmentLog, next_session, repair

    with open_dump(dump) as reader:
        config = wiring.config_for_dump(reader.header, given, vehicle, place=f"{dump}:1")
        config = replace(config, log=replace(config.log, directory=out))
        noise = wiring.noise_for_dump(reader.header, config, place=f"{dump}:1")
        sensor = wiring.instrument(config.accelerometer, noise)
        check_recorded_rate(dump, sensor)
        car = wiring.car_of(config)
        known = wiring.receiver_for_dump(reader.header, config, place=f"{dump}:1")
        facts = wiring.sidecar(config, sensor, car, known, noise) | {"replayed_from": dump.name}
        make_folder(out)
        with FolderLock(out):
            repair(out)
            session = next_session(out)
            pipeline = wiring.pipeline(config, sensor, car, known)
            segment_log = SegmentLog(out, session, facts, config.log.max_file_bytes, more=pipeline.sidecar)
            core = EventCore(sensor.decoder, wiring.gps_decoder(config), pipeline, segment_log)
            player = Player(core, rate, _progress(quiet or not sys.stderr.isatty()))
            started_s = time.monotonic()
            played = player.play(reader)
            wall_s = time.monotonic() - started_s
    if not quiet:
        print(f"\rplayed {played.duration_s:.0f} s of driving in {wall_s:.1f} s      ", file=sys.stderr)
    files, summary = _written(out, session)
    for file in files:
        note(file)
    receiver = drive_fields(pipeline.alignment, config.accelerometer)
    learning = NoiseLearning(out, pipeline, config.accelerometer, noise)
    return Outcome(out, files, core.rows, played.duration_s, wall_s, reader.torn_tail, summary, receiver, known,
                   learning, pipeline.range_use.advice, wiring.notices(config, car, sensor))


def _written(out: Path, session: int) -> tuple[list[Path], Any]:
    """The files of a session, and their rows as a summary."""
    from logger.report.summary import summarise
    from logger.store.log.row_format import read_log

    files = sorted(out.glob(f"{session:05d}-*.csv"))
    records = [record for path in files for record in read_log(path).records]
    return files, summarise(records)


def _progress(quiet: bool) -> Callable[[float], None]:
    def tell(played_s: float) -> None:
        if not quiet:
            print(f"\rplaying: {played_s / 60:.0f} min", end="", file=sys.stderr, flush=True)

    return tell
