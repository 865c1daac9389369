"""Disks that are full, fail, turn read-only or have little room, under the storage of a running service."""

from __future__ import annotations

import errno
import os
import time
from itertools import product
from pathlib import Path
from typing import Any
from unittest.mock import patch

from logger.service.storage import LOOK_US
from logger.store.log import disk_quota, log_writer
from logger.store.log.disk_quota import QuotaLimits

from .crashes import ERRORS, KINDS, Service, events, outage, problems, restart, segments
from .disk_models import RefusingFiles
from .trials import Found, Hazard, found

Case = tuple[int, tuple[str, ...], int, int]


def disk_refuses(folder: Path, case: Case) -> Found:
    error, kinds, begin, length = case
    outcome = outage(folder / "log", error, kinds, begin, length)
    assert not outcome.wrong, outcome.wrong
    assert outcome.reported or length < 12 or not {"write", "sync"} & set(kinds)
    return found(rows=outcome.rows_promised, lost=outcome.rows_promised - outcome.rows_found)


def disk_never_comes_back(folder: Path, case: tuple[int, int]) -> Found:
    error, begin = case
    files = RefusingFiles()
    files.error = error
    service = Service(folder / "log", files)
    for step in range(20):
        files.refuses = lambda kind, bad=step >= begin: bad
        service.step()
    status = service.storage.status()
    assert log_writer.disk_words(OSError(error, "")) == status.trouble
    assert status.rows_waiting >= 20 - begin
    assert status.since_s > 0
    service.storage.close()
    restart(service.folder)
    kept = segments(service.folder)
    assert kept == list(range(1, len(kept) + 1))
    assert len(kept) >= begin - 1
    assert service.storage.status().rows_lost >= 20 - len(kept)
    return found(kept=len(kept))


def failed_sync(folder: Path, rows_before: int) -> Found:
    """The system throws away what it could not write and the next fsync says all is well: so the file is left, and what
    had not reached it is written to another."""
    files = RefusingFiles()
    service = Service(folder / "log", files, max_file_bytes=100_000)
    for _ in range(rows_before):
        service.step()
    part = service.storage.log.file_name
    service.step()
    files.refuses = lambda kind: kind == "sync"
    service.step()
    assert service.storage.log.waiting == 2
    files.refuses = lambda kind: False
    service.wait()
    assert service.storage.log.file_name != part
    assert segments(service.folder, "*-001.csv") == list(range(1, rows_before + 1))
    assert segments(service.folder, "*-002.csv.part") == [rows_before + 1, rows_before + 2]
    return found()


def outages_over_and_over(folder: Path, kind: str) -> Found:
    before = len(list(Path("/proc/self/fd").iterdir()))
    files = RefusingFiles()
    service = Service(folder / "log", files)
    for round_number in range(40):
        files.refuses = lambda asked, bad=round_number % 8 >= 6: bad and asked == kind
        service.now_us += 30_000_000
        service.step()
        assert not list(service.folder.glob("*.tmp"))
    files.refuses = lambda asked: False
    service.wait()
    service.storage.close()
    assert len(list(Path("/proc/self/fd").iterdir())) == before
    assert segments(service.folder) == list(range(1, 41))
    return found(trials=5)


def outage_longer_than_memory(folder: Path, places: int) -> Found:
    with patch.object(log_writer, "WAITING_ROWS", places):
        files = RefusingFiles()
        service = Service(folder / "log", files)
        for _ in range(3):
            service.step()
        files.refuses = lambda kind: True
        for _ in range(30):
            service.step()
        status = service.storage.status()
        assert (status.rows_waiting, status.rows_lost) == (places, 30 - places)
        files.refuses = lambda kind: False
        service.wait()
        service.storage.close()
    assert segments(service.folder) == [1, 2, 3, *range(34 - places, 34)]
    assert problems(service.folder) == [f"after 00001-001.csv: gap: expected segment 4, found {34 - places}"]
    return found()


ROUND_US = 30_500_000
"""A little longer than the storage waits between two tries."""


def outage_of_a_day(folder: Path, case: tuple[str, int]) -> Found:
    """Each try of the service to go on is refused, for so many of them. What is left to be finished does not grow."""
    kind, tries = case
    files = RefusingFiles()
    service = Service(folder / "log", files, max_file_bytes=600)
    for _ in range(3):
        service.step()
    files.refuses = lambda asked: asked == kind or kind == "all"
    most = 0
    for number in range(tries):
        service.now_us += ROUND_US
        if number % 20:
            service.storage.sync()
            service.storage.tend()
        else:
            service.step()
        most = max(most, len(list(service.folder.iterdir())))
    status = service.storage.status()
    assert status.trouble
    assert most <= 8, f"{most} files"
    files.refuses = lambda asked: False
    began_s = time.process_time()
    service.wait()
    took_s = time.process_time() - began_s
    assert took_s < 3, f"{took_s:.1f} s of the processor to go on"
    assert service.storage.status().trouble == ""
    assert len(list(service.folder.glob("*.csv.part"))) == 1
    service.storage.close()
    assert segments(service.folder) == list(range(1, service.rows + 1))
    assert problems(service.folder) == []
    return found(files=most, seconds=took_s)


def each_outage_is_finished_in_its_turn(folder: Path, count: int) -> Found:
    """Parts that were left are finished one in each round of the main loop, however many there are."""
    files = RefusingFiles()
    service = Service(folder / "log", files, max_file_bytes=100_000)
    renamed = 0
    for number in range(4 * count):
        # Nothing that is left can be finished, and every fourth time nothing can be synced either.
        files.refuses = lambda kind, bad=number % 4 == 3: kind == "remove" or (bad and kind == "sync")
        service.now_us += ROUND_US
        service.step()
        service.step()
    files.refuses = lambda kind: False
    service.wait()
    left = len(list(service.folder.glob("*.csv.part")))
    for _ in range(4 * count):
        service.now_us += 500_000
        service.storage.tend()
        now_left = len(list(service.folder.glob("*.csv.part")))
        assert left - now_left <= 1
        renamed += left - now_left
        left = now_left
    assert renamed > count / 2
    assert left == 1
    service.storage.close()
    assert segments(service.folder) == list(range(1, service.rows + 1))
    return found(trials=count)


def bad_from_the_start(folder: Path, error: int) -> Found:
    files = RefusingFiles()
    files.error = error
    files.refuses = lambda kind: True
    service = Service(folder / "log", files)
    for _ in range(10):
        service.step()
    status = service.storage.status()
    assert (status.trouble, status.rows_waiting) == (log_writer.disk_words(OSError(error, "")), 10)
    assert service.storage.log.file_name is None
    files.refuses = lambda kind: False
    service.wait()
    service.step()
    service.storage.close()
    assert segments(service.folder) == list(range(1, 12))
    assert all(path.name.startswith("00001-") for path in service.folder.glob("*.csv"))
    assert list(service.folder.glob("00001*.dump.gz"))
    return found()


class FullDevice(RefusingFiles):
    """The kernel's own ENOSPC, from /dev/full, in place of a write."""

    full = False

    def write(self, descriptor: int, data: bytes) -> None:
        if not self.full:
            return super().write(descriptor, data)
        device = os.open("/dev/full", os.O_WRONLY)
        try:
            os.write(device, data)
        finally:
            os.close(device)


def real_full_device(folder: Path, rows_before: int) -> Found:
    files = FullDevice()
    service = Service(folder / "log", files)
    for _ in range(rows_before):
        service.step()
    files.full = True
    service.step()
    assert service.storage.status().trouble == "the disk is full"
    files.full = False
    service.wait()
    service.storage.close()
    assert segments(service.folder) == list(range(1, rows_before + 2))
    return found()


# --- room ------------------------------------------------------------------------------------------------------------


class Card(RefusingFiles):
    """A card of so many bytes, on which nothing else lies."""

    def __init__(self, folder: Path, size: int) -> None:
        super().__init__()
        self.folder = folder
        self.size = size

    def free_bytes(self, directory: Path) -> int:
        return self.size - sum(path.stat().st_size for path in self.folder.iterdir())


def small() -> Any:
    """Kilobytes for megabytes."""
    return patch.multiple(disk_quota, RESERVE_BYTES=50_000, STEP_BYTES=5_000)


def old_files(folder: Path) -> int:
    """Four sessions, each a log of 10 kB with its sidecar and a dump of 40 kB; gives the bytes in use."""
    folder.mkdir()
    for session in range(1, 5):
        (folder / f"{session:05d}-001.csv").write_bytes(bytes(10_000))
        (folder / f"{session:05d}-001.json").write_text("{}")
        (folder / f"{session:05d}.dump.gz").write_bytes(bytes(40_000))
    (folder / "last-session").write_text("")
    return sum(path.stat().st_size for path in folder.iterdir())


def keeper(folder: Path, files: Card, exported: set[str], limits: QuotaLimits) -> disk_quota.DiskQuota:
    return disk_quota.DiskQuota(folder, limits, lambda _: exported, files)


def exported_files_go_first(folder: Path, by_quota: bool) -> Found:
    folder = folder / "log"
    used = old_files(folder)
    limits = QuotaLimits(used + 45_000, 0) if by_quota else QuotaLimits(None, 1_000_000)
    files = Card(folder, used + 45_000 + limits.floor_bytes if not by_quota else 10**9)
    exported = {"00002-001.csv", "00002-001.json", "00003.dump.gz", "00004.dump.gz", "00001-001.csv"}
    with small():
        room = keeper(folder, files, exported, limits)
        room.look()
    assert (room.why_no_dumps, room.why_no_logs, room.exported_removed, room.dumps_lost) == ("", "", 3, 0)
    assert sorted(path.name for path in folder.iterdir() if path.name < "00005") == [
        "00001-001.csv", "00001-001.json", "00001.dump.gz", "00002.dump.gz", "00003-001.csv", "00003-001.json",
        "00004-001.csv", "00004-001.json"]
    return found()


def nothing_is_exported(folder: Path, step: int) -> Found:
    folder = folder / "log"
    used = old_files(folder)
    files = Card(folder, used + 60_000)
    seen = []
    with small():
        room = keeper(folder, files, set(), QuotaLimits(None, 0))
        for size in range(used + 60_000, 35_000, -step):
            files.size = size
            room.look()
            seen.append((bool(room.why_no_dumps), room.dumps_lost, bool(room.why_no_logs)))
            assert len(list(folder.glob("*.csv"))) == 4
        assert seen[0] == (False, 0, False)
        assert sorted(seen) == seen, "each step comes after the one before"
        assert {(True, 0, False), (True, 1, False), (True, 4, False), (True, 4, True)} <= set(seen)
        files.size += 200_000
        room.look()
    assert (room.why_no_dumps, room.why_no_logs) == ("", "")
    return found(trials=len(seen))


def name_that_is_a_folder(folder: Path, name: str) -> Found:
    """Something under the name of an old dump or log that is no file: it is skipped, the rest makes room."""
    folder = folder / "log"
    used = old_files(folder)
    (folder / name).mkdir()
    with small():
        room = keeper(folder, Card(folder, used + 4_000), set(), QuotaLimits(None, 0))
        room.look()
    assert room.dumps_lost == 1
    assert not (folder / "00001.dump.gz").exists()
    return found()


def card_fills_and_is_emptied(folder: Path, case: None) -> Found:
    """The raw dump stops, the log goes on; then the log waits; then both go on, and no row is missing."""
    folder = folder / "log"
    folder.mkdir()
    files = Card(folder, 10**6)
    with small():
        service = Service(folder, files, QuotaLimits(None, 0))
        states = []
        for size in (10**6, 40_000, -10**6, 10**6):
            files.size = size
            service.now_us += LOOK_US
            for _ in range(4):
                service.step()
            status = service.storage.status()
            states.append((bool(status.recording_trouble), bool(status.trouble)))
        assert states == [(False, False), (True, False), (True, True), (False, False)]
        service.storage.close()
    assert segments(folder) == list(range(1, 17))
    assert service.storage.status().dumps_lost == 1  # that of this session went too before the log had to wait
    recorded = events(folder)
    assert recorded == list(range(recorded[0], 32))
    assert recorded[0] >= 24
    return found()


class Unmeasured(RefusingFiles):
    """A disk that does not tell its room."""

    def free_bytes(self, directory: Path) -> int:
        raise OSError(errno.EIO, "no answer")


def room_cannot_be_measured(folder: Path, case: None) -> Found:
    service = Service(folder / "log", Unmeasured())
    service.now_us += LOOK_US
    service.step()
    assert service.storage.status().trouble == ""
    service.storage.close()
    assert segments(service.folder) == [1]
    return found()


def _outages(error: int) -> tuple[Case, ...]:
    return tuple(product((error,), (*((kind,) for kind in KINDS), KINDS), range(3, 16), (1, 12)))


_GOES_ON = ("the service stays up and `status` says it; rows wait in memory; as soon as the disk takes them each is in "
            "the log, once and in order")
HAZARDS = (
    *(Hazard(name, "the disk refuses one kind of change, or all, in one or twelve rounds of the main loop, from each "
                   "of thirteen rounds on; half of a refused write stays", _GOES_ON,
             "{rows.total:.0f} rows promised, {lost.total:.0f} lost", disk_refuses, _outages(error), 70)
      for name, error in zip(("disk full (ENOSPC)", "dying card (EIO)", "card turns read-only (EROFS)"), ERRORS,
                             strict=True)),
    Hazard("disk that never comes back", "full, failing or read-only from a round on, to the end of the drive",
           "what was on it stays; waiting and lost rows are counted and reported", "as promised", disk_never_comes_back,
           tuple(product(ERRORS, range(2, 12))), 15),
    Hazard("fsync that fails once", "the next fsync reports success, as on Linux",
           "never believed: the rows since the last good one are written again, to another file", "as promised",
           failed_sync, range(3, 22, 2), 2),
    Hazard("outages over and over", "writes or syncs refused in two of each eight rounds",
           "no row lost, no file left open, nothing half written left", "as promised", outages_over_and_over,
           ("write", "sync")),
    Hazard("outage longer than memory lasts", "all is refused for 30 rows, with room for 5 to 25 in memory",
           "memory is bounded, the newest rows are kept, those lost are counted and show as a gap", "as promised",
           outage_longer_than_memory, range(5, 26, 5), 2),
    Hazard("outage of a day", "each try to go on is refused, 2880 of them (or 200): writes, syncs, renames or all",
           "no more than 8 files in the folder; it goes on within 3 s of the processor's time, no row lost",
           "{files.most:.0f} files or fewer, went on in {seconds.most:.2f} s", outage_of_a_day,
           tuple(product(("sync", "write", "rename", "all"), (200, 2880))), 4),
    Hazard("many outages, one after the other", "each leaves a file, none of which can be finished for now",
           "one is finished in each round of the main loop; no row lost", "as promised",
           each_outage_is_finished_in_its_turn, (10, 20, 30), 1),
    Hazard("disk that is bad from the start", "all is refused before the first file is made",
           "the service starts, says it, and writes everything once it can", "as promised", bad_from_the_start, ERRORS),
    Hazard("really full device", "the kernel's `/dev/full` in place of a write", _GOES_ON, "as promised",
           real_full_device, range(1, 11), 2),
    Hazard("little room, exported files there", "the quota or the free room is short",
           "the oldest exported files go, and only as many as needed", "as promised", exported_files_go_first,
           (True, False)),
    Hazard("little room, nothing exported", "free space on the card shrinks step by step",
           "raw dumps stop first, then old dumps go, and it is said; a log never goes; then logs wait", "as promised",
           nothing_is_exported, (3000, 1000), 1),
    Hazard("folder under the name of an old file", "a folder called as a dump or a log lies among them",
           "it is skipped, and the rest makes room", "as promised", name_that_is_a_folder,
           ("00000.dump.gz", "00000-001.csv")),
    Hazard("card fills up and is emptied", "its size changes during a drive",
           "dumps stop, then the log waits in memory, then both go on; no row is lost", "as promised",
           card_fills_and_is_emptied),
    Hazard("room that cannot be measured", "the disk does not tell", "logging goes on", "as promised",
           room_cannot_be_measured),
)
