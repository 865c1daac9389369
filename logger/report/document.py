"""An HTML page that stands alone: one style, no script, no network."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from logger.report.style import STYLE
from logger.studies.pictures import STYLE as PICTURE_STYLE

_POLICY = "default-src 'none'; style-src 'unsafe-inline'"


def document(title: str, parts: Iterable[str]) -> str:
    """The page of a title, which is escaped here, and of parts, which are HTML."""
    return (f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
            f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
            f'<meta name="viewport" content="width=device-width,initial-scale=1">'
            f'<meta name="color-scheme" content="light dark"><title>{escape(title)}</title>'
            f"<style>{STYLE}{PICTURE_STYLE}</style></head>\n<body><main>{''.join(parts)}</main></body></html>\n")


def tiles(shown: Iterable[tuple[str, str, str]]) -> str:
    """Large figures: name, value, unit or a small word behind it."""
    return '<dl class="tiles">' + "".join(
        f"<div><dt>{escape(name)}</dt><dd>{escape(value)} <small>{escape(unit)}</small></dd></div>"
        for name, value, unit in shown) + "</dl>"


def section(title: str, body: str) -> str:
    """A part under a heading; nothing without a body, which is HTML."""
    return f"<section><h2>{escape(title)}</h2>{body}</section>" if body else ""


def paragraphs(lines: Iterable[str]) -> str:
    """Text."""
    return "".join(f"<p>{escape(line)}</p>" for line in lines)


def bullets(lines: Iterable[str]) -> str:
    """A list of sentences; nothing where there are none."""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<ul>{items}</ul>" if items else ""


def grid(heads: Iterable[str], rows: Iterable[Iterable[str]], words: Iterable[int] = (0,)) -> str:
    """A table; columns of the numbers ``words`` stand left, the others right."""
    left = set(words)

    def cells(row: Iterable[str], tag: str) -> str:
        return "".join(f"<{tag}{'' if index in left else ' class=n'}>{escape(cell)}</{tag}>"
                       for index, cell in enumerate(row))

    body = "".join(f"<tr>{cells(row, 'td')}</tr>" for row in rows)
    return f'<div class="scroll"><table><tr>{cells(heads, "th")}</tr>{body}</table></div>'
