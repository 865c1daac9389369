"""Paragraphs and columns of plain text, as wide as a screen."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

WIDTH = 100


def paragraphs(lines: Sequence[str], mark: str = "") -> str:
    """Lines of text as wide as a screen, each after a mark."""
    return "\n".join(fill(line, WIDTH, initial_indent=mark, subsequent_indent=" " * len(mark),
                          break_long_words=False, break_on_hyphens=False) for line in lines)


def columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of words as columns, the last one as wide as it is."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def enumerated(names: Sequence[str], last: str) -> str:
    """Names in a row, with a word before the last: "a, b or c"."""
    return f" {last} ".join(filter(None, (", ".join(names[:-1]), names[-1])))
