"""Comma-separated values (RFC 4180), for spreadsheets and scripts: a header and a line a row, empty where nothing is
known."""

import csv
from collections.abc import Iterator
from io import StringIO

from logger.exchange.layer import Format, Layer
from logger.printable import cell


class Csv(Format):
    """A table."""

    name = "csv"
    title = "a table of all rows, for spreadsheets"

    def content(self, layer: Layer, file: str) -> Iterator[bytes]:
        text = StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(layer.names)
        table.writerows([cell(value) if isinstance(value, str) else value for value in one.values]
                        for one in layer.features)
        yield text.getvalue().encode()


FORMAT = Csv()
