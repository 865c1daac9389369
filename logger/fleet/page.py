"""What a fleet's owner sees: figures in words and as JSON; a layer of roads for other programs, a line each, or a point
for what has no direction; and a page of some ten kilobytes with a map, whose tiles lie beside it, and the lists to act
on.

Problem: a county has a million segments, and a page that holds them does not open. Solution: squares of Web Mercator
(EPSG:3857), as street maps have them; down to the last level but one a tile holds means over 1/64 of its side, at the
last level segments with their history. A reader loads what is in view. A page opened from a folder may not fetch, but
may load scripts: so each tile is one, which calls ``fleetTile``.

The folder of a report is written beside its place, and moved there when it is whole.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, degrees, isfinite, radians, sin
from pathlib import Path
from typing import Any

import numpy as np

from logger.arrays import Array, Indices, Whole
from logger.bounds import FALSE_SHARE
from logger.errors import BadInput
from logger.exchange.layer import Feature, Geometry, Layer, attributes, cut, format_of, iri_title
from logger.files import make_folder, whole_folder, write_file, write_text
from logger.fleet.dataset import Engine
from logger.fleet.ingest import Counts
from logger.fleet.road_map import SEGMENT_M, RoadPieces
from logger.fleet.summary import SECTION_M, FleetFigures, RoadTable, change_found, gains_table, grouped, history
from logger.geodesy import EARTH_RADIUS_M
from logger.left_out import LeftOut, left_out_json, left_out_lines
from logger.printable import counted
from logger.report import document as doc
from logger.report.document import tiles
from logger.report.placed import damaged
from logger.report.quantities import fixed, known
from logger.report.summary import distance_words
from logger.roads.sections import FAIR_TO_IN_PER_MI, FEDERAL_WORDS, GOOD_BELOW_IN_PER_MI, federal_condition
from logger.store.log.log_reader import iso_utc, utc
from logger.units import DAY_US, INCH_PER_MILE_M_PER_KM

_SHOWN_ROADS = 15


def ingest_json(counts: Counts, rows: int) -> dict[str, Any]:
    """What an ingest did, by name; ``rows``: in the dataset after it."""
    return {**vars(counts), "rows": rows, **left_out_json(_left_out(counts))}


def _left_out(counts: Counts) -> list[LeftOut]:
    return [damaged(counts.damaged_lines), *(LeftOut(number, "row", why) for number, why in (
        (counts.repeated, "that are known already"),
        (counts.contradictions, "that contradict a known one of the same number and time; the first one is kept"),
        (counts.undated, "without a date"), (counts.unplaced, "without a position or a direction"),
        (counts.trimmed, "cut at the ends of drives")))]


def ingest_words(counts: Counts, rows: int, place: str) -> str:
    """The same in lines."""
    lines = [f"{place}: {counts.added:,} rows added, {rows:,} in all"]
    known = [f"  {counted(counts.known_logs, 'log')} known already"] if counts.known_logs else []
    return "\n".join([*lines, *known, *(f"  {one}" for one in left_out_lines(_left_out(counts)))])


def figures_json(figures: FleetFigures) -> dict[str, Any]:
    """A summary by name; null: not known."""
    names = [field.name for field in FIELDS]
    biases = figures.biases
    return {
        "by": figures.roads.by, "windows": figures.windows, "withheld_segments": figures.withheld,
        "growth_per_year": known(biases.growth_per_year), "pass_std": known(biases.pass_std),
        "session_std": known(biases.session_std), "repeats": biases.repeats, "repeats_needed": biases.needed,
        "not_known": not_known(figures) or None, "change_found_m_per_km_per_year": known(change_found(figures.roads)),
        "cars": [{"car": car, "passes": int(passes), "bias": known(gain - 1.0 if estimated else np.nan),
                  "bias_std": known(gain * std if estimated else np.nan), "group": int(group)}
                 for car, passes, gain, std, group, estimated in zip(
                     figures.names, figures.car_passes.tolist(), biases.gain.tolist(), biases.log_std.tolist(),
                     biases.group.tolist(), biases.known.tolist(), strict=True)],
        "roads": [dict(zip(names, one.values, strict=True)) for one in roads_layer(figures.roads).features]}


def figures_words(figures: FleetFigures) -> str:
    """A summary in lines: what it rests on, cars that read too high or too low, the roughest roads, and the changes."""
    roads, biases = figures.roads, figures.biases
    lines = [f"{counted(figures.windows, 'window')} of {counted(len(figures.cars), 'car')}; "
             f"{counted(len(roads.key), roads.by)}, {roads.length_m.sum() / 1000:,.1f} km"]
    if figures.withheld:
        lines.append(f"{figures.withheld:,} segments are withheld: too few cars have driven them")
    if why := not_known(figures):
        lines.append(why)
    if isfinite(biases.pass_std):
        lines.append(f"The standard error of one pass over 66 ft of road is {biases.pass_std:.1%}, of which "
                     f"{biases.session_std:.1%} is shared by all passes of a session")
    if isfinite(biases.growth_per_year):
        lines.append(f"The average road changes by {biases.growth_per_year:+.1%} a year")
    return "\n".join([*lines, "", *_words_cars(figures), "", *_roads(roads), "", *_changes(roads)])


def not_known(figures: FleetFigures) -> str:
    """Why figures are empty that too few drives show; nothing where there are enough."""
    if isfinite(figures.biases.pass_std):
        return ""
    return ("Not known yet: how drives differ, and therefore the standard error of an IRI, its change a year and the "
            f"bias of each car. This takes {figures.biases.needed} drives over roads that the same car has driven "
            f"before; there {'is' if figures.biases.repeats == 1 else 'are'} {figures.biases.repeats}. Drive the same "
            "roads again.")


def _words_cars(figures: FleetFigures) -> list[str]:
    shown_cars = 10
    sure_stds = 2.0  # Standard errors that a bias is listed from.
    biases = figures.biases
    bias, std = biases.gain - 1.0, biases.gain * biases.log_std
    if not isfinite(biases.pass_std):
        more = len(figures.names) - shown_cars
        return [f"Cars: {', '.join(sorted(figures.names)[:shown_cars])}"
                + f" and {more} more (--json has all)" * (more > 0)]
    if not biases.known.any():
        return ["No road has passes of two cars: nothing is known of their biases"]
    order = np.argsort(-np.abs(bias) * biases.known, kind="stable")
    sure = [one for one in order.tolist() if biases.known[one] and abs(bias[one]) > sure_stds * std[one]]
    alone = int((~biases.known).sum())
    lines = [f"Cars that differ from the average car ({len(sure)} of {len(bias)})"]
    width = max((len(figures.names[one]) for one in sure[:shown_cars]), default=0)
    lines += [f"  {figures.names[one]:{width}}  {bias[one]:+7.1%} ± {std[one]:.1%}  "
              f"{int(figures.car_passes[one]):,} passes" for one in sure[:shown_cars]]
    if len(sure) > shown_cars:
        lines.append(f"  and {len(sure) - shown_cars} more (--json has all)")
    return lines + ([f"  {alone} cars share no road with others: their bias is not known"] if alone else [])


def _roads(roads: RoadTable) -> list[str]:
    order = np.argsort(-np.nan_to_num(roads.iri_m_per_km), kind="stable")[:_SHOWN_ROADS].tolist()
    if not order:
        return ["No road to show"]
    lines = [f"Roughest {roads.by}s",
             "  place                    IRI [m/km]      cars  passes  a_w [m/s2]  last seen   visit"]
    return lines + [f"  {roads.lat_deg[one]:10.5f} {roads.lon_deg[one]:11.5f}  {roads.iri_m_per_km[one]:5.2f} "
                    f"{error_words(roads.iri_std_m_per_km[one]):7}  {roads.cars[one]:6d}  {roads.passes[one]:6.0f}  "
                    f"{fixed(roads.a_w_mps2[one], 2):>10}  {utc(int(roads.last_us[one])):%Y-%m-%d}  "
                    f"{roads.visit[one].replace('|', ', ')}".rstrip() for one in order]


def _changes(roads: RoadTable) -> list[str]:
    worse = np.flatnonzero(roads.worse)
    order = worse[np.argsort(roads.p_value[worse], kind="stable")][:_SHOWN_ROADS].tolist()
    limit = change_found(roads)
    power = ([f"On half of the {roads.by}s, a change of {limit:.2f} m/km a year would be found with a power of 80 %"]
            if isfinite(limit) else [])
    if not roads.changes_known:
        return [f"Whether a {roads.by} has become worse is not known"]
    if not order:
        return [f"No {roads.by} has become worse, as far as these drives show", *power]
    lines = [f"Became worse: {counted(len(worse), roads.by)} (at most {FALSE_SHARE:.0%} of these are false)", *power,
             "  place                    IRI [m/km]   a year [m/km]    p"]
    return lines + [f"  {roads.lat_deg[one]:10.5f} {roads.lon_deg[one]:11.5f}  {roads.iri_m_per_km[one]:10.2f}  "
                    f"{roads.trend_m_per_km_per_year[one]:+6.2f} ± {roads.trend_std_m_per_km_per_year[one]:.2f}  "
                    f"{roads.p_value[one]:.1g}" for one in order]


def error_words(std: float) -> str:
    """A standard error behind its value: "± 0.12"; nothing where it is not known."""
    return f"± {std:.2f}" if isfinite(std) else ""


_NUMBERS = ("lat_deg", "lon_deg", "heading_deg", "length_m", "passes", "iri_m_per_km", "iri_std_m_per_km",
            "trend_m_per_km_per_year", "trend_std_m_per_km_per_year", "p_value", "a_w_mps2", "speed_mps")
FIELDS = attributes("key", "cars", *_NUMBERS, "condition", "last_utc", "visit")
_DRAWN_M = {"segment": SEGMENT_M, "section": SECTION_M}


def roads_layer(roads: RoadTable) -> Layer:
    """The rows of a table, in its order."""
    columns = [getattr(roads, name).tolist() for name in ("key", "cars", *_NUMBERS)]
    features = []
    for values, last_us, visit in zip(zip(*columns, strict=True), roads.last_us.tolist(), roads.visit.tolist(),
                                      strict=True):
        row = dict(zip(("key", "cars", *_NUMBERS), values, strict=True))
        known = [value if not isinstance(value, float) or isfinite(value) else None for value in values]
        condition = federal_condition(row["iri_m_per_km"]) if isfinite(row["iri_m_per_km"]) else None
        last_utc = iso_utc(last_us // DAY_US * DAY_US)  # a time of day would tell whose drive it was
        features.append(Feature(roads.by, iri_title(row["iri_m_per_km"]), (*known, condition, last_utc, visit or None),
                                _line(row["lat_deg"], row["lon_deg"], row["heading_deg"], _DRAWN_M.get(roads.by, 0.0)),
                                (row["lon_deg"], row["lat_deg"]), last_utc, False, ""))
    return Layer(f"{roads.by}s", FIELDS, tuple(features))


def _line(lat_deg: float, lon_deg: float, heading_deg: float, length_m: float) -> Geometry:
    """A line of a length through a place along its direction; the place alone where there is none."""
    if not length_m or not isfinite(heading_deg):
        return (((lon_deg, lat_deg),),)
    half_deg = degrees(length_m / 2 / EARTH_RADIUS_M)
    north = half_deg * cos(radians(heading_deg))
    east = half_deg * sin(radians(heading_deg)) / cos(radians(lat_deg))
    return cut(((lon_deg - east, lat_deg - north), (lon_deg + east, lat_deg + north)))


Codes = Whole

DEEPEST = 15  # Where a segment of 66 ft is some 6 pixels long at middle latitudes
_STEPS = 4096


@dataclass(frozen=True, eq=False)
class History:
    """Means of quarters of a year since 1970, rows by road: its place in the table of segments, quarter, IRI [m/km],
    passes."""

    segment: Indices
    quarter: Codes
    iri_m_per_km: Array
    passes: Codes


def projected(lat_deg: Array, lon_deg: Array) -> tuple[Array, Array]:
    """Places [degrees] in Web Mercator, the world being 1 wide and high, y downwards."""
    most_lat_deg = 85.0
    lat_rad = np.radians(np.clip(lat_deg, -most_lat_deg, most_lat_deg))
    return lon_deg / 360.0 + 0.5, 0.5 - np.arcsinh(np.tan(lat_rad)) / (2 * np.pi)


def highest_level(x: Array, y: Array) -> int:
    """The level at which all places lie in a few tiles."""
    extent = max(float(np.ptp(x)), float(np.ptp(y)), 2.0**-DEEPEST)
    return int(np.clip(np.floor(-np.log2(extent)), 0, DEEPEST))


def write_tiles(segments: RoadTable, history: History, folder: Path) -> int:
    """Write ``folder/LEVEL/X_Y.js`` for all levels; give their number. Raises OSError."""
    x, y = projected(segments.lat_deg, segments.lon_deg)
    written = 0
    for level in range(highest_level(x, y), DEEPEST + 1):
        make_folder(folder / str(level))
        made = _of_segments(segments, history, x, y) if level == DEEPEST else _of_squares(segments, x, y, level)
        for name, content in made:
            text = json.dumps(content, separators=(",", ":"), allow_nan=False)
            write_text(folder / f"{name}.js", f'fleetTile("{name}",{text})\n')
            written += 1
    return written


def _of_squares(segments: RoadTable, x: Array, y: Array, level: int) -> Iterator[tuple[str, dict[str, Any]]]:
    cells = 64
    column, row = _tile_of(x, y, level, parts=cells)
    place, code = np.unique((column << 32) | row, return_inverse=True)
    length_m = np.bincount(code, segments.length_m)
    mean = np.bincount(code, segments.iri_m_per_km * segments.length_m) / length_m
    worst, worse = np.zeros(len(place)), np.zeros(len(place), dtype=np.int64)
    np.maximum.at(worst, code, segments.iri_m_per_km)
    np.maximum.at(worse, code, segments.worse.astype(np.int64))
    column, row = place >> 32, place & (2**32 - 1)
    quarter = 1 << (2 * column // cells % 2 + 2 * (2 * row // cells % 2))
    at = row % cells * cells + column % cells
    for name, rows in _by_tile(column // cells, row // cells, level):
        yield name, {"n": int(np.bitwise_or.reduce(quarter[rows])), "at": at[rows].tolist(),
                     "m": _hundredths(mean[rows]), "w": _hundredths(worst[rows]), "c": worse[rows].tolist()}


def _of_segments(segments: RoadTable, history: History, x: Array, y: Array) -> Iterator[tuple[str, dict[str, Any]]]:
    column, row = _tile_of(x, y, DEEPEST)
    order = np.lexsort((history.quarter, history.segment))
    steps = np.stack([history.quarter, np.round(history.iri_m_per_km * 100).astype(np.int64), history.passes], axis=1)
    steps = steps[order]
    first = np.searchsorted(history.segment[order], np.arange(len(x) + 1))
    for name, rows in _by_tile(column, row, DEEPEST):
        yield name, {"x": np.round((x[rows] * 2**DEEPEST - column[rows]) * _STEPS).astype(int).tolist(),
                     "y": np.round((y[rows] * 2**DEEPEST - row[rows]) * _STEPS).astype(int).tolist(),
                     "h": np.round(segments.heading_deg[rows]).astype(int).tolist(),
                     "m": _hundredths(segments.iri_m_per_km[rows]), "s": _hundredths(segments.iri_std_m_per_km[rows]),
                     "t": _hundredths(segments.trend_m_per_km_per_year[rows]),
                     "u": _hundredths(segments.trend_std_m_per_km_per_year[rows]),
                     "c": segments.worse[rows].astype(int).tolist(), "k": segments.cars[rows].tolist(),
                     "n": segments.passes[rows].astype(int).tolist(), "d": (segments.last_us[rows] // DAY_US).tolist(),
                     "q": [steps[first[one] : first[one + 1]].tolist() for one in rows.tolist()]}


def names_of(x: Array, y: Array, level: int) -> list[str]:
    """The tiles of a level, by name."""
    return [name for name, _ in _by_tile(*_tile_of(x, y, level), level)]


def _tile_of(x: Array, y: Array, level: int, parts: int = 1) -> tuple[Codes, Codes]:
    """Column and row of the tile, or of its parts, that places lie in."""
    across = 2**level * parts
    column, row = (np.clip(np.floor(one * across), 0, across - 1).astype(np.int64) for one in (x, y))
    return column, row


def _by_tile(column: Codes, row: Codes, level: int) -> Iterator[tuple[str, Indices]]:
    """Names of tiles, and the rows that lie in each."""
    order = np.lexsort((row, column))
    new = (np.diff(column[order]) != 0) | (np.diff(row[order]) != 0)
    for rows in np.split(order, np.flatnonzero(new) + 1):
        yield f"{level}/{int(column[rows[0]])}_{int(row[rows[0]])}", rows


def _hundredths(values: Array) -> list[int | None]:
    return [round(value * 100) if value == value else None for value in values.tolist()]


_SHARED = ("windows.js", "canvas.js", "map.js")
_STYLE = """
.tiles dd{white-space:normal}
.history{display:block;width:100%;height:150px;margin-top:8px}
#map{height:min(560px,64vh)}
"""
_LIMITS_M_PER_KM = tuple(limit * INCH_PER_MILE_M_PER_KM for limit in (GOOD_BELOW_IN_PER_MI, FAIR_TO_IN_PER_MI))
"""Of colours: those by which a section is rough, so that the map and the list of visits say the same."""
_MODES = (("m", "Mean IRI"), ("w", "Roughest"), ("t", "Became worse"))
_HINT = "Tap or click a piece of road for its figures; zoom in for more detail."


def fleet_page(figures: FleetFigures, sections: RoadTable) -> doc.Html:
    """The page of figures by segment; ``sections``: the same by 0.1 mi, for the lists."""
    segments = figures.roads
    first, last = utc(int(segments.last_us.min())), utc(int(segments.last_us.max()))
    under = (f"{counted(figures.windows, 'window')} of {counted(len(figures.cars), 'car')} · roads last seen "
             f"{first:%Y-%m-%d} to {last:%Y-%m-%d}")
    x, y = projected(segments.lat_deg, segments.lon_deg)
    level = highest_level(x, y)
    data = {"box": [float(x.min()), float(y.min()), float(x.max()), float(y.max())], "levels": level,
            "deepest": DEEPEST, "roots": names_of(x, y, level), "segment_m": SEGMENT_M,
            "limits": list(_LIMITS_M_PER_KM)}
    return doc.document("A fleet's roads", [doc.heading("A fleet's roads", under), _tiles(figures, sections), _map(),
                                            _rough(sections), _worse(sections), _cars(figures),
                                            doc.data_block("data", data)],
                        style=doc.asset("page.css") + _STYLE, loads=True, script='"use strict";\n'
                        + "".join(map(doc.asset, _SHARED)) + doc.asset("fleet.js", "logger.fleet"))


def _tiles(figures: FleetFigures, sections: RoadTable) -> doc.Html:
    segments, growth = figures.roads, figures.biases.growth_per_year
    mean = float(np.average(segments.iri_m_per_km, weights=segments.length_m))
    return tiles([
        ("Road, each direction", distance_words(float(segments.length_m.sum())), ""),
        ("Mean roughness (IRI)", f"{mean:.2f}", "m/km"),
        ("Change of the average road", f"{growth:+.1%}" if np.isfinite(growth) else None, "a year"),
        ("Became worse", f"{int(sections.worse.sum()):,}" if sections.changes_known else None,
         f"of {len(sections.key):,} sections"),
        ("Work list", f"{int((sections.visit != '').sum()):,}", "sections"),
    ])


def _map() -> doc.Html:
    buttons = doc.concatenated(doc.html('<button type="button" data-mode="{}" aria-pressed="{}">{}</button>', name,
                                        "true" if name == "m" else "false", words) for name, words in _MODES)
    good, fair = _LIMITS_M_PER_KM
    ranges = (f"below {good:.2f}", f"{good:.2f} to {fair:.2f}", f"above {fair:.2f}")
    legend = doc.concatenated(doc.html('<li><i class="f{}"></i>{}, {} m/km</li>', rank, *words)
                              for rank, words in enumerate(zip(FEDERAL_WORDS, ranges, strict=True)))
    return doc.section("Map", doc.html(
        '<noscript><p class="warn">The map is drawn by a script, which this browser does not run.</p></noscript>'
        '<div class="switch" role="group" aria-label="What the colours of the map show">{}</div>'
        '<div class="picture" id="map"><canvas tabindex="0" role="application" aria-label="Map of the roads. Arrow '
        'keys move it, plus and minus zoom, 0 shows all. The lists below hold the work list."></canvas>'
        '<canvas class="over" aria-hidden="true"></canvas><div class="zoom">'
        '<button type="button" data-zoom="in" aria-label="Zoom in">+</button>'
        '<button type="button" data-zoom="out" aria-label="Zoom out">−</button>'
        '<button type="button" data-zoom="all" aria-label="Show all">⤢</button></div></div>'
        '<ul class="legend">{}</ul><div class="readout"><div id="reading" aria-live="polite">'
        '<p class="hint" id="hint">{}</p></div></div>', buttons, legend, _HINT))


def _place(sections: RoadTable, one: int) -> doc.Html:
    return doc.html('<button type="button" data-lat="{0:.6f}" data-lon="{1:.6f}">{0:.5f}, {1:.5f}</button>',
                    float(sections.lat_deg[one]), float(sections.lon_deg[one]))


def _rough(sections: RoadTable) -> doc.Html:
    order = np.flatnonzero(sections.visit != "")
    order = order[np.argsort(-sections.iri_m_per_km[order], kind="stable")][:_SHOWN_ROADS].tolist()
    rows = [(_place(sections, one), f"{sections.iri_m_per_km[one]:.2f} {error_words(sections.iri_std_m_per_km[one])}",
             f"{sections.length_m[one]:.0f}", str(sections.cars[one]), f"{sections.passes[one]:.0f}",
             f"{utc(int(sections.last_us[one])):%Y-%m-%d}", sections.visit[one].replace("|", ", ")) for one in order]
    heads = ("Place", "IRI [m/km]", "Length [m]", "Cars", "Passes", "Last seen", "Why")
    none = ("No section is rough, worse or uncomfortable." if np.isfinite(sections.iri_std_m_per_km).any() else
            "Too few drives to be certain of any section.")
    return doc.section("Work list", doc.grid(heads, rows, words=(0, 5, 6)) + doc.hint(
        "Sections of 0.1 mi, one direction each. Rough: above 170 in/mi with 95 % certainty; worse: its change is "
        "significant; uncomfortable: 0.8 m/s² and more. Cars and passes: the fewest cars and the mean passes of its "
        "segments.")) if rows else doc.section("Work list", doc.html('<p class="empty">{}</p>', none))


def _worse(sections: RoadTable) -> doc.Html:
    order = np.flatnonzero(sections.worse)
    order = order[np.argsort(sections.p_value[order], kind="stable")][:_SHOWN_ROADS].tolist()
    rows = [(_place(sections, one), f"{sections.iri_m_per_km[one]:.2f}",
             f"{sections.trend_m_per_km_per_year[one]:+.2f} ± {sections.trend_std_m_per_km_per_year[one]:.2f}",
             f"{sections.p_value[one]:.1g}") for one in order]
    return doc.section("Became worse", doc.grid(("Place", "IRI [m/km]", "A year [m/km]", "p"), rows) + doc.hint(
        f"The {len(rows)} most certain of {int(sections.worse.sum()):,}; at most {FALSE_SHARE:.0%} of all that are "
        "called worse are false (Benjamini and Hochberg 1995).")) if rows else doc.EMPTY


def _cars(figures: FleetFigures) -> doc.Html:
    biases = figures.biases
    order = np.argsort(-np.abs(biases.gain - 1.0) * biases.known, kind="stable")[:_SHOWN_ROADS].tolist()
    rows = [(figures.names[one], f"{biases.gain[one] - 1.0:+.1%} ± "
             f"{biases.gain[one] * biases.log_std[one]:.1%}" if biases.known[one] else "not known",
             f"{figures.car_passes[one]:,.0f}") for one in order]
    return doc.section("Cars", doc.grid(("Car", "Bias", "Passes"), rows) + doc.hint(not_known(figures) or (
        "Bias of a car on the roads that it shares with others, relative to the average car; the figures above are "
        "corrected for it. Cars that differ from the average car come first.")))


INDEX = "index.html"
_TILES = "tiles"


def check_folder(out: Path) -> None:
    """Raise BadInput for a place that is neither free nor a report's."""
    if not out.parent.is_dir():
        raise BadInput(f"--out {out}: expected a folder inside one that exists")
    is_report = (out / INDEX).is_file() and (out / _TILES).is_dir()
    if out.exists() and not is_report and not (out.is_dir() and not any(out.iterdir())):
        raise BadInput(f"--out {out}: expected a new or empty folder, or one of an earlier report")


def history_of(engine: Engine, figures: FleetFigures, since_us: int | None, until_us: int | None) -> History:
    """The quarters of the segments of a summary."""
    found = engine.arrays(history(engine.rows, gains_table(figures.cars, figures.biases), since_us, until_us))
    key = figures.roads.key
    at = np.minimum(np.searchsorted(key, found["road"]), len(key) - 1)
    published = key[at] == found["road"]
    passes = found["passes"][published]
    return History(at[published], found["quarter"][published], found["iri"][published] / passes, passes)


def write_report(figures: FleetFigures, steps: History, pieces: RoadPieces | None, out: Path) -> int:
    """Write the folder, of figures by segment; give the number of tiles. BadInput for what cannot be written."""
    sections = grouped(figures.roads, "section", pieces, figures.shared)
    try:
        with whole_folder(out) as new:
            tiles = write_tiles(figures.roads, steps, new / _TILES)
            for name, roads in (("segments.parquet", figures.roads), ("sections.parquet", sections),
                                ("sections.csv", sections)):
                write_file(new / name, format_of(out / name).content(roads_layer(roads).printable(), str(out / name)))
            write_text(new / INDEX, fleet_page(figures, sections))
    except OSError as error:
        raise BadInput(f"--out {out}: expected a folder that can be written ({error.strerror or error})") from None
    return tiles
