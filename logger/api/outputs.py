"""Files to write, looked at before anything is computed."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from logger.errors import BadInput


def check_out(out: Path, runs: Iterable[Path], read: Iterable[Path] = (), option: str = "--out") -> None:
    """Raise BadInput where a file to write is one of a run or another that is read, or cannot be written.

    runs      their folders
    option    how the file was asked for
    """
    from logger.store.formats.drive_file import DRIVE, EXCITATION, PROFILE
    from logger.store.formats.run_file import RUN

    said = f"{option} {out}".lstrip()
    if out.resolve() in {(folder / name).resolve() for folder in runs for name in (DRIVE, PROFILE, EXCITATION, RUN)}:
        raise BadInput(f"{said}: expected a file that is none of a run's")
    if out.resolve() in {path.resolve() for path in read}:
        raise BadInput(f"{said}: expected another file than those that are read")
    if not out.parent.is_dir() or out.is_dir():
        raise BadInput(f"{said}: expected a file in a folder that there is")
    if not _may_be_written(out):
        raise BadInput(f"{said}: expected a file that may be written")


def _may_be_written(path: Path) -> bool:
    """Whether a file can be written, as far as that shows without writing. What is there stays as it is; one that is
    not there is made and taken away: permissions alone do not show all that root, or a file system, cannot do."""
    if path.exists():
        return os.access(path, os.W_OK)
    try:
        path.touch(exist_ok=False)
        path.unlink()
    except OSError:
        return False
    return True
