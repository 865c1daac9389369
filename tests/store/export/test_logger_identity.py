"""One number for one logger: whatever is copied, cloned, moved or read elsewhere."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from logger.store.export import sticks as module
from logger.store.export.directory_handle import DirectoryHandle
from logger.store.export.sticks import HOMES_NAME, IDENTITY_NAME, logger_identity

from ...support.faults.small_files import at_most_s

Be = Callable[[str, str], None]


@pytest.fixture
def be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Be:
    """Be the machine with this board's serial number (empty: it says none) and machine-id."""
    def become(serial: str, machine_id: str) -> None:
        for name, text in (("BOARD_SERIAL", f"{serial}\0" if serial else ""), ("MACHINE_ID", f"{machine_id}\n")):
            path = tmp_path / f"{name}-{serial}-{machine_id}"
            if text.strip():
                path.write_text(text)
            monkeypatch.setattr(module, name, path)

    become("10000000aaaaaaaa", "0" * 31 + "1")
    return become


@pytest.fixture
def card(tmp_path: Path) -> Path:
    (tmp_path / "card").mkdir()
    return tmp_path / "card"


def number(folder: Path) -> str:
    with DirectoryHandle.at(folder) as opened:
        return logger_identity(opened, folder)


@pytest.mark.usefixtures("be")
def test_it_stays_and_two_folders_have_two(card: Path, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    first = number(card)
    assert number(card) == first == (card / IDENTITY_NAME).read_text().strip()
    assert number(tmp_path / "other") != first
    assert len(first) == 12


@pytest.mark.parametrize(("serial", "machine_id", "is_same"), [
    ("10000000bbbbbbbb", "0" * 31 + "1", False),  # a card that was cloned takes its machine-id along
    ("10000000aaaaaaaa", "0" * 31 + "2", True),  # the system was put on anew
    ("", "0" * 31 + "2", False), ("0000000000000000", "0" * 31 + "2", False),
])
def test_it_is_that_of_the_board(card: Path, be: Be, serial: str, machine_id: str, is_same: bool) -> None:
    first = number(card)
    be(serial, machine_id)
    second = number(card)
    assert (second == first) == is_same
    assert number(card) == second
    be("10000000aaaaaaaa", "0" * 31 + "1")  # the card is back in the car
    assert number(card) == first


@pytest.mark.parametrize("serial", ["", "0000000000000000"])
def test_without_a_serial_number_it_is_that_of_the_machine_id(card: Path, be: Be, serial: str) -> None:
    be(serial, "1")
    first = number(card)
    be(serial, "2")
    assert number(card) != first
    be("", "")
    assert number(card) == (card / IDENTITY_NAME).read_text().strip()  # nothing is known of the machine


@pytest.mark.usefixtures("be")
def test_a_copy_beside_its_original_has_another_and_what_was_moved_has_not(card: Path, tmp_path: Path) -> None:
    first = number(card)
    shutil.copytree(card, tmp_path / "copy")
    second = number(tmp_path / "copy")
    assert second != first
    assert (number(card), number(tmp_path / "copy")) == (first, second)
    card.rename(tmp_path / "moved")
    assert number(tmp_path / "moved") == first
    for name in ("link", "card"):
        (tmp_path / name).symlink_to(tmp_path / "moved")
        assert number(tmp_path / name) == number(tmp_path / "moved") == first
    card.unlink()
    (tmp_path / "moved").rename(card)
    (tmp_path / "moved").symlink_to(card)
    assert number(card) == first


def test_one_that_an_older_version_made_is_taken_over(card: Path, be: Be) -> None:
    (card / IDENTITY_NAME).write_text("0123456789ab\n")
    assert number(card) == "0123456789ab"
    be("10000000bbbbbbbb", "1")
    assert number(card) != "0123456789ab"


@pytest.mark.usefixtures("be")
@pytest.mark.parametrize("content", [b"", b"../../../../etc\n", b"0123456789AB\n", b"0" * 5000])
@pytest.mark.parametrize("name", [IDENTITY_NAME, HOMES_NAME])
def test_damage_is_mended(card: Path, name: str, content: bytes) -> None:
    number(card)
    (card / name).write_bytes(content)
    known = number(card)
    assert number(card) == known == (card / IDENTITY_NAME).read_text().strip()
    assert known in (card / HOMES_NAME).read_text()


@pytest.mark.usefixtures("be")
@pytest.mark.parametrize("name", [IDENTITY_NAME, HOMES_NAME])
@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: path.symlink_to("nowhere")],
                         ids=["pipe", "folder", "link to nothing"])
def test_what_has_the_name_of_a_small_file_and_is_none_is_put_aside(
        card: Path, name: str, make: Callable[[Path], None]) -> None:
    make(card / name)
    with at_most_s(5):
        known = number(card)
        assert number(card) == known
    assert (card / f"{name}.aside").lstat()


def test_a_card_that_cannot_be_written_to_has_that_of_the_machine(
        card: Path, be: Be, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    (card / IDENTITY_NAME).write_text("0123456789ab\n")
    monkeypatch.setattr(DirectoryHandle, "open_lock_file", refuse)
    assert number(card) == "0123456789ab"
    (card / IDENTITY_NAME).unlink()
    first = number(card)
    be("10000000bbbbbbbb", "1")
    assert number(card) != first
