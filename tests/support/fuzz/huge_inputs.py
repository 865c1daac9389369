"""Inputs that are small on the disk and huge inside, or huge on the disk and hold nothing; run as a program.

    python -m tests.support.fuzz.huge_inputs FOLDER GIGABYTES

reads each of them in a process of little memory and prints one line per case: what came of it, seconds, and the
megabytes by which the process has grown so far.
"""

from __future__ import annotations

import gzip
import os
import resource
import sys
import threading
import time
import zlib
from collections.abc import Callable
from pathlib import Path

from drivers.dump import DumpHeader, Event, open_dump
from drivers.errors import DriverError
from drivers.wire_profiles import load_profile
from logger.api.inputs import run_on_road as read_run
from logger.errors import BadInput
from logger.service.config import load_config
from logger.store.formats.profile_file import read_profile
from logger.store.formats.record_checks import read_channels
from logger.store.formats.record_file import read_record
from logger.store.formats.vehicle_file import read_vehicle
from logger.store.integrity import verify
from logger.store.log.row_format import read_log

from ..drives.replay import core_for

HEAD = b'# ridelog-dump 1 {"start_utc": null, "accelerometer": {"driver": "%s"}, "gps": {}, "vehicle": "rav4-2009"}\n'


def line_without_end(path: Path, size: int) -> Path:
    """A file of so many zero bytes, which the disk does not store."""
    with path.open("wb") as file:
        file.truncate(size)
    return path


def packed(path: Path, head: bytes, block: bytes, size: int) -> Path:
    """A gzip file that unpacks to ``head`` and so many bytes of ``block`` over and over."""
    engine = zlib.compressobj(9, wbits=31)
    blocks = block * (1_000_000 // len(block))
    with path.open("wb") as file:
        file.write(engine.compress(head))
        for _ in range(size // len(blocks)):
            file.write(engine.compress(blocks))
        file.write(engine.flush())
    return path


def through_a_pipe(path: Path, read: Callable[[Path], object]) -> object:
    """Read a pipe into which zeros are poured as long as somebody reads."""
    os.mkfifo(path)

    def pour() -> None:
        try:
            with path.open("wb", buffering=0) as pipe:
                while True:
                    pipe.write(bytes(1 << 16))
        except BrokenPipeError:
            return
    threading.Thread(target=pour, daemon=True).start()
    return read(path)


def events_of(path: Path) -> int:
    with open_dump(path) as reader:
        return sum(1 for _ in reader)


def replay_one_moment(source: str, data: bytes, size: int) -> int:
    """Events of one and the same time through the service's core."""
    core, _ = core_for(DumpHeader(None, {"driver": "pasco"} if source != "bma220" else {"driver": "bma220"}, {},
                                  "rav4-2009"))
    event = Event(1_000_000, source, data)
    for _ in range(size // len(data)):
        core.feed(event)
    core.finish()
    return core.bad_events


def yaml_bomb(path: Path) -> Path:
    lines = ["a: &a {k: 1}", *(f"{chr(98 + k)}: &{chr(98 + k)} {{<<: [{', '.join(['*' + chr(97 + k)] * 9)}]}}"
                               for k in range(9))]
    path.write_text("\n".join(lines) + "\n")
    return path


def text(path: Path, *parts: bytes) -> Path:
    path.write_bytes(b"".join(parts))
    return path


def cases(folder: Path, size: int) -> dict[str, Callable[[], object]]:
    """Every case by its name; ``size`` is that of the files that hold nothing [bytes]."""
    def at(name: str) -> Path:
        return folder / name

    million = b"c," * 1_000_000 + b"c"
    profile_head = b"distance_m,elevation_m\n"
    erd = b"ERDFILEV2.00\n1,-1,1,1,5,0.1\nXUNITS m\nUNITSNAMm\n"
    brackets = b"a: " + b"[" * 60_000
    return {
        "line without end: dump": lambda: events_of(line_without_end(at("1.dump"), size)),
        "line without end: dump after its header": lambda: events_of(
            packed(at("2.dump.gz"), HEAD % b"pasco", b"0" * 100, size // 10)),
        "line without end: segment log": lambda: read_log(line_without_end(at("00001-000.csv"), size)).damaged_lines,
        "line without end: verify": lambda: verify([line_without_end(at("00002-000.csv"), size)])[0].records_corrupt,
        "line without end: vehicle": lambda: read_vehicle(line_without_end(at("3.yaml"), size)),
        "line without end: settings": lambda: load_config(line_without_end(at("4.yaml"), size)),
        "line without end: profile of a device": lambda: load_profile(line_without_end(at("5.yaml"), size)),
        "line without end: road profile": lambda: read_profile(line_without_end(at("6.csv"), size)),
        "line without end: record": lambda: read_record(line_without_end(at("7.csv"), size)),
        "one long number: road profile": lambda: read_profile(
            text(at("8.csv"), profile_head, b"0," + b"1" * (size // 20))),
        "pipe without end: vehicle": lambda: through_a_pipe(at("9.yaml"), read_vehicle),
        "pipe without end: dump": lambda: through_a_pipe(at("10.dump"), events_of),
        "YAML bomb: vehicle": lambda: read_vehicle(yaml_bomb(at("11.yaml"))),
        "YAML bomb: settings": lambda: load_config(yaml_bomb(at("12.yaml"))),
        "YAML bomb: profile of a device": lambda: load_profile(yaml_bomb(at("13.yaml"))),
        "60,000 brackets: vehicle": lambda: read_vehicle(text(at("14.yaml"), brackets)),
        "60,000 brackets: profile of a device": lambda: load_profile(text(at("15.yaml"), brackets)),
        "250 kB of keys: vehicle": lambda: read_vehicle(
            text(at("16.yaml"), b"".join(b"k%d: 1\n" % k for k in range(22_000)))),
        "60,000 brackets: header of a dump": lambda: events_of(
            text(at("17.dump"), b"# ridelog-dump 1 " + b"[" * 60_000 + b"\n")),
        "zip bomb of nothing": lambda: events_of(packed(at("18.dump.gz"), b"", b"\0" * 1000, size // 10)),
        "zip bomb of events": lambda: events_of(
            packed(at("19.dump.gz"), HEAD % b"pasco", b"0.000000 pasco " + b"30" * 1000 + b"\n", size // 50)),
        "gzip members without number": lambda: events_of(text(at("20.dump.gz"), gzip.compress(b"") * 20_000)),
        "one moment without end: serial sensor": lambda: replay_one_moment(
            "pasco", b"0.1,0.2,0.3\n" * 200, size // 50),
        "one moment without end: chip": lambda: replay_one_moment("bma220", b"\0\0\x40", size // 100),
        "one moment without end: GPS": lambda: replay_one_moment("nmea", b"$GPRMC" * 400, size // 50),
        "a million columns: road profile": lambda: read_profile(text(at("21.csv"), million, b"\n", b"1,2\n")),
        "a million columns: record": lambda: read_record(text(at("22.csv"), b"t_s,accel_z_mps2,", million, b"\n1,2\n")),
        "empty lines: road profile": lambda: read_profile(
            text(at("23.csv"), profile_head, b"0,0\n", b"\n" * (size // 20), b"1,1\n")),
        "words: ERD": lambda: read_profile(
            text(at("24.erd"), erd, b"END\n", b"1 2 3 4 5 6\n" * (size // 250), b"1 2 3 4 5 x\n")),
        "lines carried on: header of an ERD": lambda: read_profile(
            text(at("25.erd"), erd, (b"&       " + b"x" * 60_000 + b"\n") * (size // 1_000_000))),
        "binary numbers without end: ERD": lambda: (
            line_without_end(at("26.erd.bin"), size),
            read_profile(text(at("26.erd"), b"ERDFILEV2.00\n1,-1,1,1,2,0.1\nXUNITS m\nUNITSNAMm\nEND\n")))[1],
        "line without end: channels": lambda: read_channels(line_without_end(at("27.csv"), size)),
        "a million columns: channels": lambda: read_channels(text(at("28.csv"), b"t_s,", million, b"\n1,2\n")),
        "a folder where the drive should be": lambda: (at("run").mkdir(), at("run/drive.csv").mkdir(),
                                                        read_run(at("run")))[2],
    }


def main() -> int:
    """Run every case; 1 when one of them ends otherwise than in an answer or a refusal."""
    folder, size = Path(sys.argv[1]), round(float(sys.argv[2]) * 1e9)
    begun_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    failed = 0
    for name, run in cases(folder, size).items():
        began_s = time.process_time()
        try:
            outcome = f"answer {str(run())[:60]}"
        except (BadInput, DriverError) as error:
            outcome = f"refused: {str(error).removeprefix(str(folder))[:100]}"
        except Exception as error:  # noqa: BLE001 - this is what is being looked for
            outcome = f"FAILED: {type(error).__name__} {error}"
            failed = 1
        grown_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 - begun_mb
        print(f"{name}\t{outcome}\t{time.process_time() - began_s:.2f}\t{grown_mb:.0f}", flush=True)
        for path in folder.iterdir():
            if path.is_file() or path.is_fifo():
                path.unlink()
    return failed


if __name__ == "__main__":
    sys.exit(main())
