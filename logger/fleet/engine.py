"""Engines that carry out the expressions: DuckDB in this process, or Spark where its master says."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.errors import BadInput
from logger.fleet.dataset import EXTRA

if TYPE_CHECKING:
    import ibis.expr.types as ir

MEMORY = "1GB"
"""What DuckDB may hold; beyond it, it writes to a temporary folder."""
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
