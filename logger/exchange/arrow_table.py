"""Windows as a table of Apache Arrow, which the ``maps`` extra brings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from logger.errors import BadInput
from logger.exchange.fields import NAMES, values_of
from logger.exchange.windows import Windows
from logger.exchange.wkb import wkb

if TYPE_CHECKING:
    import pyarrow

GEOMETRY = "geometry"
_COUNTS = {"segment", "drive", "samples", "clipped_samples"}
_WORDS = {"log", "comfort", "iri_class", "flags"}
EXTRA = "{}: expected the 'maps' extra: pip install 'ridelog[maps]' ({})"


def arrow_table(windows: Windows, file: str) -> pyarrow.Table:
    """One row a window, with well-known binary as ``geometry``. BadInput that names the file where the extra is
    missing."""
    try:
        import pyarrow
    except ImportError as error:
        raise BadInput(EXTRA.format(file, error)) from None
    rows = [tuple(values_of(window)) for window in windows.rows]
    columns = list(zip(*rows, strict=True)) if rows else [()] * len(NAMES)
    table = {name: _column(pyarrow, name, values) for name, values in zip(NAMES, columns, strict=True)}
    table["t_utc"] = pyarrow.array([one.record.utc_us for one in windows.rows], pyarrow.timestamp("us", "UTC"))
    table[GEOMETRY] = pyarrow.array([wkb(window.geometry) for window in windows.rows], pyarrow.binary())
    return pyarrow.table(table)


def _column(pyarrow: Any, name: str, values: tuple[Any, ...]) -> Any:
    kind = pyarrow.string() if name in _WORDS or name == "t_utc" else (
        pyarrow.int64() if name in _COUNTS else pyarrow.float64())
    return pyarrow.array(values, kind)
