"""Export to sticks that are whole, full, pulled, damaged, shared or prepared by somebody.

``Stick`` stands in for the system's calls: it fails any one of them on cue, and when the stick is pulled it forgets
what had not been flushed, as a stick does. It does so as FAT: Linux gives a file that is renamed a new entry in the
folder with neither size nor blocks, and puts them there when the file itself is flushed after that, not the folder.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import os
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from logger.errors import BadInput, CheckFailed
from logger.store.export import directory_handle, manifest
from logger.store.export.directory_handle import DirectoryHandle
from logger.store.export.export import MARKS_NAME, ExportResult, Mark, Progress, export, exported_names, mark_exported
from logger.store.export.manifest import read_manifest
from logger.store.export.sticks import FIRST_STICK, HOMES_NAME, IDENTITY_NAME, NOT_PAIRED, PAIRED_NAME, Pairing

from .trials import Found, Hazard, found

OTHER_LOGGER = "ridelog/0123456789ab/00001-001.csv"
NAMES = ("00001-001.csv", "00001-001.json", "00002-001.csv", "00002-001.json")
RECORDING = "00002.dump.gz"
Put = Callable[[Path, Path], None]


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
        self._empty_entries: set[str] = set()
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
            self._empty_entries.discard(place)
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
            self._empty_entries.add(str(target))
        return real(*args, **named)

    def pull_before_it_is_unmounted(self) -> None:
        """The export has ended well, and the stick goes."""
        if self._lost and self.calls < self._at:
            self._forget()

    @staticmethod
    def _place(args: tuple[Any, ...], named: dict[str, Any]) -> str:
        where = named.get("dir_fd", named.get("src_dir_fd", args[0]))
        return str(Path(f"/proc/self/fd/{where}").readlink()) if isinstance(where, int) else str(where)

    def _forget(self) -> None:
        for name in (*self._unflushed.values(), *self._empty_entries):
            if Path(name).is_file() and not Path(name).is_symlink():
                os.truncate(name, 0)
        for old, new, before in reversed(self._unsynced):
            Path(new).rename(old)
            if before is not None:
                Path(new).write_bytes(before)


def a_card(root: Path) -> Path:
    """Two finished logs, an open one and its recording, and what else lies in such a folder."""
    folder = root / "log"
    folder.mkdir()
    for name in (*NAMES, "00003-001.csv.part", "00003-001.json", "00003.dump.gz.part", "last-session",
                 "00004-001.csv.tmp", "notes.txt"):
        (folder / name).write_bytes(f"content of {name}\n".encode() * 10)
    return folder


def a_stick(root: Path) -> Path:
    """A stick with somebody's holiday and another car's log."""
    (root / OTHER_LOGGER).parent.mkdir(parents=True)
    (root / OTHER_LOGGER).write_text("another car\n")
    (root / "holiday.jpg").write_text("sea\n")
    return root


def quiet(progress: Progress) -> None:
    pass


def run(logs: Path, stick: Path, pairing: Pairing = NOT_PAIRED) -> ExportResult:
    with patch("logger.store.export.export.are_on_one_disk", lambda *_: False):  # a folder stands for the stick
        return export(logs, stick, quiet, pairing)


def own(logs: Path, stick: Path) -> Path:
    return stick / "ridelog" / (logs / IDENTITY_NAME).read_text().strip()


def assert_all_there(logs: Path, stick: Path, names: tuple[str, ...] = NAMES) -> None:
    folder = own(logs, stick)
    listed = read_manifest([(folder / manifest.NAME).read_bytes()]).files
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
    listed = read_manifest([(folder / manifest.NAME).read_bytes()]).files
    for name in marked:
        assert (folder / name).read_bytes() == card[name]
        assert listed[name] == hashlib.sha256(card[name]).hexdigest()


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def put_in(system: Stick) -> Any:
    """For the length of a ``with``, the export reaches its stick through this."""
    return patch.object(directory_handle, "os", system)


def room_for(free_bytes: int) -> Any:
    return patch.object(DirectoryHandle, "free_bytes", lambda folder: (free_bytes, 512))


def number_of_calls(logs: Path, stick: Path) -> int:
    system = Stick(stick)
    with put_in(system):
        run(logs, stick)
    return system.calls


# --- pulled, failing, full


def fault_at_any_call(folder: Path, case: tuple[int, bool]) -> Found:
    error, lost = case
    logs = a_card(folder)
    card = {name: (logs / name).read_bytes() for name in NAMES}
    (folder / "measure").mkdir()
    calls = number_of_calls(logs, folder / "measure")
    assert calls > 80
    for at in range(1, calls + 2):
        for name in (MARKS_NAME, IDENTITY_NAME, HOMES_NAME):
            (logs / name).unlink(missing_ok=True)
        stick = a_stick(folder / f"stick-{at}")
        system = Stick(stick, at, error, lost)
        with put_in(system):
            try:
                result = run(logs, stick)
            except BadInput:
                assert at == 1
            else:
                assert not result.complete or exported_names(logs) == set(NAMES)
        system.pull_before_it_is_unmounted()
        assert_nothing_false(logs, stick, card)
        assert run(logs, stick).complete
        assert_all_there(logs, stick)
        assert_nothing_false(logs, stick, card)
    return found(trials=calls)


def pulled_during_a_repeat(folder: Path, case: None) -> Found:
    """A log changed since the last export and one is new: set aside, copied, listed again, cut at every call."""
    logs, stick = a_card(folder), a_stick(folder / "stick")
    at, calls = 0, 10**9
    while at < calls:
        at += 1
        (logs / NAMES[0]).write_text("first state\n")
        run(logs, stick)
        (logs / NAMES[0]).write_text("with UTC\n")
        card = {name: (logs / name).read_bytes() for name in NAMES}
        system = Stick(stick, at, lost=True)
        with put_in(system):
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
    return found(trials=at)


def little_room(folder: Path, blocks: int) -> Found:
    """Room for so many of the four files."""
    logs, stick = a_card(folder), a_stick(folder / "stick")
    with room_for(65_536 + 128 * len(NAMES) + blocks * 512 if blocks else 0):
        result = run(logs, stick)
    assert result.copied == NAMES[:blocks]
    assert [failure.name for failure in result.failures] == list(NAMES[blocks:])
    assert all("no room on the stick" in failure.reason for failure in result.failures)
    assert result.bytes_short == 512 * (len(NAMES) - blocks) or not blocks
    if blocks:
        assert_all_there(logs, stick, NAMES[:blocks])
    assert exported_names(logs) == set(NAMES[:blocks])
    with room_for(10**9):
        assert run(logs, stick).copied == NAMES[blocks:]
    assert_all_there(logs, stick)
    return found()


def few_bytes_at_a_time(folder: Path, most: int) -> Found:
    logs, stick = a_card(folder), a_stick(folder / "stick")
    system = Stick(stick)
    system.most_bytes = most
    with put_in(system):
        assert run(logs, stick).complete
    assert_all_there(logs, stick)
    return found()


def stick_that_lies(folder: Path, case: None) -> Found:
    logs, stick = a_card(folder), a_stick(folder / "stick")
    system = Stick(stick)
    system.flips = True
    with put_in(system):
        result = run(logs, stick)
    assert "differs from what was written" in result.failures[0].reason
    assert len(result.failures) == len(NAMES)
    assert contents(own(logs, stick)) == {}
    assert exported_names(logs) == set()
    return found()


def write_protected(folder: Path, case: None) -> Found:
    logs, stick = a_card(folder), a_stick(folder / "stick")
    run(logs, stick)

    def refuse(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    with patch.multiple(DirectoryHandle, **dict.fromkeys(("write", "rename", "replace", "discard", "sync"), refuse)):
        assert run(logs, stick).complete
    return found()


# --- damaged copies


def damaged_copy(folder: Path, damage: bytes) -> Found:
    logs, stick = a_card(folder), a_stick(folder / "stick")
    run(logs, stick)
    (own(logs, stick) / NAMES[0]).write_bytes(damage)
    assert run(logs, stick).copied == NAMES[:1]
    assert_all_there(logs, stick)
    return found()


def damaged_manifest(folder: Path, damage: bytes | None) -> Found:
    logs, stick = a_card(folder), a_stick(folder / "stick")
    run(logs, stick)
    path = own(logs, stick) / manifest.NAME
    path.unlink() if damage is None else path.write_bytes(damage)
    assert run(logs, stick).already_there == NAMES
    assert_all_there(logs, stick)
    return found()


def damaged_marks(folder: Path, case: None) -> Found:
    """Each byte of the list of what was exported changed, and the list cut there."""
    names = {"00001-001.csv", "00001-001.json"}
    for name in names:
        (folder / name).write_text("text\n")
    with DirectoryHandle.at(folder) as opened:
        mark_exported(opened, {name: Mark(5, (folder / name).stat().st_mtime_ns, "0" * 64) for name in names})
    path = folder / MARKS_NAME
    whole = path.read_bytes()
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1:])
        assert exported_names(folder) in (set(), names)
        path.write_bytes(whole[:place])
        assert exported_names(folder) in (set(), names)
    return found(trials=2 * len(whole))


# --- sticks that somebody prepared


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


def prepared_name(folder: Path, case: tuple[Put, str]) -> Found:
    put, name = case
    logs, stick, outside = a_card(folder), a_stick(folder / "stick"), folder / "outside"
    outside.mkdir()
    (outside / "secret").write_text("secret\n")
    run(logs, stick)
    (own(logs, stick) / name).unlink()
    put(own(logs, stick) / name, outside)
    assert run(logs, stick).complete
    assert_all_there(logs, stick)
    assert contents(outside) == {"secret": b"secret\n"}
    return found()


def prepared_folder(folder: Path, case: tuple[Put, str]) -> Found:
    put, depth = case
    logs, outside, stick = a_card(folder), folder / "outside", folder / "stick"
    outside.mkdir()
    stick.mkdir()
    (outside / "secret").write_text("secret\n")
    (folder / "scrap").mkdir()
    run(logs, folder / "scrap")
    place = stick / "ridelog" if depth == "ridelog" else own(logs, stick)
    place.parent.mkdir(exist_ok=True)
    put(place, outside)
    result = run(logs, stick)
    assert not result.complete
    assert {failure.name for failure in result.failures} == set(NAMES)
    assert contents(outside) == {"secret": b"secret\n"}
    return found()


ODD_NAMES = ("-rf", "a\nb", "*", "$(reboot)", "00009-001.csv; x", "\udcff\udcfe", "0123456789abcdef.ridelog-tmp.not")


def odd_names(folder: Path, odd: str) -> Found:
    logs, stick = a_card(folder), a_stick(folder / "stick")
    run(logs, stick)
    for place in (own(logs, stick), logs):
        (place / odd).write_text("odd\n")
    (logs / "00005-001.csv").write_text("new\n")
    assert run(logs, stick).copied == ("00005-001.csv",)
    assert (own(logs, stick) / odd).read_text() == "odd\n"
    return found()


def names_of_fat(folder: Path, case: None) -> Found:
    """Long FAT names: none of ``"*/:<>?\\|`` and no end in a dot or a space; and no two alike but for their case."""
    logs, stick = a_card(folder), a_stick(folder / "stick")
    (logs / RECORDING).write_bytes(b"bytes\n")
    run(logs, stick)
    names = [path.relative_to(stick).as_posix() for path in own(logs, stick).rglob("*")]
    assert not set("".join(names)) & set('"*:<>?\\|')
    assert not [name for name in names if name.endswith((".", " ")) or len(name) > 80]
    assert len({name.lower() for name in names}) == len(names)
    return found(trials=len(names))


# --- two at once, and cards that fail


def two_exports_at_once(folder: Path, case: None) -> Found:
    logs, stick = a_card(folder), a_stick(folder / "stick")
    run(logs, stick)
    (logs / "00005-001.csv").write_text("new\n")
    descriptor = os.open(own(logs, stick), os.O_RDONLY)
    fcntl.flock(descriptor, fcntl.LOCK_EX)
    result = run(logs, stick)
    os.close(descriptor)
    assert "another export" in result.failures[0].reason
    assert run(logs, stick).copied == ("00005-001.csv",)
    return found()


def two_sticks(folder: Path, case: None) -> Found:
    logs, stick, second = a_card(folder), a_stick(folder / "stick"), a_stick(folder / "second")
    assert run(logs, stick).copied == run(logs, second).copied == NAMES
    assert_all_there(logs, stick)
    assert_all_there(logs, second)
    return found()


def card_that_cannot_be_written_to(folder: Path, error: int) -> Found:
    logs, stick = a_card(folder), a_stick(folder / "stick")
    (folder / "machine-id").write_text("b" * 32)

    def refuse(*_: object) -> int:
        raise OSError(error, os.strerror(error))

    with (patch("logger.store.export.sticks.MACHINE_ID", folder / "machine-id"),
          patch.object(DirectoryHandle, "open_lock_file", refuse)):
        result, again = run(logs, stick), run(logs, stick)
    assert result.complete
    assert result.copied == again.already_there == NAMES
    assert result.unmarked == os.strerror(error)
    assert result.logger == again.logger
    assert exported_names(logs) == set()
    return found()


class BadCard(Stick):
    """A card on which one file cannot be read."""

    bad = ""

    def _carry_out(self, name: str, real: Callable[..., Any], place: str, args: tuple[Any, ...],
                   named: dict[str, Any]) -> Any:
        if name == "read" and place.endswith(self.bad):
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return real(*args, **named)


def card_with_a_bad_file(folder: Path, bad: str) -> Found:
    logs, stick = a_card(folder), a_stick(folder / "stick")
    card = BadCard(logs)
    card.bad = bad
    with put_in(card):
        result = run(logs, stick)
    assert [(failure.name, failure.reason) for failure in result.failures] == [(bad, "card: Input/output error")]
    assert result.copied == tuple(name for name in NAMES if name != bad)
    assert not [name for name in contents(own(logs, stick)) if "tmp" in name]
    return found()


class GrowingFile(Stick):
    """A file that gets longer at each read."""

    grows_by = 0

    def _carry_out(self, name: str, real: Callable[..., Any], place: str, args: tuple[Any, ...],
                   named: dict[str, Any]) -> Any:
        if name == "read":
            with Path(place).open("ab") as file:
                file.write(b"x" * self.grows_by)
        return real(*args, **named)


def recording_that_grows(folder: Path, grows_by: int) -> Found:
    logs, stick = a_card(folder), a_stick(folder / "stick")
    name = RECORDING
    (logs / name).write_bytes(b"bytes\n" * 10)
    file = GrowingFile(logs / name)
    file.grows_by = grows_by
    with put_in(file):
        result = run(logs, stick)
    assert [(failure.name, failure.reason) for failure in result.failures] == [
        (name, "card: the file changes while it is copied")]
    assert name not in exported_names(logs)
    assert run(logs, stick).complete
    assert_all_there(logs, stick, (*NAMES, name))
    return found()


# --- paired sticks


def pull_while_pairing(folder: Path, case: tuple[int, bool]) -> Found:
    """The first stick, failing at every call of its export, gets all the next time; no other ever does."""
    error, lost = case
    logs, stranger, first = a_card(folder), a_stick(folder / "stranger"), Pairing(FIRST_STICK)
    at, calls = 0, 10**9
    while at < calls:
        at += 1
        (logs / PAIRED_NAME).unlink(missing_ok=True)
        stick = a_stick(folder / f"stick-{at}")
        system = Stick(stick, at, error, lost)
        with put_in(system):
            try:
                run(logs, stick, pairing=first)
            except BadInput:
                assert at == 1
        calls = calls if system.calls >= at else at
        assert run(logs, stick, pairing=first).complete
        assert_all_there(logs, stick)
        with pytest.raises(CheckFailed):
            run(logs, stranger, pairing=first)
        assert {path.name for path in (stranger / "ridelog").iterdir()} == {Path(OTHER_LOGGER).parent.name}
    assert at > 80
    return found(trials=at)


def lying_stick_is_not_paired(folder: Path, case: None) -> Found:
    logs, stick = a_card(folder), a_stick(folder / "stick")
    system = Stick(stick)
    system.flips = True
    with put_in(system):
        assert not run(logs, stick, pairing=Pairing(FIRST_STICK)).complete
    assert not (logs / PAIRED_NAME).exists()
    return found()


_AGAIN = ("at every instant: nothing on the card changes, nothing of others is touched, only what is whole on the "
          "stick counts as exported; the next try completes it")
_LINKS = (hostile_link, hostile_link_to_nothing, hostile_link_to_folder, hostile_pipe, hostile_folder,
          hostile_hard_link)
HAZARDS = (
    Hazard("stick pulled early", "at every call of an export; what was not flushed is gone", _AGAIN, "as promised",
           fault_at_any_call, ((errno.ENODEV, True), (errno.ESTALE, True))),
    Hazard("stick that fails once", "every call of an export, one at a time: EIO, full, read-only", _AGAIN,
           "as promised", fault_at_any_call, ((errno.EIO, False), (errno.ENOSPC, False), (errno.EROFS, False))),
    Hazard("stick pulled during a later export", "at every call, with a log that has changed since the first", _AGAIN,
           "as promised", pulled_during_a_repeat),
    Hazard("stick without room", "for none, one, two or three of four files",
           "the oldest are copied whole, the others are named with the bytes that are missing; the next try does the "
           "rest",
           "as promised", little_room, (0, 1, 2, 3)),
    Hazard("short writes", "a write takes 1 to 100 bytes", "the rest is written", "as promised", few_bytes_at_a_time,
           (1, 7, 100)),
    Hazard("stick that does not keep what it was given", "a bit of each write changes",
           "found by reading back; nothing counts as exported", "as promised", stick_that_lies),
    Hazard("write-protected stick that has everything", "every change is refused", "no fault", "as promised",
           write_protected),
    Hazard("copy damaged since", "cut, changed in place, changed and longer, emptied", "found and made again",
           "as promised", damaged_copy,
           (b"", b"content of 00001", b"CONTENT of 00001-001.csv\n" * 10, b"CONTENT OF 00001-001.csv\n" * 20,
            b"x" * 10**6)),
    Hazard("manifest lost or damaged", "removed, emptied, cut, overwritten", "made again", "as promised",
           damaged_manifest, (None, b"", b"# ridelog-manifest 1 logger ", b"\0" * 5000)),
    Hazard("list of what was exported damaged on the card", "each byte changed, and the list cut there",
           "no file counts as exported that is not", "as promised", damaged_marks),
    Hazard("hostile file on the stick", "links (soft, hard, to a folder, to nothing), a pipe, a folder under our names",
           "set aside, never followed; nothing outside the stick changes; the export is complete", "as promised",
           prepared_name, tuple(product(_LINKS, (NAMES[0], manifest.NAME)))),
    Hazard("hostile folder on the stick", "the same where our folder belongs",
           "reported, not followed; nothing outside the stick changes", "as promised", prepared_folder,
           tuple(product((hostile_link_to_folder, hostile_link_to_nothing, hostile_pipe, hostile_hard_link),
                         ("ridelog", "own")))),
    Hazard("odd names on stick and card", "options, line ends, wildcards, commands, bytes that are not text",
           "left alone, and nothing else goes wrong", "as promised", odd_names, ODD_NAMES),
    Hazard("names of FAT", "every name that is written", "fits FAT: characters, ends, lengths, and case", "as promised",
           names_of_fat),
    Hazard("two exports to one stick", "its folder is locked by another", "they take turns", "as promised",
           two_exports_at_once),
    Hazard("two sticks", "one after the other", "each gets everything", "as promised", two_sticks),
    Hazard("stick pulled while it is paired", "at every call of the first export with `mode: first_stick`",
           "it gets everything the next time, a stranger never anything", "as promised", pull_while_pairing,
           ((errno.ENODEV, True), (errno.EIO, False))),
    Hazard("first stick does not keep its number", "a bit of each write changes", "it is not paired", "as promised",
           lying_stick_is_not_paired),
    Hazard("card that cannot be written to", "read-only, full", "emptied to the stick all the same; `unmarked` is "
                                                                "reported",
           "as promised", card_that_cannot_be_written_to, (errno.EROFS, errno.ENOSPC)),
    Hazard("card with a bad file", "reading one of four fails", "all others are copied, that one is named",
           "as promised", card_with_a_bad_file, NAMES),
    Hazard("recording that grows while it is copied", "by a byte, by a megabyte, at each read",
           "left for the next time, and complete then", "as promised", recording_that_grows, (1, 1 << 20)),
)
