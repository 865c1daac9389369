"""Words from outside, fit for a terminal, a page, a table, and the files of other programs.

Problem. The name of a car, a sensor, a road or a file comes from whoever made it. Control characters clear a terminal's
screen or end the line and begin one that says "ok"; marks of direction and characters without width make a word read
as another one; a spreadsheet computes a cell that begins with =; a megabyte fills every page; and bytes that are no
text cannot be printed at all. Solution. What cannot be seen is shown by its number, a word has ``LONGEST_WORD``
characters at most, and a cell that a spreadsheet would compute begins with an apostrophe.
"""

import re
from collections.abc import Callable
from typing import Any

LONGEST_WORD = 80
"""Characters of a word from outside; of a longer one the middle is left out. That of ``drivers.errors.shortened``."""

LONGEST_COMPLAINT = 24 * LONGEST_WORD
"""Characters of a complaint, which is one line: a terminal of the usual size, full."""

# What Unicode counts as printable and draws as nothing: fillers, joiners, variation selectors and the empty pattern of
# Braille (Unicode 15, property Default_Ignorable_Code_Point, less what str.isprintable refuses; U+2800).
_UNSEEN = re.compile("[\u034f\u115f\u1160\u17b4\u17b5\u180b-\u180f\u2800\u3164\ufe00-\ufe0f\uffa0"
                     "\U000e0100-\U000e01ef]")
_COMPUTED = re.compile(r"(^|[,;])(?=\s*[-=+@＝＋－＠])")
"""Where a cell begins that some spreadsheet takes for more than text (OWASP, CSV Injection), also behind what separates
cells in one of another country."""
_LEFT_OUT = "..."
_PLAIN_SIGNS = {"±": "+-", "²": "2", "³": "3", "·": "-", "°": "deg", "–": "-", "“": '"', "”": '"'}


def printable(text: str, keep: str = "") -> str:
    """Escape what cannot be seen, as ``\\x1b``, ``\\u202e`` or ``\\U000e0001``: line ends too, but for what is in
    ``keep``."""
    plain = text.translate(dict.fromkeys(map(ord, keep))) if keep and not text.isprintable() else text
    if plain.isprintable() and (plain.isascii() or not _UNSEEN.search(plain)):
        return text
    return "".join(one if one in keep else _shown(one) for one in text)


def word(text: str, longest: int = LONGEST_WORD) -> str:
    """A word from outside: ``printable``, and of at most ``longest`` characters, of which the first and last stay."""
    if len(text) > longest:  # the middle of a megabyte is never looked at
        half = longest // 2
        text = text[:half] + _LEFT_OUT + text[-half:]
    shown = printable(text)
    if len(shown) <= longest:
        return shown
    end = (longest - len(_LEFT_OUT)) // 2
    return shown[: longest - len(_LEFT_OUT) - end] + _LEFT_OUT + shown[-end:]


def words_in(content: Any) -> Any:
    """What a JSON file holds, with every text in it as a ``word``, keys too."""
    if isinstance(content, dict):
        return {word(key): words_in(value) for key, value in content.items()}
    if isinstance(content, list):
        return [words_in(value) for value in content]
    return word(content) if isinstance(content, str) else content


def cell(text: str) -> str:
    """A word for a table that a spreadsheet may open: with an apostrophe before what it would compute."""
    return _COMPUTED.sub(r"\1'", text)


def in_plain_signs(error: UnicodeError) -> tuple[str, int]:
    """What is written where an encoding lacks a character (a handler of ``codecs.register_error``): ``+-`` for ``±``;
    of what has no plain sign the number, ``\\u20ac``."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    plain = "".join(_PLAIN_SIGNS.get(one) or one.encode("ascii", "backslashreplace").decode("ascii") for one in lacking)
    return plain, error.end


def counted(number: int, what: str) -> str:
    """A number of things: ``1 file``, ``2,000 files``."""
    return f"{number:,} {what}{'s' * (number != 1)}"


def span_words(seconds: float) -> str:
    """A length of time: ``1 h 02 min``, ``17 min 05 s``, ``42 s``."""
    minutes, rest_s = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02d} min"
    return f"{minutes} min {rest_s:02d} s" if minutes else f"{rest_s} s"


def _shown(character: str) -> str:
    if character.isprintable() and not _UNSEEN.match(character):
        return character
    code = ord(character)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def percent(share: float) -> str:
    """A share of a power, for a sentence."""
    return f"{share:.0%}" if share >= 0.095 else f"{100 * share:.1f}%" if share >= 0.001 else "less than 0.1%"


Notify = Callable[[str], None]
"""Takes a message on the progress of some work."""


def silent(*_said: object) -> None:
    """Ignore what is said."""
