"""The files of a log: opened, filled, finished, and put right after a power cut.

Problem. The power of a car goes at any instant. Whoever looks into the folder afterwards must find every row that
had reached the disk, once, and no file that looks finished and is not. The rows written before the first GPS fix
have no UTC, and a Pi has no clock from which files could take their names.

Solution. Names come from a session number that is never used again: ``<session>-<part>.csv.part`` while open,
``.csv`` when finished, with a sidecar ``.json`` beside it. A part is only ever appended to. It is finished by a
rename: of itself, when all of it was synced and nothing in it needs to change, else of a rewritten copy (UTC filled in,
damaged lines left out) which is on the disk before it takes the name, and only then the part is removed. So at every
instant there is either the part or the finished file, and ``repair`` at the next start makes the step that was missing.
Every change to the disk goes through ``FileSystem``, so that tests can cut between any two of them.

What is promised, whatever is cut and wherever (``tests/bench/faults.py`` tries it):

1. A row that ``sync`` returned for is in the folder, once, in every later instant. The service syncs each row within
   a second of handing it over; a process that is killed loses no row at all that it had handed over.
2. No damaged row is ever taken for good: a row counts only with its CRC-32.
3. After the next start every file is finished and beside its sidecar, its rows follow one another without a gap but
   where the disk itself lost them, and no session number is given twice.
4. Where the disk refuses (full, failing, read-only), what was on it stays, and rows go on in a part of their own as
   soon as it takes them: what a failed write or sync left behind is never counted as written.

The disk has to keep its side: what fsync returned for stays, and a rename happens or does not. ext4 as on a Raspberry
Pi does; FAT does not promise the second, nor that a cut leaves no old content of the disk in a new file.
"""

from __future__ import annotations

import json
import re
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from drivers.disk import FileSystem
from drivers.regular_file import open_regular
from logger.records import WindowRecord
from logger.store.segment_log import HEADER, format_row, scan

COUNTER_NAME = "last-session"
SIDECAR_BYTES = 1_000_000
"""Most that is read as a sidecar: a settings file and a vehicle, of at most 256 kB each, and a few words."""

LATEST_UTC_US = 4_102_444_800_000_000  # 2100-01-01
CLOCK_STEP_US = 100_000
"""A clock map that has moved by less than this need not reach the disk before the file is finished."""

_LOG_NAME = re.compile(r"(\d{5,})-(\d{3,})\.csv(\.part)?")
_OWN_TEMPORARY = re.compile(r"(\d{5,}-\d{3,}\.(csv|json)|" + COUNTER_NAME + r")\.tmp")
_SESSION_NAME = re.compile(r"(\d{5,})[-.]")
_BLOCK_ROWS = 256


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
    repeated         intact rows that stand in the next part too; they are not among ``rows``
    """

    rows: int = 0
    unset: int = 0
    damaged_lines: int = 0
    torn_tail: bool = False
    repeated: int = 0


@dataclass(frozen=True)
class Repaired:
    """What became of a part that was found open: the finished file, or None when it held no row.

    problem    why the disk did not let it be finished; it is left as it is until the next repair
    """

    part: Path
    finished: Path | None
    tally: Tally
    problem: str = ""


class SegmentLog:
    """The log of one session: rows in, files out.

    directory    an existing folder that one service at a time writes to
    session      a number from ``next_session``
    sidecar      what a reader needs beside the rows (configuration, versions, scales); plain JSON values
    max_bytes    a part is finished before a row would make its rows longer than this

    ``path`` is the open part; ``rows_on_disk`` counts the rows that were synced, in all parts. Raises ``OSError`` for
    what the disk refuses, ``FileExistsError`` also when files of this session are there already. After an ``OSError``
    the open part is not to be trusted beyond its synced rows: ``go_on`` begins another, in which the rows that were
    not synced have to be written again, and ``finish_left`` finishes the one that was left.
    """

    path: Path
    _tally: Tally
    _bytes: int

    def __init__(self, directory: Path, session: int, sidecar: dict[str, Any], max_bytes: int,
                 files: FileSystem | None = None) -> None:
        self._directory = directory
        self.session = session
        self._given = sidecar
        self._max_bytes = max_bytes
        self._files = files or FileSystem()
        self._clock: ClockMap | None = None
        self._stored_clock: ClockMap | None = None
        self._without_utc: list[tuple[Path, Tally]] = []
        self._left: list[Path] = []
        self._is_retry = False  # the part was opened by ``go_on``, and nothing in it has been synced yet
        self._part = 0
        self._descriptor: int | None = None
        self._dirty = False
        self._rows_synced = 0
        self.rows_on_disk = 0
        self._open_next()

    def append(self, record: WindowRecord) -> None:
        """Write one row. It is handed to the system at once and is safe from a power cut after ``sync``."""
        row = f"{format_row(record)}\n".encode()
        if self._bytes and self._bytes + len(row) > self._max_bytes:
            self.rotate()
        self._dirty = True
        self._do(self._files.write, row)
        self._bytes += len(row)
        self._tally = replace(self._tally, rows=self._tally.rows + 1,
                              unset=self._tally.unset + (record.utc_us is None))

    def sync(self) -> None:
        """Wait until all rows are on the disk."""
        if self._dirty:
            self._do(self._files.sync)
            self._dirty = self._is_retry = False
            self.rows_on_disk += self._tally.rows - self._rows_synced
            self._rows_synced = self._tally.rows

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
        self._fill_earlier()

    def go_on(self, unsynced: Iterable[WindowRecord]) -> None:
        """After an ``OSError``: leave the part as it stands, open the next, and put the rows there that were not
        synced. A part that was opened here and has taken no row is begun anew: a disk that refuses for a day leaves
        no more files than one that refuses once. Raises ``OSError``: not yet."""
        self._let_go()
        if self._is_retry:
            self._part -= 1
        self._is_retry = True
        self._open_next()
        for record in unsynced:
            self.append(record)
        self.sync()

    @property
    def is_behind(self) -> bool:
        """True while there is something for ``finish_left`` to do."""
        return bool(self._left or (self._without_utc and self._clock is not None))

    def finish_left(self) -> None:
        """Finish one of the parts that were left. Raises ``OSError``: not yet; else ``repair`` does it one day."""
        if self._left:
            part = self._left[0]
            finished: Path | None = _finished_path(part)
            if part.exists():
                limit = _limits(path for path in part.parent.glob(f"{self.session:05d}-*.csv*")
                                if LogName.of(path))[part]
                finished = _repair_part(self._files, part, limit, self._clock).finished
            if finished is not None and finished.exists():
                self._without_utc.append((finished, take_tally(finished)))
            self._left.pop(0)
        self._fill_earlier()

    def close(self) -> None:
        """Finish the last part, or remove it when it has no rows, and what was left as far as the disk lets us.
        Closing twice does nothing."""
        if self._descriptor is None:
            return
        with suppress(OSError):
            while self.is_behind:
                self.finish_left()
        if self._tally.rows:
            self._finish()
        else:
            self._close_file()
            _remove_part(self._files, self.path)

    def _open_next(self) -> None:
        self._part += 1
        self.path = self._directory / f"{self.session:05d}-{self._part:03d}.csv.part"
        for taken in (self.path, _finished_path(self.path)):
            if taken.exists() and not self._is_retry:
                raise FileExistsError(f"{taken}: this session has been logged before")
        self._tally = Tally()
        self._bytes = 0
        self._rows_synced = 0
        self._descriptor = self._files.create(self.path)
        self._files.write(self._descriptor, f"{HEADER}\n".encode())
        self._dirty = True
        self._write_sidecar("open")

    def _finish(self) -> None:
        self.sync()
        self._close_file()
        finished = _finish_part(self._files, self.path, self._given, self._tally, self._clock)
        if self._clock is None and self._tally.unset:
            self._without_utc.append((finished, self._tally))

    def _fill_earlier(self) -> None:
        while self._clock is not None and self._without_utc:
            _fill_finished(self._files, *self._without_utc[0], self._clock)
            self._without_utc.pop(0)

    def _let_go(self) -> None:
        if not self._is_retry and self.path not in self._left:
            self._left.append(self.path)
        with suppress(OSError):
            self._close_file()

    def _close_file(self) -> None:
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            self._files.close(descriptor)

    def _do(self, act: Callable[..., None], *what: bytes) -> None:
        """Write to or sync the part. One that failed at it is never tried again: the system may by then have thrown
        away what it could not write, and tell of success."""
        if self._descriptor is None:
            raise ValueError("expected an open log: go_on() after an error, and nothing after close()")
        try:
            act(self._descriptor, *what)
        except OSError:
            self._let_go()
            raise

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
    A part on which the disk fails does not keep the others from being finished. Raises ``OSError`` for the folder.
    """
    files = files or FileSystem()
    for path in list(directory.iterdir()):
        if _OWN_TEMPORARY.fullmatch(path.name):
            files.remove(path)
    sessions: dict[int, list[Path]] = defaultdict(list)
    for path in directory.iterdir():
        if name := LogName.of(path):
            sessions[name.session].append(path)
    done = [repaired for _, logs in sorted(sessions.items()) for repaired in _repair_session(files, logs)]
    for sidecar in directory.glob("*.json"):
        log = sidecar.with_suffix(".csv")
        if LogName.of(log) and not log.exists() and not _open_path(log).exists() and _is_of_open_part(sidecar):
            files.remove(sidecar)  # its part had not yet got its name
    return done


def read_sidecar(log: Path) -> dict[str, Any] | None:
    """The sidecar of a log file, open or finished; None when it is missing. Raises ``ValueError`` when it is
    damaged, nested too deep or larger than ``SIDECAR_BYTES``."""
    try:
        with open_regular(_sidecar_path(log)) as file:
            text = file.read(SIDECAR_BYTES + 1)
    except FileNotFoundError:
        return None
    if len(text) > SIDECAR_BYTES:
        raise ValueError(f"expected at most {SIDECAR_BYTES} bytes")
    try:
        found = json.loads(text)
    except RecursionError:
        raise ValueError("expected no such deep nesting") from None
    except ValueError:
        raise ValueError("expected a JSON object") from None
    if not isinstance(found, dict):
        raise ValueError("expected a JSON object")
    return found


def _repair_session(files: FileSystem, logs: Sequence[Path]) -> list[Repaired]:
    """Finish the open parts of a session, of which these are all files. Its newest clock is that of the last part
    which knows one; finished files get it first, for it is lost with the last part."""
    parts = sorted((path for path in logs if path.suffix == ".part"), key=_place)
    clocks = [clock for part in parts if (clock := _clock_of(_sidecar_or_nothing(part))) is not None]
    clock = clocks[-1] if clocks else None
    try:
        for finished in sorted(set(logs).difference(parts)):
            if clock is not None and _may_lack_utc(finished):
                _fill_finished(files, finished, take_tally(finished), clock)
    except OSError as error:
        return [Repaired(part, None, Tally(), str(error)) for part in parts]
    limits = _limits(logs) if parts else {}
    done = []
    for part in parts:
        try:
            done.append(_repair_part(files, part, limits[part], clock))
        except OSError as error:
            done.append(Repaired(part, None, Tally(), str(error)))
    return done


def _repair_part(files: FileSystem, part: Path, limit: int | None, clock: ClockMap | None) -> Repaired:
    """Finish one part, but for its rows of segments from ``limit`` on."""
    tally = take_tally(part, limit)
    finished = _finished_path(part)
    if finished.exists() and take_tally(finished).rows >= tally.rows:
        # The cut came between the rename and the removal. After a mere kill the rename may not be on the disk yet, and
        # the removal must not come there before it.
        files.sync_directory(part.parent)
        files.remove(part)
        files.sync_directory(part.parent)
    elif tally.rows:
        _finish_copy(files, part, _sidecar_or_nothing(part), tally, clock, limit)
    else:
        _remove_part(files, part)
        return Repaired(part, None, tally)
    return Repaired(part, finished, tally)


def _limits(logs: Iterable[Path]) -> dict[Path, int | None]:
    """For each file of a session the first segment that later parts hold. Rows from there on were written again: the
    disk had failed, and what it kept of them in this part is not to be trusted. Each file is opened once."""
    limits: dict[Path, int | None] = {}
    part = limit = upcoming = None
    for log in sorted(logs, key=_place, reverse=True):
        if _place(log)[0] != part:
            part, limit = _place(log)[0], upcoming
        limits[log] = limit
        with suppress(OSError), log.open("rb") as file:  # what nobody can read is not there twice either
            upcoming = next((row.record.segment for row in scan(file) if row.record is not None), upcoming)
    return limits


def _place(log: Path) -> tuple[int, Path]:
    """Number of the part, then a finished file before an open one; by this the files of a session are in order."""
    name = LogName.of(log)
    return (name.part if name else 0), log


def _may_lack_utc(finished: Path) -> bool:
    """False where the sidecar says that no row does."""
    said = _sidecar_or_nothing(finished).get("log")
    return not isinstance(said, dict) or said.get("rows_without_utc") != 0


def take_tally(log: Path, limit: int | None = None) -> Tally:
    """Count what a log holds; rows of segments from ``limit`` on are ``repeated``. Raises ``OSError``."""
    rows = unset = damaged = repeated = 0
    torn_tail = False
    with log.open("rb") as file:
        for row in scan(file):
            torn_tail = row.torn
            if row.record is None:
                damaged += not row.torn
            elif limit is not None and row.record.segment >= limit:
                repeated += 1
            else:
                rows += 1
                unset += row.record.utc_us is None
    return Tally(rows, unset, damaged, torn_tail, repeated)


def _finish_part(files: FileSystem, part: Path, given: dict[str, Any], tally: Tally, clock: ClockMap | None) -> Path:
    """Turn a part that was written whole and synced into the finished file."""
    if clock is not None and tally.unset:
        return _finish_copy(files, part, given, tally, clock, None)
    finished = _finished_path(part)
    _store_sidecar(files, part, given, "finished", tally, clock)
    files.rename(part, finished)
    files.sync_directory(part.parent)
    return finished


def _finish_copy(files: FileSystem, part: Path, given: dict[str, Any], tally: Tally, clock: ClockMap | None,
                 limit: int | None) -> Path:
    """Turn the good rows of a part into the finished file. They are written anew: of a part that was found open nobody
    knows whether the disk holds what the system shows."""
    finished = _finished_path(part)
    filled = tally if clock is None else replace(tally, unset=0)
    _write_file(files, _temporary_path(finished), _kept_lines(part, clock, limit))
    _store_sidecar(files, part, given, "finished", filled, clock)
    files.rename(_temporary_path(finished), finished)
    files.sync_directory(part.parent)
    files.remove(part)
    files.sync_directory(part.parent)
    return finished


def _fill_finished(files: FileSystem, finished: Path, tally: Tally, clock: ClockMap | None) -> None:
    """Give UTC to the rows of a finished file that have none."""
    if clock is None or not tally.unset:
        return
    given = _sidecar_or_nothing(finished)
    _replace_file(files, finished, _kept_lines(finished, clock))
    _store_sidecar(files, finished, given, "finished", replace(tally, unset=0), clock)


def _kept_lines(log: Path, clock: ClockMap | None, limit: int | None = None) -> Iterator[bytes]:
    """The text of a log with its intact rows only, up to segment ``limit``, UTC filled in, in blocks."""
    lines = [HEADER]
    with log.open("rb") as file:
        for row in scan(file):
            if row.record is None or (limit is not None and row.record.segment >= limit):
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
    files.sync_directory(part.parent)
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


def _is_of_open_part(sidecar: Path) -> bool:
    said = _sidecar_or_nothing(sidecar).get("log")
    return isinstance(said, dict) and said.get("state") == "open"


def _clock_of(sidecar: dict[str, Any]) -> ClockMap | None:
    """The clock map that a sidecar holds, if any that can be. That of an open part holds the session's newest."""
    stored = sidecar.get("clock_map")
    offset_us = stored.get("offset_us") if isinstance(stored, dict) else None
    return ClockMap(offset_us) if type(offset_us) is int and 0 <= offset_us < LATEST_UTC_US else None


def _replace_file(files: FileSystem, path: Path, blocks: Iterable[bytes]) -> None:
    """Write a file that is there whole, in place of the old one, or not at all."""
    _write_file(files, _temporary_path(path), blocks)
    files.rename(_temporary_path(path), path)
    files.sync_directory(path.parent)


def _write_file(files: FileSystem, path: Path, blocks: Iterable[bytes]) -> None:
    """Write a file and wait until it is on the disk. What cannot be written whole is removed: it may fill the disk."""
    descriptor = files.create(path)
    try:
        try:
            for block in blocks:
                files.write(descriptor, block)
            files.sync(descriptor)
        finally:
            files.close(descriptor)
    except OSError:
        with suppress(OSError):
            files.remove(path)
        raise


def _open_path(finished: Path) -> Path:
    return finished.with_name(finished.name + ".part")


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
