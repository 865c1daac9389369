"""Progress on the screen."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from logger.printable import word
from logger.report.text_layout import WIDTH


def warned(words: str) -> None:
    """Say on stderr that it will take long."""
    print(words, file=sys.stderr, flush=True)


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """What is under way, on one line of the terminal that is wiped at the end; said to nobody where that is none."""
    try:
        yield on_screen()
    finally:
        wipe()


def on_screen() -> Callable[[str], None]:
    """Progress on one line of the terminal, on stderr; said to nobody where that is no terminal."""
    return _show if sys.stderr.isatty() else _show_nothing


def wipe() -> None:
    """End the line of progress."""
    if sys.stderr.isatty():
        print("\r" + " " * (WIDTH - 1) + "\r", end="", file=sys.stderr, flush=True)


def _show(words: str) -> None:
    print(f"\r{word(words, WIDTH - 1):{WIDTH - 1}}", end="", file=sys.stderr, flush=True)


def _show_nothing(_words: str) -> None:
    pass
