"""A folder of logs put right after a cut of the power: each open part is finished, and no row is lost or repeated."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drivers.disk import FileSystem
from logger.printable import counted
from logger.store.log import atomic_file
from logger.store.log import sidecar as sidecars
from logger.store.log.log_name import COUNTER, OwnFile, finished_path, log_name, open_path, sidecar_path
from logger.store.log.row_format import HEADER, format_row


@dataclass(frozen=True)
class Repaired:
    """What became of a part that was found open: the finished file, or None when it held no row.

    problem    why the disk did not let it be finished; it is left as it is until the next repair
    """

    part: Path
    finished: Path | None
    tally: sidecars.Tally
    problem: str = ""

    @property
    def words(self) -> str:
        """What was done, in a sentence."""
        if self.problem:
            return f"{self.part.name} could not be repaired: {self.problem}"
        damaged = counted(self.tally.damaged_lines, "damaged line") + " and a torn one" * self.tally.torn_tail
        if self.finished is None:
            return f"removed {self.part.name}: no intact row, {damaged}"
        return f"finished {self.finished.name}: {counted(self.tally.rows, 'row')}; left out {damaged}"


def repair(directory: Path, files: FileSystem | None = None,
           warn: atomic_file.Warn = atomic_file.warn_in_journal) -> list[Repaired]:
    """Put the folder right after a service that was killed: finish its parts, in order of their names.

    Every intact row is kept; damaged lines are left out and counted in the sidecar; UTC is filled in where the
    session had learned it. Repairing twice does nothing more. Must not run while a service writes to the folder.
    A part on which the disk fails does not keep the others from being finished. Raises ``OSError`` for the folder.
    """
    files = files or FileSystem()
    for path in list(directory.iterdir()):
        _clear(files, path, warn)
    sessions: dict[int, list[Path]] = defaultdict(list)
    for path in directory.iterdir():
        if (name := log_name(path)) and atomic_file.is_file(path):
            sessions[name.session].append(path)
    done = [repaired for _, logs in sorted(sessions.items()) for repaired in _repair_session(files, logs, warn)]
    for sidecar in list(directory.glob("*.json")):
        log = sidecar.with_suffix(".csv")
        if log_name(log) and not atomic_file.is_taken(log) and not atomic_file.is_taken(open_path(log)):
            _remove_lone(files, sidecar, warn)
    return done


def _clear(files: FileSystem, path: Path, warn: atomic_file.Warn) -> None:
    """Remove what a cut left as temporary; put aside what has such a name, a log's or a sidecar's, and is no file."""
    whole_name = atomic_file.name_of_temporary(path) or path.name
    is_temporary = whole_name != path.name
    own = OwnFile.of(whole_name)
    if not ((own is not None and own.kind in (".csv", ".json")) or (is_temporary and COUNTER.fullmatch(whole_name))):
        return
    why = "" if atomic_file.is_file(path) else "not a file"
    if is_temporary:
        try:
            files.remove(path)
        except OSError as error:
            why = atomic_file.disk_words(error)
        else:
            return
    if why:
        atomic_file.set_aside_if_possible(files, path, why, warn)


def _remove_lone(files: FileSystem, sidecar: Path, warn: atomic_file.Warn) -> None:
    """Remove the sidecar of a part that had no name yet. That of a finished log that was taken away stays."""
    try:
        said = (sidecars.read_sidecar(sidecar, files) or {}).get("log")
        if isinstance(said, dict) and said.get("state") == "open":
            files.remove(sidecar)
    except (ValueError, OSError) as error:
        atomic_file.set_aside_if_possible(files, sidecar, atomic_file.disk_words(error) if isinstance(error, OSError)
                                          else str(error), warn)


def _repair_session(files: FileSystem, logs: Sequence[Path], warn: atomic_file.Warn) -> list[Repaired]:
    """Finish the open parts of a session, of which these are all files. Its newest clock is that of the last part
    which knows one; finished files get it first, for it is lost with the last part."""
    parts = sorted((path for path in logs if path.suffix == ".part"), key=_place)
    clocks = [clock
              for part in parts if (clock := sidecars.clock_of(sidecars.sidecar_or_nothing(part, files))) is not None]
    clock = clocks[-1] if clocks else None
    try:
        for finished in sorted(set(logs).difference(parts)):
            if clock is not None and _may_lack_utc(files, finished):
                _fill_if_readable(files, finished, clock, warn)
    except OSError as error:
        return [Repaired(part, None, sidecars.Tally(), atomic_file.file_words(error)) for part in parts]
    later = first_segments_later(files, logs) if parts else {}
    done = []
    for part in parts:
        try:
            done.append(repair_part(files, part, later[part], clock, warn))
        except OSError as error:
            done.append(Repaired(part, None, sidecars.Tally(), atomic_file.file_words(error)))
    return done


def _fill_if_readable(files: FileSystem, finished: Path, clock: sidecars.ClockMap, warn: atomic_file.Warn) -> None:
    """Give a finished file its UTC; one that cannot be read does not get it, and keeps no other from being finished."""
    try:
        tally = tally_of(files, finished)
    except OSError as error:
        warn(f"{finished.name}: {atomic_file.disk_words(error)}; its rows get no UTC")
    else:
        fill_finished(files, finished, tally, clock, warn)


def repair_part(files: FileSystem, part: Path, limit: int | None, clock: sidecars.ClockMap | None,
                warn: atomic_file.Warn = atomic_file.warn_in_journal) -> Repaired:
    """Finish one part, but for its rows of segments from ``limit`` on. A finished file of the same name is merged."""
    finished = finished_path(part)
    logs = (finished, part) if atomic_file.is_taken(finished) else (part,)
    found = sidecars.IntactRows(files, logs, limit)
    tally = sidecars.take_tally(found)
    if len(logs) > 1 and not (found.only_in_last or tally.contradictions or _is_damaged(files, finished)):
        # The cut came between the rename and the removal. After a mere kill the rename may not be on the disk yet, and
        # the removal must not come there before it.
        files.sync_directory(part.parent)
        files.remove(part)
        files.sync_directory(part.parent)
    elif tally.rows or len(logs) > 1 or _explains_a_gap(files, part, tally, limit):
        _finish_copy(files, part, logs, _facts_of(files, part, warn), tally, clock, limit)
        if tally.contradictions:
            why = f"{tally.contradictions} of its rows differ from those in {finished.name}"
            atomic_file.set_aside(files, part, why, warn)
        else:
            files.remove(part)
            files.sync_directory(part.parent)
    else:
        remove_part(files, part)
        return Repaired(part, None, tally)
    return Repaired(part, finished, tally)


def _is_damaged(files: FileSystem, finished: Path) -> bool:
    tally = tally_of(files, finished)
    return bool(tally.damaged_lines or tally.torn_tail)


def _explains_a_gap(files: FileSystem, part: Path, tally: sidecars.Tally, limit: int | None) -> bool:
    """True for a part without an intact row that has to stay, to say why rows are missing between its neighbours."""
    if limit is None or not tally.damaged_rows:
        return False
    earlier = sorted((log for log in logs_of_session(part) if _place(log) < _place(part)), key=_place, reverse=True)
    for log in earlier:
        last = None
        for row in sidecars.IntactRows(files, (log,)):
            last = row.record.segment
        if last is not None:
            return last + 1 < limit
    return False


def logs_of_session(log: Path) -> list[Path]:
    """All files of the session that a log belongs to, open or finished, in no order."""
    name = log_name(log)
    return [path for path in log.parent.iterdir()
            if (other := log_name(path)) and name and other.session == name.session]


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
            upcoming = next((row.record.segment for row in sidecars.IntactRows(files, (log,))), upcoming)
    return found


def _place(log: Path) -> tuple[int, Path]:
    """Number of the part, then a finished file before an open one; by this the files of a session are in order."""
    name = log_name(log)
    return (name.part if name else 0), log


def _may_lack_utc(files: FileSystem, finished: Path) -> bool:
    """False where the sidecar says that no row does."""
    said = sidecars.sidecar_or_nothing(finished, files).get("log")
    return not isinstance(said, dict) or said.get("rows_without_utc") != 0


def finish_part(files: FileSystem, part: Path, given: dict[str, Any], tally: sidecars.Tally, clock: sidecars.ClockMap
                | None) -> Path:
    """Turn a part that was written whole and synced into the finished file."""
    if clock is not None and tally.unset:
        finished = _finish_copy(files, part, (part,), given, tally, clock, None)
        files.remove(part)
    else:
        finished = finished_path(part)
        sidecars.store_sidecar(files, part, given, "finished", tally, clock)
        files.rename(part, finished)
    files.sync_directory(part.parent)
    return finished


def _facts_of(files: FileSystem, log: Path, warn: atomic_file.Warn) -> dict[str, Any]:
    """What a new sidecar of a log takes over from its old one. One that is damaged or cannot be read is put aside."""
    try:
        content = sidecars.read_sidecar(log, files)
    except ValueError as error:
        why = f"damaged: {error}"
    except OSError as error:
        why = atomic_file.disk_words(error)
    else:
        return {sidecars.SETTINGS_LOST: True} if content is None else content
    atomic_file.set_aside(files, sidecar_path(log), f"{why}; {finished_path(log).name} has lost its settings and clock",
                          warn)
    return {sidecars.SETTINGS_LOST: True}


def _finish_copy(files: FileSystem, part: Path, logs: Sequence[Path], given: dict[str, Any], tally: sidecars.Tally,
                 clock: sidecars.ClockMap | None, limit: int | None) -> Path:
    """Put the intact rows of a part, or of the part and the finished file that is there, into a finished file; the part
    is still there. They are rewritten: of a part that was found open nobody knows whether the disk holds what the
    system shows."""
    finished = finished_path(part)
    filled = tally if clock is None else replace(tally, unset=0)
    if limit is not None and not tally.rows:
        filled = replace(filled, holes=(sidecars.Hole(limit - tally.damaged_rows, limit - 1),))
    temporary = atomic_file.write_temporary(files, finished, _lines(sidecars.IntactRows(files, logs, limit), clock))
    sidecars.store_sidecar(files, part, given, "finished", filled, clock)
    files.rename(temporary, finished)
    files.sync_directory(part.parent)
    return finished


def fill_finished(files: FileSystem, finished: Path, tally: sidecars.Tally, clock: sidecars.ClockMap | None,
                  warn: atomic_file.Warn = atomic_file.warn_in_journal) -> None:
    """Give UTC to the rows of a finished file that have none. What earlier repairs left out of it is still known."""
    if clock is None or not tally.unset:
        return
    given = _facts_of(files, finished, warn)
    before = sidecars.repairs_of(given)
    atomic_file.replace_file(files, finished, _lines(sidecars.IntactRows(files, (finished,)), clock))
    sidecars.store_sidecar(files, finished, given, "finished", replace(
        tally, unset=0, damaged_lines=tally.damaged_lines + before.damaged_lines,
        torn_tail=tally.torn_tail or before.torn_tail, holes=before.holes + tally.holes), clock)


def tally_of(files: FileSystem, log: Path) -> sidecars.Tally:
    """Count what one file holds. Raises ``OSError``."""
    return sidecars.take_tally(sidecars.IntactRows(files, (log,)))


def _lines(rows: Iterable[sidecars.IntactRow], clock: sidecars.ClockMap | None) -> Iterator[bytes]:
    """The text of a log with these rows, UTC filled in, in blocks."""
    block_rows = 256
    lines = [HEADER]
    for row in rows:
        lines.append(row.text if clock is None or row.record.utc_us is not None
                     else format_row(replace(sidecars.without_utc(row.record), utc_us=row.record.t_us
                                             + clock.offset_us)))
        if len(lines) >= block_rows:
            yield _joined(lines)
            lines.clear()
    yield _joined(lines)


def _joined(lines: list[str]) -> bytes:
    return "".join(f"{line}\n" for line in lines).encode()


def remove_part(files: FileSystem, part: Path) -> None:
    """Remove a part that has no rows. Its sidecar goes first, so that none is ever left alone."""
    files.remove(sidecar_path(part))
    files.sync_directory(part.parent)
    files.remove(part)
    files.sync_directory(part.parent)
