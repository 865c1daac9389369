"""The intact rows of a log file and where rows are lost between them; and its sidecar, the JSON that a reader needs
beside them (settings, versions, scales, clock).

Problem. A cut can leave a part beside the finished file that was made of it, and a card can damage either. What is
intact in one of them is not lost. Solution. Both are read at once and merged by segment. Where damaged lines stand
before a row that does not follow the one before it, and they are long enough, rows are lost there: a ``Hole``, by which
a reader can distinguish what was damaged from what was never written.

Problem. A scale or a clock with one wrong digit makes every row wrong, though each fits its own check value. Solution.
The content carries a checksum of itself, and nothing is read of a sidecar that does not fit it.
"""

import heapq
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from drivers.disk import FileSystem
from logger.files import STATE_BYTES, json_sha256
from logger.records import WindowRecord
from logger.store.log.atomic_file import replace_file
from logger.store.log.log_name import log_name, sidecar_path
from logger.store.log.row_format import SHORTEST_ROW_BYTES, scan

MOST_HOLES = 1000
"""Most holes that are listed of one file, some 40 kB of its sidecar; the last one then reaches over all further."""


class Hole(NamedTuple):
    """Segments, from the first to the last, of which rows were damaged: all, or so many at most."""

    first: int
    last: int


def are_in_holes(first: int, last: int, holes: Iterable[Hole]) -> bool:
    """True when each segment from the first to the last lies in one of the holes."""
    for hole in sorted(holes):
        if hole.first <= first <= hole.last:
            first = hole.last + 1
    return first > last


@dataclass(frozen=True)
class Tally:
    """What a log holds.

    rows             intact rows
    unset            those of them without UTC
    damaged_lines    lines that are not intact; the torn one is not among them
    torn_tail        the file ends in the middle of a row
    repeated         intact rows that stand in the next part too; they are not among ``rows``
    contradictions   rows that are intact in two places and not the same; one of each is among ``rows``
    holes            where damaged lines have taken rows; at either end of the file as many as the lines could hold
    damaged_rows     as many rows as the lines could hold, of a file without an intact row
    """

    rows: int = 0
    unset: int = 0
    damaged_lines: int = 0
    torn_tail: bool = False
    repeated: int = 0
    contradictions: int = 0
    holes: tuple[Hole, ...] = ()
    damaged_rows: int = 0


class IntactRow(NamedTuple):
    """One row: its text and record, and how many rows the damaged lines right before it could hold."""

    text: str
    record: WindowRecord
    damaged_before: int


@dataclass
class IntactRows:
    """Iterates over the intact rows of files that hold the same part, each segment once, in constant memory.

    logs     the finished file before the part: of rows that contradict each other its own is taken
    limit    rows of segments from here on are left out

    The rest is right once the rows have been read. Raises ``OSError``.
    """

    files: FileSystem
    logs: Sequence[Path]
    limit: int | None = None
    damaged_lines: int = 0
    torn_tail: bool = False
    repeated: int = 0
    contradictions: int = 0
    only_in_last: int = 0  # rows that no file but the last one holds
    reach: int | None = None  # the last segment that a file could hold, with what is damaged at its end
    damaged_rows: int = 0  # as many as the damaged lines could hold in files without an intact row

    def __iter__(self) -> Iterator[IntactRow]:
        sources = [self._rows_of(number, log) for number, log in enumerate(self.logs)]
        merged: Iterable[tuple[int, IntactRow]]
        merged = heapq.merge(*sources, key=lambda entry: entry[1].record.segment) if len(sources) > 1 else sources[0]
        for _, group in groupby(merged, key=lambda entry: entry[1].record.segment):
            found = list(group)
            self.only_in_last += all(number == len(self.logs) - 1 for number, _ in found)
            yield self._chosen([row for _, row in found])

    def _rows_of(self, number: int, log: Path) -> Iterator[tuple[int, IntactRow]]:
        damaged = 0
        torn = False
        last: int | None = None
        with self.files.open(log) as file:
            for row in scan(file):
                torn = row.torn
                if row.record is None:
                    self.damaged_lines += not row.torn
                    damaged += row.size // SHORTEST_ROW_BYTES + 1
                elif self.limit is not None and row.record.segment >= self.limit:
                    self.repeated += 1
                else:
                    last = row.record.segment
                    yield number, IntactRow(row.text, row.record, damaged)
                    damaged = 0
        self.torn_tail |= torn
        if last is None:
            self.damaged_rows = max(self.damaged_rows, damaged)
        else:
            self.reach = max(self.reach or last, last + damaged)

    def _chosen(self, rows: Sequence[IntactRow]) -> IntactRow:
        """One of the rows of a segment: the first, or one that is the same and has its UTC."""
        first = without_utc(rows[0].record)
        same = [row for row in rows if without_utc(row.record) == first]
        self.contradictions += len(same) < len(rows)
        chosen = next((row for row in same if row.record.utc_us is not None), same[0])
        return chosen._replace(damaged_before=max(row.damaged_before for row in rows))


def without_utc(record: WindowRecord) -> WindowRecord:
    """The record as it was before it had its UTC."""
    return replace(record, utc_us=None, flags=tuple(flag for flag in record.flags if flag != "time_unset"))


def take_tally(found: IntactRows) -> Tally:
    """Read all rows and count. Raises ``OSError``."""
    rows = unset = 0
    holes: list[Hole] = []
    last: int | None = None
    for row in found:
        rows += 1
        unset += row.record.utc_us is None
        segment = row.record.segment
        first = segment - row.damaged_before if last is None else last + 1
        if 0 < segment - first <= row.damaged_before:
            _add(holes, Hole(first, segment - 1))
        last = segment
    if last is not None and found.reach is not None and found.reach > last:
        _add(holes, Hole(last + 1, found.reach))
    return Tally(rows, unset, found.damaged_lines, found.torn_tail, found.repeated, found.contradictions, tuple(holes),
                 found.damaged_rows)


def _add(holes: list[Hole], hole: Hole) -> None:
    if len(holes) < MOST_HOLES:
        holes.append(hole)
    else:
        holes[-1] = Hole(holes[-1].first, hole.last)


SETTINGS_LOST = "settings_lost"  # In a sidecar that a repair has made where there was none that could be read
_SEAL = frozenset({"format", "sha256"})


@dataclass(frozen=True)
class ClockMap:
    """UTC of a session: ``utc_us = t_us + offset_us``."""

    offset_us: int


def read_sidecar(log: Path, files: FileSystem | None = None) -> dict[str, Any] | None:
    """What lies beside a log file, open or finished; None when it is missing. Raises ``ValueError`` when it is damaged,
    a link, nested too deep or larger than ``STATE_BYTES``, and ``OSError``."""
    path = sidecar_path(log)
    if path.is_symlink():
        raise ValueError("expected a file of its own, found a link to another")
    try:
        with (files or FileSystem()).open(path) as file:
            text = file.read(STATE_BYTES + 1)
    except FileNotFoundError:
        return None
    if len(text) > STATE_BYTES:
        raise ValueError(f"expected at most {STATE_BYTES} bytes")
    try:
        found = json.loads(text)
    except RecursionError:
        raise ValueError("expected less deep nesting") from None
    except ValueError:
        raise ValueError("expected a JSON object") from None
    if not isinstance(found, dict):
        raise ValueError("expected a JSON object")
    content = {key: value for key, value in found.items() if key not in _SEAL}
    if not _fits(found, content):
        raise ValueError("expected content that matches its checksum")
    return content


def store_sidecar(files: FileSystem, log: Path, given: dict[str, Any], state: str, tally: Tally,
                  clock: ClockMap | None) -> None:
    """Write the sidecar of a log, in place of the old one, in one step."""
    name = log_name(log)
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
            **({"segments_lost": tally.holes} if tally.holes else {}),
        },
    }
    plain = json.loads(json.dumps(content, allow_nan=False))  # keys and lists as a reader will find them
    text = json.dumps(sealed(plain), indent=2) + "\n"
    replace_file(files, sidecar_path(log), [text.encode()])


def sealed(content: dict[str, Any]) -> dict[str, Any]:
    """Content with its format and its checksum."""
    sealed = content | {"format": 1}
    return sealed | {"sha256": json_sha256(sealed)}


def _fits(found: dict[str, Any], content: dict[str, Any]) -> bool:
    try:
        return found == sealed(content)
    except RecursionError:  # nested as no content of ours
        return False


def sidecar_or_nothing(log: Path, files: FileSystem | None = None) -> dict[str, Any]:
    """The content of the sidecar; nothing where it is missing, damaged or cannot be read."""
    try:
        return read_sidecar(log, files) or {}
    except (ValueError, OSError):
        return {}


def repairs_of(content: dict[str, Any]) -> Tally:
    """Earlier repairs by a sidecar: damaged lines, a torn tail, holes. What cannot be is left out."""
    said = content.get("log")
    if not isinstance(said, dict):
        return Tally()
    lines, holes = said.get("damaged_lines_left_out"), said.get("segments_lost")
    return Tally(damaged_lines=lines if type(lines) is int else 0, torn_tail=said.get("torn_tail_repaired") is True,
                 holes=tuple(Hole(*hole) for hole in holes if _is_hole(hole)) if isinstance(holes, list) else ())


def _is_hole(hole: object) -> bool:
    return isinstance(hole, list) and len(hole) == 2 and all(type(end) is int for end in hole)


def clock_of(sidecar: dict[str, Any]) -> ClockMap | None:
    """The clock map that a sidecar holds, if any that can be. That of an open part holds the session's newest."""
    latest_utc_us = 4_102_444_800_000_000  # 2100-01-01
    stored = sidecar.get("clock_map")
    offset_us = stored.get("offset_us") if isinstance(stored, dict) else None
    return ClockMap(offset_us) if type(offset_us) is int and 0 <= offset_us < latest_utc_us else None
