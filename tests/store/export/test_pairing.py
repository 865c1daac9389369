"""Which sticks get the logs, and whose copies let a log be removed."""

from __future__ import annotations

from pathlib import Path

import pytest

from logger.errors import CheckFailed
from logger.store.export.directory_handle import DirectoryHandle
from logger.store.export.export import ExportResult, export, exported_names, read_marks
from logger.store.export.sticks import FIRST_STICK, KEY_FILE, KEY_NAME, OFF, PAIRED_NAME, STICK_NAME, Pairing

from ...support.faults.sticks import NAMES, a_card, a_stick, contents, own, quiet

KEY = b"0123456789abcdef0123456789abcdef\n"
FIRST = Pairing(FIRST_STICK)


pytestmark = pytest.mark.usefixtures("folders_as_sticks")


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    return a_card(tmp_path)


@pytest.fixture
def sticks(tmp_path: Path) -> list[Path]:
    return [a_stick(tmp_path / name) for name in ("mine", "theirs")]


@pytest.fixture
def by_key(tmp_path: Path) -> Pairing:
    (tmp_path / "stick.key").write_bytes(KEY)
    return Pairing(KEY_FILE, tmp_path / "stick.key")


def plug_in(logs: Path, stick: Path, pairing: Pairing) -> ExportResult:
    return export(logs, stick, quiet, pairing)


def by_hand(logs: Path, stick: Path, pairing: Pairing) -> ExportResult:
    return export(logs, stick, quiet, pairing, by_hand=True)


def files(stick: Path) -> dict[str, bytes]:
    return {str(path.relative_to(stick)): path.read_bytes() for path in stick.rglob("*") if path.is_file()}


def test_without_pairing_every_stick_gets_all_and_every_copy_counts(logs: Path, sticks: list[Path]) -> None:
    for stick in sticks:
        assert plug_in(logs, stick, Pairing()).copied == NAMES
        assert set(contents(own(logs, stick))) == {*NAMES, "manifest.sha256"}
    assert Pairing().mode == OFF
    assert exported_names(logs) == exported_names(logs, Pairing()) == set(NAMES)


def test_the_first_stick_wins(logs: Path, sticks: list[Path]) -> None:
    mine, theirs = sticks
    before = files(theirs)
    assert plug_in(logs, mine, FIRST).copied == NAMES
    for _ in range(2):
        with pytest.raises(CheckFailed, match=f"not the stick .* paired with.*{PAIRED_NAME}"):
            plug_in(logs, theirs, FIRST)
    assert files(theirs) == before
    assert plug_in(logs, mine, FIRST).already_there == NAMES
    assert exported_names(logs, FIRST) == set(NAMES)


def test_another_stick_may_take_its_place_when_the_owner_says_so(logs: Path, sticks: list[Path]) -> None:
    mine, new = sticks
    plug_in(logs, mine, FIRST)
    (logs / PAIRED_NAME).unlink()
    assert exported_names(logs, FIRST) == set()
    assert plug_in(logs, new, FIRST).copied == NAMES
    with pytest.raises(CheckFailed):
        plug_in(logs, mine, FIRST)
    assert exported_names(logs, FIRST) == set(NAMES)


@pytest.mark.parametrize("damage", [b"", b"0" * 31 + b"\n", b"x" * 40, bytes(32)])
def test_what_remembers_the_stick_damaged_is_no_pairing_with_the_next(
        logs: Path, sticks: list[Path], damage: bytes) -> None:
    plug_in(logs, sticks[0], FIRST)
    (logs / PAIRED_NAME).write_bytes(damage)
    (own(logs, sticks[0]) / STICK_NAME).write_bytes(damage)
    for stick in sticks:
        with pytest.raises(CheckFailed):
            plug_in(logs, stick, FIRST)
    assert exported_names(logs, FIRST) == set()


def test_a_stick_that_lost_its_number_is_a_stranger(logs: Path, sticks: list[Path]) -> None:
    plug_in(logs, sticks[0], FIRST)
    (own(logs, sticks[0]) / STICK_NAME).unlink()
    with pytest.raises(CheckFailed):
        plug_in(logs, sticks[0], FIRST)


def test_a_card_that_was_put_into_another_machine_knows_its_stick(
        logs: Path, sticks: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plug_in(logs, sticks[0], FIRST)
    before = own(logs, sticks[0])
    (tmp_path / "serial").write_text("another board")
    monkeypatch.setattr("logger.store.export.sticks.BOARD_SERIAL", tmp_path / "serial")
    assert plug_in(logs, sticks[0], FIRST).copied == NAMES
    assert own(logs, sticks[0]) != before
    assert exported_names(logs, FIRST) == set(NAMES)
    with pytest.raises(CheckFailed, match="not the stick"):
        plug_in(logs, sticks[1], FIRST)


def test_copies_made_before_there_was_a_pairing_count_once_the_paired_stick_has_them(
        logs: Path, sticks: list[Path], by_key: Pairing) -> None:
    mine, theirs = sticks
    plug_in(logs, theirs, Pairing())
    assert exported_names(logs, FIRST) == exported_names(logs, by_key) == set()
    plug_in(logs, mine, FIRST)
    assert exported_names(logs, FIRST) == exported_names(logs) == set(NAMES)
    assert exported_names(logs, by_key) == set()
    (mine / KEY_NAME).write_bytes(KEY)
    assert plug_in(logs, mine, by_key).already_there == NAMES
    assert exported_names(logs, by_key) == set(NAMES)


def test_a_stick_needs_the_key(logs: Path, sticks: list[Path], by_key: Pairing) -> None:
    mine, theirs = sticks
    before = files(theirs)
    (mine / KEY_NAME).write_bytes(KEY)
    assert plug_in(logs, mine, by_key).copied == NAMES
    assert exported_names(logs, by_key) == set(NAMES)
    for other in (None, b"", KEY[:-1], KEY + KEY, b"x" * 10**6):
        if other is not None:
            (theirs / KEY_NAME).write_bytes(other)
            before[KEY_NAME] = other
        with pytest.raises(CheckFailed, match=KEY_NAME):
            plug_in(logs, theirs, by_key)
    assert files(theirs) == before


@pytest.mark.parametrize("key", [None, b"", b"short\n", b"x" * 5000])
def test_a_box_without_a_good_key_gives_nothing(logs: Path, sticks: list[Path], by_key: Pairing,
                                                key: bytes | None) -> None:
    by_key.key_file.unlink()
    if key is not None:
        by_key.key_file.write_bytes(key)
        (sticks[0] / KEY_NAME).write_bytes(key)
    with pytest.raises(CheckFailed, match=r"stick\.key: expected a file of 16 to 4096 bytes"):
        plug_in(logs, sticks[0], by_key)
    assert exported_names(logs, by_key) == set()


def test_a_key_is_not_followed_out_of_the_stick(logs: Path, sticks: list[Path], by_key: Pairing) -> None:
    (sticks[1] / KEY_NAME).symlink_to(by_key.key_file)
    with pytest.raises(CheckFailed):
        plug_in(logs, sticks[1], by_key)


def test_who_copies_by_hand_gets_a_copy_that_lets_nothing_be_removed(
        logs: Path, sticks: list[Path], by_key: Pairing) -> None:
    for pairing in (FIRST, by_key):
        result = by_hand(logs, sticks[1], pairing)
        assert result.complete
        assert "not paired" in str(result.unmarked)
        assert exported_names(logs, pairing) == set()
    assert not (logs / PAIRED_NAME).exists()
    plug_in(logs, sticks[0], FIRST)
    by_hand(logs, sticks[1], FIRST)
    assert exported_names(logs, FIRST) == set(NAMES)
    assert by_hand(logs, sticks[0], FIRST).unmarked is None


def test_marks_name_their_stick(logs: Path, sticks: list[Path]) -> None:
    plug_in(logs, sticks[0], FIRST)
    with DirectoryHandle.at(logs) as folder:
        marks = read_marks(folder)
    number = (own(logs, sticks[0]) / STICK_NAME).read_text().strip()
    assert {mark.stick for mark in marks.values()} == {number} == {(logs / PAIRED_NAME).read_text().strip()}
