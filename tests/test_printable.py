"""What a terminal gets: a text from outside can neither move its cursor nor end its line."""

from __future__ import annotations

import pytest

from logger.printable import printable


@pytest.mark.parametrize(("text", "shown"), [
    ("00001-001.csv", "00001-001.csv"), ("Straße 5 m/s²", "Straße 5 m/s²"), ("", ""),
    ("\x1b[2J\rok", "\\x1b[2J\\x0dok"), ("a\nb\tc", "a\\x0ab\\x09c"), ("\x7f\x9b2J", "\\x7f\\x9b2J"),
    ("\u202egpj.exe\u2028", "\\u202egpj.exe\\u2028"), ("\udcff", "\\udcff"), ("\U000e0001", "\\U000e0001"),
])
def test_only_what_can_be_seen_is_as_it_was(text: str, shown: str) -> None:
    assert printable(text) == shown
    assert shown.isprintable()
    shown.encode()
