"""Which words of a recording are believed.

Problem. A recording comes from anybody. A word in it that is taken for a path would have a file of this machine read,
written or, where it is Python, run. Solution. What a recording says is asked for here and nowhere else, and comes back
as a plain number, as yes or no, or as one of the names that are registered on this machine; anything else is refused.
No string of a recording is given out as it stands. What a recording is called may become the name of a folder, and
never leads out of the folder that it is put into.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from math import inf
from typing import Any

from drivers.errors import SettingsError, shortened

ANYTHING = object()


class RecordedWords:
    """What a recording says about itself, by key. Each asking method gives ``usual`` for what it does not say, and
    raises SettingsError for what cannot be."""

    def __init__(self, said: Mapping[str, Any]) -> None:
        self._said = said

    def says(self, key: str, value: object = ANYTHING) -> bool:
        """Whether it says this value, or anything, under a key."""
        return key in self._said and (value is ANYTHING or self._said[key] == value)

    def number(self, key: str, usual: float, least: float, most: float) -> float:
        """A number from ``least`` to ``most``."""
        value = self._said.get(key, usual)
        if type(value) not in (int, float) or not least <= value <= most:
            raise self._wrong(key, f"a number from {least:g} to {most:g}")
        return float(value)

    def number_or_none(self, key: str, usual: float | None, least: float, most: float) -> float | None:
        """The same, or nothing, where it says ``null``."""
        value = self._said.get(key, usual)
        return None if value is None else self.number(key, value, least, most)

    def whole(self, key: str, usual: int, least: float = -inf) -> int:
        """A whole number of at least ``least``."""
        value = self._said.get(key, usual)
        if type(value) is not int or value < least:
            limit = f" of at least {least:g}" if least > -inf else ""
            raise self._wrong(key, f"a whole number{limit}")
        return value

    def flag(self, key: str) -> bool:
        """Yes or no; no where nothing is said."""
        value = self._said.get(key, False)
        if type(value) is not bool:
            raise self._wrong(key, "true or false")
        return value

    def name(self, key: str, usual: str, registered: Collection[str], otherwise: str = "") -> str:
        """One of the names that are registered here. ``otherwise``: what a person can do about another one."""
        value = self._said.get(key, usual)
        for one in registered:
            if one == value:
                return one
        raise self._wrong(key, f"{otherwise}{'one of ' if len(registered) > 1 else ''}{', '.join(registered)}")

    def group(self, key: str) -> RecordedWords:
        """An object, whose own words are asked for likewise; an empty one where nothing is said."""
        value = self._said.get(key, {})
        if not isinstance(value, Mapping):
            raise self._wrong(key, "an object")
        return RecordedWords(value)

    def _wrong(self, key: str, expected: str) -> SettingsError:
        return SettingsError(f"expected {expected} for {key!r}, found {shortened(str(self._said.get(key)))}")


def folder_name(word: str) -> str:
    """What a recording is called, as the name of a folder. SettingsError for one that would lead elsewhere or can be
    no name: ``..``, nothing, anything with a / in it."""
    if word in ("", ".", "..") or "/" in word or "\0" in word:
        raise SettingsError(f"expected a recording whose name can be that of a folder, found {shortened(word)}: rename "
                            "it")
    return word
