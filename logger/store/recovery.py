"""A folder of logs put right after a cut of the power: each open part is finished, and no row is lost or repeated."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drivers.disk import FileSystem
from logger.records import WindowRecord
from logger.store.intact_rows import Hole, IntactRow, IntactRows, Tally, take_tally, without_utc
from logger.store.log_name import LogName, finished_path, open_path, sidecar_path
from logger.store.segment_log import HEADER, format_row
from logger.store.session_counter import COUNTER_NAME
from logger.store.set_aside import Warn, disk_words, set_aside, warn_in_journal
from logger.store.sidecar import ClockMap, clock_of, read_sidecar, repairs_of, sidecar_or_nothing, store_sidecar
from logger.store.whole_file import replace_file, temporary_path, write_file

_OWN_TEMPORARY = re.compile(r"(\d{5,}-\d{3,}\.(csv|json)|" + COUNTER_NAME + r")\.tmp")
_BLOCK_ROWS = 256


@dataclass(frozen=True)
class Repaired:
    """What became of a part that was found open: the finished file, or None when it held no row.

    problem    why the disk did not let it be finished; it is left as it is until the next repair
    """

    part: Path
    finished: Path | None
    tally: Tally
    problem: str = ""


def repair(directory: Path, files: FileSystem | None = None, warn: Warn = warn_in_journal) -> list[Repaired]:
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
    done = [repaired for _, logs in sorted(sessions.items()) for repaired in _repair_session(files, logs, warn)]
    for sidecar in directory.glob("*.json"):
        log = sidecar.with_suffix(".csv")
        if LogName.of(log) and not log.exists() and not open_path(log).exists() and _is_of_open_part(sidecar):
            files.remove(sidecar)  # its part had not yet got its name
    return done


def _repair_session(files: FileSystem, logs: Sequence[Path], warn: Warn) -> list[Repaired]:
    """Finish the open parts of a session, of which these are all files. Its newest clock is that of the last part
    which knows one; finished files get it first, for it is lost with the last part."""
    parts = sorted((path for path in logs if path.suffix == ".part"), key=_place)
    clocks = [clock for part in parts if (clock := clock_of(sidecar_or_nothing(part))) is not None]
    clock = clocks[-1] if clocks else None
    try:
        for finished in sorted(set(logs).difference(parts)):
            if clock is not None and _may_lack_utc(finished):
                fill_finished(files, finished, tally_of(files, finished), clock, warn)
    except OSError as error:
        return [Repaired(part, None, Tally(), str(error)) for part in parts]
    later = first_segments_later(files, logs) if parts else {}
    done = []
    for part in parts:
        try:
            done.append(repair_part(files, part, later[part], clock, warn))
        except OSError as error:
            done.append(Repaired(part, None, Tally(), str(error)))
    return done


def repair_part(files: FileSystem, part: Path, limit: int | None, clock: ClockMap | None,
                warn: Warn = warn_in_journal) -> Repaired:
    """Finish one part, but for its rows of segments from ``limit`` on. A finished file of the same name is merged."""
    finished = finished_path(part)
    logs = (finished, part) if finished.exists() else (part,)
    found = IntactRows(files, logs, limit)
    tally = take_tally(found)
    if len(logs) > 1 and not (found.only_in_last or tally.contradictions or _is_damaged(files, finished)):
        # The cut came between the rename and the removal. After a mere kill the rename may not be on the disk yet, and
        # the removal must not come there before it.
        files.sync_directory(part.parent)
        files.remove(part)
        files.sync_directory(part.parent)
    elif tally.rows or len(logs) > 1 or _explains_a_gap(files, part, tally, limit):
        _finish_copy(files, part, logs, _facts_of(files, part, warn), tally, clock, limit)
        if tally.contradictions:
            set_aside(files, part, f"{tally.contradictions} of its rows are others than those in {finished.name}", warn)
        else:
            files.remove(part)
            files.sync_directory(part.parent)
    else:
        remove_part(files, part)
        return Repaired(part, None, tally)
    return Repaired(part, finished, tally)


def _is_damaged(files: FileSystem, finished: Path) -> bool:
    found = IntactRows(files, (finished,))
    tally = take_tally(found)
    return bool(tally.damaged_lines or tally.torn_tail)


def _explains_a_gap(files: FileSystem, part: Path, tally: Tally, limit: int | None) -> bool:
    """True for a part without an intact row where rows are missing between the parts around it, so that a file has to
    stay that says why."""
    if limit is None or not tally.damaged_rows:
        return False
    earlier = sorted((log for log in logs_of_session(part) if _place(log) < _place(part)), key=_place, reverse=True)
    for log in earlier:
        last = None
        for row in IntactRows(files, (log,)):
            last = row.record.segment
        if last is not None:
            return last + 1 < limit
    return False


def logs_of_session(log: Path) -> list[Path]:
    """All files of the session that a log belongs to, open or finished, in no order."""
    name = LogName.of(log)
    return [path for path in log.parent.iterdir()
            if (other := LogName.of(path)) and name and other.session == name.session]


def first_segments_later(files: FileSystem, logs: Iterable[Path]) -> dict[Path, int | None]:
    """For each file of a session the first segment that later parts hold. Rows from there on were written again: the
    disk had failed, and what it kept of them in this part is not to be trusted. Each file is opened once."""
    found: dict[Path, int | None] = {}
    part = limit = upcoming = None
    for log in sorted(logs, key=_place, reverse=True):
        if _place(log)[0] != part:
            part, limit = _place(log)[0], upcoming
        found[log] = limit
        with suppress(OSError):  # what nobody can read is not there twice either
            upcoming = next((row.record.segment for row in IntactRows(files, (log,))), upcoming)
    return found


def _place(log: Path) -> tuple[int, Path]:
    """Number of the part, then a finished file before an open one; by this the files of a session are in order."""
    name = LogName.of(log)
    return (name.part if name else 0), log


def _may_lack_utc(finished: Path) -> bool:
    """False where the sidecar says that no row does."""
    said = sidecar_or_nothing(finished).get("log")
    return not isinstance(said, dict) or said.get("rows_without_utc") != 0


def finish_part(files: FileSystem, part: Path, given: dict[str, Any], tally: Tally, clock: ClockMap | None) -> Path:
    """Turn a part that was written whole and synced into the finished file."""
    if clock is not None and tally.unset:
        finished = _finish_copy(files, part, (part,), given, tally, clock, None)
        files.remove(part)
    else:
        finished = finished_path(part)
        store_sidecar(files, part, given, "finished", tally, clock)
        files.rename(part, finished)
    files.sync_directory(part.parent)
    return finished


def _facts_of(files: FileSystem, log: Path, warn: Warn) -> dict[str, Any]:
    """The sidecar, to be written anew. One that is damaged or cannot be read is put aside."""
    try:
        return read_sidecar(log, files) or {}
    except ValueError as error:
        why = f"damaged: {error}"
    except OSError as error:
        why = disk_words(error)
    set_aside(files, sidecar_path(log), f"{why}; {finished_path(log).name} has lost its settings and clock", warn)
    return {}


def _finish_copy(files: FileSystem, part: Path, logs: Sequence[Path], given: dict[str, Any], tally: Tally,
                 clock: ClockMap | None, limit: int | None) -> Path:
    """Put the intact rows of a part, or of the part and the finished file that is there, into a finished file; the part
    is still there. They are written anew: of a part that was found open nobody knows whether the disk holds what the
    system shows."""
    finished = finished_path(part)
    filled = tally if clock is None else replace(tally, unset=0)
    if limit is not None and not tally.rows:
        filled = replace(filled, holes=(Hole(limit - tally.damaged_rows, limit - 1),))
    write_file(files, temporary_path(finished), _lines(IntactRows(files, logs, limit), clock))
    store_sidecar(files, part, given, "finished", filled, clock)
    files.rename(temporary_path(finished), finished)
    files.sync_directory(part.parent)
    return finished


def fill_finished(files: FileSystem, finished: Path, tally: Tally, clock: ClockMap | None,
                  warn: Warn = warn_in_journal) -> None:
    """Give UTC to the rows of a finished file that have none. What earlier repairs left out of it is still known."""
    if clock is None or not tally.unset:
        return
    given = _facts_of(files, finished, warn)
    before = repairs_of(given)
    replace_file(files, finished, _lines(IntactRows(files, (finished,)), clock))
    store_sidecar(files, finished, given, "finished", replace(
        tally, unset=0, damaged_lines=tally.damaged_lines + before.damaged_lines,
        torn_tail=tally.torn_tail or before.torn_tail, holes=before.holes + tally.holes), clock)


def tally_of(files: FileSystem, log: Path) -> Tally:
    """Count what one file holds. Raises ``OSError``."""
    return take_tally(IntactRows(files, (log,)))


def _lines(rows: Iterable[IntactRow], clock: ClockMap | None) -> Iterator[bytes]:
    """The text of a log with these rows, UTC filled in, in blocks."""
    lines = [HEADER]
    for row in rows:
        lines.append(row.text if clock is None or row.record.utc_us is not None
                     else format_row(_with_utc(row.record, clock)))
        if len(lines) >= _BLOCK_ROWS:
            yield _joined(lines)
            lines.clear()
    yield _joined(lines)


def _joined(lines: list[str]) -> bytes:
    return "".join(f"{line}\n" for line in lines).encode()


def _with_utc(record: WindowRecord, clock: ClockMap) -> WindowRecord:
    return replace(without_utc(record), utc_us=record.t_us + clock.offset_us)


def remove_part(files: FileSystem, part: Path) -> None:
    """Remove a part that has no rows. Its sidecar goes first, so that none is ever left alone."""
    files.remove(sidecar_path(part))
    files.sync_directory(part.parent)
    files.remove(part)
    files.sync_directory(part.parent)


def _is_of_open_part(sidecar: Path) -> bool:
    said = sidecar_or_nothing(sidecar).get("log")
    return isinstance(said, dict) and said.get("state") == "open"
