"""Pictures of studies as SVG text, in the style of the report's pages: lines over an axis, and shades over a grid.

Colours are classes that the page's style sheet fills in, so that one picture reads on light and on dark ground.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from math import ceil, floor

import numpy as np

from logger.report.figures import nice_step
from logger.studies.study import Array, Curves, Field, Line, Picture

WIDTH, HEIGHT = 1000, 420
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 170, 20, 44
_COLOURS = 8
_ABOUT = 6
_KEY_PX = 20

STYLE = """
.thick{fill:none;stroke-width:2;stroke-linejoin:round}.spread{stroke:none;fill:var(--c1);fill-opacity:.3}
.cell{fill:var(--c0)}
"""


def picture(one: Picture) -> str:
    """The figure element of a picture."""
    drawn = _field(one) if isinstance(one, Field) else _curves(one)
    return (f'<figure><figcaption>{escape(one.title)}</figcaption><svg class="plot" viewBox="0 0 {WIDTH} {HEIGHT}" '
            f'role="img" aria-label="{escape(one.title)}">{drawn}</svg></figure>')


@dataclass(frozen=True)
class _Frame:
    """The place of values on the picture: from the low to the high end of both axes."""

    x_low: float
    x_high: float
    y_low: float
    y_high: float

    def x(self, value: float) -> float:
        return _LEFT + (WIDTH - _LEFT - _RIGHT) * (value - self.x_low) / (self.x_high - self.x_low)

    def y(self, value: float) -> float:
        """Values beyond the frame are drawn on its edge."""
        share = min(max((value - self.y_low) / (self.y_high - self.y_low), 0.0), 1.0)
        return _TOP + (HEIGHT - _TOP - _BOTTOM) * (1 - share)


def _curves(one: Curves) -> str:
    ys = [line.y for line in one.lines]
    ys += [line.y + sign * line.errors for line in one.lines if line.errors is not None for sign in (-1, 1)]
    ys += [np.array([one.level[0]])] if one.level else []
    y_low, y_high = _ends(np.concatenate(ys))
    x_low, x_high = _ends(np.concatenate([line.x for line in one.lines]))
    frame = _Frame(x_low, x_high, y_low, y_high)
    parts = _axes(frame, one.x_name, one.y_name)
    if one.level:
        y = frame.y(one.level[0])
        parts.append(f'<path class="level" d="M{_LEFT} {y:.1f}H{WIDTH - _RIGHT}"/>'
                     f'<text class="tick" x="{WIDTH - _RIGHT + 6}" y="{y + 4:.1f}">{escape(one.level[1])}</text>')
    for number, line in enumerate(one.lines):
        parts += _line(frame, line, number)
    parts += _key([line.name for line in one.lines], below_px=frame.y(one.level[0]) if one.level else None)
    return "".join(parts)


def _line(frame: _Frame, line: Line, number: int) -> list[str]:
    parts = []
    if line.errors is not None:
        edges = [*zip(line.x, line.y + line.errors, strict=True),
                 *reversed(list(zip(line.x, line.y - line.errors, strict=True)))]
        parts.append(f'<path class="spread" d="M{_points(frame, edges)}z"/>')
    if line.dots:
        return parts + [f'<circle class="dot" cx="{frame.x(x):.1f}" cy="{frame.y(y):.1f}" r="4" '
                        f'style="fill:var(--c{number % _COLOURS})"/>' for x, y in zip(line.x, line.y, strict=True)]
    points = _points(frame, zip(line.x, line.y, strict=True))
    return [*parts, f'<path class="thick s{number % _COLOURS}" d="M{points}"/>']


def _points(frame: _Frame, points: Iterable[tuple[float, float]]) -> str:
    return " ".join(f"{frame.x(x):.1f} {frame.y(y):.1f}" for x, y in points)


def _key(names: list[str], below_px: float | None) -> list[str]:
    """What the lines are, at the right; out of the way of a level's name."""
    top = HEIGHT - _BOTTOM - _KEY_PX * len(names) if below_px is not None and below_px < HEIGHT / 2 else _TOP + 10
    x = WIDTH - _RIGHT + 6
    return [f'<path class="thick s{number % _COLOURS}" d="M{x} {top + _KEY_PX * number}h14"/>'
            f'<text class="tick" x="{x + 20}" y="{top + _KEY_PX * number + 4}">{escape(name)}</text>'
            for number, name in enumerate(names)]


def _field(one: Field) -> str:
    x_edges, y_edges = _edges(one.x), _edges(one.y)
    frame = _Frame(float(x_edges[0]), float(x_edges[-1]), float(y_edges[0]), float(y_edges[-1]))
    parts = []
    for (low, high), row in zip(pairwise(y_edges), one.values, strict=True):
        for (left, right), value in zip(pairwise(x_edges), row, strict=True):
            share = 1.0 if not np.isfinite(value) else min(max(float(value) / one.top, 0.0), 1.0)
            parts.append(f'<rect class="cell" x="{frame.x(left):.1f}" y="{frame.y(high):.1f}" '
                         f'width="{frame.x(right) - frame.x(left):.1f}" height="{frame.y(low) - frame.y(high):.1f}" '
                         f'fill-opacity="{1 - share:.2f}"/>')
    parts += _axes(frame, one.x_name, one.y_name)
    x = WIDTH - _RIGHT + 10
    for number in range(_ABOUT):
        share = number / (_ABOUT - 1)
        y = _TOP + 30 + _KEY_PX * number
        more = " and more" if share == 1 else ""
        parts.append(f'<rect class="cell" x="{x}" y="{y - 9}" width="14" height="14" fill-opacity="{1 - share:.2f}"/>'
                     f'<text class="tick" x="{x + 20}" y="{y + 2}">{share * one.top:g}{more}</text>')
    return "".join(parts) + f'<text class="tick" x="{x}" y="{_TOP + 6}">{escape(one.value_name)}</text>'


def _edges(centres: Array) -> Array:
    """Edges (n + 1,) of cells around increasing centres (n,), n > 1."""
    between = (centres[1:] + centres[:-1]) / 2
    return np.concatenate([[2 * centres[0] - between[0]], between, [2 * centres[-1] - between[-1]]])


def _ends(values: Array) -> tuple[float, float]:
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    room = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
    return low - room, high + room


def _axes(frame: _Frame, x_name: str, y_name: str) -> list[str]:
    right, bottom = WIDTH - _RIGHT, HEIGHT - _BOTTOM
    parts = [f'<path class="grid" d="M{_LEFT} {frame.y(tick):.1f}H{right}"/>'
             f'<text class="tick" x="{_LEFT - 8}" y="{frame.y(tick) + 4:.1f}" text-anchor="end">{tick:g}</text>'
             for tick in _ticks(frame.y_low, frame.y_high)]
    parts += [f'<text class="tick" x="{frame.x(tick):.1f}" y="{bottom + 18}" text-anchor="middle">{tick:g}</text>'
              for tick in _ticks(frame.x_low, frame.x_high)]
    return [*parts, f'<text class="tick" x="{right}" y="{HEIGHT - 6}" text-anchor="end">{escape(x_name)}</text>',
            f'<text class="tick" x="{_LEFT}" y="{_TOP - 6}">{escape(y_name)}</text>']


def _ticks(low: float, high: float) -> list[float]:
    step = nice_step((high - low) / _ABOUT)
    return [float(f"{index * step:.12g}") for index in range(ceil(low / step), floor(high / step) + 1)]
