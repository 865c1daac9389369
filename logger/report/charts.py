"""Charts as SVG text, all in one style: lines over an axis, shades over a grid, bars; and as files.

A chart is drawn in units of about one pixel on a desk's screen and scales with the page. Colours are not in it: they
are classes that the page's style sheet fills in, so that one chart reads on light and on dark ground. Pages need no
library; a picture file (``drawn``) is made by matplotlib, which the ``report`` extra brings, for papers and slides.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise
from math import ceil, floor, log10
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from logger.chart_data import CLASS_COLOURS, SERIES, Array, Bars, Chart, Curves, Field, Line
from logger.errors import BadInput
from logger.report.document import EMPTY, Html, concatenated, html

WIDTH = 1000
_ABOUT = 6
_KEY_PX = 20
_LETTER_PX = 7.0

Point = tuple[float, float]


# --- what all charts share ---


@dataclass(frozen=True)
class _Box:
    """The ground of a chart and the margins around what is drawn on it [px]."""

    height: int
    left: int
    right: int
    top: int
    bottom: int

    @property
    def right_px(self) -> int:
        return WIDTH - self.right

    @property
    def bottom_px(self) -> int:
        return self.height - self.bottom


_CHART = _Box(height=420, left=64, right=170, top=20, bottom=44)


@dataclass(frozen=True)
class _Frame:
    """The place of values in a box: from the low to the high end of both axes."""

    box: _Box
    x_low: float
    x_high: float
    y_low: float
    y_high: float

    def x(self, value: float) -> float:
        box = self.box
        return box.left + (box.right_px - box.left) * (value - self.x_low) / (self.x_high - self.x_low)

    def y(self, value: float) -> float:
        """Values beyond the frame are drawn on its edge."""
        share = min(max((value - self.y_low) / (self.y_high - self.y_low), 0.0), 1.0)
        return self.box.top + (self.box.bottom_px - self.box.top) * (1 - share)

    def points(self, points: Iterable[Point]) -> list[str]:
        return [f"{self.x(x):.1f} {self.y(y):.1f}" for x, y in points]

    def across(self, style: str, value: float) -> Html:
        """A line from the left to the right edge at a value."""
        return html('<path class="{}" d="M{} {:.1f}H{}"/>', style, self.box.left, self.y(value), self.box.right_px)

    def beside(self, value: float, name: str) -> Html:
        """A name at the right of a value."""
        return _words(self.box.right_px + 6, self.y(value) + 4, name)

    def rows(self, about: int, powers: bool = False) -> Html:
        """Faint lines across, with their values at the left; ``powers``: values are those of ten."""
        ticks = _powers(self.y_low, self.y_high, about) if powers else nice_ticks(self.y_low, self.y_high, about)
        return concatenated(self.across("grid", tick) + _words(self.box.left - 8, self.y(tick) + 4,
                                                               _number(tick, powers), "end") for tick in ticks)

    def columns(self, about: int, unit: float = 1.0, powers: bool = False) -> Html:
        """Values below, so many ``unit`` being 1."""
        low, high = self.x_low / unit, self.x_high / unit
        return concatenated(_words(self.x(tick * unit), self.box.bottom_px + 18, _number(tick, powers), "middle")
                            for tick in (_powers if powers else nice_ticks)(low, high, about))


def _number(tick: float, is_power: bool) -> str:
    return f"{10.0**tick:g}" if is_power else f"{tick:g}"


def _powers(low: float, high: float, about: int) -> list[float]:
    """Logarithms from ``low`` to ``high`` of powers of ten: all, every second ...; of few also 2 and 5 times it."""
    step = ceil((high - low) / (2 * about))
    parts = (0.0, log10(2), log10(5)) if high - low < about / 2 else (0.0,)
    return [power + part for power in range(floor(low), floor(high) + 1) for part in parts
            if power % step == 0 and low <= power + part <= high]


def _words(x: float, y: float, text: str, anchor: str = "start") -> Html:
    where = html(' text-anchor="{}"', anchor) if anchor != "start" else EMPTY
    return html('<text class="tick" x="{:.1f}" y="{:.1f}"{}>{}</text>', x, y, where, text)


def _figure(box: _Box, title: str, drawn: Iterable[Html], style: str = "plot") -> Html:
    """The figure element; ``style``: "plot" shrinks to the width of a phone, "plot named" is shifted there instead,
    as the names at its left would not fit."""
    svg = html('<svg class="{}" viewBox="0 0 {} {}" role="img" aria-label="{}">{}</svg>', style, WIDTH, box.height,
               title, concatenated(drawn))
    return html("<figure><figcaption>{}</figcaption>{}</figure>", title, svg)


def nice_ticks(low: float, high: float, about: int) -> list[float]:
    """Round numbers from ``low`` to ``high``, above it, in about so many steps of 1, 2 or 5 times a power of ten."""
    step = nice_step((high - low) / about)
    return [float(f"{index * step:.12g}") for index in range(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1)]


def nice_step(least: float) -> float:
    """The smallest of 1, 2, 5, 10 ... times a power of ten that is not below ``least`` (positive)."""
    power = 10.0 ** floor(log10(least))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least * (1 - 1e-9))


# --- lines over an axis, shades over a grid ---


def chart(one: Chart) -> Html:
    if isinstance(one, Bars):
        return _bars(one)
    return _figure(_CHART, one.title, _field(one) if isinstance(one, Field) else _curves(one))


def _bars(one: Bars) -> Html:
    bar_px = 24
    longest = max((len(name) for name, _ in one.bars), default=0)
    box = _Box(height=70 + bar_px * len(one.bars), left=min(24 + ceil(_LETTER_PX * longest), 2 * WIDTH // 3), right=90,
               top=26, bottom=44)
    values = [0.0, *(value for _, value in one.bars), *([] if one.level is None else [one.level[0]])]
    low, high = min(values), max(values)
    frame = _Frame(box, low, high if high > low else low + 1.0, 0.0, 1.0)
    parts = [frame.columns(_ABOUT), _words(box.right_px, box.height - 6, one.value_name, "end")]
    for number, (name, value) in enumerate(one.bars):
        y, ends = box.top + bar_px * number, sorted((frame.x(0.0), frame.x(value)))
        parts += [_cell(ends[0], y + 3, max(ends[1] - ends[0], 1.0), bar_px - 6, 1.0),
                  _words(box.left - 8, y + 16, name, "end"), _words(ends[1] + 6, y + 16, f"{value:.3g}")]
    if one.level is not None:
        x = frame.x(one.level[0])
        parts += [html('<path class="level" d="M{:.1f} {}V{}"/>', x, box.top, box.bottom_px),
                  _words(x, box.top - 8, one.level[1], "middle")]
    return _figure(box, one.title, parts, "plot named")


def _curves(one: Curves) -> list[Html]:
    shapes = [_Shape.of(line, one.log_x, one.log_y) for line in one.lines]
    level = None if one.level is None else (log10(one.level[0]) if one.log_y else one.level[0])
    ys = [edge for shape in shapes for edge in (shape.y, shape.low, shape.high)]
    ys += [] if level is None else [np.array([level])]
    ends = [_ends(np.concatenate([shape.x for shape in shapes])), _ends(np.concatenate(ys))]
    if one.equal:
        pixels = (_CHART.right_px - _CHART.left, _CHART.bottom_px - _CHART.top)
        pixel = max((high - low) / count for (low, high), count in zip(ends, pixels, strict=True))
        ends = [((low + high - pixel * count) / 2, (low + high + pixel * count) / 2)
                for (low, high), count in zip(ends, pixels, strict=True)]
    frame = _Frame(_CHART, *ends[0], *ends[1])
    parts = _axes(frame, one.x_name, one.y_name, one.log_x, one.log_y)
    if one.level is not None and level is not None:
        parts += [frame.across("level", level), frame.beside(level, one.level[1])]
    pairs = list(zip(one.lines, shapes, strict=True))
    parts += [drawn for line, shape in pairs if line.faint for drawn in _faint(frame, line, shape)]
    series = [pair for pair in pairs if not pair[0].faint]
    for number, (line, shape) in enumerate(series):
        parts += _line(frame, line, shape, SERIES[number % len(SERIES)])
    below_px = None if level is None else frame.y(level)
    names = [line.name for line, _ in series]
    if any(line.faint for line, _ in pairs):
        # In the lower left corner, where faint lines have their names at the right.
        x = _CHART.left + 14
        return parts + _keys(names, x, _CHART.bottom_px - _key_height_px(names, x))
    return parts + _key(names, below_px)


def _faint(frame: _Frame, line: Line, shape: "_Shape") -> list[Html]:
    points = frame.points(zip(shape.x, shape.y, strict=True))
    return [html('<path class="level" d="M{}"/>', " ".join(points)),
            _words(frame.x(float(shape.x[-1])) + 6, frame.y(float(shape.y[-1])) + 4, line.name)]


@dataclass(frozen=True, eq=False)
class _Shape:
    """A line as it lies on its axes (n,): values or their powers of ten, and the edges of its band."""

    x: Array
    y: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, line: Line, log_x: bool, log_y: bool) -> "_Shape":
        """On these axes. A band that reaches below 0 ends, on a logarithmic axis, a thousandth above it."""
        errors = np.zeros(1) if line.errors is None else line.errors
        low, high = line.y - errors, line.y + errors
        if log_y:
            low = np.maximum(low, 1e-3 * line.y)
        scaled = (np.log10 if log else np.asarray for log in (log_x, log_y, log_y, log_y))
        return cls(*(scale(one) for scale, one in zip(scaled, (line.x, line.y, low, high), strict=True)))


def _line(frame: _Frame, line: Line, shape: _Shape, colour: int) -> list[Html]:
    parts = []
    if line.errors is not None:
        edges = [*zip(shape.x, shape.high, strict=True), *reversed(list(zip(shape.x, shape.low, strict=True)))]
        parts.append(html('<path class="spread" d="M{}z"/>', " ".join(frame.points(edges))))
    points = list(zip(shape.x, shape.y, strict=True))
    if line.dots:
        return parts + [_dot(frame.x(x), frame.y(y), 4, colour) for x, y in points]
    return [*parts, html('<path class="thick s{}" d="M{}"/>', colour, " ".join(frame.points(points)))]


def _dot(x: float, y: float, radius: int, colour: int) -> Html:
    return html('<circle class="dot" cx="{:.1f}" cy="{:.1f}" r="{}" style="fill:var(--c{})"/>', x, y, radius, colour)


def _key(names: list[str], below_px: float | None) -> list[Html]:
    """What the lines are, at the right; out of the way of a level's name."""
    at_the_top, x = below_px is None or below_px >= _CHART.height / 2, _CHART.right_px + 6
    return _keys(names, x, _CHART.top + 10 if at_the_top else _CHART.bottom_px - _key_height_px(names, x))


def _rows(name: str, x: int) -> list[str]:
    """A name in rows that end within the chart."""
    return wrap(name, int((WIDTH - x - 20) / _LETTER_PX))


def _key_height_px(names: list[str], x: int) -> int:
    return _KEY_PX * sum(len(_rows(name, x)) for name in names)


def _keys(names: list[str], x: int, top: int) -> list[Html]:
    parts = list[Html]()
    for number, name in enumerate(names):
        parts.append(html('<path class="thick s{}" d="M{} {}h14"/>', SERIES[number % len(SERIES)], x, top))
        for row in _rows(name, x):
            parts.append(_words(x + 20, top + 4, row))
            top += _KEY_PX
    return parts


def _field(one: Field) -> list[Html]:
    x_edges, y_edges = _edges(one.x), _edges(one.y)
    frame = _Frame(_CHART, float(x_edges[0]), float(x_edges[-1]), float(y_edges[0]), float(y_edges[-1]))
    parts = []
    for (low, high), row in zip(pairwise(y_edges), one.values, strict=True):
        for (left, right), value in zip(pairwise(x_edges), row, strict=True):
            share = 0.0 if not np.isfinite(value) else min(max(float(value) / one.top, 0.0), 1.0)
            parts.append(_cell(frame.x(left), frame.y(high), frame.x(right) - frame.x(left),
                               frame.y(low) - frame.y(high), share))
    parts += _axes(frame, one.x_name, one.y_name)
    x = _CHART.right_px + 10
    for number in range(_ABOUT):
        share = number / (_ABOUT - 1)
        y = _CHART.top + 30 + _KEY_PX * number
        parts.append(_cell(x, y - 9, 14, 14, share)
                     + _words(x + 20, y + 2, f"{share * one.top:g}{' and more' if share == 1 else ''}"))
    return [*parts, _words(x, _CHART.top + 6, one.value_name)]


def _cell(x: float, y: float, width: float, height: float, opacity: float) -> Html:
    return html('<rect class="cell" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill-opacity="{:.2f}"/>',
                x, y, width, height, opacity)


def _edges(centres: Array) -> Array:
    """Edges (n + 1,) of cells around increasing centres (n,), n > 1."""
    between = (centres[1:] + centres[:-1]) / 2
    return np.concatenate([[2 * centres[0] - between[0]], between, [2 * centres[-1] - between[-1]]])


def _ends(values: Array) -> tuple[float, float]:
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    room = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
    return low - room, high + room


def _axes(frame: _Frame, x_name: str, y_name: str, log_x: bool = False, log_y: bool = False) -> list[Html]:
    box = frame.box
    return [frame.rows(_ABOUT, log_y), frame.columns(_ABOUT, powers=log_x),
            _words(box.right_px, box.height - 6, x_name, "end"), _words(box.left, box.top - 6, y_name)]


_LINE_COLOURS = tuple(CLASS_COLOURS[number] for number in SERIES)


def drawn(charts: Sequence[Chart], path: Path) -> bytes:
    """Charts under each other, as the file that this name's ending asks for. BadInput where the extra is missing."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise BadInput(f"{path}: expected the 'report' extra: pip install 'ridelog[report]' ({error})") from None
    width_in, height_in = 8.0, 3.6
    figure = Figure(figsize=(width_in, height_in * len(charts)), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    for one, axes in zip(charts, np.atleast_1d(figure.subplots(len(charts), squeeze=False)[:, 0]), strict=True):
        axes.set_title(one.title, loc="left", fontsize=10, fontweight="bold")
        axes.set_xlabel(one.value_name if isinstance(one, Bars) else one.x_name)
        axes.set_ylabel("" if isinstance(one, Bars) else one.y_name)
        if isinstance(one, Bars):
            _draw_bars(axes, one)
        elif isinstance(one, Curves):
            _draw_curves(axes, one)
        else:
            shades = axes.pcolormesh(one.x, one.y, np.asarray(one.values), vmin=0.0, vmax=one.top, cmap="Blues",
                                     shading="nearest")
            figure.colorbar(shades, ax=axes, label=one.value_name)
    # A date in the file would make the same result another file.
    ending = path.suffix.lower()
    about = {".png": {"Software": None}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}[ending]
    made = BytesIO()
    figure.savefig(made, format=ending[1:], metadata=about)
    return made.getvalue()


def _draw_bars(axes: Any, one: Bars) -> None:
    least_bars = 5  # fewer leave room below, and are no thicker
    places = np.arange(len(one.bars))
    axes.barh(places, [value for _, value in one.bars], color=_LINE_COLOURS[0], height=0.7)
    axes.set_yticks(places, [name.replace(", ", ",\n") for name, _ in one.bars], fontsize=8)
    axes.set_ylim(max(len(one.bars), least_bars) - 0.5, -0.5)
    if one.level is not None:
        axes.axvline(one.level[0], color="0.5", linestyle=":", linewidth=1, label=one.level[1])
        axes.legend(frameon=False, fontsize=8)


def _draw_curves(axes: Any, one: Curves) -> None:
    for line in (line for line in one.lines if line.faint):
        axes.plot(line.x, line.y, color="0.7", linestyle=":", linewidth=1)
        axes.annotate(line.name, (line.x[-1], line.y[-1]), xytext=(4, 0), textcoords="offset points", va="center",
                      color="0.4", fontsize=8, annotation_clip=False)
    series = [line for line in one.lines if not line.faint]
    for number, line in enumerate(series):
        colour = _LINE_COLOURS[number % len(_LINE_COLOURS)]
        if line.errors is not None:
            axes.fill_between(line.x, line.y - line.errors, line.y + line.errors, color=colour, alpha=0.25, linewidth=0)
        way = {"linestyle": "none", "marker": "o", "markersize": 3} if line.dots else {"linewidth": 1.2}
        axes.plot(line.x, line.y, color=colour, label=line.name, **way)
    if one.level is not None:
        axes.axhline(one.level[0], color="0.5", linestyle=":", linewidth=1)
        axes.annotate(one.level[1], (1.0, one.level[0]), xycoords=("axes fraction", "data"), ha="right", va="bottom",
                      color="0.4", fontsize=8)
    axes.set_xscale("log" if one.log_x else "linear")
    axes.set_yscale("log" if one.log_y else "linear")
    axes.set_aspect("equal" if one.equal else "auto", "datalim")
    axes.grid(alpha=0.25)
    if len(series) > 1:
        axes.legend(frameon=False, fontsize=8)
