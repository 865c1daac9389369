"""The names of log files: ``<session>-<part>.csv.part`` while open, ``.csv`` when finished; the sidecar ``.json``.

Recordings end in ``.part`` while they are open, too.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

PART = ".part"
_LOG_NAME = re.compile(r"(\d{5,})-(\d{3,})\.csv(\.part)?")


@dataclass(frozen=True)
class LogName:
    """What the name of a log file says."""

    session: int
    part: int
    finished: bool

    @classmethod
    def of(cls, path: Path) -> LogName | None:
        """The name of a file; None when it is not that of a log."""
        match = _LOG_NAME.fullmatch(path.name)
        return cls(int(match[1]), int(match[2]), match[3] is None) if match else None


def open_path(finished: Path) -> Path:
    """What a finished log or recording was called while it was open."""
    return finished.with_name(finished.name + PART)


def finished_path(part: Path) -> Path:
    """What a log or a recording is called once it is finished; that of a finished one is its own."""
    return part.with_name(part.name.removesuffix(PART)) if part.name.endswith(PART) else part


def sidecar_path(log: Path) -> Path:
    """The name of a log's sidecar, open or finished."""
    return log.with_name(log.name.partition(".")[0] + ".json")
