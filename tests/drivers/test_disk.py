"""What the disk is asked for: a method that promises to wait until something is on the disk asks the kernel to."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from drivers.disk import FileSystem


@pytest.fixture
def synced(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """Inode and size at the time of everything that was handed to fsync."""
    seen = []

    def spy(descriptor: int) -> None:
        found = os.fstat(descriptor)
        seen.append((found.st_ino, found.st_size))

    monkeypatch.setattr(os, "fsync", spy)
    return seen


def sync_file(path: Path) -> None:
    files = FileSystem()
    descriptor = files.create(path)
    files.write(descriptor, b"four")
    files.sync(descriptor)
    files.close(descriptor)


def cut_file(path: Path) -> None:
    path.write_bytes(b"four and more")
    FileSystem().cut(path, 4)


@pytest.mark.parametrize("act", [sync_file, cut_file])
def test_the_whole_file_is_waited_for(
        tmp_path: Path, synced: list[tuple[int, int]], act: Callable[[Path], None]) -> None:
    act(tmp_path / "a")
    assert synced == [((tmp_path / "a").stat().st_ino, 4)]
    assert (tmp_path / "a").read_bytes() == b"four"


def test_the_names_in_a_folder_are_waited_for(tmp_path: Path, synced: list[tuple[int, int]]) -> None:
    FileSystem().sync_directory(tmp_path)
    assert [inode for inode, _ in synced] == [tmp_path.stat().st_ino]


def test_a_write_goes_on_until_all_is_handed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = FileSystem()
    descriptor = files.create(tmp_path / "a")
    write = os.write
    monkeypatch.setattr(os, "write", lambda descriptor, data: write(descriptor, bytes(data[:3])))
    files.write(descriptor, b"in pieces of three")
    files.close(descriptor)
    assert (tmp_path / "a").read_bytes() == b"in pieces of three"


def test_a_new_file_is_never_in_place_of_another(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("mine")
    with pytest.raises(FileExistsError):
        FileSystem().create(tmp_path / "a", new=True)
    assert (tmp_path / "a").read_text() == "mine"
