"""Finding files in a folder of logs, in which a service may be writing, or on a stick with such folders."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path


def inside_of(folder: Path) -> Iterator[Path]:
    """Everything in a folder at any depth but links, which are not followed."""
    return (path for path in folder.rglob("*") if not path.is_symlink())
