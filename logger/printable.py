"""Text from outside, fit for a terminal.

Problem. A file's name, or a word in it, may hold control characters: printed as they are they clear the screen, turn
the direction of writing, or end the line and begin one that says "ok"; and bytes that are no text cannot be printed at
all. Solution: what cannot be seen is shown by its number.
"""

from __future__ import annotations


def printable(text: str) -> str:
    """Escape what is not printable, line ends too, as ``\\x1b``, ``\\u202e`` or ``\\U000e0001``."""
    return text if text.isprintable() else "".join(map(_shown, text))


def counted(number: int, what: str) -> str:
    """A number of things: ``1 file``, ``2,000 files``."""
    return f"{number:,} {what}{'s' * (number != 1)}"


def _shown(character: str) -> str:
    if character.isprintable():
        return character
    code = ord(character)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
