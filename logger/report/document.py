"""An HTML page that stands alone: one style, no network. Every text is escaped (``logger.report.html``).

A page may have one script of ours. The page's policy names it by its hash, so that no other one runs even if a hostile
file got a tag past us.
"""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Iterable
from hashlib import sha256
from typing import Any

from logger.report.html import EMPTY, Html, concatenated, html
from logger.report.style import STYLE

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


def tiles(shown: Iterable[tuple[str, str, str]]) -> Html:
    """Large figures: name, value, unit or a small word behind it."""
    return html('<dl class="tiles">{}</dl>', concatenated(
        html("<div><dt>{}</dt><dd>{} <small>{}</small></dd></div>", *tile) for tile in shown))


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
