"""The sidecar of a log file: what a reader needs beside the rows (settings, versions, scales, clock), as JSON.

Problem. A scale or a clock with one wrong digit makes every row wrong, though each fits its own check value. Solution.
The content carries a checksum of itself, and nothing is read of a sidecar that does not fit it. Those of older versions
have none; they are read, and said to be unchecked.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from drivers.disk import FileSystem
from logger.store.formats.checksum import json_sha256
from logger.store.log.atomic_file import replace_file
from logger.store.log.intact_rows import Hole, Tally
from logger.store.log.log_name import LogName, sidecar_path

SIDECAR_BYTES = 1_000_000
"""Most that is read as a sidecar: a settings file and a vehicle, of at most 256 kB each, and a few words."""

UNCHECKED = "taken_over_unchecked"
"""In a sidecar that a repair has made of one without a checksum."""

SETTINGS_LOST = "settings_lost"
"""In a sidecar that a repair has made where there was none that could be read."""

_FORMAT = 1
_SEAL = frozenset({"format", "sha256"})
LATEST_UTC_US = 4_102_444_800_000_000  # 2100-01-01


@dataclass(frozen=True)
class ClockMap:
    """UTC of a session: ``utc_us = t_us + offset_us``."""

    offset_us: int


@dataclass(frozen=True)
class Sidecar:
    """What lies beside a log. ``is_checked``: it fits its checksum, and always did; False: an older version wrote it,
    without one, and a repair may have taken it over."""

    content: dict[str, Any]
    is_checked: bool


def load_sidecar(log: Path, files: FileSystem | None = None) -> Sidecar | None:
    """The sidecar of a log file, open or finished; None when it is missing. Raises ``ValueError`` when it is damaged,
    a link, nested too deep or larger than ``SIDECAR_BYTES``, and ``OSError``."""
    path = sidecar_path(log)
    if path.is_symlink():
        raise ValueError("expected a file of its own, found a link to another")
    try:
        with (files or FileSystem()).open(path) as file:
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
    content = {key: value for key, value in found.items() if key not in _SEAL}
    is_sealed = not _SEAL.isdisjoint(found)
    if is_sealed and not _fits(found, content):
        raise ValueError("expected content that fits its checksum")
    return Sidecar(content, is_sealed and content.get(UNCHECKED) is not True)


def read_sidecar(log: Path, files: FileSystem | None = None) -> dict[str, Any] | None:
    """The content of ``load_sidecar``."""
    sidecar = load_sidecar(log, files)
    return None if sidecar is None else sidecar.content


def store_sidecar(files: FileSystem, log: Path, given: dict[str, Any], state: str, tally: Tally,
                  clock: ClockMap | None) -> None:
    """Write the sidecar of a log, in place of the old one, in one step."""
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
            **({"segments_lost": tally.holes} if tally.holes else {}),
        },
    }
    plain = json.loads(json.dumps(content, allow_nan=False))  # keys and lists as a reader will find them
    text = json.dumps(_sealed(plain), indent=2) + "\n"
    replace_file(files, sidecar_path(log), [text.encode()])


def _sealed(content: dict[str, Any]) -> dict[str, Any]:
    """Content with its checksum. There are two keys, so that no single damage makes it one that never had any."""
    sealed = content | {"format": _FORMAT}
    return sealed | {"sha256": json_sha256(sealed)}


def _fits(found: dict[str, Any], content: dict[str, Any]) -> bool:
    try:
        return found == _sealed(content)
    except RecursionError:  # nested as no content of ours
        return False


def sidecar_or_nothing(log: Path, files: FileSystem | None = None) -> dict[str, Any]:
    """The content of the sidecar; nothing where it is missing, damaged or cannot be read."""
    try:
        return read_sidecar(log, files) or {}
    except (ValueError, OSError):
        return {}


def repairs_of(content: dict[str, Any]) -> Tally:
    """What a sidecar says of earlier repairs of its log: damaged lines, a torn tail, holes. What cannot be is left
    out."""
    said = content.get("log")
    if not isinstance(said, dict):
        return Tally()
    lines, holes = said.get("damaged_lines_left_out"), said.get("segments_lost")
    return Tally(damaged_lines=lines if type(lines) is int else 0, torn_tail=said.get("torn_tail_repaired") is True,
                 holes=tuple(Hole(*hole) for hole in holes if _is_hole(hole)) if isinstance(holes, list) else ())


def _is_hole(hole: object) -> bool:
    return isinstance(hole, list) and len(hole) == 2 and all(type(end) is int for end in hole)


def clock_of(sidecar: dict[str, Any]) -> ClockMap | None:
    """The clock map that a sidecar holds, if any that can be. That of an open part holds the session's newest."""
    stored = sidecar.get("clock_map")
    offset_us = stored.get("offset_us") if isinstance(stored, dict) else None
    return ClockMap(offset_us) if type(offset_us) is int and 0 <= offset_us < LATEST_UTC_US else None
