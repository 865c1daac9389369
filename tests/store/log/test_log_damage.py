"""Logs that are cut, damaged or half removed: nothing intact is lost, nothing damaged accepted, and it is said."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from logger.store.integrity import verify
from logger.store.log.log_writer import SegmentLog
from logger.store.log.recovery import repair
from logger.store.log.row_format import HEADER, format_row, read_log
from logger.store.log.sidecar import MOST_HOLES, ClockMap, read_sidecar, sealed

from ...support.faults.crashes import FACTS, OFFSET_US, problems, window
from ...support.faults.log_damage import HAZARDS
from ...support.faults.trials import Hazard, cases_for_tests, label

LONG = ("a bit flipped in the sidecar of an open log", "damage inside an open log",
        "damage inside an open log and the file that was made of it")


@pytest.mark.parametrize(("hazard", "case"), cases_for_tests(HAZARDS, 1, LONG), ids=label)
def test_what_is_promised_is_held(tmp_path: Path, hazard: Hazard, case: object) -> None:
    assert hazard.trial(tmp_path, case).wrong == ()


def rows_of(*segments: int, speed: float = 15.24) -> str:
    """The text of a log with these rows."""
    rows = [format_row(replace(window(segment, utc=True), speed_mps=speed)) for segment in segments]
    return "".join(f"{line}\n" for line in [HEADER, *rows])


def test_the_place_of_damaged_rows_stands_in_the_sidecar_and_verify_tells_it(tmp_path: Path) -> None:
    part = tmp_path / "00001-001.csv.part"
    part.write_text(rows_of(1, 2, 3, 4, 5).replace(f"\n{format_row(window(3, utc=True))}\n", "\n?\n"))
    repair(tmp_path)
    sidecar = read_sidecar(tmp_path / "00001-001.csv") or {}
    assert sidecar["log"]["segments_lost"] == [[3, 3]]
    check, = verify([tmp_path])
    assert (check.ok, check.gaps) == (True, 0)
    assert check.notes == ("sidecar: settings and clock were lost before a repair",
                           "line 4: segments 3 to 3 were damaged: a repair has left them out")


def test_a_gap_without_damage_is_still_one(tmp_path: Path) -> None:
    (tmp_path / "00001-001.csv.part").write_text(f"{rows_of(1, 2)}?\n{format_row(window(4, utc=True))}\n"
                                                 f"{format_row(window(6, utc=True))}\n")
    repair(tmp_path)
    assert problems(tmp_path) == ["line 5: gap: expected segment 5, found 6"]


def test_a_part_of_which_nothing_is_intact_leaves_word_of_it(tmp_path: Path) -> None:
    (tmp_path / "00001-001.csv.part").write_text(rows_of(1, 2))
    (tmp_path / "00001-002.csv.part").write_text("?\n?\n")
    (tmp_path / "00001-003.csv.part").write_text(rows_of(5, 6))
    repair(tmp_path)
    assert problems(tmp_path) == []
    assert read_log(tmp_path / "00001-002.csv").records == ()
    (tmp_path / "00001-002.csv").unlink()
    (tmp_path / "00001-002.json").unlink()
    assert problems(tmp_path) == ["after 00001-001.csv: gap: expected segment 3, found 5"]


def test_what_was_lost_is_still_known_when_utc_is_filled_in(tmp_path: Path) -> None:
    rows = [format_row(window(segment, utc=False)) for segment in (1, 3)]
    (tmp_path / "00001-001.csv.part").write_text(f"{HEADER}\n{rows[0]}\n?\n{rows[1]}\n")
    repair(tmp_path)
    later = SegmentLog(tmp_path, 2, FACTS, 10**6)  # a clock that reaches the session's finished file
    later.append(window(4, utc=False))
    later.set_clock_map(ClockMap(OFFSET_US))
    for ending in (".csv.part", ".json"):
        (tmp_path / f"00002-001{ending}").rename(tmp_path / f"00001-002{ending}")
    repair(tmp_path)
    assert all(record.utc_us is not None for record in read_log(tmp_path / "00001-001.csv").records)
    said = (read_sidecar(tmp_path / "00001-001.csv") or {})["log"]
    assert (said["segments_lost"], said["damaged_lines_left_out"]) == ([[2, 2]], 1)
    assert problems(tmp_path) == []


def test_more_holes_than_are_listed_are_one(tmp_path: Path) -> None:
    segments = range(1, 2 * MOST_HOLES + 9, 2)
    text = "?\n".join(f"{format_row(window(segment, utc=True))}\n" for segment in segments)
    (tmp_path / "00001-001.csv.part").write_text(f"{HEADER}\n{text}")
    repair(tmp_path)
    said = (read_sidecar(tmp_path / "00001-001.csv") or {})["log"]
    assert len(said["segments_lost"]) == MOST_HOLES
    assert problems(tmp_path) == []


@pytest.mark.parametrize("holes", [7, [7], [[2]], [[2, "4"]], [[True, 5]], [[3, 4]], [[2, 3]], {"2": 4}])
def test_holes_that_are_none_excuse_nothing(tmp_path: Path, holes: object) -> None:
    (tmp_path / "00001-001.csv").write_text(rows_of(1, 5))
    (tmp_path / "00001-001.json").write_text(json.dumps(sealed({"log": {"rows": 2, "segments_lost": holes}})))
    assert problems(tmp_path) == ["line 3: gap: expected segment 2, found 5"]


def test_intact_rows_of_a_part_and_its_finished_file_are_merged(tmp_path: Path) -> None:
    lines = [format_row(window(segment, utc=True)) for segment in (1, 2, 3, 4)]
    (tmp_path / "00001-001.csv").write_text("\n".join([HEADER, lines[0], "?", lines[2], lines[3], ""]))
    (tmp_path / "00001-001.csv.part").write_text("\n".join([HEADER, "?", lines[1], lines[2], "?", ""]))
    found, = repair(tmp_path)
    assert (tmp_path / "00001-001.csv").read_text() == rows_of(1, 2, 3, 4)
    assert not found.part.exists()
    assert found.tally.rows == 4


def test_rows_that_contradict_each_other_are_both_kept(tmp_path: Path) -> None:
    (tmp_path / "00001-001.csv").write_text(rows_of(1, 2))
    other = rows_of(1) + rows_of(2, 3, speed=20.0).partition("\n")[2]
    (tmp_path / "00001-001.csv.part").write_text(other)
    warnings: list[str] = []
    repair(tmp_path, warn=warnings.append)
    assert (tmp_path / "00001-001.csv").read_text() == rows_of(1, 2) + rows_of(3, speed=20.0).partition("\n")[2]
    assert (tmp_path / "00001-001.csv.part.aside").read_text() == other
    assert len(warnings) == 1
    assert "00001-001.csv.part.aside" in warnings[0]
    assert repair(tmp_path) == []
