"""Comma-separated values (RFC 4180), for spreadsheets and scripts: a header and a line a row, empty where nothing is
known."""

from __future__ import annotations

import csv
from pathlib import Path

from logger.exchange.format import Format
from logger.exchange.layer import Layer
from logger.printable import cell


class Csv(Format):
    """A table."""

    name = "csv"
    title = "a table of all rows, for spreadsheets"

    def write(self, layer: Layer, path: Path) -> None:
        with path.open("w", encoding="utf-8", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(layer.names)
            table.writerows([cell(value) if isinstance(value, str) else value for value in one.values]
                            for one in layer.features)


FORMAT = Csv()
