"""The names of a logger's files, and what they say.

``<session>-<part>.csv.part`` while a log is open, ``.csv`` when it is finished; its sidecar ``.json``; recordings
``<session>.dump.gz`` and ``<session>-<part>.dump.gz``, while open with ``.part`` too. What an export found in the way
of one of these on a stick is called ``<name>.<8 hex digits>.old``, those of one export with the same digits.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

PART = ".part"
# Nine digits are more sessions and parts than any logger has; a longer number was not given by one.
_SESSION, _NUMBER = "[0-9]{5,9}", "[0-9]{3,9}"
_LOG = re.compile(rf"({_SESSION})-({_NUMBER})(?:(\.csv)(\.part)?|(\.json))")
_DUMP = re.compile(rf"({_SESSION})(?:-([0-9]{{1,9}}))?(\.dump(?:\.gz)?)(\.part)?")
_ASIDE = re.compile(r"(.+)\.([0-9a-f]{8})\.old")
_NUMBERED = re.compile(rf"({_SESSION})[-.]")


@dataclass(frozen=True)
class OwnFile:
    """What the name of a log, a sidecar or a recording says.

    part       0 for a recording that has none
    kind       ``.csv``, ``.json``, ``.dump`` or ``.dump.gz``
    is_open    it is being written, or was when the power went
    """

    session: int
    part: int
    kind: str
    is_open: bool

    @classmethod
    def of(cls, name: str) -> OwnFile | None:
        """The name of a file, without its folder; None when it is none of a logger's."""
        if match := _LOG.fullmatch(name):
            return cls(int(match[1]), int(match[2]), match[3] or match[5], match[4] is not None)
        if match := _DUMP.fullmatch(name):
            return cls(int(match[1]), int(match[2] or 0), match[3], match[4] is not None)
        return None


def session_of(name: str) -> int | None:
    """The session whose number a name begins with, whatever else it says; None when it has none."""
    match = _NUMBERED.match(name)
    return int(match[1]) if match else None


@dataclass(frozen=True)
class LogName:
    """What the name of a log file says."""

    session: int
    part: int
    finished: bool

    @classmethod
    def of(cls, path: Path) -> LogName | None:
        """The name of a file; None when it is not that of a log."""
        own = OwnFile.of(path.name)
        return cls(own.session, own.part, not own.is_open) if own is not None and own.kind == ".csv" else None


def open_path(finished: Path) -> Path:
    """What a finished log or recording was called while it was open."""
    return finished.with_name(finished.name + PART)


def finished_path(part: Path) -> Path:
    """What a log or a recording is called once it is finished; that of a finished one is its own."""
    return part.with_name(part.name.removesuffix(PART)) if part.name.endswith(PART) else part


def old_name(name: str, digits: str) -> str:
    """What a file is called that an export sets aside on a stick."""
    return f"{name}.{digits}.old"


def name_before(old: str) -> str | None:
    """The name that a file had before an export set it aside; None for one that was not."""
    match = _ASIDE.fullmatch(old)
    return match[1] if match else None


def sidecar_path(log: Path) -> Path:
    """The name of a log's sidecar, open, finished, or set aside with it."""
    if match := _ASIDE.fullmatch(log.name):
        return log.with_name(old_name(sidecar_path(Path(match[1])).name, match[2]))
    return log.with_name(log.name.partition(".")[0] + ".json")
