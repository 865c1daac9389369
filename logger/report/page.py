"""The report: one HTML page that holds all it shows.

It opens from a stick on a machine without network or rights: no script, no picture or font from elsewhere, and a
content policy that forbids them even if a hostile file got a tag past us. Every text that comes from a file is
escaped.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import accumulate
from typing import Any

from logger.comfort.iso2631 import COMFORT_WORDS
from logger.records import WindowRecord
from logger.report.figures import Level, Plot, line_figure
from logger.report.maps import Colouring, track_map
from logger.report.style import STYLE
from logger.report.summary import (
    COMFORT_NAMES,
    IRI_CLASSES,
    DriveSummary,
    Place,
    Share,
    along_m,
    class_limits_m_per_km,
    split_drives,
    summarise,
    utc,
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

MAX_TABLE_ROWS = 5000
_MAX_SIDECARS = 10
_MAX_SIDECAR_CHARS = 20_000

_COMFORT_SHORT = {"fairly_uncomfortable": "fairly", "very_uncomfortable": "very", "extremely_uncomfortable": "extreme"}

FLAG_MEANINGS: Mapping[str, str] = {
    "gps_lost": "speed and position were carried through a short loss of the GPS, or are absent",
    "gap": "samples of the accelerometer are missing",
    "clipped": "the accelerometer stood at the end of its range: the road is at least this rough",
    "frozen": "the readings of the accelerometer had not changed for half a minute of driving: no figures",
    "speed_doubtful": "the speed and the places of the GPS disagree: no IRI",
    "slow": "below the speed at which the r.m.s. relation holds",
    "fast": "above the speed at which the r.m.s. relation holds",
    "stationary": "the car stood inside the window; that time is not in the averages",
    "time_unset": "the GPS had not told the time yet",
    "partial": "cut short by the end of a drive or of the recording",
    "unsettled": "too near to a start, an end or a hole in the readings",
    "faint": "the sensor hardly sees this road at this speed",
    "blind": "no speed: a window by time, without distance",
}


@dataclass(frozen=True)
class LoggedFile:
    """One log file as it was read. ``sidecar`` None: it is missing or cannot be read."""

    name: str
    records: Sequence[WindowRecord]
    damaged_lines: int
    sidecar: Mapping[str, Any] | None


def page(files: Sequence[LoggedFile]) -> str:
    """The page of some log files, in order of their writing, as one HTML document."""
    records = [record for file in files for record in file.records]
    summary = summarise(records)
    drives = split_drives(records)
    parts = [
        _head(summary, files),
        _tiles(summary),
        _map_section(records, summary),
        _shares_section(summary),
        _places_section(summary.roughest),
        _drives_section(drives) if len(drives) > 1 else "",
        _plots_section(drives, summary),
        _notes_section(summary, files),
        _settings_section(files),
        _rows_section(records),
    ]
    title = escape(f"Road roughness, {date_words(summary)}")
    policy = "default-src 'none'; style-src 'unsafe-inline'"
    return (f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
            f'<meta name="viewport" content="width=device-width,initial-scale=1">'
            f'<meta name="color-scheme" content="light dark"><title>{title}</title><style>{STYLE}</style></head>\n'
            f'<body><main>{"".join(parts)}</main></body></html>\n')


def _head(summary: DriveSummary, files: Sequence[LoggedFile]) -> str:
    sidecar = next((file.sidecar for file in files if file.sidecar), {})
    vehicle = _inside(sidecar, "vehicle", "name")
    version = _inside(sidecar, "ridelog_version")
    words = [date_words(summary)]
    words += [f"vehicle {vehicle}"] if vehicle else []
    words += [f"ridelog {version}"] if version else []
    what = "Road roughness of a drive" if summary.drives == 1 else f"Road roughness of {summary.drives} drives"
    return f'<h1>{what}</h1><p class="sub">{escape(" · ".join(words))}</p>'


def _tiles(summary: DriveSummary) -> str:
    tiles = [
        ("Distance", distance_words(summary.distance_m), ""),
        ("Time", span_words(summary.duration_s), ""),
        ("Mean speed", _number(summary.mean_speed_mps, 0, 3.6), "km/h"),
        ("Mean roughness (IRI)", _number(summary.mean_iri_m_per_km, 1), "m/km"),
        ("Comfort inside (a<sub>w</sub>)", _number(summary.a_w_mps2, 2), "m/s²"),
    ]
    return '<dl class="tiles">' + "".join(
        f"<div><dt>{name}</dt><dd>{escape(value)} <small>{unit}</small></dd></div>" for name, value, unit in tiles
    ) + "</dl>"


def _map_section(records: Sequence[WindowRecord], summary: DriveSummary) -> str:
    by_iri = Colouring("by-iri", lambda record: "s" + _rank(record.iri_class, tuple(IRI_CLASSES)))
    by_comfort = Colouring("by-comfort", lambda record: "s" + _rank(record.comfort, COMFORT_NAMES))
    return (
        '<section><h2>Map</h2><input class="pick" type="radio" name="pick" id="pick-iri" checked>'
        '<input class="pick" type="radio" name="pick" id="pick-comfort"><div class="switch">'
        '<label for="pick-iri">Roughness</label><label for="pick-comfort">Comfort</label></div><div>'
        f"{track_map(records, (by_iri, by_comfort), summary.roughest)}"
        f'{_legend("by-iri", summary.iri_classes, tuple(IRI_CLASSES), class_words)}'
        f'{_legend("by-comfort", summary.comfort, COMFORT_NAMES, comfort_words)}'
        "</div></section>")


def _legend(name: str, shares: Sequence[Share], names: tuple[str, ...], words_of: Callable[[str], str]) -> str:
    entries = "".join(f'<li><i class="f{_rank(share.name, names)}"></i>{escape(words_of(share.name))}</li>'
                      for share in shares)
    return f'<ul class="legend {name}">{entries}</ul>'


def _shares_section(summary: DriveSummary) -> str:
    return ('<section class="columns">'
            f'<div><h2>Road by IRI class</h2>{_shares(summary.iri_classes, tuple(IRI_CLASSES), class_words)}</div>'
            f'<div><h2>Road by comfort</h2>{_shares(summary.comfort, COMFORT_NAMES, comfort_words)}</div></section>')


def _shares(shares: Sequence[Share], names: tuple[str, ...], words_of: Callable[[str], str]) -> str:
    if not shares:
        return '<p class="empty">No distance was measured.</p>'
    rows = "".join(
        f'<tr><td>{escape(words_of(share.name))}</td><td class="bar"><span class="f{_rank(share.name, names)}" '
        f'style="width:{share.share:.1%}"></span></td><td class="n">{share.share:.1%}</td>'
        f'<td class="n">{distance_words(share.distance_m)}</td></tr>' for share in shares)
    return f"<table>{rows}</table>"


def _places_section(places: Sequence[Place]) -> str:
    if not places:
        return ""
    rows = "".join(
        f"<tr><td>{number}</td><td>{_geo(place)}</td><td class=n>{distance_words(place.along_m)}</td>"
        f"<td>{_clock(place.utc_us)}</td><td class=n>{escape(iri_words(place))}</td>"
        f"<td class=n>{_number(place.speed_mps, 0, 3.6)}</td><td class=n>{_number(place.a_w_mps2, 2)}</td>"
        f"<td>{escape(comfort_words(place.comfort))}</td><td>{escape(' '.join(place.flags))}</td></tr>"
        for number, place in enumerate(places, start=1))
    return (
        '<section><h2>Roughest places</h2><div class="scroll"><table><tr><th>#</th><th>Coordinates</th>'
        "<th class=n>Along the way</th><th>Time (UTC)</th><th class=n>IRI [m/km]</th><th class=n>Speed [km/h]</th>"
        f"<th class=n>a<sub>w</sub> [m/s²]</th><th>Comfort</th><th>Flags</th></tr>{rows}</table></div>"
        '<p class="hint">Each the worst window within 50 m, with its standard error. A single window of some metres '
        "is an estimate: visit a place before judging it.</p></section>")


def _geo(place: Place) -> str:
    if place.lat_deg is None or place.lon_deg is None:
        return "not known"
    return f'<a href="geo:{place.lat_deg:.6f},{place.lon_deg:.6f}">{place_words(place)}</a>'


def _drives_section(drives: Sequence[Sequence[WindowRecord]]) -> str:
    rows = ""
    for number, drive in enumerate(drives, start=1):
        one = summarise(drive)
        rows += (f"<tr><td>{number}</td><td>{escape(date_words(one))}</td>"
                 f"<td class=n>{distance_words(one.distance_m)}</td><td class=n>{span_words(one.duration_s)}</td>"
                 f"<td class=n>{_number(one.mean_iri_m_per_km, 1)}</td>"
                 f"<td class=n>{_number(one.a_w_mps2, 2)}</td></tr>")
    return ('<section><h2>Drives</h2><div class="scroll"><table><tr><th>#</th><th>When</th><th class=n>Distance</th>'
            "<th class=n>Time</th><th class=n>Mean IRI [m/km]</th><th class=n>a<sub>w</sub> [m/s²]</th></tr>"
            f"{rows}</table></div></section>")


def _plots_section(drives: Sequence[Sequence[WindowRecord]], summary: DriveSummary) -> str:
    by_drive = [[record for record in drive if record.distance_end_m is not None] for drive in drives]
    measured = [record for drive in by_drive for record in drive]
    if not measured:
        return ""
    at_m = along_m(measured)
    breaks = list(accumulate(len(drive) for drive in by_drive))
    class_levels = [Level(limit, letter) for letter in IRI_CLASSES
                    if (limit := class_limits_m_per_km(letter)[0]) is not None]
    comfort_levels = [Level(limit, _COMFORT_SHORT[word]) for limit, word in COMFORT_WORDS if word in _COMFORT_SHORT]
    marks = [(place.along_m, place.iri_m_per_km, str(number)) for number, place in enumerate(summary.roughest, start=1)]
    plots = (
        Plot("Roughness, IRI", "m/km", at_m, [record.iri_m_per_km for record in measured],
             errors=[record.iri_std_m_per_km for record in measured], levels=class_levels, breaks=breaks, marks=marks),
        Plot("Weighted acceleration, a_w", "m/s²", at_m, [record.a_w_mps2 for record in measured],
             levels=comfort_levels, breaks=breaks),
        Plot("Speed", "km/h", at_m, [None if record.speed_mps is None else record.speed_mps * 3.6
                                     for record in measured], breaks=breaks),
    )
    return ('<section><h2>Along the way</h2>' + "".join(line_figure(plot) for plot in plots)
            + '<p class="hint">The shaded band is the estimate plus and minus one standard error; dotted lines are the '
              "lower limits of the IRI classes, and of discomfort: fairly, very, extreme.</p></section>")


def _notes_section(summary: DriveSummary, files: Sequence[LoggedFile]) -> str:
    notes = [_sensor_note(sidecar) for sidecar in _different(_inside(file.sidecar or {}, "sensor") for file in files)]
    missing = [file.name for file in files if file.sidecar is None]
    lost = [file.name for file in files if _inside(file.sidecar or {}, "settings_lost") is True]
    damaged = sum(file.damaged_lines for file in files)
    if missing:
        notes.append(f'<span class="warn">Without their description (.json):</span> {escape(", ".join(missing[:20]))}')
    if lost:
        names = escape(", ".join(lost[:20]))
        notes.append(f'<span class="warn">Their settings were lost before a repair:</span> {names}')
    if damaged:
        lines = "line was" if damaged == 1 else "lines were"
        notes.append(f'<span class="warn">{damaged} damaged {lines} left out.</span>')
    if summary.blind_s > 0:
        notes.append(f"{span_words(summary.blind_s)} without any speed are in no distance, no map and no plot.")
    notes += [f"iri_m_per_km: {escape(str(meaning))}"
              for meaning in _different(_inside(file.sidecar or {}, "iri_m_per_km") for file in files)]
    notes.append(f"{summary.windows} windows from {len(files)} log file{'s' * (len(files) != 1)}")
    flags = "".join(f"<tr><td>{escape(flag)}</td><td class=n>{count}</td><td class=n>{count / summary.windows:.1%}</td>"
                    f"<td>{escape(FLAG_MEANINGS.get(flag, ''))}</td></tr>" for flag, count in summary.flags.items())
    table = (f'<div class="scroll"><table><tr><th>Flag</th><th class=n>Windows</th><th class=n>Share</th><th>Meaning'
             f"</th></tr>{flags}</table></div>" if flags else "<p>No window carries a flag.</p>")
    items = "".join(f"<li>{note}</li>" for note in notes)
    return f'<section><h2>How far to trust it</h2>{table}<ul class="notes">{items}</ul></section>'


def _sensor_note(sensor: Any) -> str:
    """A sentence on the accelerometer, as HTML."""
    if not isinstance(sensor, Mapping):
        return f"Sensor: {escape(str(sensor))}"
    name = " ".join(str(sensor[key]) for key in ("driver", "profile", "profile_version") if key in sensor)
    if sensor.get("verified") is True:
        return f"Sensor: {escape(name)}"
    return (f'Sensor: {escape(name)}. <span class="warn">What its bytes mean is not verified on hardware: do not rely '
            "on any value here.</span>")


def _settings_section(files: Sequence[LoggedFile]) -> str:
    different = _different(
        {key: value for key, value in file.sidecar.items() if key not in ("log", "clock_map")}
        for file in files if file.sidecar)
    if not different:
        return ""
    texts = [json.dumps(content, indent=2, ensure_ascii=False) for content in different[:_MAX_SIDECARS]]
    blocks = "".join(f"<pre>{escape(text[:_MAX_SIDECAR_CHARS])}</pre>" for text in texts)
    return f"<details><summary>Settings, vehicle and versions</summary>{blocks}</details>"


def _rows_section(records: Sequence[WindowRecord]) -> str:
    """Every row, as a table that opens on demand. End tags that HTML lets one leave out are left out: it is long."""
    names = ("row", "time UTC", "from [m]", "lat", "lon", "km/h", "IRI", "±", "a_w", "MTVV", "VDV", "crest", "class",
             "comfort", "flags")
    head = "".join(f"<th>{name}" for name in names)
    rows = "".join("<tr>" + "".join(f"<td>{cell}" for cell in _cells(record)) for record in records[:MAX_TABLE_ROWS])
    rest = len(records) - MAX_TABLE_ROWS
    more = f'<p class="hint">{rest} more rows are in the log files.</p>' if rest > 0 else ""
    return (f'<details class="rows"><summary>All windows ({len(records)})</summary><div class="scroll">'
            f"<table><tr>{head}{rows}</table></div>{more}</details>")


def _cells(record: WindowRecord) -> tuple[str, ...]:
    return (
        str(record.segment), _clock(record.utc_us), _number(record.distance_start_m, 0), _number(record.lat_deg, 5),
        _number(record.lon_deg, 5), _number(record.speed_mps, 0, 3.6), _number(record.iri_m_per_km, 2),
        _number(record.iri_std_m_per_km, 2), _number(record.a_w_mps2, 3), _number(record.mtvv_mps2, 2),
        _number(record.vdv_mps175, 2), _number(record.crest_factor, 1), escape(record.iri_class),
        escape(comfort_words(record.comfort)), escape(" ".join(record.flags)))


def _rank(name: str, names: tuple[str, ...]) -> str:
    """Number of a name's colour; ``x`` for what has none."""
    return str(names.index(name)) if name in names else "x"


def _number(value: float | None, decimals: int, factor: float = 1.0) -> str:
    return "" if value is None else f"{value * factor:.{decimals}f}"


def _clock(utc_us: int | None) -> str:
    return "" if utc_us is None else f"{utc(utc_us):%H:%M:%S}"


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
