"""A layer as a table of Apache Arrow, which the ``maps`` extra brings."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Any

from logger.errors import BadInput
from logger.exchange.layer import Attribute, Kind, Layer, wkb

if TYPE_CHECKING:
    import pyarrow

GEOMETRY = "geometry"
EXTRA = "{}: expected the 'maps' extra: pip install 'ridelog[maps]' ({})"


def arrow_table(layer: Layer, file: str) -> pyarrow.Table:
    """One row a feature, with well-known binary as ``geometry``. BadInput that names the file where the extra is
    missing."""
    try:
        import pyarrow
    except ImportError as error:
        raise BadInput(EXTRA.format(file, error)) from None
    columns = list(zip(*(one.values for one in layer.features), strict=True)) or [()] * len(layer.fields)
    table = {field.name: _column(pyarrow, field, values)
             for field, values in zip(layer.fields, columns, strict=True)}
    table[GEOMETRY] = pyarrow.array([wkb(one.geometry) for one in layer.features], pyarrow.binary())
    return pyarrow.table(table)


def _column(pyarrow: Any, field: Attribute, values: tuple[Any, ...]) -> Any:
    if field.kind is Kind.TIME:
        times = [None if value is None else datetime.fromisoformat(value) for value in values]
        return pyarrow.array(times, pyarrow.timestamp("ms", "UTC"))
    kinds = {Kind.WORDS: pyarrow.string(), Kind.COUNT: pyarrow.int64(), Kind.NUMBER: pyarrow.float64()}
    return pyarrow.array(values, kinds[field.kind])
