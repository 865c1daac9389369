"""Text that becomes HTML or SVG: whatever is put into it is escaped, unless it is HTML already.

Problem: a page is made of hundreds of texts, many of them from files that anybody may have written; one that is not
escaped is a hole. Solution: HTML is a type of its own. ``html`` fills a template and escapes what it puts in; adding
text to HTML escapes the text; so a text that nobody thought of is shown, never obeyed.
"""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

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
