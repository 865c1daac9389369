"""One writer to a folder of logs."""

from __future__ import annotations

from pathlib import Path

import pytest

from logger.errors import BadInput
from logger.store.log.atomic_file import FolderLock


def test_a_second_writer_is_refused_until_the_first_has_gone(tmp_path: Path) -> None:
    with FolderLock(tmp_path), pytest.raises(BadInput, match="another ridelog is writing here"):
        FolderLock(tmp_path)
    with FolderLock(tmp_path):
        pass
