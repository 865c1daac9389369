"""GPX 1.1: a track a drive, a segment a stretch without a gap, a point a row, with its values as extensions.

A point's time is that of the window's middle, where the point lies.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

from logger.exchange.fields import NAMES, values_of
from logger.exchange.format import Format
from logger.exchange.windows import Window, Windows
from logger.store.log.log_reader import iso_utc, joined

_SPACE = "urn:x-ridelog:windows:1"
_IN_THE_POINT = {"lat_deg", "lon_deg", "t_utc"}


class Gpx(Format):
    """Tracks."""

    name = "gpx"
    title = "tracks, for navigation devices and programs"

    def write(self, windows: Windows, path: Path) -> None:
        with path.open("w", encoding="utf-8") as file:
            file.write('<?xml version="1.0" encoding="UTF-8"?>\n<gpx version="1.1" creator="ridelog" '
                       f'xmlns="http://www.topografix.com/GPX/1/1" xmlns:ridelog="{_SPACE}">\n')
            for (log, drive), rows in groupby(windows.rows, lambda row: (row.log, row.drive)):
                file.write(f"<trk><name>{escape(log)}, drive {drive}</name>\n")
                file.writelines(_segments(list(rows)))
                file.write("</trk>\n")
            file.write("</gpx>\n")


def _segments(rows: list[Window]) -> Iterator[str]:
    of = {id(row.record): row for row in rows}
    for piece in joined([row.record for row in rows]):
        yield "<trkseg>\n"
        yield from (_point(of[id(record)]) for record in piece)
        yield "</trkseg>\n"


def _point(row: Window) -> str:
    record = row.record
    middle_us = None if record.utc_us is None else record.utc_us + round(5e5 * record.duration_s)
    time = "" if middle_us is None else f"<time>{iso_utc(middle_us)}</time>"
    values = "".join(f"<ridelog:{name}>{escape(str(value))}</ridelog:{name}>"
                     for name, value in zip(NAMES, values_of(row), strict=True)
                     if name not in _IN_THE_POINT and value not in (None, ""))
    return (f"<trkpt lat={quoteattr(f'{record.lat_deg:.7f}')} lon={quoteattr(f'{record.lon_deg:.7f}')}>{time}"
            f"<extensions>{values}</extensions></trkpt>\n")


FORMAT = Gpx()
