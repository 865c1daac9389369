"""The same expressions on DuckDB and on Spark with workers of its own: the same figures."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import numpy as np
import pytest

from logger.api.fleet import fleet_summarise
from logger.errors import BadInput

from ..support.drives.fleet_town import drives, ingested, town

NO_SPARK = "needs the 'spark' extra and Java 17, and one of them is not here"
HAS_SPARK = importlib.util.find_spec("pyspark") is not None and shutil.which("java") is not None


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return ingested(drives(town(6, 400.0, 4, seed=3), 60, seed=4), tmp_path_factory.mktemp("town"))


@pytest.mark.slow
@pytest.mark.skipif(not HAS_SPARK, reason=NO_SPARK)
@pytest.mark.filterwarnings("ignore")  # of PySpark and of what it finds in this machine's Java
def test_spark_gives_the_same_figures(dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Few rows: two parts in the place of 200, and no second compilation of what runs once.
    (tmp_path / "spark-defaults.conf").write_text("spark.sql.shuffle.partitions 2\n")
    monkeypatch.setenv("SPARK_CONF_DIR", str(tmp_path))
    monkeypatch.setenv("JAVA_TOOL_OPTIONS", "-XX:TieredStopAtLevel=1 -XX:+UseSerialGC")
    ours, theirs = (fleet_summarise(dataset, by="section", since="2024-03-01", engine=one).found
                    for one in ("duckdb", "spark local-cluster[2,1,1024]"))
    assert (ours.windows, ours.withheld, ours.cars.tolist()) == (theirs.windows, theirs.withheld, theirs.cars.tolist())
    for name in ("gain", "log_std", "growth_per_year", "pass_std", "session_std"):
        assert np.allclose(getattr(ours.biases, name), getattr(theirs.biases, name), rtol=1e-9)
    for name in ("iri_m_per_km", "iri_std_m_per_km", "trend_m_per_km_per_year", "trend_std_m_per_km_per_year",
                 "a_w_mps2", "lat_deg", "passes"):
        assert np.allclose(getattr(ours.roads, name), getattr(theirs.roads, name), rtol=1e-7, equal_nan=True)
    assert (ours.roads.key == theirs.roads.key).all() and (ours.roads.visit == theirs.roads.visit).all()


@pytest.mark.slow
@pytest.mark.skipif(HAS_SPARK, reason="PySpark is here")
def test_spark_that_is_missing_is_asked_for(dataset: Path) -> None:
    with pytest.raises(BadInput, match="--engine spark: expected the 'spark' extra: pip install"):
        fleet_summarise(dataset, engine="spark local[2]")
