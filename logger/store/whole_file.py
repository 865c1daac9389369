"""Files that are there whole or not at all, whenever the power goes.

A new content is written to a temporary file, waited for, and renamed into place.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from drivers.disk import FileSystem


def replace_file(files: FileSystem, path: Path, blocks: Iterable[bytes]) -> None:
    """Write a file that is there whole, in place of the old one, or not at all."""
    write_file(files, temporary_path(path), blocks)
    files.rename(temporary_path(path), path)
    files.sync_directory(path.parent)


def write_file(files: FileSystem, path: Path, blocks: Iterable[bytes]) -> None:
    """Write a file and wait until it is on the disk. What cannot be written whole is removed: it may fill the disk."""
    descriptor = files.create(path)
    try:
        try:
            for block in blocks:
                files.write(descriptor, block)
            files.sync(descriptor)
        finally:
            files.close(descriptor)
    except OSError:
        with suppress(OSError):
            files.remove(path)
        raise


def temporary_path(path: Path) -> Path:
    return path.with_name(path.name + ".tmp")
