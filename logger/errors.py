"""Errors of the logger and the exit status each becomes.

    RidelogError
    |- BadInput        a file, a line or an argument that is not what was expected; exit 2
    '- CheckFailed     the check a command was asked to make found something wrong; exit 1
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

EXIT_DONE = 0
EXIT_CHECK_FAILED = 1
EXIT_BAD_INPUT = 2


class RidelogError(Exception):
    """Root of everything ridelog raises on purpose."""

    exit_status = EXIT_BAD_INPUT


class BadInput(RidelogError):
    """Wrong use or bad input. The message names the file, the line and what was expected."""

    exit_status = EXIT_BAD_INPUT


class CheckFailed(RidelogError):
    """The check found something wrong."""

    exit_status = EXIT_CHECK_FAILED


@contextmanager
def as_bad_input(word: object = "", kind: type[Exception] = ValueError) -> Iterator[None]:
    """What is complained of within, as BadInput that begins with a word: a file, a vehicle, an argument."""
    try:
        yield
    except kind as error:
        raise BadInput(f"{word}: {error}" if word else str(error)) from None


_LEAST_PART = 4
"""Letters of a word that is looked for inside others: shorter ones stand in too many."""
_MOST_GUESSES = 3
_NEARLY = 0.7  # of the letters are the same, in the same order: one is missing, wrong or in another place
"""Of ``difflib``: at its usual 0.6 "vehicle" would be nearly "hil"."""


def did_you_mean(found: str, known: Iterable[str]) -> str:
    """``; did you mean X?`` where a word is nearly one that is known, or stands in some; else nothing."""
    from difflib import get_close_matches

    words = list(known)
    near = get_close_matches(found, words, 1, _NEARLY)
    if not near and len(found) >= _LEAST_PART:
        near = [word for word in words if found in word][:_MOST_GUESSES]
    return f"; did you mean {' or '.join(near)}?" if near else ""
