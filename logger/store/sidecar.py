"""The sidecar of a log file: what a reader needs beside the rows (settings, versions, scales, clock), as JSON."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from drivers.disk import FileSystem
from logger.store.log_name import LogName, sidecar_path
from logger.store.whole_file import replace_file

SIDECAR_BYTES = 1_000_000
"""Most that is read as a sidecar: a settings file and a vehicle, of at most 256 kB each, and a few words."""

LATEST_UTC_US = 4_102_444_800_000_000  # 2100-01-01


@dataclass(frozen=True)
class ClockMap:
    """UTC of a session: ``utc_us = t_us + offset_us``."""

    offset_us: int


@dataclass(frozen=True)
class Tally:
    """What a log holds.

    rows             intact rows
    unset            those of them without UTC
    damaged_lines    lines that are not intact; the torn one is not among them
    torn_tail        the file ends in the middle of a row
    repeated         intact rows that stand in the next part too; they are not among ``rows``
    """

    rows: int = 0
    unset: int = 0
    damaged_lines: int = 0
    torn_tail: bool = False
    repeated: int = 0


def read_sidecar(log: Path) -> dict[str, Any] | None:
    """The sidecar of a log file, open or finished; None when it is missing. Raises ``ValueError`` when it is
    damaged, nested too deep or larger than ``SIDECAR_BYTES``."""
    try:
        with sidecar_path(log).open("rb") as file:
            text = file.read(SIDECAR_BYTES + 1)
    except FileNotFoundError:
        return None
    if len(text) > SIDECAR_BYTES:
        raise ValueError(f"expected at most {SIDECAR_BYTES} bytes")
    try:
        found = json.loads(text)
    except RecursionError:
        raise ValueError("expected no such deep nesting") from None
    except ValueError:
        raise ValueError("expected a JSON object") from None
    if not isinstance(found, dict):
        raise ValueError("expected a JSON object")
    return found


def store_sidecar(files: FileSystem, log: Path, given: dict[str, Any], state: str, tally: Tally,
                   clock: ClockMap | None) -> None:
    name = LogName.of(log)
    content = given | {
        "clock_map": None if clock is None else asdict(clock),
        "log": {
            "session": name.session if name else None,
            "part": name.part if name else None,
            "state": state,
            "rows": tally.rows if state == "finished" else None,
            "rows_without_utc": tally.unset if state == "finished" else None,
            "damaged_lines_left_out": tally.damaged_lines,
            "torn_tail_repaired": tally.torn_tail,
        },
    }
    text = json.dumps(content, indent=2, allow_nan=False) + "\n"
    replace_file(files, sidecar_path(log), [text.encode()])


def sidecar_or_nothing(log: Path) -> dict[str, Any]:
    """The sidecar for writing it anew; one that is lost cannot be brought back."""
    try:
        return read_sidecar(log) or {}
    except ValueError:
        return {}


def clock_of(sidecar: dict[str, Any]) -> ClockMap | None:
    """The clock map that a sidecar holds, if any that can be. That of an open part holds the session's newest."""
    stored = sidecar.get("clock_map")
    offset_us = stored.get("offset_us") if isinstance(stored, dict) else None
    return ClockMap(offset_us) if type(offset_us) is int and 0 <= offset_us < LATEST_UTC_US else None
