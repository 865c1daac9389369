"""Promises that every file in ``logger/exchange/formats`` keeps: a newcomer is tried by them at once."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import pyogrio
import pytest
from pyogrio.errors import DataSourceError

from logger.exchange.layer import formats, windows_layer, write_layer
from logger.store.log.log_reader import LoggedFile

from .test_convert import drive, eastwards

COLUMN = "iri_m_per_km"
IRI_M_PER_KM = tuple(2.1037 + 0.0101 * number for number in range(6))
NOT_KNOWN = 2


@pytest.fixture(params=list(formats()))
def file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Six rows across the 180th meridian, each with an IRI of its own; one of them is not known."""
    known = [None if number == NOT_KNOWN else round(value, 4) for number, value in enumerate(IRI_M_PER_KM)]
    rows = [replace(row, iri_m_per_km=iri)
            for row, iri in zip(drive(eastwards(-16.9, 179.9998, 6)), known, strict=True)]
    path = tmp_path / f"rows.{request.param}"
    write_layer(windows_layer([LoggedFile("00001-001.csv", rows, 0, None)]), path)
    return path


def layers(path: Path) -> list[str]:
    """What GDAL finds in a file; nothing where it does not know such files."""
    try:
        return [str(name) for name, _ in pyogrio.list_layers(path)]
    except DataSourceError:
        return []


def values(path: Path) -> list[Any]:
    """The IRI of each row of a file that is no text."""
    tables = [pyogrio.read_arrow(path, layer=layer)[1] for layer in layers(path)] or [pyarrow.parquet.read_table(path)]
    return [value for table in tables for value in table[COLUMN].to_pylist()]


def text_of(path: Path) -> str:
    """A file's text; empty where it is none."""
    data = path.read_bytes()
    return "" if b"\0" in data else data.decode("utf-8")


def test_every_row_is_kept_and_what_is_not_known_is_empty(file: Path) -> None:
    known = [str(round(value, 4)) for number, value in enumerate(IRI_M_PER_KM) if number != NOT_KNOWN]
    if text := text_of(file):
        assert re.findall(rf"(?<![\d.])(?:{'|'.join(map(re.escape, known))})(?!\d)", text) == known
        assert not re.search(r"(?<!\w)(nan|none|inf)(?!\w)", text, re.IGNORECASE)
    else:
        assert [None if value is None else str(value) for value in values(file)] == [
            *known[:NOT_KNOWN], None, *known[NOT_KNOWN:]]


def test_lines_are_cut_at_the_meridian_where_gdal_reads_the_file(file: Path) -> None:
    found = layers(file)
    assert found or file.suffix == ".parquet"  # the wheels' GDAL is built without it
    for layer in found:
        if pyogrio.read_info(file, layer=layer)["geometry_type"] is None:
            continue
        _, (west, _, east, _) = pyogrio.read_bounds(file, layer=layer)
        assert ((east - west < 1) | ((west == -180) & (east == 180)))[~np.isnan(west)].all() or layer in WHOLE


WHOLE = ("tracks",)
"""Layers that GDAL makes itself of all points of a track."""
