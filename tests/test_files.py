"""Files that are replaced in one step, and how what leads to one is followed."""

from __future__ import annotations

import errno
import os
import stat
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from logger import files
from logger.files import remove_file, together, whole_folder, why_not_written, write_text, written_files

from .support.faults.disk_models import RefusingFiles


def test_a_file_is_new_or_as_it_was_and_nothing_is_left_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, disk = tmp_path / "page.html", RefusingFiles()
    monkeypatch.setattr(files, "DISK", disk)
    write_text(path, "old")
    write_text(path, ["n", "ew"])
    for kind in ("create", "write", "sync", "close", "rename"):
        monkeypatch.setattr(disk, "refuses", lambda asked, kind=kind: asked == kind)
        with written_files() as written, pytest.raises(OSError, match="Input/output") as refused:
            write_text(path, "lost")
        assert (refused.value.errno, refused.value.filename, written) == (errno.EIO, str(path), [])
        assert (path.read_text(), list(tmp_path.iterdir())) == ("new", [path])


def test_it_is_on_the_disk_before_it_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, synced = tmp_path / "page.html", []
    monkeypatch.setattr(os, "fsync", lambda descriptor: synced.append((os.fstat(descriptor).st_size, path.exists())))
    write_text(path, "whole")
    assert synced == [(5, False)]


@pytest.mark.parametrize("knows_links", [True, False])
def test_files_are_new_together_or_none_is(
    knows_links: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also on a disk, such as FAT, that knows no two names of a file."""
    def refused(*_: object) -> None:
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    if not knows_links:
        monkeypatch.setattr(os, "link", refused)
    old = {"a": "a", "b": "b", "gone": "gone"}
    for name, text in old.items():
        (tmp_path / name).write_text(text)
    for last in ("", "no/folder"):
        try:
            with together():
                remove_file(tmp_path / "gone")
                for name in ("a", "new", "b"):
                    write_text(tmp_path / name, "other")
                if last:
                    write_text(tmp_path / last, "")
        except FileNotFoundError as error:
            assert error.filename == str(tmp_path / last)
        now = {path.name: path.read_text() for path in tmp_path.iterdir() if path.is_file()}
        assert now == {"a": "other", "b": "other", "new": "other"}
    disk = RefusingFiles()
    renames = iter((False, True))
    disk.refuses = lambda kind: kind == "rename" and next(renames)
    monkeypatch.setattr(files, "DISK", disk)
    with pytest.raises(OSError, match="Input/output"), together():
        write_text(tmp_path / "a", "third")
        write_text(tmp_path / "b", "third")
    assert {path.name: path.read_text() for path in tmp_path.iterdir() if path.is_file()} == now


def test_a_link_stays_a_mode_is_kept_and_what_is_write_protected_too(tmp_path: Path) -> None:
    real, link = tmp_path / "real" / "car.yaml", tmp_path / "car.yaml"
    real.parent.mkdir()
    link.symlink_to("real/car.yaml")
    write_text(link, "made through a link")
    real.chmod(0o640)
    write_text(link, "and again")
    assert (link.is_symlink(), real.read_text(), stat.S_IMODE(real.stat().st_mode)) == (True, "and again", 0o640)
    fresh = tmp_path / "fresh"
    write_text(fresh, "")
    usual = tmp_path / "usual"
    usual.touch()
    assert fresh.stat().st_mode == usual.stat().st_mode
    (tmp_path / "round").symlink_to("round")
    with pytest.raises(OSError, match="symbolic links"):
        write_text(tmp_path / "round", "")
    assert why_not_written(tmp_path / "fresh") == ""
    assert "No such file" in why_not_written(tmp_path / "nowhere" / "x")
    long = tmp_path / ("x" * 250)
    write_text(long, "a name that leaves no room for another beside it")
    assert long.exists()


def test_what_is_no_file_is_written_as_it_is(tmp_path: Path) -> None:
    pipe, read = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    write_text(pipe, "through the pipe")
    reader.join(10)
    assert (read, pipe.is_fifo()) == ([b"through the pipe"], True)
    log = tmp_path / "log"
    log.write_text("before\n")
    code = ("from logger.files import write_text; print('one', flush=True); write_text('/dev/stdout', 'two\\n'); "
            "print('three')")
    with log.open("a") as file:
        subprocess.run([sys.executable, "-c", code], stdout=file, check=True)
    assert log.read_text() == "before\none\ntwo\nthree\n"
    with pytest.raises(IsADirectoryError):
        write_text(tmp_path, "")


def test_a_folder_is_new_or_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place, disk = tmp_path / "page", RefusingFiles()
    monkeypatch.setattr(files, "DISK", disk)
    for text in ("old", "new"):
        with written_files() as written, whole_folder(place) as new:
            write_text(new / text, text)
        assert written == [place]
    assert [path.name for path in tmp_path.rglob("*")] == ["page", "new"]
    for at in (1, 2, 3):  # of the file inside, of the folder that was there, of the new one
        renames = iter(range(1, 4))
        monkeypatch.setattr(disk, "refuses", lambda kind, at=at, turn=renames: kind == "rename" and next(turn) == at)
        with pytest.raises(OSError, match="Input/output") as refused, whole_folder(place) as new:
            write_text(new / "third", "third")
        assert refused.value.filename == str(place)
        assert [path.name for path in tmp_path.rglob("*")] == ["page", "new"]
