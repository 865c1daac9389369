"""Text that becomes HTML or SVG: whatever is put into it is escaped, unless it is HTML already.

Problem: a page is made of hundreds of texts, many of them from files that anybody may have written; one that is not
escaped is a hole. Solution: HTML is a type of its own. ``html`` fills a template and escapes what it puts in; adding
text to HTML escapes the text; so a text that nobody thought of is shown, never obeyed.

The page is one column of text and pictures, for light and dark screens and for paper. The eight class colours run from
blue over yellow and red to purple, fall in lightness from the third on, and are apart with any common colour vision; a
casing around them carries the light ones on white and the dark ones on black.

It stands alone: one style, no network. It may have one script of ours, which its policy names by its hash, so that no
other one runs even if a hostile file got a tag past us. A notebook shows a result's text and charts in the same style,
within its own cell.
"""

import json
from base64 import b64encode
from collections.abc import Iterable
from functools import cache
from hashlib import sha256
from html import escape
from importlib import resources
from typing import Any

from logger.chart_data import CLASS_COLOURS, NO_CLASS_COLOUR
from logger.printable import printable


class Html(str):
    """Text that is HTML. Text that is not is escaped when it is added to it."""

    __slots__ = ()

    def __add__(self, other: str) -> "Html":
        return Html(str.__add__(self, escaped(other)))

    def __radd__(self, other: str) -> "Html":
        return Html(str.__add__(escaped(other), self))


EMPTY = Html()


def escaped(text: str) -> Html:
    """The text as HTML, with what cannot be seen shown by its number; HTML as it is."""
    return text if isinstance(text, Html) else Html(escape(printable(text, keep="\n\t\u00a0")))


def html(template: str, *values: object, **named: object) -> Html:
    """A template of HTML, a literal, with values in its braces as ``str.format`` puts them there; texts are escaped."""
    return Html(template.format(*map(_safe, values), **{name: _safe(value) for name, value in named.items()}))


def concatenated(parts: Iterable[str]) -> Html:
    """The parts one after the other; those that are not HTML are escaped."""
    return Html("".join(map(escaped, parts)))


def _safe(value: object) -> object:
    """Numbers as they are, so that a format may say how they are written."""
    return value if isinstance(value, int | float) else escaped(str(value) if not isinstance(value, str) else value)


_COLOURS = "".join(
    f"--{name}:{colour};" for name, colour in [*((f"c{number}", one) for number, one in enumerate(CLASS_COLOURS)),
                                               ("none", NO_CLASS_COLOUR)])


@cache
def asset(name: str, package: str = "logger.report") -> str:
    """A file of a page's script or style, out of the assets of a package."""
    return (resources.files(package) / "assets" / name).read_text("utf-8")


STYLE_SHEETS = ("light.css", "dark.css", "chart.css", "document.css")
_LIGHT, _DARK, _CHART, _PAGE = ("\n" + asset(name) for name in STYLE_SHEETS)
_LIGHT = _COLOURS + _LIGHT
STYLE = (f":root{{{_LIGHT}}}@media screen and (prefers-color-scheme:dark){{:root:not([data-paper]){{{_DARK}}}}}"
         f"{_CHART}{_PAGE}")
"""Of a page."""
CELL_STYLE = f".ridelog{{{_LIGHT}{_CHART}}}@media(prefers-color-scheme:dark){{.ridelog{{{_DARK}}}}}"
"""Of charts in somebody else's page: inside an element of the class ``ridelog`` and nowhere else (nested rules, CSS
Nesting Module)."""


_RIGHT = Html(" class=n")
_WEB_MAP = "https://www.openstreetmap.org/"
_POLICY = "default-src 'none'; style-src 'unsafe-inline'"


def document(title: str, parts: Iterable[str], *, style: str = "", script: str = "", images_from: str = "",
             loads: bool = False) -> Html:
    """The page of a title and of parts; those that are not HTML are shown as they are written.

    style, script    of this page alone, ours
    images_from      another host that the page may take pictures from (``https://host``); empty: none
    loads            the script may load others, which lie beside the page
    """
    policy = _POLICY + (f"; img-src {images_from}" if images_from else "")
    run = EMPTY
    if script:
        digest = b64encode(sha256(script.encode()).digest()).decode()
        policy += f"; script-src 'sha256-{digest}'" + " 'strict-dynamic'" * loads
        run = html("<script>{}</script>", Html(script))
    return html('<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
                '<meta http-equiv="Content-Security-Policy" content="{}">'
                '<meta name="viewport" content="width=device-width,initial-scale=1">'
                '<meta name="color-scheme" content="light dark"><title>{}</title><style>{}</style></head>\n'
                "<body><main>{}</main>{}</body></html>\n", policy, title, Html(STYLE + style), concatenated(parts), run)


def data_block(name: str, content: Any) -> Html:
    """What the page's script reads, as JSON that cannot end its element."""
    text = json.dumps(content, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return html('<script type="application/json" id="{}">{}</script>', name, Html(text))


def heading(title: str, under: str) -> Html:
    """The title of a page, and a line under it."""
    return html('<h1>{}</h1><p class="sub">{}</p>', title, under)


def tiles(shown: Iterable[tuple[str, str | None, str]]) -> Html:
    """Large figures: name, value or None where it is not known, unit or a small word behind it."""
    return html('<dl class="tiles">{}</dl>', concatenated(
        html("<div><dt>{}</dt><dd>{} <small>{}</small></dd></div>", name, value or "not known", behind if value else "")
        for name, value, behind in shown))


def section(title: str, body: str) -> Html:
    """A part under a heading; nothing without a body."""
    return html("<section><h2>{}</h2>{}</section>", title, body) if body else EMPTY


def paragraphs(lines: Iterable[str]) -> Html:
    """Text."""
    return concatenated(html("<p>{}</p>", line) for line in lines)


def hint(text: str) -> Html:
    """A remark in small letters."""
    return html('<p class="hint">{}</p>', text)


def bullets(lines: Iterable[str], style: str = "") -> Html:
    """A list of sentences; nothing where there are none."""
    items = concatenated(html("<li>{}</li>", line) for line in lines)
    start = html('<ul class="{}">', style) if style else Html("<ul>")
    return start + items + Html("</ul>") if items else EMPTY


def grid(heads: Iterable[str], rows: Iterable[Iterable[str]], words: Iterable[int] = (0,)) -> Html:
    """A table; columns of the numbers ``words`` stand left, the others right."""
    left = set(words)

    def cells(row: Iterable[str], tag: str) -> Html:
        return concatenated(html("<{0}{1}>{2}</{0}>", Html(tag), EMPTY if index in left else _RIGHT, cell)
                      for index, cell in enumerate(row))

    body = concatenated(html("<tr>{}</tr>", cells(row, "td")) for row in rows)
    return html('<div class="scroll"><table><tr>{}</tr>{}</table></div>', cells(heads, "th"), body)


def map_links(lat_deg: float, lon_deg: float, words: str) -> Html:
    """A place in words, for the reader's own map program and on a map of the web."""
    lat, lon = f"{lat_deg:.6f}", f"{lon_deg:.6f}"
    return html('<a href="geo:{},{}">{}</a> <a href="{}?mlat={}&mlon={}#map=18/{}/{}">map</a>', lat, lon, words,
                _WEB_MAP, lat, lon, lat, lon)


def cell(text: str, figures: Iterable[Html]) -> Html:
    """An element that stands alone in somebody else's page."""
    return html('<div class="ridelog" style="background:var(--ground);color:var(--ink);padding:8px 12px">'
                '<style>{}</style><pre style="color:inherit;background:none;white-space:pre-wrap">{}</pre>{}</div>',
                Html(CELL_STYLE), text, concatenated(figures))
