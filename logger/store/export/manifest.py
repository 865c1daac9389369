"""The list of what an export has put into a folder, by which the folder can be checked anywhere.

Problem. A stick travels, is pulled early, and is written to by others; at the desk somebody has to know that what
arrived is what left. Solution: one text file with a SHA-256 per file, in the form that ``sha256sum -c`` reads too, with
the logger's name in the first line. The last line counts the lines and bears their SHA-256, so that a list that was cut
or changed shows, and no line is believed before it. Names are those of our own files: a list cannot point anywhere
else. It is written and read line by line, and not beyond what a logger could ever have written, for a small machine
reads it too.
"""

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path

LINE_BYTES = 200
"""More than any line of ours has: 64 digits of a checksum, two or three numbers, and a name of at most 64."""

_LAST = re.compile(r"# (\d+) files, list ([0-9a-f]{64})")
_CUT = "cut short: expected a last line '# N files, list SHA-256'"


def list_blocks(first: str, entries: Iterable[str]) -> Iterator[bytes]:
    """The text of a list with this first line, in blocks."""
    lines_per_block = 1000
    digest = hashlib.sha256()
    count = -1
    lines = chain([first], entries)
    while some := list(islice(lines, lines_per_block)):
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
            raise ValueError("changed: the list does not match the checksum in its last line")
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


FOLDER = "ridelog"  # On a stick: a logger's files are in ``FOLDER/<identity>``
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
