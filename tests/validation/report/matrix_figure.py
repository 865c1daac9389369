"""A confusion matrix as SVG text, for a page of its style or alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

_CELL, _LEFT, _TOP, _ROOM, _LAST_LABEL = 26, 190, 170, 12, 40
_RIGHT_COLOUR, _WRONG_COLOUR, _INK, _SOFT, _LINE = (
    "var(--c0,#2f6db5)", "var(--c4,#d0402b)", "var(--ink,#1d242b)", "var(--soft,#5c6873)", "var(--faint,#dfe4e8)")
_FONT = "font-family:system-ui,sans-serif;font-size:12px"
_LEAST_SHADE = 0.25

Counts = Mapping[tuple[str, str], int]


def matrix_figure(title: str, rows: Sequence[str], columns: Sequence[str], counts: Counts,
                  good: Mapping[str, str]) -> str:
    """The SVG element: what was hidden (rows), what was said (columns), how often; ``good``: the right column of a
    row. Right answers are blue, wrong ones red, and stronger the larger their share of the row."""
    width, height = _LEFT + _CELL * len(columns) + _LAST_LABEL, _TOP + _CELL * len(rows) + _ROOM
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" '
             f'aria-label="{escape(title)}">']
    for j, column in enumerate(columns):
        x = _LEFT + _CELL * (j + 0.5) + 4
        parts.append(f'<text style="{_FONT};fill:{_SOFT}" transform="translate({x:.0f} {_TOP - 8}) rotate(-60)">'
                     f"{escape(column)}</text>")
    for i, row in enumerate(rows):
        y = _TOP + _CELL * i
        parts.append(f'<text style="{_FONT};fill:{_SOFT}" x="{_LEFT - 8}" y="{y + 17}" text-anchor="end">{escape(row)}'
                     "</text>")
        whole = sum(counts.get((row, column), 0) for column in columns) or 1
        for j, column in enumerate(columns):
            parts += _cell(_LEFT + _CELL * j, y, counts.get((row, column), 0), whole, good[row] == column)
    return "".join(parts) + "</svg>"


def _cell(x: int, y: int, count: int, whole: int, right: bool) -> list[str]:
    frame = f'x="{x + 1}" y="{y + 1}" width="{_CELL - 2}" height="{_CELL - 2}"'
    if not count:
        return [f'<rect {frame} style="fill:{_LINE};fill-opacity:{0.9 if right else 0.35}"/>']
    shade = _LEAST_SHADE + (0.85 - _LEAST_SHADE) * count / whole
    ink = "#fff" if shade > 0.5 else _INK
    return [f'<rect {frame} style="fill:{_RIGHT_COLOUR if right else _WRONG_COLOUR};fill-opacity:{shade:.2f}"/>',
            f'<text style="{_FONT};fill:{ink}" x="{x + _CELL // 2}" y="{y + 17}" text-anchor="middle">{count}'
            "</text>"]
