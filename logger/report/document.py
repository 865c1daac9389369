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

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Iterable
from hashlib import sha256
from html import escape
from typing import Any

from logger.chart_data import CLASS_COLOURS, NO_CLASS_COLOUR
from logger.printable import printable


class Html(str):
    """Text that is HTML. Text that is not is escaped when it is added to it."""

    __slots__ = ()

    def __add__(self, other: str) -> Html:
        return Html(str.__add__(self, escaped(other)))

    def __radd__(self, other: str) -> Html:
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
_LIGHT = _COLOURS + """
--ink:#1d242b;--soft:#5c6873;--line:#d9dee3;--faint:#eef1f4;--ground:#fff;--panel:#f7f9fa;--casing:#3c464f;
--band:#58a9d48c;
"""
_DARK = """
--ink:#e7ebee;--soft:#9ba7b1;--line:#343d45;--faint:#252d34;--ground:#14191e;
--panel:#1b2127;--casing:#c9d1d8;
"""
_CHART = """
svg{display:block;width:100%;height:auto}
svg text{font:12px system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans",sans-serif;fill:var(--soft)}
.s0{stroke:var(--c0)}.s1{stroke:var(--c1)}.s2{stroke:var(--c2)}.s3{stroke:var(--c3)}.s4{stroke:var(--c4)}
.s5{stroke:var(--c5)}
.s6{stroke:var(--c6)}.s7{stroke:var(--c7)}.sx{stroke:var(--none)}
.mark circle{fill:var(--ink);stroke:var(--ground);stroke-width:1.5}
svg .mark text{fill:var(--ground);font-size:10.5px;font-weight:650}
figure{margin:0 0 14px;overflow-x:auto}
@media screen and (max-width:640px){.named{min-width:640px}.plot:not(.named) .tick{font-size:17px}
.plot:not(.named) .line{stroke-width:2}.plot:not(.named) .thick{stroke-width:4}}
figcaption{font-size:13.5px;font-weight:600;margin-bottom:2px}
figcaption .unit{font-weight:400}
.grid{stroke:var(--faint);stroke-width:1}
.level{stroke:var(--line);stroke-dasharray:2 4}
.line{fill:none;stroke:var(--ink);stroke-width:1;stroke-linejoin:round;stroke-linecap:round}
.thick{fill:none;stroke-width:2;stroke-linejoin:round}.spread{stroke:none;fill:var(--c1);fill-opacity:.3}
.cell{fill:var(--c0)}
.band{fill:var(--c1);fill-opacity:.55}
"""
_PAGE = """
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--ink);font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,
"Noto Sans",sans-serif}
main{max-width:1060px;margin:0 auto;padding:36px 24px 64px}
h1{font-size:28px;line-height:1.2;font-weight:650;letter-spacing:-.01em;margin:0 0 4px}
h2{font-size:18px;font-weight:620;margin:44px 0 12px}
.sub,.unit,.empty,.hint{color:var(--soft)}
.sub{margin:0 0 24px}
.hint{font-size:13px;margin:8px 0 0}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:1px;
border:1px solid var(--line);
border-radius:8px;overflow:hidden;margin:0}
.tiles div{box-shadow:0 0 0 1px var(--line);padding:12px 16px}
.tiles dt{font-size:12.5px;color:var(--soft)}
.tiles dd{margin:0;font-size:22px;font-weight:600;font-variant-numeric:tabular-nums;white-space:nowrap}
.tiles small{font-size:13px;font-weight:400;color:var(--soft)}
.map{background:var(--panel);border:1px solid var(--line);border-radius:8px}
.map path{fill:none;stroke-linecap:round;stroke-linejoin:round}
.casing{stroke:var(--casing);stroke-width:8.5;stroke-opacity:.85}
.f0{background:var(--c0)}.f1{background:var(--c1)}.f2{background:var(--c2)}.f3{background:var(--c3)}
.f4{background:var(--c4)}.f5{background:var(--c5)}
.f6{background:var(--c6)}.f7{background:var(--c7)}.fx{background:var(--none)}
.start circle{fill:var(--ground);stroke:var(--ink);stroke-width:2.5}
.map .start text{font-weight:600;fill:var(--ink);paint-order:stroke;stroke:var(--panel);
stroke-width:4;stroke-linejoin:round}
.scale path{stroke:var(--soft);stroke-width:1.5}
.legend{display:flex;flex-wrap:wrap;gap:4px 18px;margin:10px 0 0;padding:0;list-style:none;font-size:13px;
color:var(--soft)}
.legend i,.bars i{display:inline-block;width:18px;height:6px;border-radius:3px;margin-right:7px;
vertical-align:2px;box-shadow:0 0 0 1px var(--casing)}
.columns{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(330px,100%),1fr));gap:0 48px}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:13.5px;font-variant-numeric:tabular-nums}
th{text-align:left;font-weight:600;color:var(--soft);font-size:12.5px;vertical-align:bottom}
th,td{padding:5px 12px 5px 0;border-bottom:1px solid var(--faint)}
td.n,th.n{text-align:right}
td.n{white-space:nowrap}
td.bar{width:50%;min-width:60px}
td.bar span{display:block;height:10px;border-radius:2px;min-width:2px}
a{color:inherit;text-decoration-color:var(--soft);text-underline-offset:2px}
details{margin-top:14px;border-top:1px solid var(--line);padding-top:12px}
summary{cursor:pointer;font-weight:600}
pre{background:var(--panel);border:1px solid var(--line);border-radius:8px;padding:14px;overflow:auto;
max-height:520px;font-size:12.5px;line-height:1.45}
pre.whole{max-height:none}
.lines{white-space:pre-line}
.notes{padding-left:18px;margin:14px 0 0}
.notes li{margin:3px 0}
.warn{font-weight:600}
@media(max-width:500px){main{padding:20px 14px 40px}h1{font-size:23px}h2{margin-top:32px}}
@media print{*{print-color-adjust:exact;-webkit-print-color-adjust:exact}main{padding:0;max-width:none}
section,tr,figure{break-inside:avoid}}
"""
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
