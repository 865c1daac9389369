"""Files to write, looked at before anything is computed."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from logger.errors import BadInput
from logger.files import why_not_written


def check_outs(asked: Iterable[tuple[str, Path | None]], runs: Iterable[Path] = (), read: Iterable[Path] = ()) -> None:
    """Raise BadInput as ``check_out`` for any of the files to write, by the options that ask for them, and where two
    are one file."""
    folders, files = list(runs), list(read)
    taken: set[Path] = set()
    for option, out in asked:
        if out is not None:
            if out.resolve() in taken:
                raise BadInput(f"{option} {out}: expected every file to be another one")
            check_out(out, folders, files, option)
            taken.add(out.resolve())


def check_out(out: Path, runs: Iterable[Path], read: Iterable[Path] = (), option: str = "--out") -> None:
    """Raise BadInput where a file to write is one of a run or another that is read, or cannot be written.

    runs      their folders
    option    how the file was asked for
    """
    from logger.store.formats.drive_file import DRIVE, EXCITATION, PROFILE, RUN

    said = f"{option} {out}".lstrip()
    if out.resolve() in {(folder / name).resolve() for folder in runs for name in (DRIVE, PROFILE, EXCITATION, RUN)}:
        raise BadInput(f"{said}: expected a file that is none of a run's")
    if out.resolve() in {path.resolve() for path in read}:
        raise BadInput(f"{said}: expected another file than those that are read")
    if not out.parent.is_dir() or out.is_dir():
        raise BadInput(f"{said}: expected a file in a folder that there is")
    if why := why_not_written(out):
        raise BadInput(f"{said}: expected a file that may be written ({why})")
