"""Comma-separated values (RFC 4180), for spreadsheets and scripts: a header and a line a row, empty where nothing is
known."""

from __future__ import annotations

import csv
from pathlib import Path

from logger.exchange.fields import NAMES, values_of
from logger.exchange.format import Format
from logger.exchange.windows import Windows


class Csv(Format):
    """A table."""

    name = "csv"
    title = "a table of all rows, for spreadsheets"

    def write(self, windows: Windows, path: Path) -> None:
        with path.open("w", encoding="utf-8", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(NAMES)
            table.writerows(values_of(window) for window in windows.rows)


FORMAT = Csv()
