"""The list of what an export has put into a folder, by which the folder can be checked anywhere.

Problem. A stick travels, is pulled early, and is written to by others; at the desk somebody has to know that what
arrived is what left. Solution: one text file with a SHA-256 per file, in the form that ``sha256sum -c`` reads too, with
the logger's name in the first line and a checksum of the list in the last, so that a list that was cut or changed
shows. Names are those of our own files: a list cannot point anywhere else.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

FOLDER = "ridelog"
"""On a stick: a logger's files are in ``FOLDER/<identity>``."""

NAME = "manifest.sha256"
MAX_BYTES = 64_000_000

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
    entries = "".join(f"{digest}  {name}\n" for name, digest in sorted(manifest.files.items()))
    text = f"{_FIRST}{manifest.logger}\n{entries}"
    return f"{text}# {len(manifest.files)} files, list {_digest(text)}\n".encode("ascii")


def parse_manifest(data: bytes) -> Manifest:
    """Read the text back. Raises ValueError, which says what was expected, for one that is not whole."""
    try:
        text = data.decode("ascii")
    except UnicodeDecodeError:
        raise ValueError("expected ASCII text") from None
    first, *lines = text.split("\n")
    head = _HEAD.fullmatch(first)
    if head is None:
        raise ValueError(f"line 1: expected '{_FIRST}' and a logger's 12 hex digits")
    last = _LAST.fullmatch(lines[-2]) if len(lines) >= 2 and not lines[-1] else None
    if last is None:
        raise ValueError("cut short: expected a last line '# N files, list SHA-256'")
    if last[2] != _digest(text[: -len(lines[-2]) - 1]):
        raise ValueError("changed: the list does not fit the checksum in its last line")
    files = {}
    for number, line in enumerate(lines[:-2], start=2):
        entry = _ENTRY.fullmatch(line)
        if entry is None:
            raise ValueError(f"line {number}: expected 'SHA-256  NAME', the name that of a log or a dump")
        files[entry[2]] = entry[1]
    return Manifest(head[1], files)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("ascii")).hexdigest()
