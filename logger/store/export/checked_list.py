"""A list in a text file that shows when it was cut or changed: its last line counts the lines and bears their SHA-256.

Problem. The lists of what was exported may be as long as a folder has files, are read by a small machine, and come from
sticks that anybody had in hand. Solution: they are written and read line by line, and no reader believes a line before
the last one has been checked.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator
from itertools import chain, islice

LINE_BYTES = 200
"""More than any line of ours has: 64 digits of a checksum, two or three numbers, and a name of at most 64."""

_LINES_PER_BLOCK = 1000
_LAST = re.compile(r"# (\d+) files, list ([0-9a-f]{64})")
_CUT = "cut short: expected a last line '# N files, list SHA-256'"


def list_blocks(first: str, entries: Iterable[str]) -> Iterator[bytes]:
    """The text of a list with this first line, in blocks."""
    digest = hashlib.sha256()
    count = -1
    lines = chain([first], entries)
    while some := list(islice(lines, _LINES_PER_BLOCK)):
        block = "".join(f"{line}\n" for line in some).encode("ascii")
        digest.update(block)
        count += len(some)
        yield block
    yield f"# {count} files, list {digest.hexdigest()}\n".encode("ascii")


def list_lines(blocks: Iterable[bytes]) -> Iterator[str]:
    """The lines of such a text, the first one too, but for the last. Raises ValueError, which says what was expected,
    at the latest after all of them: none is true before."""
    digest = hashlib.sha256()
    lines = _lines(blocks)
    for line in lines:
        if (last := _LAST.fullmatch(line)) is None:
            digest.update(f"{line}\n".encode("ascii"))
            yield line
        elif next(lines, None) is not None:
            raise ValueError("expected nothing after the line '# N files, list SHA-256'")
        elif last[2] != digest.hexdigest():
            raise ValueError("changed: the list does not fit the checksum in its last line")
        else:
            return
    raise ValueError(_CUT)


def _lines(blocks: Iterable[bytes]) -> Iterator[str]:
    rest = b""
    for block in blocks:
        *lines, rest = (rest + block).split(b"\n")
        yield from map(_text, lines)
        _text(rest)
    if rest:
        raise ValueError(_CUT)


def _text(line: bytes) -> str:
    if len(line) > LINE_BYTES:
        raise ValueError(f"expected lines of at most {LINE_BYTES} bytes")
    try:
        return line.decode("ascii")
    except UnicodeDecodeError:
        raise ValueError("expected ASCII text") from None
