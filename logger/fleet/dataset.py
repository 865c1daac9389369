"""A dataset: Parquet files by month and coarse cell, and a manifest that says which of them count.

Problem. A file system may lose power, and a process may be killed, between any two steps of a change that touches
many files; and rows may be offered twice. Solution. New files are written under temporary names, waited for, renamed,
and only then named in the manifest, which is replaced as a whole. What no manifest names does not count, and is
removed by the next that writes. A commit's ledger says which logs and which sessions its files hold.

``month=2026-07/cell=1234/000001-0.parquet``: files by month, not by day: a fleet's day in a coarse cell is a few
thousand rows, and a reader pays for each file. ``--since`` and ``--until`` go by the days that the manifest has of
each file.

Engines that carry out the expressions: DuckDB in this process, or Spark where its master says.
"""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from logger.errors import BadInput
from logger.files import BESIDE, DISK, MAP_BYTES, make_folder, naming, read_bounded, replace_bytes
from logger.fleet.road_map import region_of
from logger.store.log.atomic_file import FolderLock
from logger.units import DAY_US

if TYPE_CHECKING:
    import ibis.expr.types as ir
    import pyarrow


EXTRA = "expected the 'fleet' extra: pip install 'ridelog[fleet]' ({})"
_MANIFEST = "manifest.json"
_FORMAT = 1
_EPOCH_MONTH = 1970 * 12
_ROWS_PATH = re.compile(r"month=[0-9]{4}-[0-9]{2}/cell=-?[0-9]{1,20}/[0-9]{6,12}-[0-9]{1,9}\.parquet")
_LEDGER_PATH = re.compile(r"ledger/[0-9]{6,12}\.parquet")

ROW_TYPES = {"road": "int64", "car": "int64", "session": "int32", "segment": "int32", "crc32": "int64",
             "drive": "int32", "utc_us": "int64", "lat_deg": "float64", "lon_deg": "float64", "heading_deg": "float32",
             "speed_mps": "float32", "length_m": "float32", "iri_m_per_km": "float32", "iri_std_m_per_km": "float32",
             "a_w_mps2": "float32", "flags": "string", "pass_windows": "int32", "pass_iri_m_per_km": "float64",
             "pass_iri_std_m_per_km": "float64", "pass_a_w_mps2": "float64"}
"""Columns of a row; NaN is written as not known."""
_LEDGER = ("car", "session", "log", "sha256", "rows", "damaged_lines", "undated", "unplaced", "trimmed", "repeated")


@dataclass(frozen=True)
class DataFile:
    """A file of rows: its path inside the dataset, its rows, the days that they are of."""

    path: str
    rows: int
    first_day: int
    last_day: int


@dataclass(frozen=True)
class Commit:
    """What one step of an ingest has added."""

    name: str
    ledger: str
    rows: int
    files: tuple[DataFile, ...]


@dataclass(frozen=True)
class DatasetManifest:
    """What counts in a dataset.

    roads    SHA-256 of the map that keys were made with; empty: cells
    """

    roads: str = ""
    trim_m: float = 0.0
    commits: tuple[Commit, ...] = field(default=())

    @property
    def rows(self) -> int:
        return sum(one.rows for one in self.commits)


class Dataset:
    """A folder that is a dataset, or is to be one."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.manifest = self._read()

    @property
    def is_new(self) -> bool:
        return not (self.folder / _MANIFEST).exists()

    def files(self, since_us: int | None = None, until_us: int | None = None) -> list[Path]:
        """The files with rows of days that touch a time [us since 1970]."""
        first = -np.inf if since_us is None else since_us // DAY_US
        last = np.inf if until_us is None else until_us // DAY_US
        return [self.folder / one.path for commit in self.manifest.commits for one in commit.files
                if one.last_day >= first and one.first_day <= last]

    def ledger(self) -> dict[str, list[Any]]:
        """What was ingested: columns of all commits' ledgers, and ``commit``, its place among the commits."""
        from pyarrow import parquet

        found: dict[str, list[Any]] = {name: [] for name in (*_LEDGER, "commit")}
        for number, commit in enumerate(self.manifest.commits):
            table = parquet.read_table(self.folder / commit.ledger, partitioning=None)
            for name in _LEDGER:
                found[name] += table[name].to_pylist()
            found["commit"] += [number] * len(table)
        return found

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Alone, and without what an ingest that was killed has left. BadInput where another writes."""
        make_folder(self.folder)
        strange = [one.name for one in self.folder.iterdir() if one.name != _MANIFEST and not one.name.startswith(
            (".", "month=", "ledger", "roads."))]
        if strange:
            raise BadInput(f"{self.folder}: expected a dataset or an empty folder, found {sorted(strange)[0]}")
        with FolderLock(self.folder):
            self.manifest = self._read()
            self._clear()
            try:
                yield
            finally:
                self._clear()

    def commit(self, rows: Mapping[str, npt.NDArray[Any]], ledger: Mapping[str, Sequence[Any]], roads: str,
               trim_m: float) -> None:
        """Add rows (n,) and what is said of their logs, whole or not at all."""
        import pyarrow

        last = self.manifest.commits[-1].name if self.manifest.commits else "0"
        name = f"{int(last) + 1:06d}"
        files = tuple(self._write_rows(name, rows)) if len(rows["road"]) else ()
        ledger_path = f"ledger/{name}.parquet"
        self._write(ledger_path, pyarrow.table({one: list(ledger[one]) for one in _LEDGER}))
        commit = Commit(name, ledger_path, sum(one.rows for one in files), files)
        self._replace(DatasetManifest(roads, trim_m, (*self.manifest.commits, commit)))

    def _replace(self, manifest: DatasetManifest) -> None:
        content = {"ridelog_fleet": _FORMAT, **asdict(manifest)}
        replace_bytes(self.folder / _MANIFEST, json.dumps(content, separators=(",", ":")).encode())
        self.manifest = manifest

    def _write_rows(self, commit: str, rows: Mapping[str, npt.NDArray[Any]]) -> Iterator[DataFile]:
        """Files by month and coarse cell; rows by road inside, so that they pack well and a road is found quickly."""
        day = rows["utc_us"] // DAY_US
        month = rows["utc_us"].astype("datetime64[us]").astype("datetime64[M]").astype(np.int64)
        region = region_of(rows["lat_deg"], rows["lon_deg"])
        order = np.lexsort((rows["utc_us"], rows["road"], region, month))
        table = arrow_rows({name: values[order] for name, values in rows.items()})
        month, region, day = month[order], region[order], day[order]
        starts = np.flatnonzero(np.concatenate([[True], (np.diff(month) != 0) | (np.diff(region) != 0)]))
        for number, (start, end) in enumerate(zip(starts, [*starts[1:], len(order)], strict=True)):
            year, of_year = divmod(int(month[start]) + _EPOCH_MONTH, 12)
            path = f"month={year:04d}-{of_year + 1:02d}/cell={int(region[start])}/{commit}-{number}.parquet"
            self._write(path, table.slice(start, end - start))
            yield DataFile(path, int(end - start), int(day[start:end].min()), int(day[start:end].max()))

    def _write(self, path: str, table: pyarrow.Table) -> None:
        from pyarrow import parquet

        whole, made = self.folder / path, BytesIO()
        parquet.write_table(table, made, compression="zstd")
        make_folder(whole.parent)
        replace_bytes(whole, made.getvalue())
        with naming(whole):
            DISK.sync_directory(whole.parent)

    def _clear(self) -> None:
        """Remove files that no manifest names."""
        named = {self.folder / one.path for commit in self.manifest.commits for one in commit.files}
        named |= {self.folder / commit.ledger for commit in self.manifest.commits}
        for path in [*self.folder.glob("month=*/cell=*/*"), *self.folder.glob("ledger/*"),
                     *self.folder.glob(f"{BESIDE}*"), *self.folder.glob(f".{_MANIFEST}.*")]:
            if path not in named:
                path.unlink()
        for folder in [*self.folder.glob("month=*/cell=*"), *self.folder.glob("month=*"), self.folder / "ledger"]:
            if folder.is_dir() and not any(folder.iterdir()):
                folder.rmdir()

    def _read(self) -> DatasetManifest:
        path = self.folder / _MANIFEST
        if not path.exists():
            return DatasetManifest()
        try:
            content = json.loads(read_bounded(path, MAP_BYTES))
            if content["ridelog_fleet"] != _FORMAT:
                raise ValueError
            commits = tuple(Commit(one["name"], _inside(one["ledger"], _LEDGER_PATH), int(one["rows"]), tuple(
                DataFile(_inside(file["path"], _ROWS_PATH), int(file["rows"]), int(file["first_day"]),
                         int(file["last_day"]))
                for file in one["files"])) for one in content["commits"])
            return DatasetManifest(str(content["roads"]), float(content["trim_m"]), commits)
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
            raise BadInput(f"{path}: expected the manifest of a fleet's dataset, format {_FORMAT}") from None


def _inside(path: str, own: re.Pattern[str]) -> str:
    """A path that a dataset has given itself: a manifest cannot point anywhere else. ValueError for another."""
    if not own.fullmatch(path):
        raise ValueError
    return path


def existing(folder: Path) -> Dataset:
    """A dataset that is there. BadInput for none, or one without a row."""
    if not (folder / _MANIFEST).is_file():
        raise BadInput(f"{folder}: expected a dataset that 'ridelog fleet ingest' has made, found no {_MANIFEST}")
    found = Dataset(folder)
    if not found.manifest.rows:
        raise BadInput(f"{folder}: expected a dataset with at least one row")
    return found


def arrow_rows(rows: Mapping[str, npt.NDArray[Any]]) -> pyarrow.Table:
    """Columns as a table of the dataset's types."""
    import pyarrow

    return pyarrow.table({name: pyarrow.array(rows[name], from_pandas=True).cast(getattr(pyarrow, kind)())
                          for name, kind in ROW_TYPES.items()})


MEMORY = "1GB"  # What DuckDB may hold; beyond it, it writes to a temporary folder
_NAME = "fleet_rows"


class Engine:
    """A connection and the rows of some files. ``name``: duckdb or spark."""

    def __init__(self, name: str, connection: Any, rows: ir.Table) -> None:
        self.name, self.rows = name, rows
        self._connection = connection

    def arrays(self, expression: ir.Table) -> dict[str, Any]:
        """The columns of a result as NumPy arrays."""
        table = self._connection.to_pyarrow(expression)
        return {name: table[name].to_numpy() for name in table.column_names}

    @contextmanager
    def kept(self, expression: ir.Table) -> Iterator[ir.Table]:
        """A result that the engine computes once and keeps until the end of the block."""
        kept = expression.cache()
        try:
            yield kept
        finally:
            kept.release()


@contextmanager
def opened(files: Sequence[Path], engine: str) -> Iterator[Engine]:
    """An engine with the rows of files.

    engine    ``duckdb``, or a master of Spark: ``spark://host:7077``, or ``spark`` and what a master is called
              (``spark local[2]``, ``spark local-cluster[2,1,1024]``, ``spark yarn``)

    BadInput for another engine, or where the libraries are missing.
    """
    try:
        import ibis
    except ImportError as error:
        raise BadInput(f"fleet: {EXTRA.format(error)}") from None
    if engine == "duckdb":
        with tempfile.TemporaryDirectory(prefix="ridelog-fleet-") as folder:
            connection = ibis.duckdb.connect(memory_limit=MEMORY, temp_directory=folder, preserve_insertion_order=False)
            try:
                rows = connection.read_parquet([str(path) for path in files], table_name=_NAME, hive_partitioning=False)
                yield Engine("duckdb", connection, rows)
            finally:
                connection.disconnect()
        return
    word, _, master = engine.partition(" ")
    if engine.startswith("spark://"):
        master = engine
    elif word != "spark" or not master:
        raise BadInput(f"--engine {engine}: expected duckdb, spark://HOST:PORT, or 'spark MASTER' such as "
                       "'spark local[2]'")
    with _spark(master) as session:
        session.read.parquet(*(str(path.resolve()) for path in files)).createOrReplaceTempView(_NAME)
        connection = ibis.pyspark.connect(session)
        yield Engine("spark", connection, connection.table(_NAME))


@contextmanager
def _spark(master: str) -> Iterator[Any]:
    try:
        from pyspark.sql import SparkSession
    except ImportError as error:
        raise BadInput(f"--engine spark: expected the 'spark' extra: pip install 'ridelog[spark]' ({error})") from None
    from py4j.protocol import Py4JError
    from pyspark.errors import PySparkException

    try:
        session = (SparkSession.builder.master(master).appName("ridelog fleet")
                   .config("spark.ui.enabled", "false").config("spark.sql.session.timeZone", "UTC")
                   .config("spark.sql.execution.arrow.pyspark.enabled", "true").getOrCreate())
        session.sparkContext.setLogLevel("ERROR")
    except (Py4JError, PySparkException):
        raise BadInput(f"--engine: expected a master of Spark that answers, found none at {master}") from None
    try:
        yield session
    finally:
        session.stop()
