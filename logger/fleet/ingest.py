"""From logs to the rows of a dataset."""

import csv
import hmac
import io
import secrets
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from drivers.disk import open_regular
from logger.arrays import Array, Bools, Indices, Whole
from logger.errors import BadInput
from logger.files import read_bounded, replace_bytes
from logger.fleet.dataset import ROW_TYPES, Dataset
from logger.fleet.road_map import SEGMENT_M
from logger.geodesy import EARTH_RADIUS_M
from logger.printable import cell, word
from logger.report.summary import NOT_COUNTED
from logger.roads.sections import WindowErrors, errors_of_means
from logger.store.log.log_name import log_name
from logger.store.log.row_format import COLUMNS, FLAGS, HEADER, LATEST_US, scan
from logger.units import US_PER_S


def own_key(dataset: Path) -> bytes:
    """The key of a dataset, beside its folder, so that the folder can be given away without it; a new one where there
    is none. BadInput for one that is damaged."""
    key_bytes = 32
    path = dataset.with_name(f"{dataset.name}.key")
    if not path.exists():
        replace_bytes(path, f"{secrets.token_hex(key_bytes)}\n".encode("ascii"), 0o600)
    try:
        key = bytes.fromhex(read_bounded(path, 4096).decode("ascii").strip())
    except (ValueError, UnicodeDecodeError):
        key = b""
    if len(key) != key_bytes:
        raise BadInput(f"{path}: expected {2 * key_bytes} hexadecimal digits, the key of the cars' pseudonyms")
    return key


def pseudonym(name: str, key: bytes) -> int:
    """The number of a car, 63 bits.

    Who has the dataset alone cannot tell which car is which, nor try names. Its owner reads names: beside the key lies
    a table of them, by pseudonym. The number has 63 bits: among a million cars the chance of two alike is one in ten
    million.
    """
    return int.from_bytes(hmac.digest(key, name.encode("utf-8", "surrogateescape"), "sha256")[:8], "big") >> 1


def shown_car(number: int) -> str:
    """A pseudonym as it is printed."""
    return f"car-{number:016x}"


def names_path(dataset: Path) -> Path:
    """Where the names of a dataset's cars lie: beside its folder, as the key does."""
    return dataset.with_name(f"{dataset.name}.cars.csv")


def names_of(dataset: Path) -> Mapping[int, str]:
    """The cars' names by their numbers; none where the table is not there. BadInput for one that cannot be read."""
    most_bytes = 256 << 20
    path = names_path(dataset)
    if not path.exists():
        return {}
    try:
        rows = list(csv.reader(io.StringIO(read_bounded(path, most_bytes).decode("utf-8"), newline="")))
        return {int(car.removeprefix("car-"), 16): word(name) for car, name in rows[1:]}
    except (ValueError, csv.Error):
        raise BadInput(f"{path}: expected lines car,name as 'fleet ingest' writes them; remove the file and ingest the "
                       "logs again") from None


def keep_names(dataset: Path, names: Iterable[str], key: bytes) -> None:
    """Add the names of cars to the table. OSError if that fails."""
    known = names_of(dataset)
    found = dict(known) | {pseudonym(name, key): cell(word(name)) for name in names}
    if found != known:
        table = io.StringIO(newline="")
        rows = csv.writer(table, lineterminator="\n")
        rows.writerows([("car", "name"), *((shown_car(number), name) for number, name in sorted(found.items()))])
        replace_bytes(names_path(dataset), table.getvalue().encode())


_COUNTS = ("segment", "drive")
_NUMBERS = ("distance_start_m", "distance_end_m", "lat_deg", "lon_deg", "speed_mps", "iri_m_per_km", "iri_std_m_per_km",
            "a_w_mps2", "duration_s", "iri_level_std_m_per_km", "iri_common_std_m_per_km", "iri_place_std_m_per_km")
_LARGEST_COUNT = np.iinfo(np.int32).max  # Of a dataset's column; no logger counts so far
_LARGEST = {column.name: column.largest for column in COLUMNS}


@dataclass(frozen=True, eq=False)
class LogColumns:
    """Intact rows (n,) of one log.

    columns          by their names in the file, NaN: not known; ``utc_us`` (0: not known), ``t_us``, ``flags``,
                     ``crc32``
    damaged_lines    that were refused
    sha256           of the whole file
    """

    columns: Mapping[str, npt.NDArray[Any]]
    damaged_lines: int
    sha256: str


def read_bytes(log: Path) -> tuple[bytes, str]:
    """A log as it is, and its SHA-256. BadInput for one that cannot be opened."""
    try:
        with open_regular(log) as file:
            data = file.read()
    except OSError as error:
        raise BadInput(f"{log}: expected a segment log that can be read ({error.strerror})") from None
    return data, sha256(data).hexdigest()


def columns_of(logs: Sequence[tuple[bytes, str]]) -> list[LogColumns]:
    """The rows of logs, damaged or not, each given as its bytes and their digest.

    Problem: the reader of logs makes a record of each row, some 50 us; a year of a fleet would take days. Solution: the
    check values are compared line by line, and where all fit, Arrow reads the numbers. Where a line does not fit, or
    holds what no column may, the reader of logs judges the file row by row, so that both give the same rows; but a
    number that fits its check value and is spelt otherwise than a logger does (1e3) is taken here.
    """
    checked = [_checks(data) for data, _ in logs]
    sizes = [0 if one is None else len(one) for one in checked]
    whole = _quick([data for (data, _), one in zip(logs, checked, strict=True) if one is not None],
                   np.concatenate([one for one in checked if one is not None] or [np.zeros(0, np.int64)]))
    if whole is None and len(logs) > 1:
        return [one for log in logs for one in columns_of([log])]
    end = np.cumsum(sizes)
    return [LogColumns({name: values[last - size : last] for name, values in whole.items()}, 0, digest)
            if whole is not None and one is not None else LogColumns(*_row_by_row(data), digest)
            for (data, digest), one, size, last in zip(logs, checked, sizes, end.tolist(), strict=True)]


def _checks(data: bytes) -> Whole | None:
    """The check values of all lines; None where a line does not fit its own, or the header is another."""
    header, _, body = data.partition(b"\n")
    if header != HEADER.encode() or not body.endswith(b"\n"):
        return None
    lines, crc32 = body.splitlines(), zlib.crc32
    checks = [crc32(line[:-9]) for line in lines]
    if any(b",%08x" % check != line[-9:] for check, line in zip(checks, lines, strict=True)):
        return None
    return np.array(checks, dtype=np.int64)


def _quick(logs: Sequence[bytes], checks: Whole) -> dict[str, npt.NDArray[Any]] | None:
    """All rows of intact logs, read at once, as each reading costs; None where a row is not what Arrow reads."""
    import pyarrow
    from pyarrow import csv

    types = {name: pyarrow.int64() for name in _COUNTS} | {name: pyarrow.float64() for name in (*_NUMBERS, "t_s")}
    types |= {"t_utc": pyarrow.timestamp("us", "UTC"), "flags": pyarrow.string()}
    start = len(HEADER) + 1
    data = b"".join([HEADER.encode(), b"\n", *(memoryview(log)[start:] for log in logs)])
    try:
        table = csv.read_csv(
            io.BytesIO(data), csv.ReadOptions(use_threads=False, block_size=min(max(len(data), 1 << 20), 1 << 30)),
            csv.ParseOptions(quote_char=False, ignore_empty_lines=False),
            csv.ConvertOptions(include_columns=list(types), column_types=types, null_values=[""]))
    except pyarrow.ArrowInvalid:
        return None
    if len(table) != len(checks) or any(table[name].null_count for name in (*_COUNTS, "t_s", "duration_s")):
        return None
    columns: dict[str, npt.NDArray[Any]] = {name: table[name].to_numpy() for name in _COUNTS}
    if any((np.abs(columns[name]) > _LARGEST_COUNT).any() for name in _COUNTS):
        return None
    for name in (*_NUMBERS, "t_s"):
        nulls = table[name].null_count
        values = table[name].to_numpy()
        if np.isfinite(values).sum() != len(values) - nulls or (np.abs(values) > (_LARGEST[name] or 1e10)).any():
            return None
        columns[name] = values
    columns["t_us"] = np.round(columns.pop("t_s") * US_PER_S).astype(np.int64)
    columns["utc_us"] = table["t_utc"].cast(pyarrow.int64()).fill_null(0).to_numpy()
    if ((columns["utc_us"] < 0) | (columns["utc_us"] >= LATEST_US)).any():
        return None
    if not all(FLAGS.fullmatch(flags or "none") for flags in table["flags"].unique().to_pylist()):
        return None
    columns["flags"] = table["flags"].to_numpy(zero_copy_only=False)
    columns["crc32"] = checks
    return columns


def _row_by_row(data: bytes) -> tuple[dict[str, npt.NDArray[Any]], int]:
    records, checks, damaged = [], [], 0
    for row in scan(io.BytesIO(data)):
        if row.record is None or any(abs(getattr(row.record, name)) > _LARGEST_COUNT for name in _COUNTS):
            damaged += 1
        else:
            records.append(row.record)
            checks.append(int(row.text[-8:], 16))
    columns: dict[str, npt.NDArray[Any]] = {
        name: np.array([getattr(one, name) for one in records], dtype=np.int64) for name in (*_COUNTS, "t_us")}
    columns |= {name: np.array([getattr(one, name) for one in records], dtype=np.float64) for name in _NUMBERS}
    columns["utc_us"] = np.array([one.utc_us or 0 for one in records], dtype=np.int64)
    columns["flags"] = np.array(["|".join(one.flags) for one in records], dtype=object)
    columns["crc32"] = np.array(checks, dtype=np.int64)
    return columns, damaged


def joined_columns(parts: list[Mapping[str, npt.NDArray[Any]]]) -> dict[str, npt.NDArray[Any]]:
    """The rows of parts, one after the other."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


Columns = dict[str, npt.NDArray[Any]]
Keyed = Callable[[Array, Array, Array, Indices], Whole]
"""Latitudes, longitudes, directions (n,) [degrees] and numbers of drives, to keys of roads (n,)."""

ERRORS = ("iri_std_m_per_km", "iri_level_std_m_per_km", "iri_common_std_m_per_km", "iri_place_std_m_per_km")
"""Columns of the IRI's standard error and its parts."""


@dataclass(frozen=True, eq=False)
class Filed:
    """Rows (n,) to file, and how many were left out: without a date, without a place or direction, cut at the ends."""

    columns: Columns
    undated: int
    unplaced: int
    trimmed: int


def filed_rows(session: Mapping[str, npt.NDArray[Any]], keyed: Keyed, trim_m: float) -> Filed:
    """The rows of one session, all its logs together.

    A pass is a car once over a piece of road; its windows share the car's track, so passes, not windows, are what a
    standard error counts. The row in the middle of a pass carries its mean, so that a summary needs one grouping, not
    two.

    keyed     makes the keys of roads
    trim_m    how much of each drive's start and end is left out [m]
    """
    order = np.argsort(session["segment"], kind="stable")
    rows = {name: values[order] for name, values in session.items()}
    drive = np.cumsum(np.diff(rows["drive"], prepend=rows["drive"][:1]) != 0)
    kept = _inside(rows, drive, trim_m)
    trimmed = int(len(kept) - kept.sum())
    heading_deg = headings(rows["lat_deg"], rows["lon_deg"], drive)
    dated, placed = rows["utc_us"] > 0, np.isfinite(heading_deg)
    chosen = kept & dated & placed
    out: Columns = {name: values[chosen] for name, values in rows.items()}
    out["heading_deg"], drive = heading_deg[chosen], drive[chosen]
    out["road"] = keyed(out["lat_deg"], out["lon_deg"], out["heading_deg"], drive)
    out["length_m"] = out["distance_end_m"] - out["distance_start_m"]
    out |= _passes(out, drive)
    return Filed(out, int((kept & ~dated).sum()), int((kept & dated & ~placed).sum()), trimmed)


def headings(lat_deg: Array, lon_deg: Array, drive: Indices) -> Array:
    """Directions (n,) from the row before to the row after, clockwise from north [degrees]; NaN where no neighbour of
    the same drive has another place."""
    count = len(lat_deg)
    before, after = np.maximum(np.arange(count) - 1, 0), np.minimum(np.arange(count) + 1, count - 1)
    before = np.where((drive[before] == drive) & np.isfinite(lat_deg[before]), before, np.arange(count))
    after = np.where((drive[after] == drive) & np.isfinite(lat_deg[after]), after, np.arange(count))
    north = lat_deg[after] - lat_deg[before]
    east = (lon_deg[after] - lon_deg[before] + 180.0) % 360.0 - 180.0
    east = east * np.cos(np.radians(lat_deg))
    moved_m = np.hypot(north, east) * (np.pi / 180.0 * EARTH_RADIUS_M)
    least_move_m = 1.0
    return np.where(moved_m >= least_move_m, np.degrees(np.arctan2(east, north)) % 360.0, np.nan)


def _inside(rows: Mapping[str, npt.NDArray[Any]], drive: Indices, trim_m: float) -> Bools:
    """Which rows lie farther from the ends of their drive than is cut; rows without a distance count as none."""
    if not trim_m:
        return np.ones(len(drive), dtype=np.bool_)
    length_m = np.nan_to_num(rows["distance_end_m"] - rows["distance_start_m"])
    end_m = np.cumsum(length_m)
    first, last = np.searchsorted(drive, drive, side="left"), np.searchsorted(drive, drive, side="right") - 1
    from_start_m, to_end_m = end_m - length_m - (end_m - length_m)[first], end_m[last] - end_m
    return np.asarray((from_start_m >= trim_m) & (to_end_m >= trim_m))


def _passes(rows: Columns, drive: Indices) -> Columns:
    """Means over each pass, at the row in its middle; nothing at the others."""
    again_m = 5 * SEGMENT_M
    count = len(drive)
    known = np.isfinite(rows["iri_m_per_km"]) & np.isfinite(rows["iri_std_m_per_km"])
    counted = {text: NOT_COUNTED.isdisjoint((text or "").split("|")) for text in set(rows["flags"].tolist())}
    known &= np.array([counted[text] for text in rows["flags"].tolist()], dtype=bool)
    found = {name: np.full(count, np.nan) for name in ("pass_iri_m_per_km", "pass_iri_std_m_per_km", "pass_a_w_mps2")}
    windows = np.zeros(count, dtype=np.int64)
    row = np.flatnonzero(known)
    if not len(row):
        return {**found, "pass_windows": windows}
    along_m = np.cumsum(np.nan_to_num(rows["length_m"]))
    row = row[np.lexsort((row, rows["road"][row], drive[row]))]
    new = (np.diff(rows["road"][row]) != 0) | (np.diff(drive[row]) != 0) | (np.diff(along_m[row]) > again_m)
    number = np.cumsum(np.concatenate([[0], new]))
    size = np.bincount(number)
    middle = row[np.cumsum(size) - size + size // 2]

    def total(values: Array) -> Array:
        return np.asarray(np.bincount(number, values[row]), dtype=np.float64)

    windows[middle] = size
    found["pass_iri_m_per_km"][middle] = total(rows["iri_m_per_km"]) / size
    length_m = rows["length_m"]
    errors = errors_of_means(WindowErrors(*(rows[name] for name in ERRORS)), rows["iri_m_per_km"],
                             along_m - length_m / 2, length_m, row, length_m[row], number, len(size))
    found["pass_iri_std_m_per_km"][middle] = errors.std
    felt = total(np.isfinite(rows["a_w_mps2"]).astype(np.float64))
    square = total(np.nan_to_num(rows["a_w_mps2"]) ** 2)
    found["pass_a_w_mps2"][middle] = np.sqrt(np.divide(square, felt, out=np.full(len(size), np.nan), where=felt > 0))
    return {**found, "pass_windows": windows}


BATCH_ROWS = 500_000  # Rows of a commit, at least: some 300 MB while they are written


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
        name = log_name(path)
        found[path.parent if name else path, car, name.session if name else 0].append(path)
    return [Session(car, number, tuple(sorted(paths))) for (_, car, number), paths in found.items()]


def ingest_sessions(dataset: Dataset, sessions: Sequence[Session], keyed: Keyed, *, roads: str, trim_m: float,
                    batch_rows: int = BATCH_ROWS) -> Counts:
    """Add what is new; the dataset is being written to by this process. Raises BadInput and OSError, and then what was
    committed stays.

    A log whose bytes are known is skipped. Of a session that is known in part, rows are compared by number and
    check value; a row of the same number and time with another check value is a contradiction, counted, and the first
    one stays. So an ingest that was cut off goes on where it was when it is started again.
    """
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


def _read_together(sessions: Sequence[Session], past: "_Past", counts: Counts
                   ) -> Iterator[list[tuple[Session, list[tuple[bytes, str]]]]]:
    """Sessions that are not known whole, and the bytes of their logs, some megabytes at a time."""
    # Of logs that are read at once, at least: beyond it the cost of a reading no longer counts.
    together_bytes = 8 << 20
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
        if size >= together_bytes:
            yield together
            together, size = [], 0
    if together:
        yield together


def _take(session: Session, read: Sequence[LogColumns], past: "_Past", waiting: _Waiting, counts: Counts,
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
        self._now: dict[tuple[int, int], list[Whole]] = defaultdict(list)

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
              ) -> tuple[Bools, Bools]:
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

    def _filed(self, session: Session) -> Iterator[Whole]:
        from pyarrow import parquet

        for number in sorted(self._commits.get((session.car, session.number), ())):
            for file in self._dataset.manifest.commits[number].files:
                table = parquet.read_table(self._dataset.folder / file.path, columns=list(_MARKS), partitioning=None,
                                           filters=[("car", "=", session.car), ("session", "=", session.number)])
                yield np.stack([table[name].to_numpy() for name in _MARKS], axis=1).astype(np.int64)
