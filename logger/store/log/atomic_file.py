"""Files that are there whole or not at all, whenever the power goes.

A new content is written to a temporary file, waited for, and renamed into place.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from drivers.disk import FileSystem
from logger.store.log.quarantine import is_taken, numbered

_TEMPORARY = re.compile(r"(.+)\.tmp(-[0-9]+)?")


def replace_file(files: FileSystem, path: Path, blocks: Iterable[bytes]) -> None:
    """Write a file that is there whole, in place of the old one, or not at all. Raises ``OSError``."""
    files.rename(write_temporary(files, path, blocks), path)
    files.sync_directory(path.parent)


def write_temporary(files: FileSystem, path: Path, blocks: Iterable[bytes]) -> Path:
    """Write what is to have a name, under another one, and wait until it is on the disk; give that name. What cannot be
    written whole is removed: it may fill the disk. Raises ``OSError``."""
    temporary, descriptor = _created(files, path)
    try:
        try:
            for block in blocks:
                files.write(descriptor, block)
            files.sync(descriptor)
        finally:
            files.close(descriptor)
    except OSError:
        with suppress(OSError):
            files.remove(temporary)
        raise
    return temporary


def name_of_temporary(path: Path) -> str | None:
    """The name that a temporary file was to have; None for a file that is none."""
    match = _TEMPORARY.fullmatch(path.name)
    return match[1] if match else None


def _created(files: FileSystem, path: Path) -> tuple[Path, int]:
    """An empty temporary file and its descriptor. Names of which something there is not to be written to are passed
    over."""
    for temporary in numbered(path.with_name(f"{path.name}.tmp")):
        is_in_the_way = is_taken(temporary)
        try:
            return temporary, files.create(temporary)
        except OSError:
            if not is_in_the_way:
                raise
    raise AssertionError("names never end")
