"""Segment logs for those who read them: found in a folder, read damaged or not, and their rows as drives and ways.

Rows are joined when the next begins where the last ended and lies near it; what is not joined is a gap, and stays one.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from hashlib import sha256
from itertools import accumulate
from pathlib import Path
from typing import Any

from logger.errors import BadInput
from logger.geodesy import apart_m
from logger.printable import word, words_in
from logger.records import WindowRecord
from logger.store.log.log_name import finished_path, inside_of, log_name, name_before
from logger.store.log.row_format import EPOCH, read_log, write_utc
from logger.store.log.sidecar import read_sidecar


@dataclass(frozen=True)
class LoggedFile:
    """One log file as it was read; its name and the texts of its sidecar are words that can be seen
    (``logger.printable``). ``sidecar`` None: it is missing or cannot be read."""

    name: str
    records: Sequence[WindowRecord]
    damaged_lines: int
    sidecar: Mapping[str, Any] | None


def find_logs(place: Path) -> list[Path]:
    """The logs in a folder at any depth, open ones too, folder by folder in order of their writing, and those of other
    recordings that an export set aside (``other_recordings``); or the one file. Raises BadInput for none."""
    if place.is_file() or finished_path(place).is_file():
        return [place]
    if not place.is_dir():
        raise BadInput(f"{place}: expected a folder of segment logs, or one log file")
    found: dict[tuple[Path, int, int], Path] = {}
    inside = sorted(inside_of(place))
    for path in inside:
        name = log_name(path)
        if name is None or path.is_dir():
            continue
        if not name.is_open or (path.parent, name.session, name.part) not in found:
            found[path.parent, name.session, name.part] = path
    others = other_recordings(inside)
    if not found and not others:
        raise BadInput(f"{place}: expected segment logs (such as 00001-001.csv), found none")
    return [found[key] for key in sorted(found)] + others


def other_recordings(paths: Iterable[Path]) -> list[Path]:
    """Those of the files that are logs which an export set aside on a stick, and no older state of what has their name
    now: they have no row in common with it, nor with each other. Two loggers once had one number, and so one folder."""
    rows: dict[Path, set[tuple[int, int]]] = {}
    found = []
    for path in sorted(paths):
        before = name_before(path.name)
        if before is None or log_name(named := path.with_name(before)) is None or not path.is_file():
            continue
        mine, theirs = _rows_in(path), rows.setdefault(named, _rows_in(named))
        if mine and not mine & theirs:
            found.append(path)
        theirs |= mine
    return found


def _rows_in(log: Path) -> set[tuple[int, int]]:
    """What distinguishes the rows of a log: number and monotonic time; none where it cannot be read."""
    try:
        return {(row.segment, row.t_us) for row in read_log(log).records}
    except OSError:
        return set()


def find_logs_in(places: Sequence[Path]) -> list[tuple[Path, Path | None]]:
    """The logs of files and folders, place by place, each with the folder that its name is shown from.

    A copy of a log that came before it (from a stick, say) is left out: it would count a drive twice. Raises BadInput
    for a place without any.
    """
    # With one place its own name says nothing; among several it distinguishes them.
    listed = [(log, place if len(places) == 1 else place.parent) for place in places for log in find_logs(place)]
    of_one_size = Counter(_name_and_size(log) for log, _ in listed)
    found: list[tuple[Path, Path | None]] = []
    seen: set[object] = set()
    for log, shown_from in listed:
        marks = {log.resolve(), _copied(log) if of_one_size[_name_and_size(log)] > 1 else None} - {None}
        if not seen & marks:
            found.append((log, shown_from))
        seen |= marks
    return found


def read_found(found: Iterable[tuple[Path, Path | None]]) -> list[LoggedFile]:
    """The logs that ``find_logs_in`` found, but those that are there no more. BadInput as ``read_logged``."""
    return [logged for log, place in found if (logged := read_logged(log, place)) is not None]


def _name_and_size(log: Path) -> tuple[str, int | None]:
    """What copies share and can be asked without reading the log."""
    try:
        return log.name, log.stat().st_size
    except OSError:
        return log.name, None


def _copied(log: Path) -> tuple[str, bytes] | None:
    """What a log shares with its copies: name and content. None for one that is still written, or cannot be read."""
    try:
        return (log.name, sha256(log.read_bytes()).digest()) if finished_path(log) == log else None
    except OSError:
        return None


def read_logged(log: Path, place: Path | None = None) -> LoggedFile | None:
    """Read a log, damaged or not, and what lies beside it; None for one that is there no more. Raises BadInput for a
    file that cannot be opened."""
    if not log.exists():
        log = finished_path(log)
    try:
        content = read_log(log)
    except FileNotFoundError:
        return None if finished_path(log) == log else read_logged(log, place)
    except OSError as error:
        raise BadInput(f"{log}: expected a segment log that can be read ({error.strerror})") from None
    try:
        sidecar = read_sidecar(log)
    except (ValueError, OSError):
        sidecar = None
    name = str(log.relative_to(place)) if place is not None and place in log.parents else log.name
    return LoggedFile(word(name), content.records, content.damaged_lines, words_in(sidecar))


# --- rows ---


def split_drives(records: Iterable[WindowRecord]) -> list[list[WindowRecord]]:
    """Rows drive by drive. A new drive begins where its number changes or the count of rows restarts."""
    drives: list[list[WindowRecord]] = []
    last: WindowRecord | None = None
    for record in records:
        if last is None or record.drive != last.drive or record.segment <= last.segment:
            drives.append([])
        drives[-1].append(record)
        last = record
    return drives


def joined(records: Sequence[WindowRecord]) -> list[list[WindowRecord]]:
    """Rows with a position, in stretches without a gap."""
    pieces: list[list[WindowRecord]] = []
    last: WindowRecord | None = None
    for record in records:
        if record.lat_deg is None or record.lon_deg is None:
            last = None
            continue
        if last is None or not _follows(last, record):
            pieces.append([])
        pieces[-1].append(record)
        last = record
    return pieces


def _follows(last: WindowRecord, record: WindowRecord) -> bool:
    if last.distance_end_m is None or record.distance_start_m is None or last.drive != record.drive:
        return False
    ground_m = apart_m(last, record)
    join_m, near_m = 0.5, 5 * max(length_m(last), length_m(record))
    apart_along_m = abs(record.distance_start_m - last.distance_end_m)
    return apart_along_m < join_m and ground_m is not None and ground_m < near_m


def length_m(record: WindowRecord) -> float:
    """Length of a window [m]; 0 for one by time."""
    if record.distance_start_m is None or record.distance_end_m is None:
        return 0.0
    return record.distance_end_m - record.distance_start_m


def along_m(records: Sequence[WindowRecord]) -> list[float]:
    """Distance from the first row's start to each row's middle, through all rows [m]."""
    lengths_m = [length_m(record) for record in records]
    return [end - length / 2 for end, length in zip(accumulate(lengths_m), lengths_m, strict=True)]


def end_utc_us(record: WindowRecord) -> int | None:
    """UTC at the end of a window [us]."""
    return None if record.utc_us is None else record.utc_us + round(record.duration_s * 1e6)


def utc(utc_us: int) -> datetime:
    """An instant [us since 1970] as a date and time."""
    return EPOCH + timedelta(microseconds=utc_us)


def iso_utc(utc_us: int | None) -> str | None:
    """An instant [us since 1970] as ISO 8601 with milliseconds."""
    return write_utc(utc_us) or None
