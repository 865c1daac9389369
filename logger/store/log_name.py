"""The names of log files: ``<session>-<part>.csv.part`` while open, ``.csv`` when finished; the sidecar ``.json``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

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
    return finished.with_name(finished.name + ".part")


def finished_path(part: Path) -> Path:
    return part.with_name(part.name.removesuffix(".part"))


def sidecar_path(log: Path) -> Path:
    return log.with_name(log.name.partition(".")[0] + ".json")
