"""``ridelog replay``: a recorded dump through the code of the service."""

import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from drivers.dump import open_dump
from logger.files import make_folder, naming, note
from logger.printable import counted
from logger.question import Answer, Argument, LongQuestion, Option, Verb
from logger.service.config import load_config

LOWEST_RATE, HIGHEST_RATE = 0.01, 1e6


def _rate(rate: float) -> None:
    if rate != 0 and not LOWEST_RATE <= rate <= HIGHEST_RATE:
        raise ValueError(f"expected 0, or a number from {LOWEST_RATE:g} to {HIGHEST_RATE:g}")


@dataclass(frozen=True, kw_only=True)
class ReplayQuestion(LongQuestion):
    """Play a recorded dump through the same service code that runs in the car.

      ridelog replay drive.dump.gz --out again
      ridelog replay drive.dump.gz --out other-car --vehicle mycar.yaml

    The rows that come out depend on the recording and the settings alone, whatever the rate.
    """

    dump: Annotated[Path, Argument("recorded drive (.dump or .dump.gz)", metavar="DUMP", read=Path)]
    out: Annotated[Path, Option("folder for the segment logs", metavar="DIR", read=Path)]
    rate: Annotated[float, Option("1: real time; 0 (default): at full speed", metavar="N", check=_rate)] = 0.0
    config: Annotated[Path | None, Option("settings of that drive", metavar="FILE", read=Path)] = None
    vehicle: Annotated[str | None, Option("instead of the vehicle that the recording names",
                                          metavar="NAME|FILE")] = None


VERB = Verb(ReplayQuestion, "logger.commands.replay:replayed")


@dataclass(frozen=True, eq=False, repr=False)
class Outcome(Answer):
    """What a replay made: the ``files``; the rest by ``as_json``."""

    files: list[Path]


def replayed(asked: ReplayQuestion) -> Outcome:
    """Play a dump into logs."""
    from logger.report.summary import screen, summarise, summary_json
    from logger.service import wiring
    from logger.service.event_core import EventCore
    from logger.service.learning import NoiseLearning, drive_fields, drive_words
    from logger.service.main_loop import Player
    from logger.service.wiring import check_recorded_rate
    from logger.store.log.atomic_file import FolderLock
    from logger.store.log.log_name import next_session
    from logger.store.log.log_writer import SegmentLog
    from logger.store.log.recovery import repair
    from logger.store.log.row_format import read_log

    dump, out = asked.dump, asked.out
    given = load_config(asked.config) if asked.config else None
    with open_dump(dump) as reader:
        config = wiring.config_for_dump(reader.header, given, asked.vehicle, place=f"{dump}:1")
        config = replace(config, log=replace(config.log, directory=out))
        noise = wiring.noise_for_dump(reader.header, config, place=f"{dump}:1")
        sensor = wiring.instrument(config.accelerometer, noise)
        check_recorded_rate(dump, sensor)
        car = wiring.car_of(config)
        known = wiring.receiver_for_dump(reader.header, config, place=f"{dump}:1")
        facts = wiring.sidecar(config, sensor, car, known, noise) | {"replayed_from": dump.name}
        make_folder(out)
        with FolderLock(out), naming(out):
            repair(out)
            session = next_session(out)
            pipeline = wiring.pipeline(config, sensor, car, known)
            segment_log = SegmentLog(out, session, facts, config.log.max_file_bytes, more=pipeline.sidecar)
            core = EventCore(sensor.decoder, wiring.gps_decoder(config), pipeline, segment_log)
            player = Player(core, asked.rate, lambda played_s: asked.progress(f"playing: {played_s / 60:.0f} min"))
            started_s = time.monotonic()
            played = player.play(reader)
            wall_s = time.monotonic() - started_s
    files = sorted(out.glob(f"{session:05d}-*.csv"))
    for file in files:
        note(file)
    summary = summarise([record for path in files for record in read_log(path).records])
    receiver = drive_fields(pipeline.alignment, config.accelerometer)
    learning, better = NoiseLearning(out, pipeline, config.accelerometer, noise), pipeline.range_use.advice
    doubts = {"accelerometer": core.accelerometer_doubt, "GPS": core.gps_doubt}
    notices = (*wiring.notices(config, car, sensor), *(f"{name}: {doubt}" for name, doubt in doubts.items() if doubt))
    lines = [
        screen(summary, sys.stdout.encoding or "ascii"),
        *(["The recording was cut short; everything before the cut was played."] if reader.torn_tail else []),
        *drive_words(receiver, known), f"Sensor's noise: {learning.words()}",
        *([f"Sensor's settings: {better}"] if better else []), *notices,
        f"Logs: {out} ({counted(len(files), 'file')}, {counted(core.rows, 'row')})"]
    return Outcome("\n".join(lines), {
        "directory": str(out), "files": [path.name for path in files], "rows": core.rows,
        "played_s": played.duration_s, "wall_s": wall_s, "torn_tail": reader.torn_tail, "receiver": receiver,
        "noise": learning.fields(), "better_setting": better or None, "notices": list(notices),
        "summary": summary_json(summary)}, files)
