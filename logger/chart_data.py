"""What a chart shows, as arrays: lines over an axis, shades over a grid, or bars. ``logger.report.charts`` draws it."""

from dataclasses import dataclass

import numpy as np

from logger.arrays import Array

MOST_POINTS, MOST_DOTS = 4000, 2000
CURVE_POINTS, CURVE_REACH = 201, 0.999
"""Of a force curve: points that look smooth at the width of a page, and the share of the time that motions stay within
its ends."""

CLASS_COLOURS = ("#2f6db5", "#58a9d4", "#f2c744", "#ef8d32", "#d0402b", "#9e1b5e", "#651a70", "#35104a")
"""Of classes from best to worst: from blue over yellow and red to purple, distinguishable with any common colour
vision."""
NO_CLASS_COLOUR = "#9aa4ad"
SERIES = (0, 4, 1, 5, 3, 6, 2, 7)
"""Numbers of these colours for the lines of a chart: neighbours differ most, yellow comes late on white."""


@dataclass(frozen=True, eq=False)
class Line:
    """Points (n,) of a chart, joined unless they are ``dots``; ``errors`` (n,): standard errors, drawn as a band;
    ``faint``: a limit or a scale behind the others, with its name at its end."""

    name: str
    x: Array
    y: Array
    errors: Array | None = None
    dots: bool = False
    faint: bool = False


def line(name: str, x: Array, y: Array) -> Line:
    """A line of a chart through (n,), (n,); of very many points the lowest and the highest of each stretch, so that no
    peak is lost and a notebook stays small."""
    block = -(-2 * len(x) // MOST_POINTS)
    if block < 2:
        return Line(name, x, y)
    whole = len(y) // block * block
    rows = y[:whole].reshape(-1, block)
    ends = np.stack([rows.argmin(axis=1), rows.argmax(axis=1)], axis=1)
    kept = np.append((np.sort(ends, axis=1) + block * np.arange(len(rows))[:, None]).ravel(), np.arange(whole, len(y)))
    return Line(name, x[kept], y[kept])


@dataclass(frozen=True, eq=False)
class Curves:
    """A chart of lines; ``level``: a value that has a name, drawn across; on logarithmic axes values are above 0;
    ``equal``: a unit is as long on both axes, as on a map."""

    title: str
    x_name: str
    y_name: str
    lines: tuple[Line, ...]
    level: tuple[float, str] | None = None
    log_x: bool = False
    log_y: bool = False
    equal: bool = False


@dataclass(frozen=True, eq=False)
class Field:
    """A chart of values (len(y), len(x)) over a grid, as shades from 0 to ``top``, the most the darkest; what lies
    above is drawn as it."""

    title: str
    x_name: str
    y_name: str
    x: Array
    y: Array
    values: Array
    value_name: str
    top: float


@dataclass(frozen=True, eq=False)
class Bars:
    """A chart of named values from 0, one below the other; ``level``: a value that has a name, drawn through all."""

    title: str
    value_name: str
    bars: tuple[tuple[str, float], ...]
    level: tuple[float, str] | None = None


Chart = Curves | Field | Bars
