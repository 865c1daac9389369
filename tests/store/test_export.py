"""Export to sticks that are whole, full, pulled, damaged, shared or prepared by somebody.

``Stick`` stands in for the system's calls: it fails any one of them on cue, and when the stick is pulled it forgets
what had not been flushed, as a stick does.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from logger.errors import BadInput
from logger.store import manifest, open_folder
from logger.store.export import ExportResult, Progress, export, finished_files
from logger.store.exported import IDENTITY_NAME, exported_names
from logger.store.manifest import parse_manifest
from logger.store.open_folder import OpenFolder
from logger.store.verify import FileCheck, verify

OTHER_LOGGER = "ridelog/0123456789ab/00001-001.csv"
NAMES = ("00001-001.csv", "00001-001.json", "00002-001.csv", "00002-001.json")


class Stick:
    """The ``os`` module, with a stick that can be pulled at its n-th call.

    lost      after that call nothing on the stick works any more, and what was not flushed is gone
    at        number of the call that fails; 0: none
    """

    def __init__(self, root: Path, at: int = 0, error: int = errno.EIO, lost: bool = False) -> None:
        self._root = str(root)
        self._at = at
        self._error = error
        self._lost = lost
        self.calls = 0
        self.most_bytes = 1 << 30
        self.flips = False
        self._unflushed: dict[int, str] = {}
        self._unsynced: list[tuple[str, str, bytes | None]] = []

    def __getattr__(self, name: str) -> Any:
        real = getattr(os, name)
        if not callable(real) or name == "stat_result":
            return real
        return lambda *args, **named: self._call(name, real, args, named)

    def _call(self, name: str, real: Callable[..., Any], args: tuple[Any, ...], named: dict[str, Any]) -> Any:
        place = self._place(args, named)
        if not place.startswith(self._root):
            return real(*args, **named)
        self.calls += 1
        if name == "close":
            os.close(args[0])
            self._unflushed.pop(args[0], None)
            if Path(place).is_dir():
                return None
        if self.calls == self._at or (self._lost and self.calls > self._at > 0):
            if self._lost and self.calls == self._at:
                self._forget()
            raise OSError(self._error, os.strerror(self._error))
        return None if name == "close" else self._carry_out(name, real, place, args, named)

    def _carry_out(self, name: str, real: Callable[..., Any], place: str, args: tuple[Any, ...],
                   named: dict[str, Any]) -> Any:
        if name == "fsync":
            self._unflushed.pop(args[0], None)
            if Path(place).is_dir():
                self._unsynced.clear()
            return None
        if name == "write":
            self._unflushed[args[0]] = place
            data = bytes(args[1])[: self.most_bytes]
            return real(args[0], bytes([data[0] ^ 1]) + data[1:] if self.flips else data)
        if name == "rename":
            target = Path(place, args[1])
            before = target.read_bytes() if target.is_file() and not target.is_symlink() else None
            self._unsynced.append((f"{place}/{args[0]}", str(target), before))
        return real(*args, **named)

    @staticmethod
    def _place(args: tuple[Any, ...], named: dict[str, Any]) -> str:
        where = named.get("dir_fd", named.get("src_dir_fd", args[0]))
        return str(Path(f"/proc/self/fd/{where}").readlink()) if isinstance(where, int) else str(where)

    def _forget(self) -> None:
        for name in self._unflushed.values():
            if Path(name).is_file():
                os.truncate(name, 0)
        for old, new, before in reversed(self._unsynced):
            Path(new).rename(old)
            if before is not None:
                Path(new).write_bytes(before)


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Two finished logs, an open one, a recording of each session, and what else lies in such a folder."""
    folder = tmp_path / "log"
    folder.mkdir()
    for name in (*NAMES, "00003-001.csv.part", "00003-001.json", "00002.dump.gz", "00003.dump.gz.part", "last-session",
                 "00004-001.csv.tmp", "notes.txt"):
        (folder / name).write_bytes(f"content of {name}\n".encode() * 10)
    return folder


@pytest.fixture
def stick(tmp_path: Path) -> Path:
    """A stick with somebody's holiday and another car's log."""
    root = tmp_path / "stick"
    (root / OTHER_LOGGER).parent.mkdir(parents=True)
    (root / OTHER_LOGGER).write_text("another car\n")
    (root / "holiday.jpg").write_text("sea\n")
    return root


def quiet(progress: Progress) -> None:
    pass


def run(logs: Path, stick: Path, dumps: bool = False) -> ExportResult:
    return export(logs, stick, dumps, quiet)


def own(logs: Path, stick: Path) -> Path:
    return stick / "ridelog" / (logs / IDENTITY_NAME).read_text().strip()


def assert_all_there(logs: Path, stick: Path, names: tuple[str, ...] = NAMES) -> None:
    folder = own(logs, stick)
    listed = parse_manifest((folder / manifest.NAME).read_bytes()).files
    assert set(names) <= set(listed)
    for name in names:
        assert (folder / name).read_bytes() == (logs / name).read_bytes()
        assert listed[name] == hashlib.sha256((logs / name).read_bytes()).hexdigest()
    assert not list(folder.glob("*tmp*"))
    assert set(names) <= exported_names(logs)


def assert_nothing_false(logs: Path, stick: Path, card: dict[str, bytes]) -> None:
    """What must hold at every instant, however the export went."""
    assert {name: (logs / name).read_bytes() for name in card} == card
    assert (stick / OTHER_LOGGER).read_text() == "another car\n"
    assert (stick / "holiday.jpg").read_text() == "sea\n"
    assert {path.name for path in stick.iterdir()} == {"holiday.jpg", "ridelog"}
    marked = exported_names(logs)
    if not marked:
        return
    folder = own(logs, stick)
    listed = parse_manifest((folder / manifest.NAME).read_bytes()).files
    for name in marked:
        assert (folder / name).read_bytes() == card[name]
        assert listed[name] == hashlib.sha256(card[name]).hexdigest()


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_finished_logs_and_their_sidecars_are_copied(logs: Path, stick: Path) -> None:
    result = run(logs, stick)
    assert result.complete
    assert result.copied == NAMES
    assert result.bytes_copied == sum((logs / name).stat().st_size for name in NAMES)
    assert_all_there(logs, stick)
    assert set(contents(own(logs, stick))) == {*NAMES, manifest.NAME}
    assert exported_names(logs) == set(NAMES)
    assert (stick / OTHER_LOGGER).read_text() == "another car\n"


def test_recordings_of_finished_sessions_go_along_when_asked(logs: Path, stick: Path) -> None:
    assert run(logs, stick, dumps=True).copied == (*NAMES, "00002.dump.gz")


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
    with OpenFolder.at(tmp_path) as folder:
        assert finished_files(folder, False) == logs
        assert finished_files(folder, True) == logs + dumps


def test_a_second_stick_gets_everything_too(logs: Path, stick: Path, tmp_path: Path) -> None:
    run(logs, stick)
    (tmp_path / "second").mkdir()
    assert run(logs, tmp_path / "second").copied == NAMES


def test_older_exports_of_files_that_the_card_no_longer_has_stay(logs: Path, stick: Path) -> None:
    run(logs, stick)
    for name in NAMES[:2]:
        (logs / name).unlink()
    (logs / "00005-001.csv").write_text("new\n")
    assert run(logs, stick).complete
    assert set(contents(own(logs, stick))) == {*NAMES, "00005-001.csv", manifest.NAME}
    assert set(parse_manifest((own(logs, stick) / manifest.NAME).read_bytes()).files) == {*NAMES, "00005-001.csv"}


def test_a_log_that_learnt_its_utc_is_exported_again_and_the_old_one_kept(logs: Path, stick: Path) -> None:
    run(logs, stick)
    old = (logs / NAMES[0]).read_bytes()
    (logs / NAMES[0]).write_bytes(b"the same rows, with UTC\n")
    assert NAMES[0] not in exported_names(logs)
    result = run(logs, stick)
    assert result.copied == NAMES[:1]
    aside, = result.set_aside
    assert (own(logs, stick) / aside).read_bytes() == old
    assert_all_there(logs, stick)


@pytest.mark.parametrize("damage", [b"", b"content of 00001", b"CONTENT OF 00001-001.csv\n" * 20, b"x" * 10**6])
def test_a_copy_that_is_damaged_is_made_anew(logs: Path, stick: Path, damage: bytes) -> None:
    run(logs, stick)
    (own(logs, stick) / NAMES[0]).write_bytes(damage)
    assert run(logs, stick).copied == NAMES[:1]
    assert_all_there(logs, stick)


@pytest.mark.parametrize("damage", [None, b"", b"# ridelog-manifest 1 logger ", b"\0" * 5000])
def test_a_manifest_that_is_lost_or_damaged_is_made_anew(logs: Path, stick: Path, damage: bytes | None) -> None:
    run(logs, stick)
    path = own(logs, stick) / manifest.NAME
    path.unlink() if damage is None else path.write_bytes(damage)
    assert run(logs, stick).already_there == NAMES
    assert_all_there(logs, stick)


def test_files_that_the_owner_took_off_the_stick_leave_its_manifest(logs: Path, stick: Path) -> None:
    run(logs, stick)
    for name in NAMES[:2]:
        (own(logs, stick) / name).unlink()
        (logs / name).unlink()
    run(logs, stick)
    assert set(parse_manifest((own(logs, stick) / manifest.NAME).read_bytes()).files) == set(NAMES[2:])


def hostile_link(path: Path, outside: Path) -> None:
    path.symlink_to(outside / "secret")


def hostile_link_to_nothing(path: Path, outside: Path) -> None:
    path.symlink_to(outside / "to-be-made")


def hostile_link_to_folder(path: Path, outside: Path) -> None:
    path.symlink_to(outside)


def hostile_pipe(path: Path, outside: Path) -> None:
    os.mkfifo(path)


def hostile_folder(path: Path, outside: Path) -> None:
    path.mkdir()
    (path / "x").touch()


def hostile_hard_link(path: Path, outside: Path) -> None:
    path.hardlink_to(outside / "secret")


@pytest.mark.parametrize("put", [hostile_link, hostile_link_to_nothing, hostile_link_to_folder, hostile_pipe,
                                 hostile_folder, hostile_hard_link])
@pytest.mark.parametrize("name", [NAMES[0], manifest.NAME])
def test_a_prepared_name_is_set_aside_and_never_followed(
        logs: Path, stick: Path, tmp_path: Path, put: Callable[[Path, Path], None], name: str) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "secret").write_text("secret\n")
    run(logs, stick)
    (own(logs, stick) / name).unlink()
    put(own(logs, stick) / name, outside)
    assert run(logs, stick).complete
    assert_all_there(logs, stick)
    assert contents(outside) == {"secret": b"secret\n"}


@pytest.mark.parametrize("put", [hostile_link_to_folder, hostile_link_to_nothing, hostile_pipe, hostile_hard_link])
@pytest.mark.parametrize("depth", ["ridelog", "own"])
def test_something_else_where_our_folder_belongs_is_told_and_not_followed(
        logs: Path, tmp_path: Path, put: Callable[[Path, Path], None], depth: str) -> None:
    outside, stick = tmp_path / "outside", tmp_path / "stick"
    outside.mkdir()
    stick.mkdir()
    (outside / "secret").write_text("secret\n")
    (tmp_path / "scrap").mkdir()
    run(logs, tmp_path / "scrap")
    place = stick / "ridelog" if depth == "ridelog" else own(logs, stick)
    place.parent.mkdir(exist_ok=True)
    put(place, outside)
    result = run(logs, stick)
    assert not result.complete
    assert {failure.name for failure in result.failures} == set(NAMES)
    assert contents(outside) == {"secret": b"secret\n"}


def test_names_with_odd_characters_around_ours_change_nothing(logs: Path, stick: Path) -> None:
    run(logs, stick)
    odd = ["-rf", "a\nb", "*", "$(reboot)", "00009-001.csv; x", "\udcff\udcfe", "0123456789abcdef.ridelog-tmp.not"]
    for name in odd:
        (own(logs, stick) / name).write_text("odd\n")
        (logs / name).write_text("odd\n")
    (logs / "00005-001.csv").write_text("new\n")
    assert run(logs, stick).copied == ("00005-001.csv",)
    assert {name: (own(logs, stick) / name).read_text() for name in odd} == dict.fromkeys(odd, "odd\n")


def test_links_and_folders_on_the_card_are_not_exported(logs: Path, stick: Path, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret\n")
    (logs / "00006-001.csv").symlink_to(tmp_path / "secret")
    (logs / "00007-001.csv").mkdir()
    result = run(logs, stick)
    assert {failure.name: failure.reason for failure in result.failures} == {
        "00006-001.csv": "card: Too many levels of symbolic links", "00007-001.csv": "card: not a regular file"}
    assert_all_there(logs, stick)


def test_names_fit_every_fat(logs: Path, stick: Path) -> None:
    """Long FAT names: none of ``"*/:<>?\\|`` and no end in a dot or a space; and no two alike but for their case."""
    run(logs, stick, dumps=True)
    names = [path.relative_to(stick).as_posix() for path in own(logs, stick).rglob("*")]
    assert not set("".join(names)) & set('"*:<>?\\|')
    assert not [name for name in names if name.endswith((".", " ")) or len(name) > 80]
    assert len({name.lower() for name in names}) == len(names)


def room_for(monkeypatch: pytest.MonkeyPatch, free_bytes: int) -> None:
    monkeypatch.setattr(OpenFolder, "free_bytes", lambda folder: (free_bytes, 512))


def test_a_stick_without_room_for_all_gets_the_oldest_and_says_what_is_missing(
        logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    room_for(monkeypatch, 65_536 + 128 * len(NAMES) + 3 * 512)
    result = run(logs, stick)
    assert result.copied == NAMES[:3]
    assert result.bytes_short == 512
    assert [failure.name for failure in result.failures] == [NAMES[3]]
    assert "no room on the stick" in result.failures[0].reason
    assert_all_there(logs, stick, NAMES[:3])
    room_for(monkeypatch, 10**9)
    assert run(logs, stick).copied == NAMES[3:]
    assert_all_there(logs, stick)


def test_a_full_stick_gets_nothing_and_is_told(logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    room_for(monkeypatch, 0)
    result = run(logs, stick)
    assert len(result.failures) == len(NAMES)
    assert exported_names(logs) == set()


def put_in(monkeypatch: pytest.MonkeyPatch, system: Stick) -> Stick:
    monkeypatch.setattr(open_folder, "os", system)
    return system


def number_of_calls(logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> int:
    with monkeypatch.context() as patch:
        system = put_in(patch, Stick(stick))
        run(logs, stick)
        return system.calls


@pytest.mark.parametrize(("error", "lost"), [(errno.ENODEV, True), (errno.ESTALE, True), (errno.EIO, False),
                                             (errno.ENOSPC, False), (errno.EROFS, False)])
def test_a_fault_at_any_call_loses_nothing_and_the_next_try_puts_it_right(
        logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: int, lost: bool) -> None:
    card = {name: (logs / name).read_bytes() for name in NAMES}
    (tmp_path / "measure").mkdir()
    calls = number_of_calls(logs, tmp_path / "measure", monkeypatch)
    assert calls > 80
    for at in range(1, calls + 1):
        for name in ("exported.json", IDENTITY_NAME):
            (logs / name).unlink(missing_ok=True)
        stick = tmp_path / f"stick-{at}"
        (stick / OTHER_LOGGER).parent.mkdir(parents=True)
        (stick / OTHER_LOGGER).write_text("another car\n")
        (stick / "holiday.jpg").write_text("sea\n")
        with monkeypatch.context() as patch:
            put_in(patch, Stick(stick, at, error, lost))
            try:
                result = run(logs, stick)
            except BadInput:
                assert at == 1
            else:
                assert not result.complete or exported_names(logs) == set(NAMES)
        assert_nothing_false(logs, stick, card)
        assert run(logs, stick).complete
        assert_all_there(logs, stick)
        assert_nothing_false(logs, stick, card)


def test_pulled_at_any_call_of_a_repeat_with_a_changed_log(
        logs: Path, stick: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A log changed since the last export and one is new: set aside, copied, listed anew, cut at every call."""
    at, calls = 0, 10**9
    while at < calls:
        at += 1
        (logs / NAMES[0]).write_text("first state\n")
        run(logs, stick)
        (logs / NAMES[0]).write_text("with UTC\n")
        card = {name: (logs / name).read_bytes() for name in NAMES}
        with monkeypatch.context() as patch:
            system = put_in(patch, Stick(stick, at, lost=True))
            try:
                run(logs, stick)
            except BadInput:
                assert at == 1
            calls = calls if system.calls >= at else at
        for name in exported_names(logs):
            assert (own(logs, stick) / name).read_bytes() == card[name]
        assert run(logs, stick).complete
        assert_all_there(logs, stick)
    assert at > 40


def test_writes_that_take_a_few_bytes_at_a_time_are_gone_on_with(
        logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put_in(monkeypatch, Stick(stick)).most_bytes = 7
    assert run(logs, stick).complete
    monkeypatch.undo()
    assert_all_there(logs, stick)


def test_a_stick_that_does_not_keep_what_it_was_given_is_found_out(
        logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put_in(monkeypatch, Stick(stick)).flips = True
    result = run(logs, stick)
    monkeypatch.undo()
    assert "does not read back" in result.failures[0].reason
    assert len(result.failures) == len(NAMES)
    assert contents(own(logs, stick)) == {}
    assert exported_names(logs) == set()


def test_a_write_protected_stick_that_has_everything_is_no_fault(
        logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(logs, stick)

    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    for name in ("write", "rename", "replace", "discard", "sync"):
        monkeypatch.setattr(OpenFolder, name, refuse)
    assert run(logs, stick).complete


@pytest.mark.parametrize("error", [errno.EROFS, errno.ENOSPC])
def test_a_card_that_can_no_longer_be_written_to_is_still_emptied(
        logs: Path, stick: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: int) -> None:
    (tmp_path / "machine-id").write_text("b" * 32)
    monkeypatch.setattr("logger.store.exported.MACHINE_ID", tmp_path / "machine-id")

    def refuse(*_: object) -> int:
        raise OSError(error, os.strerror(error))

    monkeypatch.setattr(OpenFolder, "open_lock_file", refuse)
    result, again = run(logs, stick), run(logs, stick)
    assert result.complete
    assert result.copied == again.already_there == NAMES
    assert result.unmarked == os.strerror(error)
    assert result.logger == again.logger
    assert exported_names(logs) == set()


def test_without_the_right_to_write_to_the_card_the_first_export_asks_for_it(
        logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(OpenFolder, "open_lock_file", refuse)
    with pytest.raises(BadInput, match="sudo"):
        run(logs, stick)


def test_a_card_with_a_bad_file_gives_all_others(logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class BadCard(Stick):
        def _carry_out(self, name: str, real: Callable[..., Any], place: str, args: tuple[Any, ...],
                       named: dict[str, Any]) -> Any:
            if name == "read" and place.endswith(NAMES[0]):
                raise OSError(errno.EIO, os.strerror(errno.EIO))
            return real(*args, **named)

    put_in(monkeypatch, BadCard(logs))
    result = run(logs, stick)
    assert [(failure.name, failure.reason) for failure in result.failures] == [(NAMES[0], "card: Input/output error")]
    assert result.copied == NAMES[1:]
    assert not [name for name in contents(own(logs, stick)) if "tmp" in name]


@pytest.mark.parametrize("grows_by", [1, 1 << 20])
def test_a_recording_that_grows_while_it_is_copied_is_left_for_the_next_time(
        logs: Path, stick: Path, monkeypatch: pytest.MonkeyPatch, grows_by: int) -> None:
    name = "00002.dump.gz"

    class Growing(Stick):
        def _carry_out(self, call: str, real: Callable[..., Any], place: str, args: tuple[Any, ...],
                       named: dict[str, Any]) -> Any:
            if call == "read":
                with Path(place).open("ab") as file:
                    file.write(b"x" * grows_by)
            return real(*args, **named)

    with monkeypatch.context() as patch:
        put_in(patch, Growing(logs / name))
        result = run(logs, stick, dumps=True)
    assert [(failure.name, failure.reason) for failure in result.failures] == [
        (name, "card: the file changes while it is copied")]
    assert name not in exported_names(logs)
    assert run(logs, stick, dumps=True).complete
    assert_all_there(logs, stick, (*NAMES, name))


def test_two_exports_to_one_stick_take_turns(logs: Path, stick: Path) -> None:
    run(logs, stick)
    (logs / "00005-001.csv").write_text("new\n")
    descriptor = os.open(own(logs, stick), os.O_RDONLY)
    fcntl.flock(descriptor, fcntl.LOCK_EX)
    result = run(logs, stick)
    os.close(descriptor)
    assert "another export" in result.failures[0].reason
    assert run(logs, stick).copied == ("00005-001.csv",)


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
    told: list[Progress] = []
    export(logs, stick, False, told.append)
    assert told[0] == Progress(0, len(NAMES))
    assert told[-1] == Progress(len(NAMES), len(NAMES))
    assert [progress.done for progress in told] == sorted(progress.done for progress in told)


@pytest.mark.parametrize("place", ["", "inside", "missing", "file"])
def test_a_wrong_place_is_refused(logs: Path, tmp_path: Path, place: str) -> None:
    (logs / "inside").mkdir()
    (tmp_path / "file").touch()
    target = {"": logs, "inside": logs / "inside", "missing": tmp_path / "missing", "file": tmp_path / "file"}[place]
    with pytest.raises(BadInput, match="expected"):
        run(logs, target)


def checked(folder: Path) -> FileCheck:
    return next(check for check in verify([folder]) if check.kind == "manifest")


def test_what_was_exported_passes_the_check_at_the_desk(logs: Path, stick: Path) -> None:
    run(logs, stick, dumps=True)
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
