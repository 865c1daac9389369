"""The names of a logger's files: what is ours, and what only looks like it."""

from __future__ import annotations

from pathlib import Path

import pytest

from logger.store.log.log_name import OwnFile, log_name, next_session, session_of

NINES = 200 * "9"


@pytest.mark.parametrize(("name", "found"), [
    ("00012-003.csv", OwnFile(12, 3, ".csv", False)), ("00012-003.csv.part", OwnFile(12, 3, ".csv", True)),
    ("123456-1000.json", OwnFile(123456, 1000, ".json", False)), ("00012.dump.gz", OwnFile(12, 0, ".dump.gz", False)),
    ("00012-002.dump.gz.part", OwnFile(12, 2, ".dump.gz", True)), ("00012.dump", OwnFile(12, 0, ".dump", False))])
def test_a_name_says_session_part_and_kind(name: str, found: OwnFile) -> None:
    assert OwnFile.of(name) == found


@pytest.mark.parametrize("name", ["0012-003.csv", "00012.csv", "00012-03.csv", "00012-003.csv.aside", "x00012-003.csv",
                                  "00012-003.json.part", f"{NINES}-001.csv", f"00001-{NINES}.csv", "٠٠٠١٢-٠٠٣.csv",
                                  "00012-003.csv\n"])
def test_other_names_are_not_ours(name: str) -> None:
    assert OwnFile.of(name) is None
    assert log_name(Path(name)) is None


def test_names_of_logs_are_some_of_them() -> None:
    assert log_name(Path("a/00012-003.csv.part")) == OwnFile(12, 3, ".csv", is_open=True)
    assert log_name(Path("00012-003.json")) is None


def test_a_strange_number_is_no_session(tmp_path: Path) -> None:
    """A counter that went on from it could name no file."""
    for name in (f"{NINES}-001.csv", "٠٠٠١٢-001.csv", "00041-001.csv.aside"):
        (tmp_path / name).touch()
    assert session_of(f"{NINES}-001.csv") is None
    assert next_session(tmp_path) == 42
