"""What the page's script fills: the places of the map, the curves and the table, with their keys and words."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from logger.records import WindowRecord
from logger.report.document import hint, section
from logger.report.html import EMPTY, Html, concatenated, html
from logger.report.places_passed import MOST_ROWS
from logger.report.summary import COMFORT_NAMES, IRI_CLASSES, DriveSummary, Share
from logger.report.terminal import class_words, comfort_words

_MODES = (("iri", "Roughness"), ("comfort", "Comfort"), ("trust", "Flags"))
_TRUST = (("0", "no flag"), ("3", "a flag, and a value"), ("x", "no value, or one that stands in no mean"))


def track_views(records: Sequence[WindowRecord], summary: DriveSummary, sources: str, drives: Sequence[str]) -> Html:
    """The map and the curves, which the script draws, and what it says of them.

    sources    whose pictures and roads the map shows
    drives     when each was
    """
    placed = any(record.lat_deg is not None and record.lon_deg is not None for record in records)
    if not placed and not summary.distance_m > 0:
        return section("Along the way", Html('<p class="empty">No row has a position or a distance: there is neither '
                                             "map nor curve.</p>"))
    parts = [_map_view(summary, sources, drives) if placed else
             Html('<p class="empty">No row has a position, so there is no map.</p>')]
    parts += [_curves_view()] if summary.distance_m > 0 else []
    return html('<section id="views" data-mode="iri"><h2>Along the way</h2><noscript><p class="warn">The map, the '
                "curves and the table of windows are drawn by a script, which this browser does not run.</p>"
                "</noscript>{}{}</section>", concatenated(parts), _READOUT)


def _choice(drives: Sequence[str]) -> Html:
    """All drives, or one of them."""
    if len(drives) < 2:
        return EMPTY
    options = concatenated(html('<option value="{}">Drive {}: {}</option>', number, number + 1, when)
                           for number, when in enumerate(drives))
    return html('<label class="choice">Show <select id="only"><option value="-1">all drives</option>{}</select>'
                "</label>", options)


def _repeated_words(windows: int) -> str:
    if windows <= MOST_ROWS:
        return "Where several drives came by, the colour is that of their mean."
    return (f"More than {MOST_ROWS:,} windows: where several drives came by, they are drawn one over the other. Show a "
            "single drive, or let ridelog passes average them.")


def _map_view(summary: DriveSummary, sources: str, drives: Sequence[str]) -> Html:
    buttons = concatenated(html('<button type="button" data-mode="{}" aria-pressed="{}">{}</button>', name,
                                "true" if name == "iri" else "false", words) for name, words in _MODES)
    trust = concatenated(html('<li><i class="f{}"></i>{}</li>', *entry) for entry in _TRUST)
    repeated = hint(_repeated_words(summary.windows)) if len(drives) > 1 else EMPTY
    return html('<div class="above"><div class="switch" role="group" aria-label="What the colours of the map show">'
                "{}</div>{}</div>"
                '<div class="picture" id="map"><canvas tabindex="0" role="application" aria-label="Map of the way. '
                "Arrow keys move it, plus and minus zoom, 0 shows all. The table of all windows below holds the same "
                'values."></canvas><canvas class="over" aria-hidden="true"></canvas><div class="zoom">'
                '<button type="button" data-zoom="in" aria-label="Zoom in">+</button>'
                '<button type="button" data-zoom="out" aria-label="Zoom out">−</button>'
                '<button type="button" data-zoom="all" aria-label="Show the whole way">⤢</button></div></div>'
                '{}{}<ul class="legend by-trust">{}</ul>{}{}', buttons, _choice(drives),
                _legend("by-iri", summary.iri_classes, tuple(IRI_CLASSES), class_words),
                _legend("by-comfort", summary.comfort, COMFORT_NAMES, comfort_words), trust, repeated,
                hint(sources) if sources else EMPTY)


def _curves_view() -> Html:
    return Html('<div class="picture" id="curves"><canvas tabindex="0" role="application" aria-label="Curves '
                "of roughness, weighted acceleration and speed along the way. Left and right go from window "
                "to window, with Shift they choose a range; plus and minus zoom, 0 shows all. The table of all "
                'windows below holds the same values."></canvas><canvas class="over" aria-hidden="true"></canvas>'
                "</div>") + hint(
        "The shaded band is the IRI plus and minus its standard error. Where many windows share a place of the "
        "picture, the line is their mean, weighted by length, the band the mean error of one window, and a grey stroke "
        "reaches up to the worst of them. Dotted: lower limits of the IRI classes, and of discomfort (fairly, very, "
        "extreme). The strip at the bottom: orange where a window carries a flag, grey where it has no value that "
        "counts.")


_READOUT = Html(
    '<div class="readout"><div id="reading" aria-live="polite"><p class="hint">Point at a window, or tap it. Drag over '
    'the curves for the figures of a range.</p></div><div id="range" hidden><div id="figures" aria-live="polite"></div>'
    '<p class="actions"><button type="button" id="range-look">Look at it</button>'
    '<button type="button" id="look-all">Whole way</button>'
    '<button type="button" id="range-clear">Forget the range</button></p></div></div>')


def _legend(name: str, shares: Sequence[Share], names: tuple[str, ...], words_of: Callable[[str], str]) -> Html:
    shown = {share.name for share in shares}
    ranks = [number for number, one in enumerate(names) if one in shown]
    shown |= set(names[min(ranks): max(ranks)]) if ranks else set()  # a mean of windows may lie between their classes
    entries = concatenated(html('<li><i class="f{}"></i>{}</li>', rank(one, names), words_of(one))
                           for one in sorted(shown, key=lambda one: names.index(one) if one in names else len(names)))
    return html('<ul class="legend {}">{}</ul>', name, entries)


def windows_table(records: Sequence[WindowRecord]) -> Html:
    """Every row, as a table of which the script shows some at a time: it stands behind the map and the curves."""
    names = ("drive", "row", "time UTC", "from [m]", "lat", "lon", "km/h", "IRI [m/km]", "±", "a_w [m/s²]",
             "MTVV [m/s²]", "VDV [m/s^1.75]", "crest", "class", "comfort", "flags")
    head = concatenated(html('<th scope="col">{}</th>', name) for name in names)
    turns = concatenated(html('<button type="button" data-turn="{}">{}</button>', *turn) for turn in (
        ("first", "First"), ("-1", "Previous"), ("1", "Next"), ("last", "Last")))
    return html('<details class="rows"><summary>All windows ({})</summary><div class="scroll"><table><thead><tr>{}</tr>'
                '</thead><tbody id="rows"></tbody></table></div><p class="actions">{}<span id="rows-of" '
                'aria-live="polite"></span></p></details>', len(records), head, turns)


def rank(name: str, names: tuple[str, ...]) -> str:
    """Number of a name's colour; ``x`` for what has none."""
    return str(names.index(name)) if name in names else "x"
