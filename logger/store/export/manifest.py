"""The list of what an export has put into a folder, by which the folder can be checked anywhere.

Problem. A stick travels, is pulled early, and is written to by others; at the desk somebody has to know that what
arrived is what left. Solution: one text file with a SHA-256 per file, in the form that ``sha256sum -c`` reads too, with
the logger's name in the first line and a checksum of the list in the last, so that a list that was cut or changed
shows. Names are those of our own files: a list cannot point anywhere else. It is read line by line, and not beyond what
a logger could ever have written, for a small machine reads it too.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from logger.store.export.checked_list import list_blocks, list_lines

FOLDER = "ridelog"
"""On a stick: a logger's files are in ``FOLDER/<identity>``."""

NAME = "manifest.sha256"
MAX_FILES = 100_000
"""Most files of one logger on one stick: ten drives a day, each a log and its sidecar, for 13 years. A list of so many
takes some 30 MB of memory, a fifth of what the export's unit may use."""

_FIRST = "# ridelog-manifest 1 logger "
_IDENTITY = re.compile(r"[0-9a-f]{12}")
_HEAD = re.compile(re.escape(_FIRST) + f"({_IDENTITY.pattern})")
_ENTRY = re.compile(r"([0-9a-f]{64})  ([0-9][0-9A-Za-z._-]{0,63})")


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
    entries = (f"{manifest.files[name]}  {name}" for name in sorted(manifest.files))
    return list_blocks(f"{_FIRST}{manifest.logger}", entries)


def read_manifest(blocks: Iterable[bytes]) -> Manifest:
    """Read the text back, which comes in blocks. Raises ValueError, which says what was expected, for one that is not
    whole or lists more than ``MAX_FILES`` files."""
    lines = list_lines(blocks)
    head = _HEAD.fullmatch(next(lines, ""))
    if head is None:
        raise ValueError(f"line 1: expected '{_FIRST}' and a logger's 12 hex digits")
    files: dict[str, str] = {}
    for number, line in enumerate(lines, start=2):
        entry = _ENTRY.fullmatch(line)
        if entry is None:
            raise ValueError(f"line {number}: expected 'SHA-256  NAME', the name that of a log or a dump")
        if len(files) == MAX_FILES:
            raise ValueError(f"line {number}: expected at most {MAX_FILES} files")
        files[entry[2]] = entry[1]
    return Manifest(head[1], files)
