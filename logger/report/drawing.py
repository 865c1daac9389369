"""Charts as one picture file, drawn by matplotlib, which the ``report`` extra brings: for papers and slides.

Pages draw the same charts with ``logger.report.charts``, which needs no library.
"""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from logger.chart_data import CLASS_COLOURS, SERIES, Bars, Chart, Curves
from logger.errors import BadInput

ENDINGS = (".png", ".svg", ".pdf")
_WIDTH_IN, _HEIGHT_IN, _DPI = 8.0, 3.6, 150
_LEAST_BARS = 5  # fewer leave room below, and are no thicker
_LINE_COLOURS = tuple(CLASS_COLOURS[number] for number in SERIES)


def drawn(charts: Sequence[Chart], path: Path) -> bytes:
    """Charts under each other, as the file that this name's ending asks for. BadInput where the extra is missing."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise BadInput(f"{path}: expected the 'report' extra: pip install 'ridelog[report]' ({error})") from None
    figure = Figure(figsize=(_WIDTH_IN, _HEIGHT_IN * len(charts)), dpi=_DPI, layout="constrained")
    FigureCanvasAgg(figure)
    for one, axes in zip(charts, np.atleast_1d(figure.subplots(len(charts), squeeze=False)[:, 0]), strict=True):
        axes.set_title(one.title, loc="left", fontsize=10, fontweight="bold")
        axes.set_xlabel(one.value_name if isinstance(one, Bars) else one.x_name)
        axes.set_ylabel("" if isinstance(one, Bars) else one.y_name)
        if isinstance(one, Bars):
            _bars(axes, one)
        elif isinstance(one, Curves):
            _curves(axes, one)
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


def _bars(axes: Any, one: Bars) -> None:
    places = np.arange(len(one.bars))
    axes.barh(places, [value for _, value in one.bars], color=_LINE_COLOURS[0], height=0.7)
    axes.set_yticks(places, [name.replace(", ", ",\n") for name, _ in one.bars], fontsize=8)
    axes.set_ylim(max(len(one.bars), _LEAST_BARS) - 0.5, -0.5)
    if one.level is not None:
        axes.axvline(one.level[0], color="0.5", linestyle=":", linewidth=1, label=one.level[1])
        axes.legend(frameon=False, fontsize=8)


def _curves(axes: Any, one: Curves) -> None:
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
    axes.grid(alpha=0.25)
    if len(series) > 1:
        axes.legend(frameon=False, fontsize=8)
