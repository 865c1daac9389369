"""Finished and open logs that are cut, damaged or half removed, and what the next start makes of them."""

from __future__ import annotations

import random
import shutil
from pathlib import Path

from logger.store.rotation import SegmentLog, repair
from logger.store.space import Limits, SpaceKeeper

from crashes import FACTS, problems, window
from fault_trials import Found, Hazard
from faulty_disk import CrashModel, RecordingFiles, lay_out

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


HAZARDS = (
    Hazard("killed or cut off while room is made", "all ends after each change of the disk while exported logs go, in "
           "a kill or with what was not synced in any state", "each log is there with its sidecar or gone with it, "
           "`ridelog verify` has nothing against what is left, and no lone sidecar stays for ever", "as promised",
           cut_while_room_is_made, (False, True)),
)
