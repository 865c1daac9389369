"""Numbers of pairs as shaded cells, for a page: what remains of one effect when another is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

from logger.chart_data import Array
from logger.report.html import Html, concatenated, html

_CELL_PX, _HIGH_PX, _LEFT_PX, _TOP_PX, _ROOM_PX = 40, 24, 190, 150, 60
_FAINTEST, _DARKEST = 0.12, 0.9
_WHITE_FROM = 0.5


def heat_map(title: str, names: Sequence[str], values: Array, least: float, full: float) -> Html:
    """The figure element of values (n, n): one row and one column for each name, the diagonal framed.

    What is below ``least`` is red, what is above it blue, and darker up to ``full``.
    """
    width, height = _LEFT_PX + _CELL_PX * len(names) + _ROOM_PX, _TOP_PX + _HIGH_PX * len(names) + 8
    heads = concatenated(
        html('<text transform="translate({:.0f} {}) rotate(-55)">{}</text>', _LEFT_PX + _CELL_PX * (column + 0.5),
             _TOP_PX - 8, name) for column, name in enumerate(names))
    rows = concatenated(
        html('<text x="{}" y="{}" text-anchor="end">{}</text>', _LEFT_PX - 8, _TOP_PX + _HIGH_PX * row + 17, name)
        + concatenated(_cell(row, column, float(values[row, column]), least, full) for column in range(len(names)))
        for row, name in enumerate(names))
    return html('<figure><figcaption>{}</figcaption><svg class="plot" viewBox="0 0 {} {}" role="img" aria-label="{}">'
                "{}{}</svg></figure>", title, width, height, title, heads, rows)


def _cell(row: int, column: int, value: float, least: float, full: float) -> Html:
    x, y = _LEFT_PX + _CELL_PX * column, _TOP_PX + _HIGH_PX * row
    share = min(max(log(max(value, least) / least) / log(full / least), 0.0), 1.0)
    shade = _FAINTEST + (_DARKEST - _FAINTEST) * share if value >= least else 0.35 * (1 - value / least) + _FAINTEST
    colour = "--c0" if value >= least else "--c4"
    frame = "stroke:var(--ink);stroke-width:1.5" if row == column else "stroke:none"
    ink = "#fff" if shade > _WHITE_FROM else "var(--ink)"
    return html('<rect x="{}" y="{}" width="{}" height="{}" style="fill:var({});fill-opacity:{:.2f};{}"/>'
                '<text x="{}" y="{}" text-anchor="middle" style="fill:{};font-size:11px">{}</text>',
                x + 1, y + 1, _CELL_PX - 2, _HIGH_PX - 2, colour, shade, frame, x + _CELL_PX // 2, y + 16, ink,
                f"{value:.1f}" if value < 10 else f"{value:.0f}")
