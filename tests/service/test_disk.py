"""Full, failing and read-only disks: the storage goes on, says so, writes everything once it can, loses nothing."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from logger.service.storage import LOOK_US
from logger.store import lasting, space
from logger.store.rotation import SegmentLog
from logger.store.space import Limits

from crashes import ERRORS, FACTS, KINDS, Service, events, outage, problems, restart, segments, window
from faulty_disk import RefusingFiles


@pytest.mark.parametrize("error", ERRORS)
@pytest.mark.parametrize("kinds", [*((kind,) for kind in KINDS), KINDS], ids="+".join)
def test_an_outage_of_the_disk_costs_no_row(tmp_path: Path, error: int, kinds: tuple[str, ...]) -> None:
    """It begins at any step, with any change of the disk being refused, once or for a while."""
    outcomes = [outage(tmp_path / f"{begin}-{length}", error, kinds, begin, length)
                for begin in (4, 9, 15) for length in (1, 12)]
    assert [outcome.wrong for outcome in outcomes if outcome.wrong] == []
    assert all(outcome.rows_found == outcome.rows_promised for outcome in outcomes)
    assert any(outcome.told for outcome in outcomes) or kinds in (("close",), ("remove",))


@pytest.mark.parametrize("error", ERRORS)
def test_a_disk_that_never_comes_back_keeps_what_it_had(tmp_path: Path, error: int) -> None:
    for begin in range(2, 12):
        files = RefusingFiles()
        files.error = error
        service = Service(tmp_path / f"{begin}", files)
        for step in range(20):
            files.refuses = lambda kind, bad=step >= begin: bad
            service.step()
        status = service.storage.status()
        assert lasting.disk_words(OSError(error, "")) == status.trouble
        assert status.rows_waiting >= 20 - begin
        assert status.since_s > 0
        service.storage.close()
        restart(service.folder)
        kept = segments(service.folder)
        assert kept == list(range(1, len(kept) + 1))
        assert len(kept) >= begin - 1
        assert service.storage.status().rows_lost >= 20 - len(kept)


def test_a_failed_sync_is_never_taken_for_good_by_the_next_one(tmp_path: Path) -> None:
    """The system throws away what it could not write and the next fsync says all is well: so the file is left, and what
    had not reached it is written to another."""
    files = RefusingFiles()
    service = Service(tmp_path / "log", files, max_file_bytes=100_000)
    for _ in range(5):
        service.step()
    part = service.storage.log.file_name
    service.step()
    files.refuses = lambda kind: kind == "sync"
    service.step()
    assert service.storage.log.waiting == 2
    files.refuses = lambda kind: False
    service.wait()
    assert service.storage.log.file_name != part
    assert segments(tmp_path / "log", "*-001.csv") == [1, 2, 3, 4, 5]
    assert segments(tmp_path / "log", "*-002.csv.part") == [6, 7]


@pytest.mark.parametrize("kind", ["write", "sync"])
def test_a_part_that_failed_takes_nothing_more(tmp_path: Path, kind: str) -> None:
    files = RefusingFiles()
    log = SegmentLog(tmp_path, 1, FACTS, 100_000, files)
    log.append(window(1, utc=True))
    log.sync()
    files.refuses = lambda asked: asked == kind
    with pytest.raises(OSError, match="error"):
        log.append(window(2, utc=True))
        log.sync()
    files.refuses = lambda asked: False
    with pytest.raises(ValueError, match="go_on"):
        log.append(window(2, utc=True))
    with pytest.raises(ValueError, match="go_on"):
        log.sync()
    assert log.rows_on_disk == 1


@pytest.mark.parametrize("kind", ["write", "sync"])
def test_an_outage_leaves_no_file_open_and_nothing_half_written(tmp_path: Path, kind: str) -> None:
    before = len(list(Path("/proc/self/fd").iterdir()))
    files = RefusingFiles()
    service = Service(tmp_path / "log", files)
    for round_number in range(40):
        files.refuses = lambda asked, bad=round_number % 8 >= 6: bad and asked == kind
        service.now_us += 30_000_000
        service.step()
        assert not list(service.folder.glob("*.tmp"))
    files.refuses = lambda asked: False
    service.wait()
    service.storage.close()
    assert len(list(Path("/proc/self/fd").iterdir())) == before


def test_memory_for_rows_is_bounded_and_what_was_lost_is_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lasting, "WAITING_ROWS", 10)
    files = RefusingFiles()
    service = Service(tmp_path / "log", files)
    for _ in range(3):
        service.step()
    files.refuses = lambda kind: True
    for _ in range(30):
        service.step()
    assert (service.storage.status().rows_waiting, service.storage.status().rows_lost) == (10, 20)
    files.refuses = lambda kind: False
    service.wait()
    service.storage.close()
    assert segments(service.folder) == [1, 2, 3, *range(24, 34)]
    assert problems(service.folder) == ["after 00001-001.csv: gap: expected segment 4, found 24"]


def test_a_disk_that_is_bad_from_the_start(tmp_path: Path) -> None:
    files = RefusingFiles()
    files.error = errno.EROFS
    files.refuses = lambda kind: True
    service = Service(tmp_path / "log", files)
    for _ in range(10):
        service.step()
    status = service.storage.status()
    assert (status.trouble, status.rows_waiting) == ("the disk has become read-only", 10)
    assert service.storage.log.file_name is None
    files.refuses = lambda kind: False
    service.wait()
    service.step()
    service.storage.close()
    assert segments(service.folder) == list(range(1, 12))
    assert all(path.name.startswith("00001-") for path in service.folder.glob("*.csv"))
    assert list(service.folder.glob("00001*.dump.gz"))


def test_the_real_full_device(tmp_path: Path) -> None:
    """/dev/full: the kernel's own ENOSPC, in the middle of the writes of a part."""
    class Full(RefusingFiles):
        full = False

        def write(self, descriptor: int, data: bytes) -> None:
            if not self.full:
                return super().write(descriptor, data)
            device = os.open("/dev/full", os.O_WRONLY)
            try:
                os.write(device, data)
            finally:
                os.close(device)

    files = Full()
    service = Service(tmp_path / "log", files)
    service.step()
    files.full = True
    service.step()
    assert service.storage.status().trouble == "the disk is full"
    files.full = False
    service.wait()
    service.storage.close()
    assert segments(service.folder) == [1, 2]


# --- room ------------------------------------------------------------------------------------------------------------


class Card(RefusingFiles):
    """A card of so many bytes, on which nothing else lies."""

    def __init__(self, folder: Path, size: int) -> None:
        super().__init__()
        self.folder = folder
        self.size = size

    def free_bytes(self, directory: Path) -> int:
        return self.size - sum(path.stat().st_size for path in self.folder.iterdir())


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kilobytes for megabytes."""
    monkeypatch.setattr(space, "RESERVE_BYTES", 50_000)
    monkeypatch.setattr(space, "STEP_BYTES", 5_000)


def old_files(folder: Path) -> None:
    """Four sessions, each a log of 10 kB with its sidecar and a dump of 40 kB."""
    folder.mkdir()
    for session in range(1, 5):
        (folder / f"{session:05d}-001.csv").write_bytes(bytes(10_000))
        (folder / f"{session:05d}-001.json").write_text("{}")
        (folder / f"{session:05d}.dump.gz").write_bytes(bytes(40_000))
    (folder / "last-session").write_text("")


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir() if path.name < "00005")


def keeper(folder: Path, files: Card, exported: set[str], limits: Limits) -> space.SpaceKeeper:
    return space.SpaceKeeper(folder, limits, lambda _: exported, files)


@pytest.mark.parametrize("by_quota", [False, True])
def test_the_oldest_exported_files_go_first_and_only_as_far_as_needed(
    tmp_path: Path, small: None, by_quota: bool
) -> None:
    folder = tmp_path / "log"
    old_files(folder)
    used = sum(path.stat().st_size for path in folder.iterdir())
    limits = Limits(used + 45_000, 0) if by_quota else Limits(None, 1_000_000)
    files = Card(folder, used + 45_000 + limits.floor_bytes if not by_quota else 10**9)
    exported = {"00002-001.csv", "00002-001.json", "00003.dump.gz", "00004.dump.gz", "00001-001.csv"}
    room = keeper(folder, files, exported, limits)
    room.look()
    assert (room.why_no_dumps, room.why_no_logs, room.exported_removed, room.dumps_lost) == ("", "", 3, 0)
    assert names(folder) == ["00001-001.csv", "00001-001.json", "00001.dump.gz", "00002.dump.gz", "00003-001.csv",
                             "00003-001.json", "00004-001.csv", "00004-001.json"]


def test_then_dumps_stop_then_old_dumps_go_and_logs_never(tmp_path: Path, small: None) -> None:
    folder = tmp_path / "log"
    old_files(folder)
    used = sum(path.stat().st_size for path in folder.iterdir())
    files = Card(folder, used + 60_000)
    room = keeper(folder, files, set(), Limits(None, 0))
    seen = []
    for size in range(used + 60_000, 35_000, -3_000):
        files.size = size
        room.look()
        seen.append((bool(room.why_no_dumps), room.dumps_lost, bool(room.why_no_logs)))
        assert len(list(folder.glob("*.csv"))) == 4
    assert seen[0] == (False, 0, False)
    assert sorted(seen) == seen  # each step comes after the one before
    assert {(True, 0, False), (True, 1, False), (True, 4, False), (True, 4, True)} <= set(seen)
    files.size += 200_000
    room.look()
    assert (room.why_no_dumps, room.why_no_logs) == ("", "")


def test_a_card_that_fills_up_and_is_emptied(tmp_path: Path, small: None) -> None:
    """The raw dump stops, the log goes on; then the log waits; then both go on, and no row is missing."""
    folder = tmp_path / "log"
    folder.mkdir()
    files = Card(folder, 10**6)
    service = Service(folder, files, Limits(None, 0))
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


def test_a_disk_whose_room_cannot_be_measured_stops_nothing(tmp_path: Path) -> None:
    class Blind(RefusingFiles):
        def free_bytes(self, directory: Path) -> int:
            raise OSError(errno.EIO, "no answer")

    service = Service(tmp_path / "log", Blind())
    service.now_us += LOOK_US
    service.step()
    assert service.storage.status().trouble == ""
    service.storage.close()
    assert segments(service.folder) == [1]
