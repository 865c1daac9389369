"""The overview of a fleet: a page of some ten kilobytes with a map, whose tiles lie beside it, and the lists to act
on."""

from __future__ import annotations

from functools import cache
from importlib import resources

import numpy as np

from logger.fleet.road_cells import SEGMENT_M
from logger.fleet.summary import FALSE_SHARE, FleetFigures, RoadTable
from logger.fleet.tiles import DEEPEST, highest_level, names_of, projected
from logger.fleet.words import error_words, not_known
from logger.printable import counted
from logger.report.document import data_block, document, grid, heading, hint, section, tiles
from logger.report.html import EMPTY, Html, concatenated, html
from logger.report.terminal import distance_words
from logger.roads.sections import FAIR_TO_IN_PER_MI, FEDERAL_WORDS, GOOD_BELOW_IN_PER_MI
from logger.store.log.log_reader import utc
from logger.units import INCH_PER_MILE_M_PER_KM

_SHOWN = 20
_SHARED = ("windows.js", "canvas.js", "map.js")
_STYLE = """
.tiles dd{white-space:normal}
.history{display:block;width:100%;height:150px;margin-top:8px}
#map{height:min(560px,64vh)}
"""
_LIMITS_M_PER_KM = tuple(limit * INCH_PER_MILE_M_PER_KM for limit in (GOOD_BELOW_IN_PER_MI, FAIR_TO_IN_PER_MI))
"""Of colours: those by which a section is rough, so that the map and the list of visits say the same."""
_MODES = (("m", "Mean IRI"), ("w", "Roughest"), ("t", "Became worse"))
_HINT = "Tap or click a piece of road for its figures; the nearer the map, the finer they are."


def fleet_page(figures: FleetFigures, sections: RoadTable) -> Html:
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
    return document("A fleet's roads", [
        heading("A fleet's roads", under), _tiles(figures, sections), _map(), _rough(sections), _worse(sections),
        _cars(figures), data_block("data", data),
    ], style=_shared("page.css") + _STYLE, loads=True,
        script='"use strict";\n' + "".join(map(_shared, _SHARED)) + _own())


@cache
def _shared(name: str) -> str:
    return (resources.files("logger.report") / "assets" / name).read_text("utf-8")


@cache
def _own() -> str:
    return (resources.files("logger.fleet") / "assets" / "fleet.js").read_text("utf-8")


def _tiles(figures: FleetFigures, sections: RoadTable) -> Html:
    segments, growth = figures.roads, figures.biases.growth_per_year
    mean = float(np.average(segments.iri_m_per_km, weights=segments.length_m))
    return tiles([
        ("Road, each direction", distance_words(float(segments.length_m.sum())), ""),
        ("Mean roughness (IRI)", f"{mean:.2f}", "m/km"),
        ("Change of the mean road", f"{growth:+.1%}" if np.isfinite(growth) else "not known", "a year"),
        ("Became worse", f"{int(sections.worse.sum()):,}" if sections.changes_known else "not known",
         f"of {len(sections.key):,} sections"),
        ("To visit", f"{int((sections.visit != '').sum()):,}", "sections"),
    ])


def _map() -> Html:
    buttons = concatenated(html('<button type="button" data-mode="{}" aria-pressed="{}">{}</button>', name,
                                "true" if name == "m" else "false", words) for name, words in _MODES)
    good, fair = _LIMITS_M_PER_KM
    ranges = (f"below {good:.2f}", f"{good:.2f} to {fair:.2f}", f"above {fair:.2f}")
    legend = concatenated(html('<li><i class="f{}"></i>{}, {} m/km</li>', rank, *words)
                          for rank, words in enumerate(zip(FEDERAL_WORDS, ranges, strict=True)))
    return section("Map", html(
        '<noscript><p class="warn">The map is drawn by a script, which this browser does not run.</p></noscript>'
        '<div class="switch" role="group" aria-label="What the colours of the map show">{}</div>'
        '<div class="picture" id="map"><canvas tabindex="0" role="application" aria-label="Map of the roads. Arrow '
        'keys move it, plus and minus zoom, 0 shows all. The lists below hold the places to visit."></canvas>'
        '<canvas class="over" aria-hidden="true"></canvas><div class="zoom">'
        '<button type="button" data-zoom="in" aria-label="Zoom in">+</button>'
        '<button type="button" data-zoom="out" aria-label="Zoom out">−</button>'
        '<button type="button" data-zoom="all" aria-label="Show all">⤢</button></div></div>'
        '<ul class="legend">{}</ul><div class="readout"><div id="reading" aria-live="polite">'
        '<p class="hint" id="hint">{}</p></div></div>', buttons, legend, _HINT))


def _place(sections: RoadTable, one: int) -> Html:
    return html('<button type="button" data-lat="{0:.6f}" data-lon="{1:.6f}">{0:.5f}, {1:.5f}</button>',
                float(sections.lat_deg[one]), float(sections.lon_deg[one]))


def _rough(sections: RoadTable) -> Html:
    order = np.flatnonzero(sections.visit != "")
    order = order[np.argsort(-sections.iri_m_per_km[order], kind="stable")][:_SHOWN].tolist()
    rows = [(_place(sections, one), f"{sections.iri_m_per_km[one]:.2f} {error_words(sections.iri_std_m_per_km[one])}",
             f"{sections.length_m[one]:.0f}", str(sections.cars[one]), f"{sections.passes[one]:.0f}",
             f"{utc(int(sections.last_us[one])):%Y-%m-%d}", sections.visit[one].replace("|", ", ")) for one in order]
    heads = ("Place", "IRI [m/km]", "Length [m]", "Cars", "Passes", "Last seen", "Why")
    none = ("No section gives a reason." if np.isfinite(sections.iri_std_m_per_km).any() else
            "Too few drives to be certain of any section.")
    return section("To visit", grid(heads, rows, words=(0, 5, 6)) + hint(
        "Sections of 0.1 mi, one direction each. Rough: above 170 in/mi with 95 % certainty; worse: its change is "
        "significant; uncomfortable: 0.8 m/s² and more. Cars and passes: the fewest cars and the mean passes of its "
        "segments.")) if rows else section("To visit", html('<p class="empty">{}</p>', none))


def _worse(sections: RoadTable) -> Html:
    order = np.flatnonzero(sections.worse)
    order = order[np.argsort(sections.p_value[order], kind="stable")][:_SHOWN].tolist()
    rows = [(_place(sections, one), f"{sections.iri_m_per_km[one]:.2f}",
             f"{sections.trend_m_per_km_per_year[one]:+.2f} ± {sections.trend_std_m_per_km_per_year[one]:.2f}",
             f"{sections.p_value[one]:.1g}") for one in order]
    return section("Became worse", grid(("Place", "IRI [m/km]", "A year [m/km]", "p"), rows) + hint(
        f"The {len(rows)} most certain of {int(sections.worse.sum()):,}; of all that are called worse at most "
        f"{FALSE_SHARE:.0%} are so falsely (Benjamini and Hochberg 1995).")) if rows else EMPTY


def _cars(figures: FleetFigures) -> Html:
    biases = figures.biases
    order = np.argsort(-np.abs(biases.gain - 1.0) * biases.known, kind="stable")[:_SHOWN].tolist()
    rows = [(figures.names[one], f"{biases.gain[one] - 1.0:+.1%} ± "
             f"{biases.gain[one] * biases.log_std[one]:.1%}" if biases.known[one] else "not known",
             f"{figures.car_passes[one]:,.0f}") for one in order]
    return section("Cars", grid(("Car", "Reads", "Passes"), rows) + hint(not_known(figures) or (
        "What a car reads of the roads that it shares with others, against the mean car; the figures above are free of "
        "it. The cars that read otherwise come first.")))
