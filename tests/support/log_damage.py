"""Finished and open logs that are cut, damaged or half removed, and what the next start makes of them."""

from __future__ import annotations

import random
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path

from logger.commands.report import read_logged
from logger.records import WindowRecord
from logger.store.rotation import ClockMap, SegmentLog, read_sidecar, repair
from logger.store.segment_log import format_row, parse_row, read_log
from logger.store.space import Limits, SpaceKeeper

from crashes import FACTS, OFFSET_US, problems, window
from fault_trials import Found, Hazard, found
from faulty_disk import CrashModel, RecordingFiles, RefusingFiles, lay_out

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
    SpaceKeeper(folder, Limits(None, 0), lambda _: exported, files).look()


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


def _as_written(records: Sequence[WindowRecord], segments: Iterable[int]) -> None:
    """These rows, in this order, each as it was written, with the right UTC or none."""
    assert [record.segment for record in records] == list(segments)
    for record in records:
        assert record == parse_row(format_row(window(record.segment, utc=record.utc_us is not None)))


HAZARDS = (
    Hazard("killed or cut off while room is made", "all ends after each change of the disk while exported logs go, in "
           "a kill or with what was not synced in any state", "each log is there with its sidecar or gone with it, "
           "`ridelog verify` has nothing against what is left, and no lone sidecar stays for ever", "as promised",
           cut_while_room_is_made, (False, True)),
    Hazard("a bit flipped in the sidecar of an open log", "at random places; its rows wait for their UTC",
           "every row is kept, with the right UTC or flagged `time_unset`", "{unknown.total:.0f} without UTC",
           flipped_sidecar_of_an_open_part, tuple((seed, 500) for seed in range(4)), 1),
    Hazard("a bit flipped in the sidecar of a finished log", "at random places",
           "`ridelog verify` says so and `ridelog report` does not show it, or nothing that is read has changed",
           "{seen.total:.0f} seen", flipped_sidecar_of_a_finished_log, tuple((seed, 500) for seed in range(4)), 1),
)
