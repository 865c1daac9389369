"""The report: one HTML page that holds all it shows.

It opens from a stick on a machine without network or rights: no script, no picture or font from elsewhere, and a
content policy that forbids them even if a hostile file got a tag past us. Every text that comes from a file is
escaped. The map and the curves are drawn by a script of ours (``assets``) out of packed numbers; all else is plain.

Problem: 100,000 windows of some fifteen numbers are 15 MB as text, and a page has to hold them. Solution: a number is
kept in the steps that can be read off the page (a millimetre, a hundredth of a m/km), differences from row to row are
kept where neighbours are alike, and what is left is deflated byte by byte of equal weight, so that the bytes that are
all zero cost nothing.
"""

import json
import zlib
from base64 import b64encode
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from math import isfinite
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import numpy.typing as npt

from logger.chart_data import Array
from logger.comfort.iso2631 import COMFORT_WORDS
from logger.printable import counted, span_words
from logger.records import WindowRecord
from logger.report import document as doc
from logger.report.placed import MOST_ROWS, PlacesPassed, places_passed
from logger.report.quantities import fixed
from logger.report.summary import (
    COMFORT_NAMES,
    IRI_CLASSES,
    DriveSummary,
    RoughWindow,
    Share,
    class_limits_m_per_km,
    class_words,
    comfort_words,
    counts,
    date_words,
    distance_words,
    expected_square,
    iri_words,
    place_words,
    summarise,
)
from logger.store.log.log_reader import LoggedFile, along_m, joined, length_m, split_drives, utc
from logger.units import KMH_MPS
from logger.vehicle.uncertain import not_known
from logger.vehicle.vehicle import GENERIC

SCRIPTS = ("windows.js", "canvas.js", "map.js", "curves.js", "page.js")

_A_W = doc.Html("a<sub>w</sub> [m/s²]")

FLAG_MEANINGS: Mapping[str, str] = {
    "gps_lost": "speed and position were carried through a short loss of the GPS, or are absent",
    "gap": "samples of the accelerometer are missing",
    "clipped": "the accelerometer clipped, at the end of its range: the road is at least this rough",
    "frozen": "the readings of the accelerometer had not changed for half a minute of driving: no figures",
    "repeated": "the accelerometer, or its bridge, sent each sample more than once: no figures",
    "gps_late": "the GPS line was full and the fixes waited: place, speed and time may be seconds late",
    "speed_doubtful": "the GPS's speed and positions disagree: no IRI",
    "slow": "below the speed at which the r.m.s. relation holds",
    "fast": "above the speed at which the r.m.s. relation holds",
    "stationary": "the car stood inside the window; averages leave that time out",
    "time_unset": "the GPS had not given the time yet",
    "partial": "cut short by the end of a drive or of the recording",
    "unsettled": "too near to a start, an end or a gap in the readings",
    "hidden": "the ride is below the sensor's noise: no value; averages count half of the measured power",
    "faint": "the sensor hardly sees this road at this speed",
    "blind": "no speed: a window by time, without distance",
}


@dataclass(frozen=True, eq=False)
class MapLine:
    """A line on the ground: latitudes and longitudes (n,) [degrees]."""

    name: str
    lat_deg: Array
    lon_deg: Array


def page(files: Sequence[LoggedFile], base: Sequence[MapLine] = (), base_name: str = "", tiles_from: str = "",
         first: Sequence[str] = (), title: tuple[str, str] | None = None,
         marked: Sequence[int] | None = None) -> doc.Html:
    """The page of some log files, in order of their writing, as one HTML document.

    base          roads that are drawn beneath, out of a file named ``base_name``
    tiles_from    address of street pictures, with {z}, {x} and {y} in it; empty: none, and no request is made
    first         sections above the map
    title         and a line under it, of means that carry no flags; None: of drives, and their dates
    marked        rows with a number on the map and in the curves, which ``first`` lists; None: the roughest places,
                  which are listed too
    """
    records = [record for file in files for record in file.records]
    summary = summarise(records)
    drives = split_drives(records)
    host = "{0.scheme}://{0.netloc}".format(urlsplit(tiles_from)) if tiles_from else ""
    return doc.document(title[0] if title else f"Road roughness, {date_words(summary)}", [
        doc.heading(*title) if title else _head(summary, files),
        _tiles(summary),
        *first,
        track_views(records, summary, _sources(base_name, host), [date_words(summarise(one)) for one in drives]),
        _shares_section(summary),
        _places_section(records, summary.roughest) if marked is None else doc.EMPTY,
        _drives_section(drives) if len(drives) > 1 else doc.EMPTY,
        _notes_section(summary, files) if title is None else doc.EMPTY,
        _settings_section(files),
        windows_table(records),
        doc.data_block("data", track_data(drives, base, places_passed(drives)) | {
            "places": _numbers(records, summary.roughest) if marked is None else list(marked),
            "tiles": tiles_from, "meanings": FLAG_MEANINGS,
            "names": {"iri": [class_words(letter) for letter in IRI_CLASSES],
                      "comfort": [comfort_words(name) for name in COMFORT_NAMES]}}),
    ], style=doc.asset("page.css"), script='"use strict";\n' + "".join(map(doc.asset, SCRIPTS)), images_from=host)


def _sources(base_name: str, host: str) -> str:
    """Whose pictures and roads the map shows."""
    shown = [f"Roads beneath: {base_name}"] if base_name else []
    shown += [f"Street pictures: {urlsplit(host).netloc}"] if host else []
    return ". ".join([*shown, "Where they are OpenStreetMap's: © OpenStreetMap contributors"]) if shown else ""


def _head(summary: DriveSummary, files: Sequence[LoggedFile]) -> doc.Html:
    sidecar = next((file.sidecar for file in files if file.sidecar), {})
    vehicle = _inside(sidecar, "vehicle", "name")
    version = _inside(sidecar, "ridelog_version")
    words = [date_words(summary)]
    words += [f"vehicle {vehicle}"] if vehicle else []
    words += [f"ridelog {version}"] if version else []
    what = "Road roughness of a drive" if summary.drives == 1 else f"Road roughness of {summary.drives} drives"
    return doc.heading(what, " · ".join(words))


def _tiles(summary: DriveSummary) -> doc.Html:
    return doc.tiles([
        ("Distance", distance_words(summary.distance_m), ""),
        ("Time", span_words(summary.duration_s), ""),
        ("Mean speed", _kmh(summary.mean_speed_mps), "km/h"),
        ("Mean roughness (IRI)", fixed(summary.mean_iri_m_per_km, 1), "m/km"),
        (doc.Html("Comfort inside (a<sub>w</sub>)"), fixed(summary.a_w_mps2, 2), "m/s²"),
    ])


def _shares_section(summary: DriveSummary) -> doc.Html:
    return doc.html('<section class="columns"><div><h2>Road by IRI (classes of ISO 8608)</h2>{}</div><div>'
                    "<h2>Road by comfort</h2>{}</div></section>",
                    _shares(summary.iri_classes, tuple(IRI_CLASSES), class_words),
                    _shares(summary.comfort, COMFORT_NAMES, comfort_words))


def _shares(shares: Sequence[Share], names: tuple[str, ...], words_of: Callable[[str], str]) -> doc.Html:
    if not shares:
        return doc.Html('<p class="empty">No distance was measured.</p>')
    return doc.html("<table>{}</table>", doc.concatenated(
        doc.html('<tr><td>{0}</td><td class="bar"><span class="f{1}" style="width:{2:.1%}"></span></td>'
                 '<td class="n">{2:.1%}</td><td class="n">{3}</td></tr>', words_of(share.name),
                 rank(share.name, names), share.share, distance_words(share.distance_m)) for share in shares))


def _places_section(records: Sequence[WindowRecord], places: Sequence[RoughWindow]) -> doc.Html:
    rows = [(number_button(index, number), str(place.drive), _instant(place.utc_us), _geo(place),
             distance_words(place.along_m), iri_words(place), _kmh(place.speed_mps),
             fixed(place.a_w_mps2, 2), comfort_words(place.comfort), " ".join(place.flags))
            for number, (index, place) in enumerate(zip(_numbers(records, places), places, strict=True), start=1)]
    if not rows:
        return doc.EMPTY
    heads = ("#", "Drive", "When (UTC)", "Coordinates", "Distance", "IRI [m/km]", "Speed [km/h]", _A_W, "Comfort",
             "Flags")
    return doc.section("Roughest places", doc.html(
        '<div id="places">{}</div>', doc.grid(heads, rows, words=(0, 1, 2, 3, 8, 9))) + doc.hint(
        "Each row is the worst window within 50 m, with its standard error. One window is an uncertain estimate: visit "
        "a place before you judge it. The map and the curves show its number."))


def number_button(row: int, number: int) -> doc.Html:
    """The number of a place, which shows its row on the map and in the curves."""
    return doc.html('<button type="button" data-window="{}">{}</button>', row, str(number))


def _numbers(records: Sequence[WindowRecord], places: Sequence[RoughWindow]) -> list[int]:
    rows = {(along, record.iri_m_per_km): index
            for index, (along, record) in enumerate(zip(along_m(records), records, strict=True))}
    return [rows[place.along_m, place.iri_m_per_km] for place in places]


def _geo(place: RoughWindow) -> doc.Html | str:
    if place.lat_deg is None or place.lon_deg is None:
        return "not known"
    return doc.map_links(place.lat_deg, place.lon_deg, place_words(place))


def _drives_section(drives: Sequence[Sequence[WindowRecord]]) -> doc.Html:
    rows = [(str(number), date_words(one), distance_words(one.distance_m), span_words(one.duration_s),
             fixed(one.mean_iri_m_per_km, 1), fixed(one.a_w_mps2, 2))
            for number, one in enumerate(map(summarise, drives), start=1)]
    return doc.section("Drives",
                       doc.grid(("#", "When", "Distance", "Time", "Mean IRI [m/km]", _A_W), rows, words=(0, 1)))


def notices(files: Sequence[LoggedFile]) -> list[str]:
    """That the car of some was not known, and how wrong that can make their IRI at most; empty: it was."""
    shares = [_inside(file.sidecar or {}, "iri_vehicle_share_std") for file in files
              if _inside(file.sidecar or {}, "vehicle", "name") == GENERIC]
    known = [share for share in shares if isinstance(share, float) and isfinite(share)]
    return [not_known(max(known))] if known else []


def _notes_section(summary: DriveSummary, files: Sequence[LoggedFile]) -> doc.Html:
    notes = [_sensor_note(sidecar) for sidecar in _different(_inside(file.sidecar or {}, "sensor") for file in files)]
    missing = [file.name for file in files if file.sidecar is None]
    lost = [file.name for file in files if _inside(file.sidecar or {}, "settings_lost") is True]
    damaged = sum(file.damaged_lines for file in files)
    notes += [_warning(words) for words in notices(files)]
    if missing:
        notes.append(_warning("Logs without a sidecar (.json):") + f" {', '.join(missing[:20])}")
    if lost:
        notes.append(_warning("Their settings were lost before a repair:") + f" {', '.join(lost[:20])}")
    if damaged:
        notes.append(_warning(f"{damaged} damaged {'line was' if damaged == 1 else 'lines were'} left out."))
    if summary.blind_s > 0:
        notes.append(f"{span_words(summary.blind_s)} without any speed: left out of distance, map and curves.")
    notes += [f"iri_m_per_km: {meaning}"
              for meaning in _different(_inside(file.sidecar or {}, "iri_m_per_km") for file in files)]
    notes.append(f"{counted(summary.windows, 'window')} from {counted(len(files), 'log file')}")
    rows = [(flag, str(count), f"{count / summary.windows:.1%}", FLAG_MEANINGS.get(flag, ""))
            for flag, count in summary.flags.items()]
    flags = (doc.grid(("Flag", "Windows", "Share", "Meaning"), rows, words=(0, 3)) if rows
             else doc.paragraphs(["No window carries a flag."]))
    return doc.section("How far to trust it", flags + doc.bullets(notes, style="notes"))


def _warning(text: str) -> doc.Html:
    return doc.html('<span class="warn">{}</span>', text)


def _sensor_note(sensor: Any) -> str:
    if not isinstance(sensor, Mapping):
        return f"Sensor: {sensor}"
    name = " ".join(str(sensor[key]) for key in ("driver", "profile", "profile_version") if key in sensor)
    if sensor.get("verified") is True:
        return f"Sensor: {name}"
    return f"Sensor: {name}. " + _warning("Nobody has verified on hardware what its bytes mean: do not rely on any "
                                          "value here.")


def _settings_section(files: Sequence[LoggedFile]) -> doc.Html:
    most, most_characters = 10, 20_000
    different = _different({key: value for key, value in file.sidecar.items() if key not in ("log", "clock_map")}
                           for file in files if file.sidecar)
    if not different:
        return doc.EMPTY
    texts = [json.dumps(content, indent=2, ensure_ascii=False) for content in different[:most]]
    blocks = doc.concatenated(doc.html("<pre>{}</pre>", text[:most_characters]) for text in texts)
    return doc.html("<details><summary>Settings, vehicle and versions</summary>{}</details>", blocks)


def _kmh(speed_mps: float | None) -> str:
    return fixed(speed_mps and speed_mps / KMH_MPS, 0)


def _instant(utc_us: int | None) -> str:
    return "not known" if utc_us is None else f"{utc(utc_us):%Y-%m-%d %H:%M:%S}"


def _inside(content: Any, *keys: str) -> Any:
    """What stands under some nested keys; None where one is missing. A sidecar may hold anything."""
    for key in keys:
        content = content.get(key) if isinstance(content, Mapping) else None
    return content


def _different(contents: Iterable[Any]) -> list[Any]:
    """Contents that are there, each once, in order."""
    seen: dict[str, Any] = {}
    for content in contents:
        if content is not None:
            seen.setdefault(json.dumps(content, sort_keys=True), content)
    return list(seen.values())


_MODES = (("iri", "Roughness"), ("comfort", "Comfort"), ("trust", "Flags"))
_TRUST = (("0", "no flag"), ("3", "a flag, and a value"), ("x", "no value, or one that the means leave out"))


def track_views(records: Sequence[WindowRecord], summary: DriveSummary, sources: str,
                drives: Sequence[str]) -> doc.Html:
    """The map and the curves, which the script draws, and what it says of them.

    sources    whose pictures and roads the map shows
    drives     when each was
    """
    placed = any(record.lat_deg is not None and record.lon_deg is not None for record in records)
    if not placed and not summary.distance_m > 0:
        return doc.section("Along the road",
                           doc.Html('<p class="empty">No row has a position or a distance: there is neither '
                                             "map nor curve.</p>"))
    parts = [_map_view(summary, sources, drives) if placed else
             doc.Html('<p class="empty">No row has a position, so there is no map.</p>')]
    parts += [_curves_view()] if summary.distance_m > 0 else []
    return doc.html('<section id="views" data-mode="iri"><h2>Along the road</h2><noscript><p class="warn">The map, the '
                    "curves and the table of windows are drawn by a script, which this browser does not run.</p>"
                    "</noscript>{}{}</section>", doc.concatenated(parts), _READOUT)


def _choice(drives: Sequence[str]) -> doc.Html:
    if len(drives) < 2:
        return doc.EMPTY
    options = doc.concatenated(doc.html('<option value="{}">Drive {}: {}</option>', number, number + 1, when)
                               for number, when in enumerate(drives))
    return doc.html('<label class="choice">Show <select id="only"><option value="-1">all drives</option>{}</select>'
                    "</label>", options)


def _repeated_words(windows: int) -> str:
    if windows <= MOST_ROWS:
        return "Where several drives passed, the colour shows their mean."
    return (f"More than {MOST_ROWS:,} windows: where several drives passed, the page draws one over the other. Show a "
            "single drive, or average them with ridelog passes.")


def _map_view(summary: DriveSummary, sources: str, drives: Sequence[str]) -> doc.Html:
    buttons = doc.concatenated(doc.html('<button type="button" data-mode="{}" aria-pressed="{}">{}</button>', name,
                                        "true" if name == "iri" else "false", words) for name, words in _MODES)
    trust = doc.concatenated(doc.html('<li><i class="f{}"></i>{}</li>', *entry) for entry in _TRUST)
    repeated = doc.hint(_repeated_words(summary.windows)) if len(drives) > 1 else doc.EMPTY
    return doc.html('<div class="above"><div class="switch" role="group" aria-label="What the colours of the map show">'
                    "{}</div>{}</div>"
                    '<div class="picture" id="map"><canvas tabindex="0" role="application" aria-label="Map of the '
                    "road. Arrow keys move it, plus and minus zoom, 0 shows all. The table of all windows below holds "
                    'the same values."></canvas><canvas class="over" aria-hidden="true"></canvas><div class="zoom">'
                    '<button type="button" data-zoom="in" aria-label="Zoom in">+</button>'
                    '<button type="button" data-zoom="out" aria-label="Zoom out">−</button>'
                    '<button type="button" data-zoom="all" aria-label="Show the whole drive">⤢</button></div></div>'
                    '{}{}<ul class="legend by-trust">{}</ul>{}{}', buttons, _choice(drives),
                    _legend("by-iri", summary.iri_classes, tuple(IRI_CLASSES), class_words),
                    _legend("by-comfort", summary.comfort, COMFORT_NAMES, comfort_words), trust, repeated,
                    doc.hint(sources) if sources else doc.EMPTY)


def _curves_view() -> doc.Html:
    return doc.Html('<div class="picture" id="curves"><canvas tabindex="0" role="application" aria-label="Curves '
                    "of roughness, weighted acceleration and speed along the road. Left and right go from window "
                    "to window, with Shift they choose a range; plus and minus zoom, 0 shows all. The table of all "
                    'windows below holds the same values."></canvas><canvas class="over" aria-hidden="true"></canvas>'
                    "</div>") + doc.hint(
            "The shaded band is the IRI plus and minus its standard error. Where many windows share a pixel, "
            "the line is their mean, weighted by length, and the band is the mean standard error of one window. A grey "
            "stroke reaches up to the worst of them. Dotted: lower limits of the IRI classes, and of discomfort "
            "(fairly, very, extreme). The strip at the bottom: orange where a window carries a flag, grey where it has "
            "no usable value.")


_READOUT = doc.Html(
    '<div class="readout"><div id="reading" aria-live="polite"><p class="hint">Point at a window, or tap it. Drag over '
    'the curves for the figures of a range.</p></div><div id="range" hidden><div id="figures" aria-live="polite"></div>'
    '<p class="actions"><button type="button" id="range-look">Zoom to it</button>'
    '<button type="button" id="look-all">Whole drive</button>'
    '<button type="button" id="range-clear">Clear the range</button></p></div></div>')


def _legend(name: str, shares: Sequence[Share], names: tuple[str, ...], words_of: Callable[[str], str]) -> doc.Html:
    shown = {share.name for share in shares}
    ranks = [number for number, one in enumerate(names) if one in shown]
    shown |= set(names[min(ranks): max(ranks)]) if ranks else set()  # a mean of windows may lie between their classes
    entries = doc.concatenated(doc.html('<li><i class="f{}"></i>{}</li>', rank(one, names), words_of(one))
                               for one in sorted(shown, key=lambda one: names.index(one) if one in names
                                                 else len(names)))
    return doc.html('<ul class="legend {}">{}</ul>', name, entries)


def windows_table(records: Sequence[WindowRecord]) -> doc.Html:
    """Every row, as a table of which the script shows some at a time: it stands behind the map and the curves."""
    names = ("drive", "row", "time UTC", "from [m]", "lat", "lon", "km/h", "IRI [m/km]", "±", "a_w [m/s²]",
             "MTVV [m/s²]", "VDV [m/s^1.75]", "crest", "class", "comfort", "flags")
    head = doc.concatenated(doc.html('<th scope="col">{}</th>', name) for name in names)
    turns = doc.concatenated(doc.html('<button type="button" data-turn="{}">{}</button>', *turn) for turn in (
        ("first", "First"), ("-1", "Previous"), ("1", "Next"), ("last", "Last")))
    return doc.html('<details class="rows"><summary>All windows ({})</summary><div class="scroll"><table><thead>'
                    '<tr>{}</tr></thead><tbody id="rows"></tbody></table></div><p class="actions">{}<span id="rows-of" '
                    'aria-live="polite"></span></p></details>', len(records), head, turns)


def rank(name: str, names: tuple[str, ...]) -> str:
    """Number of a name's colour; ``x`` for what has none."""
    return str(names.index(name)) if name in names else "x"


UNKNOWN, _MOST = np.iinfo(np.int32).min, np.iinfo(np.int32).max  # the first stands for a value that is not known
_DEG = 1e6  # Steps in a degree: 0.11 m, the six decimals that RFC 7946 (section 11.2) calls enough
Ints = npt.NDArray[np.uint32]
Column = tuple[str, float, int, Array]
"""Name, steps per unit, how many times differences are taken, values (n,) with NaN for unknown."""

_PLAIN: Sequence[tuple[str, float, int, Callable[[WindowRecord], float | None]]] = (
    ("row", 1, 1, lambda record: record.segment),
    ("length_m", 1e3, 1, length_m),
    ("duration_s", 1e3, 1, lambda record: record.duration_s),
    ("lat_deg", _DEG, 2, lambda record: record.lat_deg),
    ("speed_mps", 1e2, 1, lambda record: record.speed_mps),
    ("iri_m_per_km", 1e2, 0, lambda record: record.iri_m_per_km),
    ("iri_std_m_per_km", 1e2, 0, lambda record: record.iri_std_m_per_km),
    ("a_w_mps2", 1e3, 0, lambda record: record.a_w_mps2),
    ("mtvv_mps2", 1e2, 0, lambda record: record.mtvv_mps2),
    ("vdv_mps175", 1e2, 0, lambda record: record.vdv_mps175),
    ("crest_factor", 1e1, 0, lambda record: record.crest_factor),
    ("iri_rank", 1, 0, lambda record: _number_of(record.iri_class, tuple(IRI_CLASSES))),
    ("comfort_rank", 1, 0, lambda record: _number_of(record.comfort, COMFORT_NAMES)),
    ("counts", 1, 0, counts),
)


def track_data(drives: Sequence[Sequence[WindowRecord]], base: Sequence[MapLine] = (),
               passed: PlacesPassed | None = None) -> dict[str, Any]:
    """All that the script draws, as JSON can hold it.

    base      roads that are drawn beneath
    passed    places that several drives passed
    """
    records = list(chain.from_iterable(drives))
    origin_deg = next((record.lon_deg for record in records if record.lon_deg is not None), 0.0)
    flags = list(dict.fromkeys(record.flags for record in records))
    numbers = {combination: number for number, combination in enumerate(flags)}
    columns = [(name, steps, order, _floats(map(value_of, records))) for name, steps, order, value_of in _PLAIN]
    columns += [
        ("lon_deg", _DEG, 2, _unwrapped(_floats(record.lon_deg for record in records), origin_deg)),
        # Most windows begin when the one before ends: beside their durations their instants cost nothing.
        ("beyond_s", 1e3, 1, np.concatenate([_since_s(drive) for drive in drives] or [np.zeros(0)])
         - _elapsed_s(records)),
        # Most windows are expected to be what they are: as a difference the column is all but empty.
        ("expected_above_mps2", 1e3, 0, _floats(map(_expected_above, records))),
        ("flags", 1, 0, _floats(numbers[record.flags] for record in records)),
        ("begins", 1, 0, _begins(drives)),
    ]
    if passed is not None:
        columns.append(("place", 1, 2, passed.place))
    return {
        "windows": packed(columns),
        "drives": [{"windows": len(drive), "start_s": _start_s(drive)} for drive in drives],
        "passed": None if passed is None else packed([
            ("drives", 1, 0, passed.drives.astype(np.float64)), ("iri_m_per_km", 1e2, 0, passed.iri_m_per_km),
            ("iri_std_m_per_km", 1e2, 0, passed.iri_std_m_per_km)]),
        "flags": flags,
        "base": packed(_base_columns(base, origin_deg, _floats(record.lat_deg for record in records),
                                     columns[len(_PLAIN)][3])),
        "limits": {"iri": [class_limits_m_per_km(letter)[0] for letter in tuple(IRI_CLASSES)[1:]],
                   "comfort": sorted(limit for limit, _ in COMFORT_WORDS)[1:]},
        "letters": tuple(IRI_CLASSES),
    }


def packed(columns: Sequence[Column]) -> dict[str, Any]:
    """Columns of equal length as base64 text of one deflated block, and what is needed to read it."""
    planes = b"".join(_planes(values, steps, order) for _, steps, order, values in columns)
    return {"count": len(columns[0][3]), "columns": [[name, steps, order] for name, steps, order, _ in columns],
            "packed": b64encode(zlib.compress(planes, 9)).decode("ascii")}


def _planes(values: Array, steps: float, order: int) -> bytes:
    """The lowest bytes of all numbers, then the next ones, four in all. Differences wrap around 32 bits, as the
    script's sums do, so that any number comes back as it was."""
    known = np.isfinite(values)
    whole = np.where(known, np.clip(np.where(known, values, 0.0), -_MOST / steps, _MOST / steps) * steps, UNKNOWN)
    differences = np.rint(whole).astype(np.int64).astype(np.uint32)
    for _ in range(order):
        differences = np.diff(differences, prepend=np.uint32(0))
    signed = differences.view(np.int32)
    # Small numbers of either sign become small numbers without one (zigzag, as in Protocol Buffers).
    zigzag = (differences << np.uint32(1)) ^ (signed >> 31).view(np.uint32)
    return zigzag.astype("<u4").view(np.uint8).reshape(-1, 4).T.tobytes()


def _floats(values: Any) -> Array:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _unwrapped(lon_deg: Array, origin_deg: float) -> Array:
    """Longitudes that do not jump at the date line: within 180 degrees of the origin."""
    return (lon_deg - origin_deg + 180.0) % 360.0 - 180.0 + origin_deg


def _number_of(name: str, names: tuple[str, ...]) -> int | None:
    return names.index(name) if name in names else None


def _start_s(drive: Sequence[WindowRecord]) -> float | None:
    """Seconds since 1970 of the first row that knows them."""
    return next((record.utc_us / 1e6 for record in drive if record.utc_us is not None), None)


def _since_s(drive: Sequence[WindowRecord]) -> Array:
    """Time of each row since the drive's first date."""
    return _floats(record.utc_us and record.utc_us / 1e6 for record in drive) - (_start_s(drive) or 0.0)


def _elapsed_s(records: Sequence[WindowRecord]) -> Array:
    """Time in all windows before each, in the milliseconds that the script sums up."""
    lasted_s = np.round(_floats(record.duration_s for record in records), 3)
    return np.cumsum(lasted_s) - lasted_s


def _expected_above(record: WindowRecord) -> float | None:
    """How far the acceleration that stands in a mean lies above the one that is shown (NaN: it stands in none)."""
    square = expected_square(record)
    return None if square is None else square**0.5 - (record.a_w_mps2 or 0.0)


def _begins(drives: Sequence[Sequence[WindowRecord]]) -> Array:
    """2 where a drive begins, 1 where a row is not joined to the one before, 0 elsewhere."""
    begins = []
    for drive in drives:
        firsts = {id(piece[0]) for piece in joined(drive) if piece}
        placed = [record.lat_deg is not None and record.lon_deg is not None for record in drive]
        begins += [2] + [int(id(record) in firsts or here != before)
                         for record, here, before in zip(drive[1:], placed[1:], placed, strict=False)]
    return _floats(begins)


def _base_columns(base: Sequence[MapLine], origin_deg: float, lat_deg: Array, lon_deg: Array) -> list[Column]:
    """The roads beneath, those that come near to the way: as far around it as it is wide, 1 km at least."""
    near = _near(lat_deg, lon_deg)
    kept = [(way.lat_deg, lon) for way in base if near(way.lat_deg, lon := _unwrapped(way.lon_deg, origin_deg))]
    begins = [np.arange(len(lat)) == 0 for lat, _ in kept]
    return [("lat_deg", _DEG / 10, 1, np.concatenate([lat for lat, _ in kept] or [np.zeros(0)])),
            ("lon_deg", _DEG / 10, 1, np.concatenate([lon for _, lon in kept] or [np.zeros(0)])),
            ("begins", 1, 0, np.concatenate([one.astype(np.float64) for one in begins] or [np.zeros(0)]))]


def _near(lat_deg: Array, lon_deg: Array) -> Callable[[Array, Array], bool]:
    if not np.isfinite(lat_deg).any():
        return lambda lat, lon: False
    south, north = np.nanmin(lat_deg), np.nanmax(lat_deg)
    west, east = np.nanmin(lon_deg), np.nanmax(lon_deg)
    around = max(north - south, (east - west) * np.cos(np.radians(south)), 0.01)
    aside = around / max(np.cos(np.radians(south)), 0.01)
    return lambda lat, lon: bool(lat.size and lat.max() > south - around and lat.min() < north + around
                                 and lon.max() > west - aside and lon.min() < east + aside)
