"""Segment logs of a folder, found and read, damaged or not."""

from __future__ import annotations

from pathlib import Path

from logger.errors import BadInput
from logger.report.page import LoggedFile
from logger.store.log.log_folder import inside_of
from logger.store.log.log_name import LogName, finished_path
from logger.store.log.row_format import read_log
from logger.store.log.sidecar import read_sidecar


def find_logs(place: Path) -> list[Path]:
    """The logs in a folder at any depth, open ones too, folder by folder in order of their writing; or the one file.
    Raises BadInput for none."""
    if place.is_file() or finished_path(place).is_file():
        return [place]
    if not place.is_dir():
        raise BadInput(f"{place}: expected a folder of segment logs, or one log file")
    found: dict[tuple[Path, int, int], Path] = {}
    for path in sorted(inside_of(place)):
        name = LogName.of(path)
        if name is None or path.is_dir():
            continue
        if name.finished or (path.parent, name.session, name.part) not in found:
            found[path.parent, name.session, name.part] = path
    if not found:
        raise BadInput(f"{place}: expected segment logs (such as 00001-001.csv), found none")
    return [found[key] for key in sorted(found)]


def read_logged(log: Path, place: Path | None = None) -> LoggedFile | None:
    """Read a log, damaged or not, and what lies beside it; None for one that is there no more. Raises BadInput for a
    file that cannot be opened."""
    if not log.exists():
        log = finished_path(log)
    try:
        content = read_log(log)
    except FileNotFoundError:
        return None if finished_path(log) == log else read_logged(log, place)
    except OSError as error:
        raise BadInput(f"{log}: expected a segment log that can be read ({error.strerror})") from None
    try:
        sidecar = read_sidecar(log)
    except (ValueError, OSError):
        sidecar = None
    name = str(log.relative_to(place)) if place is not None and place in log.parents else log.name
    return LoggedFile(name, content.records, content.damaged_lines, sidecar)
