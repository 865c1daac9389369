"""The files of a log: opened, filled, finished, and put right after a power cut.

Problem. The power of a car goes at any instant. Whoever looks into the folder afterwards must find every row that
had reached the disk, once, and no file that looks finished and is not. The rows written before the first GPS fix
have no UTC, and a Pi has no clock from which files could take their names.

Solution. Names come from a session number that is never used again: ``<session>-<part>.csv.part`` while open,
``.csv`` when finished, with a sidecar ``.json`` beside it. A part is only ever appended to. It is finished by a
rename: of itself, when nothing in it needs to change, else of a rewritten copy (UTC filled in, damaged lines left
out) which is on the disk before it takes the name, and only then the part is removed. So at every instant there is
either the part or the finished file, and ``repair`` at the next start makes the step that was missing.
Every change to the disk goes through ``FileSystem``, so that tests can cut between any two of them.
"""

from __future__ import annotations

import json
import os
import re
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from logger.records import WindowRecord
from logger.store.segment_log import HEADER, format_row, scan

COUNTER_NAME = "last-session"
CLOCK_STEP_US = 100_000
"""A clock map that has moved by less than this need not reach the disk before the file is finished."""

_LOG_NAME = re.compile(r"(\d{5,})-(\d{3,})\.csv(\.part)?")
_OWN_TEMPORARY = re.compile(r"(\d{5,}-\d{3,}\.(csv|json)|" + COUNTER_NAME + r")\.tmp")
_SESSION_NAME = re.compile(r"(\d{5,})[-.]")
_BLOCK_ROWS = 256


class FileSystem:
    """The few ways in which logs change the disk."""

    def create(self, path: Path) -> int:
        """Open an empty file for writing; give its descriptor."""
        return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644)

    def write(self, descriptor: int, data: bytes) -> None:
        """Hand all bytes to the system."""
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(descriptor, rest):]

    def sync(self, descriptor: int) -> None:
        """Wait until the file is on the disk."""
        os.fsync(descriptor)

    def close(self, descriptor: int) -> None:
        os.close(descriptor)

    def rename(self, source: Path, target: Path) -> None:
        """Give a file another name, in place of the file that had it."""
        source.rename(target)

    def remove(self, path: Path) -> None:
        """Remove a file, if it is there."""
        path.unlink(missing_ok=True)

    def sync_directory(self, directory: Path) -> None:
        """Wait until the names in a folder are on the disk."""
        descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


@dataclass(frozen=True)
class ClockMap:
    """UTC of a session: ``utc_us = t_us + offset_us``."""

    offset_us: int


@dataclass(frozen=True)
class LogName:
    """What the name of a log file says."""

    session: int
    part: int
    finished: bool

    @classmethod
    def of(cls, path: Path) -> LogName | None:
        """The name of a file; None when it is not that of a log."""
        match = _LOG_NAME.fullmatch(path.name)
        return cls(int(match[1]), int(match[2]), match[3] is None) if match else None


@dataclass(frozen=True)
class Tally:
    """What a log holds.

    rows             intact rows
    unset            those of them without UTC
    damaged_lines    lines that are not intact; the torn one is not among them
    torn_tail        the file ends in the middle of a row
    """

    rows: int = 0
    unset: int = 0
    damaged_lines: int = 0
    torn_tail: bool = False


@dataclass(frozen=True)
class Repaired:
    """What became of a part that was found open: the finished file, or None when it held no row."""

    part: Path
    finished: Path | None
    tally: Tally


class SegmentLog:
    """The log of one session: rows in, files out.

    directory    an existing folder that one service at a time writes to
    session      a number from ``next_session``
    sidecar      what a reader needs beside the rows (configuration, versions, scales); plain JSON values
    max_bytes    a part is finished before a row would make its rows longer than this

    ``path`` is the open part. Raises ``OSError`` for what the disk refuses, ``FileExistsError`` also when files
    of this session are there already.
    """

    path: Path
    _tally: Tally
    _bytes: int
    _descriptor: int
    _dirty: bool

    def __init__(self, directory: Path, session: int, sidecar: dict[str, Any], max_bytes: int,
                 files: FileSystem | None = None) -> None:
        self._directory = directory
        self._session = session
        self._given = sidecar
        self._max_bytes = max_bytes
        self._files = files or FileSystem()
        self._clock: ClockMap | None = None
        self._stored_clock: ClockMap | None = None
        self._without_utc: list[tuple[Path, Tally]] = []
        self._part = 0
        self._closed = False
        self._open_next()

    def append(self, record: WindowRecord) -> None:
        """Write one row. It is handed to the system at once and is safe from a power cut after ``sync``."""
        row = f"{format_row(record)}\n".encode()
        if self._bytes and self._bytes + len(row) > self._max_bytes:
            self.rotate()
        self._files.write(self._descriptor, row)
        self._dirty = True
        self._bytes += len(row)
        self._tally = replace(self._tally, rows=self._tally.rows + 1,
                              unset=self._tally.unset + (record.utc_us is None))

    def sync(self) -> None:
        """Wait until all rows are on the disk."""
        if self._dirty:
            self._files.sync(self._descriptor)
            self._dirty = False

    def rotate(self) -> None:
        """Finish the part and open the next; a part without rows stays open."""
        if self._tally.rows:
            self._finish()
            self._open_next()

    def set_clock_map(self, clock: ClockMap) -> None:
        """Tell the session's UTC, or a better one. Rows written without it get it when their file is finished;
        in files that are finished already they get it now."""
        self._clock = clock
        if self._stored_clock is None or abs(clock.offset_us - self._stored_clock.offset_us) >= CLOCK_STEP_US:
            self._write_sidecar("open")
        for path, tally in self._without_utc:
            _fill_finished(self._files, path, tally, clock)
        self._without_utc.clear()

    def close(self) -> None:
        """Finish the last part, or remove it when it has no rows. Closing twice does nothing."""
        if self._closed:
            return
        self._closed = True
        if self._tally.rows:
            self._finish()
        else:
            self._files.close(self._descriptor)
            _remove_part(self._files, self.path)

    def _open_next(self) -> None:
        self._part += 1
        self.path = self._directory / f"{self._session:05d}-{self._part:03d}.csv.part"
        for taken in (self.path, _finished_path(self.path)):
            if taken.exists():
                raise FileExistsError(f"{taken}: this session has been logged before")
        self._tally = Tally()
        self._bytes = 0
        self._descriptor = self._files.create(self.path)
        self._files.write(self._descriptor, f"{HEADER}\n".encode())
        self._dirty = True
        self._write_sidecar("open")

    def _finish(self) -> None:
        self.sync()
        self._files.close(self._descriptor)
        finished = _finish_part(self._files, self.path, self._given, self._tally, self._clock)
        if self._clock is None and self._tally.unset:
            self._without_utc.append((finished, self._tally))

    def _write_sidecar(self, state: str) -> None:
        _store_sidecar(self._files, self.path, self._given, state, self._tally, self._clock)
        self._stored_clock = self._clock


def next_session(directory: Path, files: FileSystem | None = None) -> int:
    """A session number that no file of the folder has or ever had, stored before it is given out.

    It counts on from the counter file and from the names that are there, whichever is higher, so that neither a
    lost counter nor logs that were moved away bring a number back. Raises ``OSError``.
    """
    matches = (_SESSION_NAME.match(path.name) for path in directory.iterdir())
    number = max([_read_counter(directory / COUNTER_NAME), *(int(match[1]) for match in matches if match)]) + 1
    text = str(number)
    _replace_file(files or FileSystem(), directory / COUNTER_NAME, [f"{text} {_check(text)}\n".encode()])
    return number


def repair(directory: Path, files: FileSystem | None = None) -> list[Repaired]:
    """Put the folder right after a service that was killed: finish its parts, in order of their names.

    Every intact row is kept; damaged lines are left out and counted in the sidecar; UTC is filled in where the
    session had learnt it. Repairing twice does nothing more. Must not run while a service writes to the folder.
    Raises ``OSError``.
    """
    files = files or FileSystem()
    for path in list(directory.iterdir()):
        if _OWN_TEMPORARY.fullmatch(path.name):
            files.remove(path)
    parts = sorted(path for path in directory.glob("*.csv.part") if LogName.of(path))
    return [_repair_part(files, part) for part in parts]


def read_sidecar(log: Path) -> dict[str, Any] | None:
    """The sidecar of a log file, open or finished; None when it is missing. Raises ``ValueError`` when it is
    damaged."""
    try:
        found = json.loads(_sidecar_path(log).read_bytes())
    except FileNotFoundError:
        return None
    if not isinstance(found, dict):
        raise ValueError("expected a JSON object")
    return found


def _repair_part(files: FileSystem, part: Path) -> Repaired:
    tally = take_tally(part)
    finished = _finished_path(part)
    given = _sidecar_or_nothing(part)
    clock = _clock_of(given)
    if clock is not None:
        for earlier in sorted(part.parent.glob(f"{part.name.split('-')[0]}-*.csv")):
            _fill_finished(files, earlier, take_tally(earlier), clock)
    if finished.exists() and take_tally(finished).rows >= tally.rows:
        files.remove(part)  # the cut came between the rename and this
        files.sync_directory(part.parent)
    elif tally.rows:
        _finish_part(files, part, given, tally, clock)
    else:
        _remove_part(files, part)
        return Repaired(part, None, tally)
    return Repaired(part, finished, tally)


def take_tally(log: Path) -> Tally:
    """Count what a log holds. Raises ``OSError``."""
    rows = unset = damaged = 0
    torn_tail = False
    with log.open("rb") as file:
        for row in scan(file):
            if row.record is not None:
                rows += 1
                unset += row.record.utc_us is None
            else:
                damaged += not row.torn
            torn_tail = row.torn
    return Tally(rows, unset, damaged, torn_tail)


def _finish_part(files: FileSystem, part: Path, given: dict[str, Any], tally: Tally, clock: ClockMap | None) -> Path:
    """Turn a part that is on the disk into the finished file."""
    finished = _finished_path(part)
    filled = tally if clock is None else replace(tally, unset=0)
    if filled == tally and not (tally.damaged_lines or tally.torn_tail):
        _store_sidecar(files, part, given, "finished", tally, clock)
        files.rename(part, finished)
        files.sync_directory(part.parent)
        return finished
    _write_file(files, _temporary_path(finished), _kept_lines(part, clock))
    _store_sidecar(files, part, given, "finished", filled, clock)
    files.rename(_temporary_path(finished), finished)
    files.sync_directory(part.parent)
    files.remove(part)
    files.sync_directory(part.parent)
    return finished


def _fill_finished(files: FileSystem, finished: Path, tally: Tally, clock: ClockMap) -> None:
    """Give UTC to the rows of a finished file that have none."""
    if not tally.unset:
        return
    given = _sidecar_or_nothing(finished)
    _replace_file(files, finished, _kept_lines(finished, clock))
    _store_sidecar(files, finished, given, "finished", replace(tally, unset=0), clock)


def _kept_lines(log: Path, clock: ClockMap | None) -> Iterator[bytes]:
    """The text of a log with its intact rows only, UTC filled in, in blocks."""
    lines = [HEADER]
    with log.open("rb") as file:
        for row in scan(file):
            if row.record is None:
                continue
            lines.append(row.text if clock is None or row.record.utc_us is not None
                         else format_row(_with_utc(row.record, clock)))
            if len(lines) >= _BLOCK_ROWS:
                yield _joined(lines)
                lines.clear()
    yield _joined(lines)


def _joined(lines: list[str]) -> bytes:
    return "".join(f"{line}\n" for line in lines).encode()


def _with_utc(record: WindowRecord, clock: ClockMap) -> WindowRecord:
    return replace(record, utc_us=record.t_us + clock.offset_us,
                   flags=tuple(flag for flag in record.flags if flag != "time_unset"))


def _remove_part(files: FileSystem, part: Path) -> None:
    """Remove a part that has no rows. Its sidecar goes first, so that none is ever left alone."""
    files.remove(_sidecar_path(part))
    files.remove(part)
    files.sync_directory(part.parent)


def _store_sidecar(files: FileSystem, log: Path, given: dict[str, Any], state: str, tally: Tally,
                   clock: ClockMap | None) -> None:
    name = LogName.of(log)
    content = given | {
        "clock_map": None if clock is None else asdict(clock),
        "log": {
            "session": name.session if name else None,
            "part": name.part if name else None,
            "state": state,
            "rows": tally.rows if state == "finished" else None,
            "rows_without_utc": tally.unset if state == "finished" else None,
            "damaged_lines_left_out": tally.damaged_lines,
            "torn_tail_repaired": tally.torn_tail,
        },
    }
    text = json.dumps(content, indent=2, allow_nan=False) + "\n"
    _replace_file(files, _sidecar_path(log), [text.encode()])


def _sidecar_or_nothing(log: Path) -> dict[str, Any]:
    """The sidecar for writing it anew; one that is lost cannot be brought back."""
    try:
        return read_sidecar(log) or {}
    except ValueError:
        return {}


def _clock_of(sidecar: dict[str, Any]) -> ClockMap | None:
    """The clock map that a sidecar holds, if any. That of an open part holds the session's newest."""
    stored = sidecar.get("clock_map")
    offset_us = stored.get("offset_us") if isinstance(stored, dict) else None
    return ClockMap(offset_us) if isinstance(offset_us, int) else None


def _replace_file(files: FileSystem, path: Path, blocks: Iterable[bytes]) -> None:
    """Write a file that is there whole, in place of the old one, or not at all."""
    _write_file(files, _temporary_path(path), blocks)
    files.rename(_temporary_path(path), path)
    files.sync_directory(path.parent)


def _write_file(files: FileSystem, path: Path, blocks: Iterable[bytes]) -> None:
    """Write a file and wait until it is on the disk."""
    descriptor = files.create(path)
    try:
        for block in blocks:
            files.write(descriptor, block)
        files.sync(descriptor)
    finally:
        files.close(descriptor)


def _finished_path(part: Path) -> Path:
    return part.with_name(part.name.removesuffix(".part"))


def _sidecar_path(log: Path) -> Path:
    return log.with_name(log.name.partition(".")[0] + ".json")


def _temporary_path(path: Path) -> Path:
    return path.with_name(path.name + ".tmp")


def _read_counter(path: Path) -> int:
    """The last number given out; 0 when the file is missing or damaged."""
    try:
        text, _, check = path.read_text("ascii", "replace").strip().partition(" ")
    except FileNotFoundError:
        return 0
    return int(text) if check == _check(text) and text.isdecimal() else 0


def _check(text: str) -> str:
    return f"{zlib.crc32(text.encode('ascii', 'replace')):08x}"
