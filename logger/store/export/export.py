"""Finished logs copied to a stick that may be pulled at any instant, and remembered as exported when they are safe.

Room on the card may be made by removing what has been exported, and nothing else: so the memory of it must never say
yes too early, nor of a file that has changed since, as a log does that learns its UTC after it was exported. A mark
carries size, time of change and SHA-256 of what was exported; it counts while the file still has that size and time.
The marks are one list with a checksum over itself, replaced in one step; one that is damaged is as good as none, and
the files are marked again by the next export that finds them on its stick. Exports to two sticks at once take turns.

Problem. A person plugs a stick into a car and pulls it when it suits them. What is on the stick then must be right or
absent, what is remembered as exported must really be there, and the next try must put right what is missing. The stick
may be full, read-only or worn, may carry other cars' logs, and may hold names that somebody prepared.

Solution. Every logger has a folder of its own on the stick, ``ridelog/<identity>``. A file is written there under a
temporary name, flushed, read back from the medium against the SHA-256 of what was read from the card, and only then
given its name. What has the name already, and is not the same, is set aside under another name, never overwritten, and
stays in the manifest if it was in it. Now and then, the more seldom the longer it is, the manifest is replaced in the
same way; only what a manifest that was read back lists is marked as exported. So at every instant the marks are true,
and a second export copies what the first one did not. Nothing is written when all is there, so that a stick that is
write-protected by then is no fault. What a stick holds is never taken into memory as a whole.
"""

import errno
import os
import re
import secrets
import stat
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

from logger.errors import BadInput
from logger.store.export import manifest
from logger.store.export.directory_handle import DirectoryHandle, OpenFile
from logger.store.export.manifest import Manifest, list_blocks, list_lines, manifest_blocks, read_manifest
from logger.store.export.sticks import (
    NOT_PAIRED,
    Pairing,
    logger_identity,
    pair_first,
    refuse_stranger,
    stick_name,
    trusted_sticks,
)
from logger.store.log.disk_quota import are_on_one_disk
from logger.store.log.log_name import CAR, OwnFile, name_before, old_name

MARKS_NAME = "exported-marks"

_FIRST = "# ridelog-exported 1"
_NO_STICK = "-"
_ENTRY = re.compile(r"([0-9a-f]{64}) (\d{1,15}) (-?\d{1,19}) ([0-9a-f]{32}|-) ([0-9][0-9A-Za-z._-]{0,63})")


@dataclass(frozen=True, slots=True)
class Mark:
    """What was exported under a name, and to which stick (``pairing.stick_name``; empty: unknown)."""

    size_bytes: int
    mtime_ns: int
    sha256: str
    stick: str = ""

    def is_of(self, found: os.stat_result) -> bool:
        """True when the file has not changed since."""
        return found.st_size == self.size_bytes and found.st_mtime_ns == self.mtime_ns


def exported_names(log_folder: Path, pairing: Pairing = NOT_PAIRED) -> set[str]:
    """Names of the files in this folder that lie, as they are now, on a stick whose copies count: copied, read back, in
    its manifest.

    Anything in doubt is left out. Raises ``OSError`` for a folder that cannot be read.
    """
    with DirectoryHandle.at(log_folder) as folder:
        sticks = trusted_sticks(pairing, folder)
        return {name for name, mark in read_marks(folder).items() if sticks is None or mark.stick in sticks
                if (found := folder.find(name)) is not None and mark.is_of(found)}


def read_marks(log_folder: DirectoryHandle) -> dict[str, Mark]:
    """All marks by name; none where the file of marks is missing or not whole."""
    try:
        return dict(_stored(log_folder))
    except ValueError:
        return {}


def mark_exported(log_folder: DirectoryHandle, new: Mapping[str, Mark]) -> None:
    """Remember files that lie on a stick; forget those that the folder no longer has. Raises ``OSError``."""
    with log_folder.turn():
        present = set(log_folder.names())
        fresh = [(name, mark) for name, mark in new.items() if name in present]
        kept = ((name, mark) for name, mark in _stored(log_folder) if name in present and name not in new)
        try:
            log_folder.replace(MARKS_NAME, list_blocks(_FIRST, map(_line, chain(kept, fresh))))
        except ValueError:
            log_folder.replace(MARKS_NAME, list_blocks(_FIRST, map(_line, fresh)))


def _line(named: tuple[str, Mark]) -> str:
    name, mark = named
    return f"{mark.sha256} {mark.size_bytes} {mark.mtime_ns} {mark.stick or _NO_STICK} {name}"


def _stored(log_folder: DirectoryHandle) -> Iterator[tuple[str, Mark]]:
    """The marks, one at a time; true once all have come. Raises ValueError where their file is not there or whole."""
    try:
        with log_folder.open(MARKS_NAME) as file:
            lines = list_lines(file.blocks())
            if next(lines, "") != _FIRST:
                raise ValueError(f"line 1: expected '{_FIRST}'")
            for line in lines:
                entry = _ENTRY.fullmatch(line)
                if entry is None:
                    raise ValueError("expected 'SHA-256 SIZE TIME STICK NAME'")
                stick = "" if entry[4] == _NO_STICK else sys.intern(entry[4])
                yield entry[5], Mark(int(entry[2]), int(entry[3]), entry[1], stick)
    except OSError as error:
        raise ValueError(f"expected a readable file ({error.strerror})") from None


FILES_PER_MANIFEST = 32
GROWTH_PER_MANIFEST = 8
"""The lists are rewritten when an eighth has been added: nine times their last length is written in all, and a stick
that is pulled has at most a ninth of its files to be read once more, which are there."""

ROOM_FOR_MANIFEST_BYTES = 65_536
BYTES_PER_ENTRY = 128

_STICK_IS_LOST = {errno.EIO, errno.ENODEV, errno.ENXIO, errno.ESTALE, errno.EROFS, errno.ENOSPC, errno.EDQUOT,
                  errno.ENOTCONN, errno.ENOMEDIUM, errno.ESHUTDOWN}


@dataclass(frozen=True)
class Failure:
    """A file that is not on the stick, and why."""

    name: str
    reason: str


@dataclass(frozen=True)
class Progress:
    """How far an export is: files looked at, of how many."""

    done: int
    total: int


@dataclass(frozen=True)
class ExportResult:
    """What an export did.

    logger          identity of the logger, which names its folder on the stick; None: it was not reached
    copied          names of the files that were copied now
    already_there   those that were there and right
    failures        those that are not there, or not in the manifest yet
    set_aside       new names of what was in the way on the stick
    bytes_copied    size of the copied files
    bytes_short     how much more room the stick would need
    unmarked        why the card could not remember the export; None: it does
    """

    logger: str | None = None
    copied: tuple[str, ...] = ()
    already_there: tuple[str, ...] = ()
    failures: tuple[Failure, ...] = ()
    set_aside: tuple[str, ...] = ()
    bytes_copied: int = 0
    bytes_short: int = 0
    unmarked: str | None = None

    @property
    def complete(self) -> bool:
        """True when every finished file is on the stick, right, and in its manifest."""
        return not self.failures


class _CardFault(Exception):
    """The card did not give a file."""


def export(logs: Path, stick: Path, report: Callable[[Progress], None], pairing: Pairing = NOT_PAIRED,
           by_hand: bool = False) -> ExportResult:
    """Copy the finished logs and recordings of a folder to a stick.

    ``report`` is called before the first file and after each. What the stick or the card refuses is in the result.
    Raises BadInput for folders that are not there, or where the copies would lie in the logs or around them, and
    CheckFailed for a stick that ``pairing`` refuses. Who copies ``by_hand`` gets a copy anywhere, which counts as an
    export where the stick is paired. A copy on the disk that holds the logs never counts: no stick is mounted there.
    """
    if _overlap(logs, stick / manifest.FOLDER):
        raise BadInput(f"{stick}: expected a place apart from the folder of logs, {logs}: the copies would go to "
                       f"{stick / manifest.FOLDER}")
    with _folder(stick, "to copy to, such as a mounted stick") as root, _folder(logs, "with the logs") as card:
        names = finished_files(card)
        try:
            identity = logger_identity(card, logs)
        except OSError as error:
            raise BadInput(f"{logs}: expected a folder that can be written to ({_reason(error)}); run this as the "
                           "service's user or with sudo") from None
        name = stick_name(pairing, root, card, identity)
        if not by_hand:
            refuse_stranger(pairing, card, logs, name)
        try:
            why_not = f"no stick is mounted at {stick}, it is on the disk that holds the logs" \
                if are_on_one_disk(stick, logs) else ""
            with root.inside(manifest.FOLDER) as common, common.inside(identity) as own:
                if not own.lock():
                    raise OSError(errno.EBUSY, "another export is writing to this stick")
                if not by_hand and not why_not:
                    name = pair_first(pairing, card, own, name)
                trusted = trusted_sticks(pairing, card)
                if trusted is not None and name not in trusted:
                    why_not = why_not or "this place is not paired with it"
                return _Export(card, own, identity, report, name, why_not).run(names)
        except OSError as error:
            reason = f"{manifest.FOLDER}/{identity} on the stick: {_reason(error)}"
            return ExportResult(identity, failures=tuple(Failure(name, reason) for name in names))


def finished_files(card: DirectoryHandle) -> list[str]:
    """Names of what can be exported, oldest first: each log followed by its sidecar, learned cars, recordings.

    What is being written has a name that ends in ``.part``.
    """
    present = set(card.names())
    own = sorted((file.session, file.part, name, file.kind) for name in present
                 if (file := OwnFile.of(name)) and not file.is_open)
    logs = [name for *_, name, kind in own
            if kind in (".csv", ".json") and str(Path(name).with_suffix(".csv")) in present]
    return logs + sorted(filter(CAR.fullmatch, present)) + [
        name for *_, name, kind in own if kind not in (".csv", ".json")]


class _Export:
    """One run: from the card's folder to the logger's own on the stick, which marks call ``name``. ``why_not``: why
    what is copied may not be marked; empty: it may."""

    def __init__(self, card: DirectoryHandle, stick: DirectoryHandle, identity: str, report: Callable[[Progress], None],
                 name: str, why_not: str) -> None:
        self._card, self._stick, self._identity, self._report, self._name = card, stick, identity, report, name
        self._counts = not why_not
        self._digits = secrets.token_hex(4)
        self._marks = read_marks(card)
        self._listed = self._read_manifest()
        listed = self._listed or {}
        self._entries = {name: listed[name] for name in map(str.lower, stick.each_name()) if name in listed}
        self._fresh: dict[str, Mark] = {}
        self._copied: list[str] = []
        self._there: list[str] = []
        self._failures: list[Failure] = []
        self._set_aside: list[str] = []
        self._bytes = 0
        self._unmarked = why_not or None

    def run(self, names: list[str]) -> ExportResult:
        """Everything in turn; what does not fit is left out from the end."""
        self._stick.clean()
        missing = self._look(names)
        most = manifest.MAX_FILES - len(self._entries)
        missing, too_many = missing[:most], missing[most:]
        fitting, short = self._fitting(missing) if missing else ([], 0)
        for number, name in enumerate(fitting, start=1):
            fault = self._copy_one(name)
            self._report(Progress(len(self._there) + number, len(names)))
            if fault is not None:
                self._failures += [Failure(rest, fault) for rest in fitting[number:]]
                break
            if len(self._fresh) >= max(FILES_PER_MANIFEST, len(self._entries) // GROWTH_PER_MANIFEST):
                self._settle()
        reason = f"no room on the stick: {-(-short // 1000)} kB more are needed"
        self._failures += [Failure(name, reason) for name in missing[len(fitting):]]
        reason = f"the stick holds {manifest.MAX_FILES} files of this logger, the maximum: remove some"
        self._failures += [Failure(name, reason) for name in too_many]
        if (fault := self._settle()) is not None:
            self._give_up_unlisted(f"the manifest on the stick: {fault}")
        return ExportResult(self._identity, tuple(self._copied), tuple(self._there), tuple(self._failures),
                            tuple(self._set_aside), self._bytes, short, self._unmarked)

    def _look(self, names: list[str]) -> list[str]:
        """Those of the files that are not on the stick."""
        missing: list[str] = []
        for number, name in enumerate(names):
            self._report(Progress(number - len(missing), len(names)))
            if not self._is_there(name):
                missing.append(name)
        self._report(Progress(len(names) - len(missing), len(names)))
        return missing

    def _is_there(self, name: str) -> bool:
        """True when the stick holds the file as the card does, under its name or one that it was set aside under. Both
        are read, but for what a mark says of the card."""
        try:
            places = (name, *(listed for listed in self._entries if name_before(listed) == name))
            with self._card.open(name) as file:
                alike = [place for place in places if (found := self._stick.find(place)) is not None
                         and found.st_size == file.stat.st_size]
                if not alike:
                    return False
                known = self._marks.get(name)
                is_known = known is not None and known.is_of(file.stat)
                mark = known if known and is_known else self._mark(file, self._card.sha256(name))
            there = next((place for place in alike if self._stick.sha256(place) == mark.sha256), None)
        except OSError:
            return False  # the copy will meet the same fault, and report it
        if there is None:
            return False
        self._there.append(name)
        self._entries[there] = mark.sha256
        if not is_known or mark.stick != self._name:
            self._fresh[name] = replace(mark, stick=self._name)
        return True

    def _fitting(self, names: list[str]) -> tuple[list[str], int]:
        """The first of these files, as many as there is room for, and the bytes that the rest is short of."""
        free, unit = self._stick.free_bytes()
        free -= ROOM_FOR_MANIFEST_BYTES + BYTES_PER_ENTRY * (len(self._entries) + len(names))
        fitting = []
        for name in names:
            free -= -(-self._size_on_card(name) // unit) * unit
            if free >= 0:
                fitting.append(name)
        return fitting, max(0, -free)

    def _size_on_card(self, name: str) -> int:
        try:
            found = self._card.find(name)
        except OSError:
            return 0  # the copy will meet the same fault, and report it
        return found.st_size if found else 0

    def _copy_one(self, name: str) -> str | None:
        """Copy a file; give the reason when nothing more can be copied after it."""
        try:
            self._copy(name)
        except _CardFault as fault:
            self._failures.append(Failure(name, str(fault)))
        except OSError as error:
            self._failures.append(Failure(name, f"stick: {_reason(error)}"))
            return f"stick: {_reason(error)}" if error.errno in _STICK_IS_LOST else None
        return None

    def _copy(self, name: str) -> None:
        try:
            file = self._card.open(name)
        except OSError as error:
            raise _CardFault(f"card: {_reason(error)}") from None
        with file:
            digest = self._put(name, _from_card(file), self._clear)
            self._fresh[name] = self._mark(file, digest)
            self._bytes += file.stat.st_size
        self._entries[name] = digest
        self._copied.append(name)

    def _put(self, name: str, blocks: Iterable[bytes], make_way: Callable[[str], None]) -> str:
        """Write a file that gets its name once it was read back; give its SHA-256."""
        temporary, digest = self._stick.write(blocks)
        try:
            if self._stick.sha256(temporary) != digest:
                raise OSError(errno.EIO, "what it reads back differs from what was written")
            make_way(name)
            self._stick.rename(temporary, name)
        except OSError:
            self._stick.discard(temporary)
            raise
        return digest

    def _mark(self, file: OpenFile, digest: str) -> Mark:
        return Mark(file.stat.st_size, file.stat.st_mtime_ns, digest, self._name)

    def _clear(self, name: str) -> None:
        """Set aside what stands in the way: an older state, a damaged copy, or something that is not ours."""
        if self._stick.find(name) is None:
            return
        aside = old_name(name, self._digits)
        if self._stick.find(aside) is not None:
            aside = old_name(name, secrets.token_hex(4))
        listed = self._entries.pop(name, None)
        is_whole = listed is not None and self._is_as_listed(name, listed)
        self._stick.rename(name, aside)
        self._set_aside.append(aside)
        if listed is not None and is_whole:
            self._entries[aside] = listed

    def _is_as_listed(self, name: str, digest: str) -> bool:
        try:
            return self._stick.sha256(name) == digest
        except OSError:
            return False

    def _settle(self) -> str | None:
        """Bring the manifest up to date, then remember what it lists. Gives the reason when the stick refuses."""
        try:
            is_first = self._listed is None and not self._failures  # of nothing, perhaps: an export has a manifest
            if self._entries != (self._listed or {}) or is_first:
                self._write_manifest()
        except OSError as error:
            return _reason(error)
        try:
            if self._fresh and self._counts:
                mark_exported(self._card, self._fresh)
        except OSError as error:
            self._unmarked = _reason(error)
        self._fresh = {}
        return None

    def _give_up_unlisted(self, reason: str) -> None:
        """What no manifest lists cannot be checked at the desk: it counts as not copied."""
        listed = self._listed or {}
        unlisted = {name for name, digest in self._entries.items() if listed.get(name) != digest}
        self._failures += [Failure(name, reason) for name in sorted(unlisted)]
        self._copied = [name for name in self._copied if name not in unlisted]
        self._there = [name for name in self._there if name not in unlisted]

    def _read_manifest(self) -> dict[str, str] | None:
        """What the stick's manifest lists; None for one that is missing, not whole, or another logger's."""
        try:
            with self._stick.open(manifest.NAME) as file:
                found = read_manifest(file.blocks())
        except (OSError, ValueError):
            return None
        return dict(found.files) if found.logger == self._identity else None

    def _write_manifest(self) -> None:
        self._put(manifest.NAME, manifest_blocks(Manifest(self._identity, self._entries)), self._clear_if_strange)
        self._listed = dict(self._entries)

    def _clear_if_strange(self, name: str) -> None:
        found = self._stick.find(name)
        if found is not None and not stat.S_ISREG(found.st_mode):
            self._clear(name)


def _overlap(one: Path, other: Path) -> bool:
    """True when two folders, which need not be there, are the same or one holds the other, by whatever path."""
    lines = [_lineage(one), _lineage(other)]
    return any(line[0] in other_line for line, other_line in (lines, lines[::-1]) if line[0] is not None)


def _lineage(folder: Path) -> list[tuple[int, int] | None]:
    """Device and inode of a folder and of all that hold it, itself first; None for what is not there."""
    resolved = folder.resolve()
    return [_identity(path) for path in (resolved, *resolved.parents)]


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def _from_card(file: OpenFile) -> Iterator[bytes]:
    """The bytes of a file. Raises _CardFault where the card does not give them, or not as many as it said."""
    rest = file.stat.st_size
    try:
        for block in file.blocks():
            rest -= len(block)
            yield block
            if rest < 0:
                break
    except OSError as error:
        raise _CardFault(f"card: {_reason(error)}") from None
    if rest:
        raise _CardFault("card: the file changes while it is copied")


def _folder(path: Path, meaning: str) -> DirectoryHandle:
    try:
        return DirectoryHandle.at(path)
    except OSError as error:
        raise BadInput(f"{path}: expected a folder {meaning} ({_reason(error)})") from None


def _reason(error: OSError) -> str:
    return error.strerror or os.strerror(error.errno or errno.EIO)
