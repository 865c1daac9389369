"""The report: one HTML page that holds all it shows.

It opens from a stick on a machine without network or rights: no script, no picture or font from elsewhere, and a
content policy that forbids them even if a hostile file got a tag past us. Every text that comes from a file is
escaped. The map and the curves are drawn by a script of ours (``assets``) out of packed numbers; all else is plain.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib import resources
from typing import Any
from urllib.parse import urlsplit

from logger.printable import counted
from logger.records import WindowRecord
from logger.report.document import (
    bullets,
    data_block,
    document,
    grid,
    heading,
    hint,
    map_links,
    paragraphs,
    section,
    tiles,
)
from logger.report.html import EMPTY, Html, concatenated, html
from logger.report.maps import Way
from logger.report.places_passed import places_passed
from logger.report.summary import (
    COMFORT_NAMES,
    IRI_CLASSES,
    DriveSummary,
    RoughWindow,
    Share,
    summarise,
)
from logger.report.terminal import (
    class_words,
    comfort_words,
    date_words,
    distance_words,
    iri_words,
    place_words,
    span_words,
)
from logger.report.track_data import track_data
from logger.report.track_views import rank, track_views, windows_table
from logger.store.log.log_reader import LoggedFile, along_m, split_drives, utc

SCRIPTS = ("windows.js", "canvas.js", "map.js", "curves.js", "page.js")
_MAX_SIDECARS = 10
_MAX_SIDECAR_CHARS = 20_000

_A_W = Html("a<sub>w</sub> [m/s²]")

FLAG_MEANINGS: Mapping[str, str] = {
    "gps_lost": "speed and position were carried through a short loss of the GPS, or are absent",
    "gap": "samples of the accelerometer are missing",
    "clipped": "the accelerometer stood at the end of its range: the road is at least this rough",
    "frozen": "the readings of the accelerometer had not changed for half a minute of driving: no figures",
    "repeated": "the accelerometer, or what brings its samples, gave each more than once: no figures",
    "gps_late": "the fixes waited on a full line, nobody knows how long: place, speed and time may be seconds late",
    "speed_doubtful": "the speed and the places of the GPS disagree: no IRI",
    "slow": "below the speed at which the r.m.s. relation holds",
    "fast": "above the speed at which the r.m.s. relation holds",
    "stationary": "the car stood inside the window; that time is not in the averages",
    "time_unset": "the GPS had not given the time yet",
    "partial": "cut short by the end of a drive or of the recording",
    "unsettled": "too near to a start, an end or a hole in the readings",
    "hidden": "the ride is below the sensor's own noise: no value, but it counts in means as what it can be",
    "faint": "the sensor hardly sees this road at this speed",
    "blind": "no speed: a window by time, without distance",
}


def page(files: Sequence[LoggedFile], base: Sequence[Way] = (), base_name: str = "", tiles_from: str = "",
         first: Sequence[str] = (), title: tuple[str, str] | None = None, marked: Sequence[int] | None = None) -> Html:
    """The page of some log files, in order of their writing, as one HTML document.

    base          roads that are drawn beneath, out of a file named ``base_name``
    tiles_from    address of street pictures, with {z}, {x} and {y} in it; empty: none, and no request is made
    first         sections above the map
    title         and a line under it; None: of drives, and their dates
    marked        rows with a number on the map and in the curves, which ``first`` lists; None: the roughest places,
                  which are listed too
    """
    records = [record for file in files for record in file.records]
    summary = summarise(records)
    drives = split_drives(records)
    host = "{0.scheme}://{0.netloc}".format(urlsplit(tiles_from)) if tiles_from else ""
    return document(title[0] if title else f"Road roughness, {date_words(summary)}", [
        heading(*title) if title else _head(summary, files),
        _tiles(summary),
        *first,
        track_views(records, summary, _sources(base_name, host), [date_words(summarise(one)) for one in drives]),
        _shares_section(summary),
        _places_section(records, summary.roughest) if marked is None else EMPTY,
        _drives_section(drives) if len(drives) > 1 else EMPTY,
        _notes_section(summary, files),
        _settings_section(files),
        windows_table(records),
        data_block("data", track_data(drives, base, places_passed(drives)) | {
            "places": _numbers(records, summary.roughest) if marked is None else list(marked),
            "tiles": tiles_from, "meanings": FLAG_MEANINGS,
            "names": {"iri": [class_words(letter) for letter in IRI_CLASSES],
                      "comfort": [comfort_words(name) for name in COMFORT_NAMES]}}),
    ], style=_asset("page.css"), script='"use strict";\n' + "".join(map(_asset, SCRIPTS)), images_from=host)


@cache
def _asset(name: str) -> str:
    """A file of the page's script or style."""
    return (resources.files("logger.report") / "assets" / name).read_text("utf-8")


def _sources(base_name: str, host: str) -> str:
    """Whose pictures and roads the map shows."""
    shown = [f"Roads beneath: {base_name}"] if base_name else []
    shown += [f"Street pictures: {urlsplit(host).netloc}"] if host else []
    return ". ".join([*shown, "Where they are OpenStreetMap's: © OpenStreetMap contributors"]) if shown else ""


def _head(summary: DriveSummary, files: Sequence[LoggedFile]) -> Html:
    sidecar = next((file.sidecar for file in files if file.sidecar), {})
    vehicle = _inside(sidecar, "vehicle", "name")
    version = _inside(sidecar, "ridelog_version")
    words = [date_words(summary)]
    words += [f"vehicle {vehicle}"] if vehicle else []
    words += [f"ridelog {version}"] if version else []
    what = "Road roughness of a drive" if summary.drives == 1 else f"Road roughness of {summary.drives} drives"
    return heading(what, " · ".join(words))


def _tiles(summary: DriveSummary) -> Html:
    return tiles([
        ("Distance", distance_words(summary.distance_m), ""),
        ("Time", span_words(summary.duration_s), ""),
        ("Mean speed", _number(summary.mean_speed_mps, 0, 3.6), "km/h"),
        ("Mean roughness (IRI)", _number(summary.mean_iri_m_per_km, 1), "m/km"),
        (Html("Comfort inside (a<sub>w</sub>)"), _number(summary.a_w_mps2, 2), "m/s²"),
    ])


def _shares_section(summary: DriveSummary) -> Html:
    return html('<section class="columns"><div><h2>Road by IRI (classes of ISO 8608)</h2>{}</div><div>'
                "<h2>Road by comfort</h2>{}</div></section>",
                _shares(summary.iri_classes, tuple(IRI_CLASSES), class_words),
                _shares(summary.comfort, COMFORT_NAMES, comfort_words))


def _shares(shares: Sequence[Share], names: tuple[str, ...], words_of: Callable[[str], str]) -> Html:
    if not shares:
        return Html('<p class="empty">No distance was measured.</p>')
    return html("<table>{}</table>", concatenated(
        html('<tr><td>{0}</td><td class="bar"><span class="f{1}" style="width:{2:.1%}"></span></td>'
             '<td class="n">{2:.1%}</td><td class="n">{3}</td></tr>', words_of(share.name),
             rank(share.name, names), share.share, distance_words(share.distance_m)) for share in shares))


def _places_section(records: Sequence[WindowRecord], places: Sequence[RoughWindow]) -> Html:
    rows = [(number_button(index, number), str(place.drive),
             _instant(place.utc_us), _geo(place), distance_words(place.along_m), iri_words(place),
             _number(place.speed_mps, 0, 3.6), _number(place.a_w_mps2, 2), comfort_words(place.comfort),
             " ".join(place.flags))
            for number, (index, place) in enumerate(zip(_numbers(records, places), places, strict=True), start=1)]
    if not rows:
        return EMPTY
    heads = ("#", "Drive", "When (UTC)", "Coordinates", "Along the way", "IRI [m/km]", "Speed [km/h]", _A_W, "Comfort",
             "Flags")
    return section("Roughest places", html(
        '<div id="places">{}</div>', grid(heads, rows, words=(0, 1, 2, 3, 8, 9))) + hint(
        "Each the worst window within 50 m, with its standard error. A single window of some metres is an estimate: "
        "visit a place before judging it. Its number shows it on the map and in the curves."))


def number_button(row: int, number: int) -> Html:
    """The number of a place, which shows its row on the map and in the curves."""
    return html('<button type="button" data-window="{}">{}</button>', row, str(number))


def _numbers(records: Sequence[WindowRecord], places: Sequence[RoughWindow]) -> list[int]:
    """Which rows the places are."""
    rows = {(along, record.iri_m_per_km): index
            for index, (along, record) in enumerate(zip(along_m(records), records, strict=True))}
    return [rows[place.along_m, place.iri_m_per_km] for place in places]


def _geo(place: RoughWindow) -> Html | str:
    if place.lat_deg is None or place.lon_deg is None:
        return "not known"
    return map_links(place.lat_deg, place.lon_deg, place_words(place))


def _drives_section(drives: Sequence[Sequence[WindowRecord]]) -> Html:
    rows = [(str(number), date_words(one), distance_words(one.distance_m), span_words(one.duration_s),
             _number(one.mean_iri_m_per_km, 1), _number(one.a_w_mps2, 2))
            for number, one in enumerate(map(summarise, drives), start=1)]
    return section("Drives", grid(("#", "When", "Distance", "Time", "Mean IRI [m/km]", _A_W), rows, words=(0, 1)))


def _notes_section(summary: DriveSummary, files: Sequence[LoggedFile]) -> Html:
    notes = [_sensor_note(sidecar) for sidecar in _different(_inside(file.sidecar or {}, "sensor") for file in files)]
    missing = [file.name for file in files if file.sidecar is None]
    lost = [file.name for file in files if _inside(file.sidecar or {}, "settings_lost") is True]
    damaged = sum(file.damaged_lines for file in files)
    if missing:
        notes.append(_warning("Without their description (.json):") + f" {', '.join(missing[:20])}")
    if lost:
        notes.append(_warning("Their settings were lost before a repair:") + f" {', '.join(lost[:20])}")
    if damaged:
        notes.append(_warning(f"{damaged} damaged {'line was' if damaged == 1 else 'lines were'} left out."))
    if summary.blind_s > 0:
        notes.append(f"{span_words(summary.blind_s)} without any speed are in no distance, no map and no plot.")
    notes += [f"iri_m_per_km: {meaning}"
              for meaning in _different(_inside(file.sidecar or {}, "iri_m_per_km") for file in files)]
    notes.append(f"{counted(summary.windows, 'window')} from {counted(len(files), 'log file')}")
    rows = [(flag, str(count), f"{count / summary.windows:.1%}", FLAG_MEANINGS.get(flag, ""))
            for flag, count in summary.flags.items()]
    flags = (grid(("Flag", "Windows", "Share", "Meaning"), rows, words=(0, 3)) if rows
             else paragraphs(["No window carries a flag."]))
    return section("How far to trust it", flags + bullets(notes, style="notes"))


def _warning(text: str) -> Html:
    return html('<span class="warn">{}</span>', text)


def _sensor_note(sensor: Any) -> str:
    """A sentence on the accelerometer."""
    if not isinstance(sensor, Mapping):
        return f"Sensor: {sensor}"
    name = " ".join(str(sensor[key]) for key in ("driver", "profile", "profile_version") if key in sensor)
    if sensor.get("verified") is True:
        return f"Sensor: {name}"
    return f"Sensor: {name}. " + _warning("What its bytes mean is not verified on hardware: do not rely on any value "
                                          "here.")


def _settings_section(files: Sequence[LoggedFile]) -> Html:
    different = _different(
        {key: value for key, value in file.sidecar.items() if key not in ("log", "clock_map")}
        for file in files if file.sidecar)
    if not different:
        return EMPTY
    texts = [json.dumps(content, indent=2, ensure_ascii=False) for content in different[:_MAX_SIDECARS]]
    blocks = concatenated(html("<pre>{}</pre>", text[:_MAX_SIDECAR_CHARS]) for text in texts)
    return html("<details><summary>Settings, vehicle and versions</summary>{}</details>", blocks)


def _number(value: float | None, decimals: int, factor: float = 1.0) -> str:
    return "" if value is None else f"{value * factor:.{decimals}f}"


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
