"""Finished and open logs that are cut, damaged or half removed, and what the next start makes of them."""

from __future__ import annotations

import json
import random
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path

from logger.records import WindowRecord
from logger.store.log.disk_quota import DiskQuota, QuotaLimits
from logger.store.log.log_reader import read_logged
from logger.store.log.log_writer import SegmentLog
from logger.store.log.recovery import repair
from logger.store.log.row_format import HEADER, format_row, parse_row, read_log
from logger.store.log.sidecar import ClockMap, read_sidecar, sealed

from .crashes import FACTS, OFFSET_US, problems, window
from .disk_models import CrashModel, RecordingFiles, RefusingFiles, lay_out
from .trials import Found, Hazard, found

ROWS = 6


class FullCard(RecordingFiles):
    """A card without any room."""

    def free_bytes(self, directory: Path) -> int:
        return 0


def session_of(folder: Path, session: int, rows: int = ROWS, max_bytes: int = 10**6) -> SegmentLog:
    """A session with so many rows, synced and still open."""
    log = SegmentLog(folder, session, FACTS, max_bytes)
    for segment in range(1, rows + 1):
        log.append(window(segment, utc=True))
    log.sync()
    return log


def cut_while_room_is_made(folder: Path, power: bool) -> Found:
    """Every exported log goes; all ends after each change of that."""
    (folder / "log").mkdir()
    for session in (1, 2, 3):
        session_of(folder / "log", session).close()
    files = FullCard(folder / "log")
    _make_room(folder / "log", files)
    rng = random.Random(3)
    trials = 0
    wrong = []
    for count in range(len(files.journal) + 1):
        for _ in range(4 if power else 1):
            model = CrashModel.after(files, count)
            after = lay_out(folder / "after", model.powerless(rng) if power else model.killed())
            repair(after)
            wrong += problems(after) if list(after.glob("*.csv")) else []
            _make_room(after, FullCard(after))
            if list(after.iterdir()):
                wrong.append(f"stays for ever: {sorted(path.name for path in after.iterdir())}")
            shutil.rmtree(after)
            trials += 1
    return Found(trials, wrong=tuple(wrong))


def _make_room(folder: Path, files: FullCard) -> None:
    exported = {path.name for path in folder.iterdir()}
    DiskQuota(folder, QuotaLimits(None, 0), lambda _: exported, files).look()


def flipped_sidecar_of_an_open_part(folder: Path, case: tuple[int, int]) -> Found:
    """So many random bits, each of the sidecar of a part whose rows have no UTC yet. What is repaired is all rows, with
    the right UTC or none."""
    seed, trials = case
    log = SegmentLog(folder, 1, FACTS, 10**6, RefusingFiles())
    for segment in range(1, ROWS + 1):
        log.append(window(segment, utc=False))
    log.set_clock_map(ClockMap(OFFSET_US))
    image = {path.name: path.read_bytes() for path in folder.iterdir()}
    log.close()
    rng = random.Random(seed)
    unknown = 0
    for _ in range(trials):
        after = lay_out(folder / "after", image | {"00001-001.json": flipped(image["00001-001.json"], rng)})
        repair(after, RefusingFiles())
        records = read_log(after / "00001-001.csv").records
        _as_written(records, range(1, ROWS + 1))
        unknown += records[0].utc_us is None
        assert problems(after) == []
        shutil.rmtree(after)
    return found(trials, unknown=unknown)


def flipped_sidecar_of_a_finished_log(folder: Path, case: tuple[int, int]) -> Found:
    """So many random bits. Either nothing that is read has changed, or nothing is read of it and it is said."""
    seed, trials = case
    session_of(folder, 1).close()
    log, sidecar = folder / "00001-001.csv", folder / "00001-001.json"
    whole, content = sidecar.read_bytes(), read_sidecar(log)
    rng = random.Random(seed)
    seen = 0
    for _ in range(trials):
        sidecar.write_bytes(flipped(whole, rng))
        is_wrong = bool(problems(folder))
        shown = read_logged(log).sidecar
        assert shown == (None if is_wrong else content), f"accepted: {shown}"
        seen += is_wrong
    return found(trials, seen=seen)


def flipped(data: bytes, rng: random.Random) -> bytes:
    """One bit is another."""
    place, bit = rng.randrange(len(data)), rng.randrange(8)
    return data[:place] + bytes([data[place] ^ 1 << bit]) + data[place + 1:]


def damaged_part(folder: Path, case: tuple[int, int]) -> Found:
    """So many sessions of one to three parts that were left open, or of which the last was, each with damage inside. A
    row is kept when its line is as it was; nothing but a hole is missing, and nobody finds fault with that."""
    seed, trials = case
    rng = random.Random(seed)
    lost = 0
    for _ in range(trials):
        image, last = _session_image(rng)
        parts = sorted(name for name in image if name.endswith(".part"))
        name = rng.choice(parts)
        image[name] = damaged(image[name], rng, may_be_cut=name == parts[-1])
        lines = {line for name, data in image.items() if ".csv" in name for line in data.split(b"\n")}
        kept = [segment for segment in range(1, last + 1) if format_row(window(segment, utc=True)).encode() in lines]
        after = lay_out(folder / "after", image)
        repair(after, RefusingFiles())
        assert not list(after.glob("*.part")), f"{name}: left open"
        logs = sorted(after.glob("*.csv"))
        assert logs or not kept
        records = [record for log in logs for record in read_log(log).records]
        assert {record.segment for record in records} >= set(kept), f"{name}: rows are lost"
        _as_written(records, sorted({record.segment for record in records}))
        wrong = problems(after) if logs else []
        assert not wrong, f"{name}: {wrong}"
        lost += last - len(records)
        shutil.rmtree(after)
    return found(trials, lost=lost)


def _session_image(rng: random.Random) -> tuple[dict[str, bytes], int]:
    """The files of a session that was cut off, and its last row."""
    rows = [rng.randrange(1, 9) for _ in range(rng.randrange(1, 4))]
    first_open = rng.randrange(len(rows))
    image = {}
    segment = 0
    for part, count in enumerate(rows):
        lines = [HEADER, *(format_row(window(segment + 1 + n, utc=True)) for n in range(count))]
        segment += count
        is_open = part >= first_open
        image[f"00001-{part + 1:03d}.csv{'.part' * is_open}"] = "".join(f"{line}\n" for line in lines).encode()
        if not is_open:
            image[f"00001-{part + 1:03d}.json"] = json.dumps(sealed({"log": {"rows": count}})).encode()
    return image, segment


def damaged(data: bytes, rng: random.Random, may_be_cut: bool = True) -> bytes:
    """Other bits, bytes, sectors or lengths somewhere; never cut to a whole number of lines, which leaves no trace."""
    begin = rng.randrange(len(data))
    length = min(rng.choice((1, 3, 40, 512, 3000)), len(data) - begin)
    kind = rng.randrange(6)
    if kind == 0:
        return flipped(data, rng)
    if kind == 1:
        return data[:begin] + bytes(length) + data[begin + length:]
    if kind == 2:
        return data[:begin] + rng.randbytes(length) + data[begin + length:]
    if kind == 3 and b"\n" in data[begin:]:  # two lines become one
        newline = data.index(b"\n", begin)
        return data[:newline] + data[newline + 1:]
    if kind == 4 and may_be_cut and begin and data[begin - 1:begin] != b"\n":  # torn
        return data[:begin]
    return data[:begin] + bytes(rng.choices(b"0123456789", k=length)) + data[begin + length:]


def both_damaged(folder: Path, case: tuple[int, int]) -> Found:
    """A part and the file that was made of it, left beside each other by a cut, each with damage of its own."""
    seed, trials = case
    rng = random.Random(seed)
    missing = 0
    for _ in range(trials):
        rows = range(1, rng.randrange(2, 12))
        lines = {ending: [HEADER, *(format_row(window(n, utc=ending == "csv")) for n in rows)]
                 for ending in ("csv", "csv.part")}
        image = {f"00001-001.{ending}": "".join(f"{line}\n" for line in text).encode()
                 for ending, text in lines.items()}
        for name in list(image):
            for _ in range(rng.randrange(1, 3)):
                image[name] = damaged(image[name], rng)
        written = {line.encode(): max(0, place) for text in lines.values() for place, line in enumerate(text)}
        kept = {written.get(line, 0) for data in image.values() for line in data.split(b"\n")} - {0}
        image["00001-001.json"] = json.dumps(sealed({"log": {"rows": len(rows)}})).encode()
        after = lay_out(folder / "after", image)
        repair(after, RefusingFiles())
        logs = list(after.glob("*.csv"))
        records = read_log(logs[0]).records if logs else ()
        assert {record.segment for record in records} >= kept, "rows are lost"
        _as_written(records, sorted({record.segment for record in records}))
        assert not logs or problems(after) == [], problems(after)
        missing += len(rows) - len(records)
        shutil.rmtree(after)
    return found(trials, missing=missing)


def _as_written(records: Sequence[WindowRecord], segments: Iterable[int]) -> None:
    """These rows, in this order, each as it was written, with the right UTC or none."""
    assert [record.segment for record in records] == list(segments)
    for record in records:
        assert record == parse_row(format_row(window(record.segment, utc=record.utc_us is not None)))


HAZARDS = (
    Hazard("killed or cut off while space is freed", "the process is killed, or the power cut, after each change of "
           "the disk while exported logs are removed; what was not synced is in any state",
           "each log is there with its sidecar or gone with it, what is left passes `ridelog verify`, and no lone "
           "sidecar remains", "as promised", cut_while_room_is_made, (False, True)),
    Hazard("a bit flipped in the sidecar of an open log", "at random places; its rows wait for their UTC",
           "every row is kept, with the right UTC or flagged `time_unset`", "{unknown.total:.0f} without UTC",
           flipped_sidecar_of_an_open_part, tuple((seed, 500) for seed in range(4)), 1),
    Hazard("a bit flipped in the sidecar of a finished log", "at random places",
           "`ridelog verify` says so and `ridelog report` does not show it, or nothing that is read has changed",
           "{seen.total:.0f} seen", flipped_sidecar_of_a_finished_log, tuple((seed, 500) for seed in range(4)), 1),
    Hazard("damage inside an open log", "bits, bytes, sectors, line ends and lengths of a session's open files are "
           "changed", "the next start keeps every row whose line is as it was, the files pass `ridelog verify`, and "
           "the sidecar says what was lost", "{lost.total:.0f} rows lost, none accepted",
           damaged_part, tuple((seed, 1000) for seed in range(7)), 1),
    Hazard("damage inside an open log and the file that was made of it", "a cut has left both, and each is damaged",
           "every row that is intact in either is kept, once and in order", "{missing.total:.0f} rows damaged in both",
           both_damaged, tuple((seed, 500) for seed in range(4)), 1),
)
