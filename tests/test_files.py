"""Files that are replaced in one step."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from logger.files import replace_bytes


def test_a_file_is_new_or_as_it_was_and_nothing_is_left_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "page.html"
    replace_bytes(path, b"old")
    replace_bytes(path, b"new")
    assert path.read_bytes() == b"new"

    def full(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space") as refused:
        replace_bytes(path, b"lost")
    assert refused.value.filename == str(path)
    assert (path.read_bytes(), list(tmp_path.iterdir())) == (b"new", [path])


def test_it_is_on_the_disk_before_it_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, synced = tmp_path / "page.html", []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append((os.fstat(descriptor).st_size, path.exists())))
    replace_bytes(path, b"whole")
    assert synced == [(5, False)]
