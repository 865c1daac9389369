"""Plots against distance as SVG text, all in one style.

A figure is drawn in units of about one pixel on a desk's screen and scales with the page. Colours are not in it: they
are classes that the page's style sheet fills in, so that one picture reads on light and on dark ground.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor, log10

WIDTH = 1000
_HEIGHT = 190
_LEFT, _RIGHT, _TOP, _BOTTOM = 46, 60, 14, 34
_NAME_ROOM = 11
MAX_POINTS = 4000
"""More points than this are drawn as means of neighbours: a screen has no more columns."""

Value = float | None


@dataclass(frozen=True)
class Level:
    """A faint line across a plot at a value that has a name."""

    value: float
    name: str


@dataclass(frozen=True)
class Plot:
    """What is drawn: one line over the distance, perhaps with a band of its standard error.

    along_m    (n,) distance [m], rising
    values     (n,) None where not known; the line is broken there
    errors     (n,) standard errors; empty: no band
    breaks     indices at which a new line begins (a new drive)
    marks      (distance [m], value, text) of numbered points
    """

    title: str
    unit: str
    along_m: Sequence[float]
    values: Sequence[Value]
    errors: Sequence[Value] = ()
    levels: Sequence[Level] = ()
    breaks: Sequence[int] = ()
    marks: Sequence[tuple[float, float, str]] = ()


def line_figure(plot: Plot) -> str:
    """The SVG element of a plot."""
    along_m, values, errors, group = _thinned(plot)
    top = max((value for value in values if value is not None), default=1.0) * 1.05 or 1.0
    end_m = max(plot.along_m, default=1.0) or 1.0
    y_ticks, x_ticks = nice_ticks(top, 5), nice_ticks(end_m / 1000, 8)
    frame = _Frame(end_m, max(top, y_ticks[-1]))
    runs = _runs(values, {index // group for index in plot.breaks})
    parts = [f'<svg class="plot" viewBox="0 0 {WIDTH} {_HEIGHT}" role="img" aria-label="{escape(plot.title)}">']
    parts += [f'<path class="grid" d="M{_LEFT} {frame.y(tick):.1f}H{WIDTH - _RIGHT}"/>'
              f'<text class="tick" x="{_LEFT - 8}" y="{frame.y(tick) + 4:.1f}" text-anchor="end">{tick:g}</text>'
              for tick in y_ticks]
    parts += [f'<text class="tick" x="{frame.x(tick * 1000):.1f}" y="{_HEIGHT - _BOTTOM + 18}" '
              f'text-anchor="middle">{tick:g}</text>' for tick in x_ticks]
    parts += _levels(frame, plot.levels)
    parts.append(f'<text class="tick" x="{WIDTH - _RIGHT}" y="{_HEIGHT - 2}" text-anchor="end">distance [km]</text>')
    if errors:
        parts.append(f'<path class="band" d="{_band(frame, along_m, values, errors, runs)}"/>')
    parts.append(f'<path class="line" d="{_line(frame, along_m, values, runs)}"/>')
    parts += [numbered_mark(frame.x(at_m), frame.y(value), text) for at_m, value, text in plot.marks]
    parts.append("</svg>")
    caption = f'{escape(plot.title)} <span class="unit">[{escape(plot.unit)}]</span>'
    note = "" if group == 1 else f' <span class="unit">each point the mean of {group} windows</span>'
    return f"<figure><figcaption>{caption}{note}</figcaption>{''.join(parts)}</figure>"


def numbered_mark(x: float, y: float, text: str) -> str:
    """A small disc with a number, at a place of a picture."""
    return (f'<g class="mark"><circle cx="{x:.1f}" cy="{y:.1f}" r="8"/>'
            f'<text x="{x:.1f}" y="{y + 3.7:.1f}" text-anchor="middle">{escape(text)}</text></g>')


def nice_ticks(end: float, about: int) -> list[float]:
    """Round numbers from 0 up to ``end`` (positive), in about so many steps of 1, 2 or 5 times a power of ten."""
    step = nice_step(end / about)
    return [float(f"{index * step:.12g}") for index in range(floor(end / step + 1e-9) + 1)]


def nice_step(least: float) -> float:
    """The smallest of 1, 2, 5, 10 ... times a power of ten that is not below ``least`` (positive)."""
    power = 10.0 ** floor(log10(least))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least * (1 - 1e-9))


@dataclass(frozen=True)
class _Frame:
    end_m: float
    top: float

    def x(self, at_m: float) -> float:
        return _LEFT + (WIDTH - _LEFT - _RIGHT) * at_m / self.end_m

    def y(self, value: float) -> float:
        """Values beyond the frame are drawn on its edge."""
        share = min(max(value / self.top, 0.0), 1.0)
        return _TOP + (_HEIGHT - _TOP - _BOTTOM) * (1 - share)


def _levels(frame: _Frame, levels: Sequence[Level]) -> list[str]:
    """The lines of the levels; a name where the one above it leaves room."""
    parts = []
    named_y = 0.0
    for level in sorted(levels, key=lambda level: -level.value):
        y = frame.y(level.value)
        if level.value >= frame.top:
            continue
        parts.append(f'<path class="level" d="M{_LEFT} {y:.1f}H{WIDTH - _RIGHT}"/>')
        if y - named_y >= _NAME_ROOM:
            named_y = y
            parts.append(f'<text class="tick" x="{WIDTH - _RIGHT + 6}" y="{y + 4:.1f}">{escape(level.name)}</text>')
    return parts


def _thinned(plot: Plot) -> tuple[list[float], list[Value], list[Value], int]:
    """The points to draw, and how many rows one of them stands for."""
    group = ceil(len(plot.values) / MAX_POINTS) or 1
    starts = range(0, len(plot.values), group)
    along_m = [_mean(plot.along_m[start:start + group]) or 0.0 for start in starts]
    values = [_mean(plot.values[start:start + group]) for start in starts]
    errors = [_mean(plot.errors[start:start + group]) for start in starts] if plot.errors else []
    return along_m, values, errors, group


def _mean(values: Iterable[Value]) -> Value:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def _runs(values: Sequence[Value], breaks: set[int]) -> list[range]:
    """Stretches of known values without a break in them."""
    runs: list[range] = []
    start: int | None = None
    for index, value in enumerate(values):
        if start is not None and (value is None or index in breaks):
            runs.append(range(start, index))
            start = None
        if start is None and value is not None:
            start = index
    if start is not None:
        runs.append(range(start, len(values)))
    return runs


def _line(frame: _Frame, along_m: Sequence[float], values: Sequence[Value], runs: Sequence[range]) -> str:
    return "".join(_path(f"{frame.x(along_m[i]):.1f} {frame.y(values[i] or 0.0):.1f}" for i in run) for run in runs)


def _band(frame: _Frame, along_m: Sequence[float], values: Sequence[Value], errors: Sequence[Value],
          runs: Sequence[range]) -> str:
    """Value plus and minus its standard error, as closed shapes."""
    def edge(run: Iterable[int], sign: int) -> list[str]:
        return [f"{frame.x(along_m[i]):.1f} {frame.y((values[i] or 0.0) + sign * (errors[i] or 0.0)):.1f}" for i in run]

    return "".join(_path([*edge(run, 1), *edge(reversed(run), -1)]) + "z" for run in runs)


def _path(points: Iterable[str]) -> str:
    """One line through points. A single point becomes a dot, by the round end of a line without length."""
    drawn = list(points)
    return "M" + (" ".join(drawn) if len(drawn) > 1 else f"{drawn[0]}h0")
