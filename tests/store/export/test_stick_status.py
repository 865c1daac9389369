"""Notes and the light. The light is a folder of plain files; the kernel's list of triggers is put in by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from logger.store.export import sticks
from logger.store.export.sticks import StickNote, StickState, read_note, read_notes, show_on_led, write_note

COPYING = StickNote("sda1", "copying", True, "copying, 1 of 4 files")
DONE = StickNote("sda1", "ready", True, "4 files copied; it may be pulled")
FAILED = StickNote("sdb1", "ready", False, "no room; it may be pulled")


@pytest.fixture
def led(tmp_path: Path) -> Path:
    folder = tmp_path / "leds" / "ACT"
    folder.mkdir(parents=True)
    (folder / "trigger").write_text("none kbd-scrolllock timer heartbeat [mmc0] default-on\n")
    (folder / "max_brightness").write_text("255\n")
    (folder / "brightness").write_text("0\n")
    return folder


@pytest.fixture
def notes(tmp_path: Path) -> Path:
    folder = tmp_path / "notes"
    folder.mkdir()
    return folder


def put(notes: Path, *all_notes: StickNote) -> None:
    for path in notes.glob("*.json"):
        path.unlink()
    for note in all_notes:
        write_note(notes / f"{note.stick}.json", note)


@pytest.mark.parametrize("content", ["[]", "{", "[" * 9_000, "[" * 10**6, '{"stick": 1}'])
def test_what_is_no_note_is_passed_over(notes: Path, content: str) -> None:
    put(notes, DONE)
    (notes / "sdb1.json").write_text(content)
    assert read_notes(notes) == [DONE]


def test_notes_are_read_as_written_and_in_order(notes: Path) -> None:
    put(notes, FAILED, COPYING)
    assert read_notes(notes) == [COPYING, FAILED]


def test_a_stick_whose_note_is_still_empty_waits(led: Path, notes: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The unit makes it before anything else, so that a stick is never without a note, nor with that of another."""
    (notes / "sda1.27.json").touch()
    monkeypatch.setattr(sticks, "is_plugged_in", lambda path: True)
    waiting, = read_notes(notes)
    assert (waiting.stick, waiting.state, waiting.ok) == ("sda1", "waiting", True)
    assert read_note(notes / "sda1.27.json") == waiting
    show_on_led(led, notes)
    assert (led / "trigger").read_text() == "heartbeat"


def test_the_note_of_a_stick_that_was_pulled_counts_no_more(
        led: Path, notes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is removed when systemd comes to it, and an export that was cut short may still write to it."""
    disk = tmp_path / "devices" / "sda"
    (disk / "sda1").mkdir(parents=True)
    (disk / "diskseq").write_text("28\n")
    block = tmp_path / "block"
    block.mkdir()
    for name, place in (("sda", disk), ("sda1", disk / "sda1")):
        (block / name).symlink_to(place)
    monkeypatch.setattr(sticks, "BLOCK_DEVICES", block)
    for name in ("sda1.27", "sda.28", "sda1.28", "sdb1.27", "by-hand"):
        write_note(notes / f"{name}.json", replace(FAILED, stick=name))
    assert [note.stick for note in read_notes(notes)] == ["by-hand", "sda.28", "sda1.28"]
    for name in ("sda.28", "sda1.28", "by-hand"):
        (notes / f"{name}.json").unlink()
    show_on_led(led, notes)
    assert "[mmc0]" in (led / "trigger").read_text()


@pytest.mark.parametrize("text", ["[]", "{}", '{"stick": 1}', '{"stick":"a","state":"x","ok":true,"text":""}'])
def test_what_is_no_note_is_none(notes: Path, text: str) -> None:
    (notes / "sda1.json").write_text(text)
    assert read_note(notes / "sda1.json") is None
    assert read_notes(notes) == []
    assert read_notes(notes / "missing") == []


def shown(led: Path, notes: Path, *all_notes: StickNote) -> str:
    put(notes, *all_notes)
    show_on_led(led, notes)
    return (led / "trigger").read_text()


def test_the_light_goes_from_beating_to_steady_and_back_to_what_it_was(led: Path, notes: Path) -> None:
    assert shown(led, notes, COPYING) == "heartbeat"
    assert shown(led, notes, DONE) == "none"
    assert (led / "brightness").read_text().strip() == "255"
    assert shown(led, notes) == "mmc0"
    assert list(notes.iterdir()) == []


def test_with_two_sticks_the_light_shows_what_matters_more(led: Path, notes: Path) -> None:
    assert shown(led, notes, COPYING, FAILED) == "heartbeat"
    assert shown(led, notes, DONE, FAILED) == "timer"
    assert shown(led, notes, DONE) == "none"
    assert shown(led, notes) == "mmc0"


@pytest.mark.parametrize("state", ["copying", "unmounting"])
def test_a_stick_that_failed_beats_until_it_is_unmounted(led: Path, notes: Path, state: StickState) -> None:
    assert shown(led, notes, StickNote("sda1", state, False, "x")) == "heartbeat"


def test_a_light_that_is_not_there_is_no_fault(tmp_path: Path, notes: Path) -> None:
    put(notes, COPYING)
    show_on_led(tmp_path / "none", notes)
    show_on_led(tmp_path / "none", tmp_path / "no notes")
    assert read_notes(notes) == [COPYING]
