"""Export: what is copied, what is not, what is promised when a stick or a card fails, and the check at the desk."""

from __future__ import annotations

import errno
import itertools
import os
import tracemalloc
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from logger.errors import BadInput
from logger.store.export import directory_handle, manifest
from logger.store.export.directory_handle import DirectoryHandle
from logger.store.export.export import MARKS_NAME, Progress, export, exported_names, finished_files
from logger.store.export.manifest import Manifest, manifest_blocks, read_manifest
from logger.store.integrity import FileCheck, verify

from ...support.faults.sticks import (
    HAZARDS,
    NAMES,
    OTHER_LOGGER,
    RECORDING,
    a_card,
    a_stick,
    assert_all_there,
    contents,
    hostile_pipe,
    own,
    run,
)
from ...support.faults.trials import Hazard, cases_for_tests, label

pytestmark = pytest.mark.usefixtures("folders_as_sticks")


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    return a_card(tmp_path)


@pytest.fixture
def stick(tmp_path: Path) -> Path:
    return a_stick(tmp_path / "stick")


@pytest.fixture
def no_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """The card's flushes take no time; those of the stick are its model's."""
    monkeypatch.setattr(os, "fsync", lambda _: None)


LONG = ("stick pulled early", "stick that fails once", "stick pulled while it is paired")


@pytest.mark.usefixtures("no_waiting")
@pytest.mark.parametrize(("hazard", "case"), cases_for_tests(HAZARDS, 1, LONG), ids=label)
def test_what_is_promised_is_held(tmp_path: Path, hazard: Hazard, case: object) -> None:
    assert hazard.trial(tmp_path, case).wrong == ()


def test_finished_logs_and_their_sidecars_are_copied(logs: Path, stick: Path) -> None:
    result = run(logs, stick)
    assert result.complete
    assert result.copied == NAMES
    assert result.bytes_copied == sum((logs / name).stat().st_size for name in NAMES)
    assert_all_there(logs, stick)
    assert set(contents(own(logs, stick))) == {*NAMES, manifest.NAME}
    assert exported_names(logs) == set(NAMES)
    assert (stick / OTHER_LOGGER).read_text() == "another car\n"


def test_recordings_of_finished_sessions_go_along(logs: Path, stick: Path) -> None:
    (logs / RECORDING).write_bytes(b"bytes\n")
    assert run(logs, stick).copied == (*NAMES, RECORDING)


def test_the_second_time_nothing_is_written(logs: Path, stick: Path) -> None:
    run(logs, stick)
    before = {path: path.stat().st_mtime_ns for path in stick.rglob("*")}
    result = run(logs, stick)
    assert result.complete
    assert result.copied == ()
    assert result.already_there == NAMES
    assert {path: path.stat().st_mtime_ns for path in stick.rglob("*")} == before


def test_only_what_is_new_is_copied(logs: Path, stick: Path) -> None:
    run(logs, stick)
    (logs / "00002-002.csv").write_text("more\n")
    assert run(logs, stick).copied == ("00002-002.csv",)
    assert_all_there(logs, stick, (*NAMES, "00002-002.csv"))


def test_order_is_that_of_the_sessions_beyond_five_digits_too(tmp_path: Path) -> None:
    logs = ["99999-001.csv", "99999-001.json", "99999-002.csv", "100000-001.csv"]
    dumps = ["99999.dump", "99999-2.dump.gz", "99999-10.dump.gz", "100000.dump.gz"]
    for name in (*logs, *dumps, "00007.json", "99999-003.json", "100001.dump.gz.part", "100001-001.csv.part"):
        (tmp_path / name).touch()
    with DirectoryHandle.at(tmp_path) as folder:
        assert finished_files(folder) == logs + dumps


def test_older_exports_of_files_that_the_card_no_longer_has_stay(logs: Path, stick: Path) -> None:
    run(logs, stick)
    for name in NAMES[:2]:
        (logs / name).unlink()
    (logs / "00005-001.csv").write_text("new\n")
    assert run(logs, stick).complete
    assert set(contents(own(logs, stick))) == {*NAMES, "00005-001.csv", manifest.NAME}
    assert set(read_manifest([(own(logs, stick) / manifest.NAME).read_bytes()]).files) == {*NAMES, "00005-001.csv"}


def test_a_log_that_learned_its_utc_is_exported_again_and_the_old_one_kept(logs: Path, stick: Path) -> None:
    run(logs, stick)
    old = (logs / NAMES[0]).read_bytes()
    (logs / NAMES[0]).write_bytes(b"the same rows, with UTC\n")
    assert NAMES[0] not in exported_names(logs)
    result = run(logs, stick)
    assert result.copied == NAMES[:1]
    aside, = result.set_aside
    assert (own(logs, stick) / aside).read_bytes() == old
    assert_all_there(logs, stick)


def test_files_that_the_owner_took_off_the_stick_leave_its_manifest(logs: Path, stick: Path) -> None:
    run(logs, stick)
    for name in NAMES[:2]:
        (own(logs, stick) / name).unlink()
        (logs / name).unlink()
    run(logs, stick)
    assert set(read_manifest([(own(logs, stick) / manifest.NAME).read_bytes()]).files) == set(NAMES[2:])


def test_links_and_folders_on_the_card_are_not_exported(logs: Path, stick: Path, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret\n")
    (logs / "00006-001.csv").symlink_to(tmp_path / "secret")
    (logs / "00007-001.csv").mkdir()
    result = run(logs, stick)
    assert {failure.name: failure.reason for failure in result.failures} == {
        "00006-001.csv": "card: Too many levels of symbolic links", "00007-001.csv": "card: Is a directory"}
    assert_all_there(logs, stick)


def test_without_the_right_to_write_to_the_card_the_first_export_asks_for_it(
        logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(DirectoryHandle, "open_lock_file", refuse)
    with pytest.raises(BadInput, match="sudo"):
        run(logs, stick)


def test_what_a_cut_export_left_is_cleaned_and_nothing_else(logs: Path, stick: Path) -> None:
    run(logs, stick)
    left, others = "00112233445566ff.ridelog-tmp", "00112233445566FF.ridelog-tmp"
    for name in (left, others):
        (own(logs, stick) / name).write_text("half\n")
    (logs / "00005-001.csv").write_text("new\n")
    run(logs, stick)
    assert left not in contents(own(logs, stick))
    assert others in contents(own(logs, stick))


def test_progress_goes_from_nothing_to_all(logs: Path, stick: Path) -> None:
    reported: list[Progress] = []
    export(logs, stick, reported.append)
    assert reported[0] == Progress(0, len(NAMES))
    assert reported[-1] == Progress(len(NAMES), len(NAMES))
    assert [progress.done for progress in reported] == sorted(progress.done for progress in reported)


MOST_MEMORY_BYTES = 60_000_000
"""Of the 150 MB that the unit may use Python and its modules take some 40."""


def most_memory_bytes(act: Callable[[], object]) -> int:
    tracemalloc.start()
    try:
        act()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def a_manifest(logs: Path, stick: Path, files: int) -> bytes:
    run(logs, stick)
    listed = {f"{number:05d}-{'0' * 40}.csv": "0" * 64 for number in range(files)}
    return b"".join(manifest_blocks(Manifest(own(logs, stick).name, listed)))


@pytest.mark.slow
def test_a_manifest_longer_than_any_of_ours_takes_no_memory(logs: Path, stick: Path) -> None:
    text = a_manifest(logs, stick, 400_000)
    (own(logs, stick) / manifest.NAME).write_bytes(text)
    del text
    assert most_memory_bytes(lambda: run(logs, stick)) < MOST_MEMORY_BYTES
    assert_all_there(logs, stick)


@pytest.mark.slow
def test_the_longest_manifest_that_is_read_fits_the_memory(logs: Path, stick: Path) -> None:
    text = a_manifest(logs, stick, manifest.MAX_FILES)
    (own(logs, stick) / manifest.NAME).write_bytes(text)
    del text
    assert most_memory_bytes(lambda: run(logs, stick)) < MOST_MEMORY_BYTES
    assert_all_there(logs, stick)


@pytest.mark.slow
def test_names_without_end_on_a_stick_take_no_memory(
        logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(logs, stick)
    real = os.scandir

    class Crowd:
        """A folder that also holds 100,000 long names."""

        def __init__(self, place: int) -> None:
            self._entries = real(place)

        def __enter__(self) -> Iterator[SimpleNamespace]:
            crowd = (SimpleNamespace(name=f"{number:06d}-{'x' * 240}") for number in range(100_000))
            return itertools.chain(self._entries, crowd)

        def __exit__(self, *_: object) -> None:
            self._entries.close()

    (logs / "00005-001.csv").write_text("new\n")
    card = logs.stat().st_ino
    monkeypatch.setattr(directory_handle.os, "scandir",
                        lambda place: real(place) if os.fstat(place).st_ino == card else Crowd(place))
    assert most_memory_bytes(lambda: run(logs, stick)) < 20_000_000
    monkeypatch.undo()
    assert_all_there(logs, stick, (*NAMES, "00005-001.csv"))


def test_a_stick_holds_no_more_files_of_a_logger_than_its_manifest(
        logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(manifest, "MAX_FILES", 3)
    result = run(logs, stick)
    assert result.copied == NAMES[:3]
    assert [failure.name for failure in result.failures] == [NAMES[3]]
    assert "3 files" in result.failures[0].reason
    assert_all_there(logs, stick, NAMES[:3])


@pytest.mark.usefixtures("no_waiting")
def test_lists_are_written_no_more_often_than_their_length_bears(
        tmp_path: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is written beside the files grows as their number, not as its square: else 65,000 take hours."""
    (tmp_path / "log").mkdir()
    for number in range(1500):
        (tmp_path / "log" / f"{number:05d}-001.csv").touch()
    written = 0
    real = DirectoryHandle.write

    def write(folder: DirectoryHandle, blocks: Iterable[bytes]) -> tuple[str, str]:
        def counted() -> Iterator[bytes]:
            nonlocal written
            for block in blocks:
                written += len(block)
                yield block
        return real(folder, counted())

    monkeypatch.setattr(DirectoryHandle, "write", write)
    assert run(tmp_path / "log", stick).complete
    ends = sum(path.stat().st_size for path in
               (own(tmp_path / "log", stick) / manifest.NAME, tmp_path / "log" / MARKS_NAME))
    assert written < 10 * ends


@pytest.mark.parametrize("place", ["", "inside", "missing", "file"])
def test_a_wrong_place_is_refused(logs: Path, tmp_path: Path, place: str) -> None:
    (logs / "inside").mkdir()
    (tmp_path / "file").touch()
    target = {"": logs, "inside": logs / "inside", "missing": tmp_path / "missing", "file": tmp_path / "file"}[place]
    with pytest.raises(BadInput, match="expected"):
        run(logs, target)


@pytest.mark.parametrize("logs_at", ["ridelog", "ridelog/log", "link"])
def test_a_place_whose_own_folder_would_be_or_hold_the_logs_is_refused(tmp_path: Path, logs_at: str) -> None:
    """What is copied goes into ``ridelog`` there: with the logs in /var/lib/ridelog, /var/lib is such a place."""
    (tmp_path / "ridelog").mkdir()
    (tmp_path / "link").symlink_to("ridelog")
    logs = tmp_path / logs_at
    logs.mkdir(exist_ok=True)
    (logs / "00001-001.csv").write_text("rows\n")
    before = contents(logs)
    with pytest.raises(BadInput, match="expected a place apart from the folder of logs"):
        run(logs, tmp_path)
    assert contents(logs) == before
    assert exported_names(logs) == set()


def test_a_place_whose_own_folder_leads_into_the_logs_is_refused(logs: Path, tmp_path: Path) -> None:
    (logs / "inside").mkdir()
    (tmp_path / "place").mkdir()
    (tmp_path / "place" / "ridelog").symlink_to(logs / "inside")
    with pytest.raises(BadInput, match="expected a place apart from the folder of logs"):
        run(logs, tmp_path / "place")


def checked(folder: Path) -> FileCheck:
    other = Path(OTHER_LOGGER).parent.name
    return next(check for check in verify([folder]) if check.kind == "manifest" and check.path.parent.name != other)


def test_an_export_of_nothing_passes_the_check_at_the_desk(tmp_path: Path) -> None:
    for name in ("log", "stick"):
        (tmp_path / name).mkdir()
    assert run(tmp_path / "log", tmp_path / "stick").complete
    check, = verify([tmp_path / "stick"])
    assert (check.kind, check.ok, check.records_good) == ("manifest", True, 0)


def test_what_was_exported_passes_the_check_at_the_desk(logs: Path, stick: Path) -> None:
    (logs / RECORDING).write_bytes(b"bytes\n")
    run(logs, stick)
    check = checked(stick)
    assert check.ok
    assert check.records_good == len(NAMES) + 1


@pytest.mark.parametrize(("damage", "found"), [
    (lambda folder: (folder / NAMES[0]).write_bytes(b"x"), (3, 1, 0, "00001-001.csv: corrupt")),
    (lambda folder: (folder / NAMES[1]).unlink(), (3, 0, 1, "00001-001.json: missing")),
    (lambda folder: (folder / "00009-001.csv").touch(), (4, 0, 1, "00009-001.csv: expected in the manifest")),
    (lambda folder: os.truncate(folder / manifest.NAME, 200), (0, 1, 0, "corrupt: cut short")),
    (lambda folder: hostile_pipe(folder / "00009.dump", folder), (4, 0, 1, "00009.dump: expected in the manifest")),
    (lambda folder: (folder / NAMES[0]).unlink() or hostile_pipe(folder / NAMES[0], folder),
     (3, 1, 0, "not a regular file")),
])
def test_what_happened_to_it_since_is_found_at_the_desk(
        logs: Path, stick: Path, damage: Callable[[Path], object], found: tuple[int, int, int, str]) -> None:
    run(logs, stick)
    damage(own(logs, stick))
    check = checked(own(logs, stick))
    assert (check.records_good, check.records_corrupt, check.gaps) == found[:3]
    assert found[3] in check.problems[0]
