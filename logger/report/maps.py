"""Lines on the ground as one SVG picture; no tiles, no network.

Degrees become metres around the middle of the lines (a degree of longitude shrinks with the cosine of the latitude),
which is right to a part in a thousand for a day's drive. Points are left out where they lie within a third of a pixel
of the line through the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np

from logger.chart_data import Array
from logger.geodesy import east_and_north_m
from logger.report.charts import WIDTH, nice_step
from logger.report.document import Html, concatenated, html

_MARGIN = 46
_LEAST_HEIGHT, _MOST_HEIGHT = 260, 640
_LEAST_SPAN_M = 50.0

Point = tuple[float, float]


@dataclass(frozen=True, eq=False)
class MapLine:
    """A line on the ground: latitudes and longitudes (n,) [degrees]."""

    name: str
    lat_deg: Array
    lon_deg: Array


def ways_map(measured: Sequence[MapLine], driven: Sequence[MapLine]) -> Html:
    """The figure of lines that were measured, wide, under the places at which drives were seen, as dots; with a key."""
    spread = (1, 2, 4, 6)  # colours of a page's style that differ most, on its dark casing
    projection = _Projection.around([place for one in measured for place in _places(one)])
    parts = [html('<path class="casing" d="{}"/>', _path([projection.xy(place) for place in _places(one)]))
             for one in measured]
    for number, one in enumerate(driven):
        dots = (projection.xy(place) for place in _places(one))
        parts.append(concatenated(html('<circle cx="{:.1f}" cy="{:.1f}" r="2.4" style="fill:var(--c{})"/>', *dot,
                                       spread[number % len(spread)]) for dot in dots))
    parts += [_begins(projection.xy(_places(one)[0]), one.name) for one in measured]
    drawn = html('<figure><svg class="map plot" viewBox="0 0 {} {:.0f}" role="img" aria-label="Map of the drives">{}'
                 "</svg></figure>", WIDTH, projection.height,
                 concatenated([*parts, _scale_bar(projection), _north()]))
    key = concatenated(html('<li><i class="f{}"></i>{}</li>', spread[number % len(spread)], one.name)
                       for number, one in enumerate(driven))
    return drawn + html('<ul class="legend">{}</ul>', key)


def _begins(at: Point, name: str) -> Html:
    """A disc where a line begins, its name above it, out of the way of the line."""
    x, y = at
    return html('<g class="start"><circle cx="{:.1f}" cy="{:.1f}" r="7"/><text x="{:.1f}" y="{:.1f}" '
                'text-anchor="{}">{}</text></g>', x, y, x, y - 14, "start" if x < WIDTH / 2 else "end", name)


def _places(way: MapLine) -> list[_Spot]:
    return [_Spot(float(lat), float(lon)) for lat, lon in zip(way.lat_deg, way.lon_deg, strict=True)]


@dataclass(frozen=True)
class _Spot:
    lat_deg: float
    lon_deg: float


@dataclass(frozen=True)
class _Projection:
    """From degrees to the picture."""

    lat_deg: float
    lon_deg: float
    middle_m: Point
    units_per_m: float
    height: float

    @classmethod
    def around(cls, places: Sequence[_Spot]) -> _Projection:
        """The largest scale at which all places fit the picture."""
        latitudes = [place.lat_deg for place in places]
        plain = cls((min(latitudes) + max(latitudes)) / 2, places[0].lon_deg, (0.0, 0.0), 1.0, 0.0)
        metres = np.array([plain.metres(place) for place in places])
        low, high = metres.min(axis=0), metres.max(axis=0)
        middle = (low + high) / 2
        wide_m, high_m = np.maximum(high - low, _LEAST_SPAN_M)
        scale = min((WIDTH - 2 * _MARGIN) / wide_m, (_MOST_HEIGHT - 2 * _MARGIN) / high_m)
        height = max(high_m * scale + 2 * _MARGIN, _LEAST_HEIGHT)
        return cls(plain.lat_deg, plain.lon_deg, (float(middle[0]), float(middle[1])), float(scale), float(height))

    def metres(self, place: _Spot) -> Point:
        """East and north of the origin [m]."""
        return east_and_north_m(place.lat_deg, place.lon_deg, self.lat_deg, self.lon_deg)

    def xy(self, place: _Spot) -> Point:
        """In the picture, y downwards."""
        east_m, north_m = self.metres(place)
        return (WIDTH / 2 + (east_m - self.middle_m[0]) * self.units_per_m,
                self.height / 2 - (north_m - self.middle_m[1]) * self.units_per_m)


def _path(points: Sequence[Point]) -> str:
    tolerance = 0.3  # of a unit of the picture
    kept = [f"{x:.1f} {y:.1f}" for x, y in simplified(points, tolerance)]
    return "M" + (" ".join(kept) if len(kept) > 1 else f"{kept[0]}h0")


def simplified(points: Sequence[Point], tolerance: float) -> list[Point]:
    """The points without those within ``tolerance`` of the line through the rest (Douglas and Peucker 1973)."""
    xy = np.asarray(points, dtype=float).reshape(-1, 2)
    keep = np.zeros(len(xy), dtype=bool)
    keep[[0, -1]] = True
    spans = [(0, len(xy) - 1)]
    while spans:
        first, last = spans.pop()
        if last - first < 2:
            continue
        inner = xy[first + 1:last] - xy[first]
        chord = xy[last] - xy[first]
        square = hypot(*chord) ** 2  # 0 between points that are all but one
        along = np.clip(inner @ chord / square, 0.0, 1.0) if square > 0 else np.zeros(len(inner))
        off = np.linalg.norm(inner - along[:, None] * chord, axis=1)
        worst = int(off.argmax())
        if off[worst] > tolerance:
            keep[first + 1 + worst] = True
            spans += [(first, first + 1 + worst), (first + 1 + worst, last)]
    return [(float(x), float(y)) for x, y in xy[keep]]


def _scale_bar(projection: _Projection) -> Html:
    length_m = nice_step(90 / projection.units_per_m)
    width = length_m * projection.units_per_m
    text = f"{length_m / 1000:g} km" if length_m >= 1000 else f"{length_m:g} m"
    y = projection.height - 14
    return html('<g class="scale"><path d="M16 {:.1f}v5h{:.1f}v-5"/><text x="{:.1f}" y="{:.1f}" '
                'text-anchor="middle">{}</text></g>', y - 5, width, 16 + width / 2, y - 6, text)


def _north() -> Html:
    x = WIDTH - 24
    return html('<g class="scale"><path d="M{0} 40V16m-5 8l5-8l5 8"/><text x="{0}" y="54" text-anchor="middle">N</text>'
                "</g>", x)
