"""The list of what an export has put into a folder, by which the folder can be checked anywhere.

Problem. A stick travels, is pulled early, and is written to by others; at the desk somebody has to know that what
arrived is what left. Solution: one text file with a SHA-256 per file, in the form that ``sha256sum -c`` reads too, with
the logger's name in the first line and a checksum of the list in the last, so that a list that was cut or changed
shows. Names are those of our own files: a list cannot point anywhere else. It is read line by line, and not beyond what
a logger could ever have written, for a small machine reads it too.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

FOLDER = "ridelog"
"""On a stick: a logger's files are in ``FOLDER/<identity>``."""

NAME = "manifest.sha256"
MAX_FILES = 100_000
"""Most files of one logger on one stick: ten drives a day, each a log and its sidecar, for 13 years. A list of so many
takes some 30 MB of memory, a fifth of what the export's unit may use."""

_LINE_BYTES = 200
"""More than any line has: the longest is that of a file, 64 digits, two spaces and a name of at most 64."""

_FILES_PER_BLOCK = 1000
_FIRST = "# ridelog-manifest 1 logger "
_IDENTITY = re.compile(r"[0-9a-f]{12}")
_HEAD = re.compile(re.escape(_FIRST) + f"({_IDENTITY.pattern})")
_ENTRY = re.compile(r"([0-9a-f]{64})  ([0-9][0-9A-Za-z._-]{0,63})")
_LAST = re.compile(r"# (\d+) files, list ([0-9a-f]{64})")


@dataclass(frozen=True)
class Manifest:
    """``logger`` is the identity of who wrote it; ``files`` are SHA-256 in hex, by name."""

    logger: str
    files: Mapping[str, str]


def is_of_export(folder: Path) -> bool:
    """True for the folder of a logger on a stick, which has to hold a manifest."""
    return folder.parent.name == FOLDER and _IDENTITY.fullmatch(folder.name) is not None


def format_manifest(manifest: Manifest) -> bytes:
    """The text of the file."""
    return b"".join(manifest_blocks(manifest))


def manifest_blocks(manifest: Manifest) -> Iterator[bytes]:
    """The text of the file, in blocks."""
    digest = hashlib.sha256()
    for block in _list_blocks(manifest):
        digest.update(block)
        yield block
    yield f"# {len(manifest.files)} files, list {digest.hexdigest()}\n".encode("ascii")


def _list_blocks(manifest: Manifest) -> Iterator[bytes]:
    yield f"{_FIRST}{manifest.logger}\n".encode("ascii")
    names = iter(sorted(manifest.files))
    while some := list(islice(names, _FILES_PER_BLOCK)):
        yield "".join(f"{manifest.files[name]}  {name}\n" for name in some).encode("ascii")


def parse_manifest(data: bytes) -> Manifest:
    """Read the text back. Raises ValueError, which says what was expected, for one that is not whole."""
    return read_manifest([data])


def read_manifest(blocks: Iterable[bytes]) -> Manifest:
    """The same for a text that comes in blocks. Raises ValueError for more than ``MAX_FILES`` files too."""
    lines = _lines(blocks)
    first = next(lines, "")
    head = _HEAD.fullmatch(first)
    if head is None:
        raise ValueError(f"line 1: expected '{_FIRST}' and a logger's 12 hex digits")
    digest = hashlib.sha256(f"{first}\n".encode("ascii"))
    files: dict[str, str] = {}
    for number, line in enumerate(lines, start=2):
        if last := _LAST.fullmatch(line):
            if next(lines, None) is not None:
                raise ValueError(f"line {number + 1}: expected nothing after the line '# N files, list SHA-256'")
            if last[2] != digest.hexdigest():
                raise ValueError("changed: the list does not fit the checksum in its last line")
            return Manifest(head[1], files)
        entry = _ENTRY.fullmatch(line)
        if entry is None:
            raise ValueError(f"line {number}: expected 'SHA-256  NAME', the name that of a log or a dump")
        if len(files) == MAX_FILES:
            raise ValueError(f"line {number}: expected at most {MAX_FILES} files")
        files[entry[2]] = entry[1]
        digest.update(f"{line}\n".encode("ascii"))
    raise ValueError("cut short: expected a last line '# N files, list SHA-256'")


def _lines(blocks: Iterable[bytes]) -> Iterator[str]:
    """The lines of a text, without their ends. Raises ValueError for one that is too long, no ASCII, or has no end."""
    rest = b""
    for block in blocks:
        *lines, rest = (rest + block).split(b"\n")
        yield from map(_text, lines)
        _text(rest)
    if rest:
        raise ValueError("cut short: expected a last line '# N files, list SHA-256'")


def _text(line: bytes) -> str:
    if len(line) > _LINE_BYTES:
        raise ValueError(f"expected lines of at most {_LINE_BYTES} bytes")
    try:
        return line.decode("ascii")
    except UnicodeDecodeError:
        raise ValueError("expected ASCII text") from None
