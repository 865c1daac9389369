"""The marks that let a file be removed from the card: never one too many."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from logger.store.export.directory_handle import LOCK_NAME, DirectoryHandle
from logger.store.export.export import MARKS_NAME, Mark, exported_names, mark_exported

from ...support.faults.small_files import at_most_s


def a_file(folder: Path, name: str, text: str = "text\n") -> Mark:
    path = folder / name
    path.write_text(text)
    found = path.stat()
    return Mark(found.st_size, found.st_mtime_ns, "0" * 64)


def mark(folder: Path, marks: dict[str, Mark]) -> None:
    with DirectoryHandle.at(folder) as opened:
        mark_exported(opened, marks)


def test_nothing_is_exported_in_a_folder_that_never_was(tmp_path: Path) -> None:
    a_file(tmp_path, "00001-001.csv")
    assert exported_names(tmp_path) == set()


def test_marks_add_up_and_go_with_their_files(tmp_path: Path) -> None:
    names = ["00001-001.csv", "00001-001.json", "00002-001.csv"]
    for name in names:
        mark(tmp_path, {name: a_file(tmp_path, name)})
    assert exported_names(tmp_path) == set(names)
    (tmp_path / names[0]).unlink()
    assert exported_names(tmp_path) == set(names[1:])
    mark(tmp_path, {})
    assert names[0] not in (tmp_path / MARKS_NAME).read_text()


@pytest.mark.parametrize("later", [("text that grew\n", 0), ("txet\n", 1)])
def test_a_file_that_changed_is_not_exported(tmp_path: Path, later: tuple[str, int]) -> None:
    text, seconds = later
    old = a_file(tmp_path, "00001-001.csv")
    mark(tmp_path, {"00001-001.csv": old})
    a_file(tmp_path, "00001-001.csv", text)
    os.utime(tmp_path / "00001-001.csv", ns=(0, old.mtime_ns + seconds * 10**9))
    assert exported_names(tmp_path) == set()


@pytest.mark.parametrize("content", ["", "[]", "1", '{"format": 1}', "[" * 10_000, "# ridelog-exported 1\n",
                                     "# 0 files, list " + "0" * 64 + "\n"])
def test_a_file_of_marks_that_is_none_marks_nothing(tmp_path: Path, content: str) -> None:
    (tmp_path / MARKS_NAME).write_text(content)
    assert exported_names(tmp_path) == set()


def test_marks_that_are_a_link_mark_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "log"
    folder.mkdir()
    mark(folder, {"00001-001.csv": a_file(folder, "00001-001.csv")})
    (folder / MARKS_NAME).rename(tmp_path / "elsewhere")
    (folder / MARKS_NAME).symlink_to(tmp_path / "elsewhere")
    assert exported_names(folder) == set()


def test_two_exports_at_once_lose_no_mark(tmp_path: Path) -> None:
    marks = {f"{number:05d}-001.csv": a_file(tmp_path, f"{number:05d}-001.csv") for number in range(40)}
    halves = [dict(list(marks.items())[start::2]) for start in (0, 1)]

    def export(half: dict[str, Mark]) -> None:
        for name, one in half.items():
            mark(tmp_path, {name: one})

    threads = [threading.Thread(target=export, args=(half,)) for half in halves]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert exported_names(tmp_path) == set(marks)


def test_nothing_else_is_left_in_the_folder(tmp_path: Path) -> None:
    mark(tmp_path, {"00001-001.csv": a_file(tmp_path, "00001-001.csv")})
    assert {path.name for path in tmp_path.iterdir()} == {"00001-001.csv", MARKS_NAME, LOCK_NAME}


@pytest.mark.parametrize("name", [LOCK_NAME, MARKS_NAME])
@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: path.symlink_to("nowhere")],
                         ids=["pipe", "folder", "link to nothing"])
def test_what_has_the_name_of_a_small_file_and_is_none_is_put_aside(
        tmp_path: Path, name: str, make: Callable[[Path], None]) -> None:
    make(tmp_path / name)
    with at_most_s(5):
        mark(tmp_path, {"00001-001.csv": a_file(tmp_path, "00001-001.csv")})
    assert exported_names(tmp_path) == {"00001-001.csv"}
    assert (tmp_path / f"{name}.aside").lstat()
