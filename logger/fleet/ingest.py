"""Logs into a dataset: what is new, once, whatever was ingested before and whenever it was killed.

A log whose bytes are known is passed over. Of a session that is known in part, rows are compared by number and check
value; a row of the same number and time with another check value is a contradiction, counted, and the first one
stays. So an ingest that was cut off goes on where it was when it is started again.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.fleet.dataset import ROW_TYPES, Dataset
from logger.fleet.drive_rows import Filed, Keyed, filed_rows
from logger.fleet.log_columns import LogColumns, columns_of, joined_columns, read_bytes
from logger.store.log.log_name import LogName

BATCH_ROWS = 500_000
"""Rows of a commit, at least: some 300 MB while they are written."""

_TOGETHER_BYTES = 8 << 20
"""Of logs that are read at once, at least: beyond it the cost of a reading no longer counts."""

_MARKS = ("segment", "crc32", "utc_us")
_SAME_US = 10_000_000
"""Rows of one number that lie farther apart than this are of two recorders that share a name and a session number."""


@dataclass
class Counts:
    """What an ingest did with rows and logs."""

    logs: int = 0
    known_logs: int = 0
    added: int = 0
    repeated: int = 0
    contradictions: int = 0
    damaged_lines: int = 0
    undated: int = 0
    unplaced: int = 0
    trimmed: int = 0


@dataclass(frozen=True)
class Session:
    """Logs of one session of one car, in the order of their parts."""

    car: int
    number: int
    logs: tuple[Path, ...]


@dataclass
class _Waiting:
    rows: list[Mapping[str, npt.NDArray[Any]]] = field(default_factory=list)
    ledger: dict[str, list[Any]] = field(default_factory=lambda: defaultdict(list))
    count: int = 0


def sessions_of(logs: Iterable[tuple[Path, int]]) -> list[Session]:
    """Logs with their cars, by folder and session; a file that is named otherwise than a logger's is a session of its
    own, with the number 0."""
    found: dict[tuple[Path, int, int], list[Path]] = defaultdict(list)
    for path, car in logs:
        name = LogName.of(path)
        found[path.parent if name else path, car, name.session if name else 0].append(path)
    return [Session(car, number, tuple(sorted(paths))) for (_, car, number), paths in found.items()]


def ingest_sessions(dataset: Dataset, sessions: Sequence[Session], keyed: Keyed, *, roads: str, trim_m: float,
                    batch_rows: int = BATCH_ROWS) -> Counts:
    """Add what is new; the dataset is being written to by this process. Raises BadInput and OSError, and then what was
    committed stays."""
    counts, waiting = Counts(), _Waiting()
    past = _Past(dataset)
    for unread in _read_together(sessions, past, counts):
        columns = iter(columns_of([log for _, logs in unread for log in logs]))
        for session, logs in unread:
            _take(session, list(islice(columns, len(logs))), past, waiting, counts, keyed, trim_m)
            if waiting.count >= batch_rows:
                _commit(dataset, waiting, roads, trim_m)
                waiting = _Waiting()
    if waiting.ledger:
        _commit(dataset, waiting, roads, trim_m)
    return counts


def _read_together(sessions: Sequence[Session], past: _Past, counts: Counts
                   ) -> Iterator[list[tuple[Session, list[tuple[bytes, str]]]]]:
    """Sessions that are not known whole, and the bytes of their logs, some megabytes at a time."""
    together: list[tuple[Session, list[tuple[bytes, str]]]] = []
    size = 0
    for session in sessions:
        found = [read_bytes(log) for log in session.logs]
        counts.logs += len(found)
        if past.holds(session, [digest for _, digest in found]):
            counts.known_logs += len(found)
            continue
        together.append((session, found))
        size += sum(len(data) for data, _ in found)
        if size >= _TOGETHER_BYTES:
            yield together
            together, size = [], 0
    if together:
        yield together


def _take(session: Session, read: Sequence[LogColumns], past: _Past, waiting: _Waiting, counts: Counts,
          keyed: Keyed, trim_m: float) -> None:
    filed = filed_rows(_once(joined_columns([one.columns for one in read])), keyed, trim_m)
    rows = filed.columns
    known, contradicted = past.known(session, rows)
    new = ~(known | contradicted)
    rows = {name: values[new] for name, values in rows.items() if name in ROW_TYPES}
    count = int(new.sum())
    rows["car"] = np.full(count, session.car, dtype=np.int64)
    rows["session"] = np.full(count, session.number, dtype=np.int32)
    _say(session, read, filed, count, int(known.sum()), waiting, counts)
    counts.contradictions += int(contradicted.sum())
    waiting.rows.append(rows)
    waiting.count += count
    past.add(session, rows)


def _say(session: Session, read: Sequence[LogColumns], filed: Filed, added: int, repeated: int,
         waiting: _Waiting, counts: Counts) -> None:
    """What a ledger keeps of logs; figures of a session stand at its first log."""
    counts.added += added
    counts.repeated += repeated
    counts.undated += filed.undated
    counts.unplaced += filed.unplaced
    counts.trimmed += filed.trimmed
    for number, (log, one) in enumerate(zip(session.logs, read, strict=True)):
        counts.damaged_lines += one.damaged_lines
        of_session = {"rows": added, "undated": filed.undated, "unplaced": filed.unplaced, "trimmed": filed.trimmed,
                      "repeated": repeated}
        entry = {"car": session.car, "session": session.number, "log": log.name, "sha256": one.sha256,
                 "damaged_lines": one.damaged_lines} | {name: 0 if number else value
                                                        for name, value in of_session.items()}
        for name, value in entry.items():
            waiting.ledger[name].append(value)


def _commit(dataset: Dataset, waiting: _Waiting, roads: str, trim_m: float) -> None:
    dataset.commit(joined_columns(waiting.rows), waiting.ledger, roads, trim_m)


def _once(rows: dict[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """Each row once, of those that stand in two logs the first; one with its UTC before one without."""
    order = np.lexsort((rows["utc_us"] == 0, rows["segment"]))
    first = order[np.concatenate([[True], np.diff(rows["segment"][order]) != 0])] if len(order) else order
    first.sort()
    return {name: values[first] for name, values in rows.items()}


class _Past:
    """What a dataset, and what waits for its commit, holds of sessions."""

    def __init__(self, dataset: Dataset) -> None:
        self._dataset = dataset
        ledger = dataset.ledger()
        self._logs = set(zip(ledger["car"], ledger["session"], ledger["sha256"], strict=True))
        self._commits: dict[tuple[int, int], set[int]] = defaultdict(set)
        for car, session, commit in zip(ledger["car"], ledger["session"], ledger["commit"], strict=True):
            self._commits[car, session].add(commit)
        self._now: dict[tuple[int, int], list[npt.NDArray[np.int64]]] = defaultdict(list)

    def holds(self, session: Session, digests: Sequence[str]) -> bool:
        """Whether all these logs of a session are known; from now on they are."""
        logs = {(session.car, session.number, digest) for digest in digests}
        known = logs <= self._logs
        self._logs |= logs
        return known

    def add(self, session: Session, rows: Mapping[str, npt.NDArray[Any]]) -> None:
        self._now[session.car, session.number].append(
            np.stack([rows[name] for name in _MARKS], axis=1).astype(np.int64))

    def known(self, session: Session, rows: Mapping[str, npt.NDArray[Any]]
              ) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
        """Which rows are known, and which are by number and time, with another check value."""
        segment = rows["segment"]
        parts = [*self._now[session.car, session.number], *self._filed(session)]
        if not parts:
            return np.zeros(len(segment), dtype=np.bool_), np.zeros(len(segment), dtype=np.bool_)
        there = np.concatenate(parts)
        same = np.isin((segment << 32) | rows["crc32"], (there[:, 0] << 32) | there[:, 1])
        near = (there[:, 0] << 32) | (there[:, 2] // _SAME_US)
        when = (segment << 32) | (rows["utc_us"] // _SAME_US)
        return same, ~same & (np.isin(when, near) | np.isin(when - 1, near) | np.isin(when + 1, near))

    def _filed(self, session: Session) -> Iterator[npt.NDArray[np.int64]]:
        from pyarrow import parquet

        for number in sorted(self._commits.get((session.car, session.number), ())):
            for file in self._dataset.manifest.commits[number].files:
                table = parquet.read_table(
                    self._dataset.folder / file.path, columns=list(_MARKS), partitioning=None,
                    filters=[("car", "=", session.car), ("session", "=", session.number)])
                yield np.stack([table[name].to_numpy() for name in _MARKS], axis=1).astype(np.int64)
