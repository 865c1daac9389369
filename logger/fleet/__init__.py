"""Many cars over years: verified rows in a dataset of Parquet files, and the figures of its roads by an existing engine
(DuckDB in this process, or Spark)."""
