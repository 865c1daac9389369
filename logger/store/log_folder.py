"""Finding files in a folder of logs, in which a service may be writing, or on a stick with such folders."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

PART = ".part"
"""How the name of a log or a recording ends while it is open."""


def inside_of(folder: Path) -> Iterator[Path]:
    """Everything in a folder at any depth but links, which are not followed."""
    return (path for path in folder.rglob("*") if not path.is_symlink())


def finished_name(path: Path) -> Path:
    """What the file is called once it is finished."""
    return path.with_suffix("") if path.suffix == PART else path


def part_name(path: Path) -> Path:
    """What a finished file was called while it was open."""
    return path.with_name(path.name + PART)
