"""What other programs are given of a row: the columns of the log by their names there, and where the row is from.

Standard names and units stay as in the log; the row's check value stays there.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from logger.exchange.windows import Window
from logger.store.log.log_reader import iso_utc
from logger.store.log.row_format import COLUMNS
from logger.units import US_PER_S

LOG = "log"
NAMES = (LOG, *(column.name for column in COLUMNS))


def values_of(window: Window) -> Iterator[Any]:
    """In the order of ``NAMES``: texts, whole numbers, numbers, and None for what is not known."""
    yield window.log
    for column in COLUMNS:
        value = getattr(window.record, column.attribute)
        if column.name == "t_utc":
            yield iso_utc(value)
        elif column.name == "t_s":
            yield value / US_PER_S
        elif column.name == "flags":
            yield "|".join(value)
        else:
            yield None if value == "" else value
