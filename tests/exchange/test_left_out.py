"""What a command leaves out is in its JSON and in a line, with the reason, in one form for all commands."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from logger.api.drives import profile_of
from logger.api.inputs import Run
from logger.api.lab.checks import driven_stretches
from logger.commands.main import main
from logger.left_out import LeftOut, counting, left_out_json, left_out_lines
from logger.profiles.track import Track
from logger.runs import runs_left_out

from .test_convert import drive, eastwards, write

DAMAGED = {"amount": 1, "unit": "damaged line", "why": "('ridelog verify' lists them)"}


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """30 rows: one that does not count, two without an IRI, three without a place; and a line that is none."""
    places: list = eastwards(50.0, 8.0, 30)
    rows = drive([None if 10 <= number < 13 else place for number, place in enumerate(places)])
    object.__setattr__(rows[0], "flags", ("unsettled",))
    for number in (28, 29):
        object.__setattr__(rows[number], "iri_m_per_km", None)
    folder = write(tmp_path / "logs", rows)
    write(folder, drive(places[:2]), "00003-001.csv", "torn,line\n")
    return folder


def left_out(capsys: pytest.CaptureFixture[str], *words: object) -> dict[str, float]:
    assert main([*map(str, words), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["left_out"]
    assert all(set(one) == {"amount", "unit", "why"} for one in found)
    return {f"{one['unit']} {one['why']}": one["amount"] for one in found}


def test_commands_on_logs_count_what_they_leave_out(
        logs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = " ".join((DAMAGED["unit"], DAMAGED["why"]))  # type: ignore[arg-type]
    assert left_out(capsys, "convert", logs, "--to", tmp_path / "a.csv") == {line: 1}
    assert left_out(capsys, "report", logs, "--out", tmp_path / "a.html") == {line: 1}
    assert left_out(capsys, "sections", logs) == {line: 1, "row without a usable IRI": 3}
    assert left_out(capsys, "passes", logs) == {line: 1, "row without a usable IRI": 3, "row without a position": 3}
    by_fleet = left_out(capsys, "fleet", "ingest", logs, "--to", tmp_path / "town", "--car", "a")
    assert by_fleet[line] == 1
    assert by_fleet["row without a position or a direction"] >= 3
    for words in (("sections", logs), ("passes", logs), ("report", logs, "--out", tmp_path / "a.html")):
        assert main(list(map(str, words))) == 0
        assert "Not used: 1 damaged line ('ridelog verify' lists them)" in capsys.readouterr().out


def test_of_a_drive_the_lab_counts_standing_beginnings_and_holes() -> None:
    count, speed, usable = 4000, np.full(4000, 10.0), np.ones(4000)
    speed[1500:2000] = 0.0  # 5 s of standing
    usable[3000:3100] = 0.0  # 1 s in which nothing was read
    usable[3500:] = 0.0  # and 5 s at the end
    one = Run(Path("a"), 100.0, np.arange(count) / 100, np.sin(np.arange(count)), speed,
              np.cumsum(speed) / 100, None, None, usable=usable, profile=profile_of(Track(1.0, np.zeros(500))))
    found = {one.why: one.amount for one in runs_left_out(driven_stretches(one))}
    assert found == {
        "without excitation or readings": pytest.approx(10.0, abs=0.1),
        "without a reading": 100,
        "at the beginning of runs, as the motion before is unknown": pytest.approx(4.0, abs=0.1)}
    without = replace(one, usable=None, speed_mps=np.full(count, 10.0))
    assert {one.amount for one in runs_left_out(driven_stretches(without))} == {2.0}


def test_one_form() -> None:
    several = [LeftOut(3, "row", "without a position"), LeftOut(0, "row", "torn"), LeftOut(1.2, "s", "at an end"),
               LeftOut(4, "row", "without a position"), LeftOut(12.34, "s", "without a fix")]
    assert left_out_lines(several) == ["Not used: 7 rows without a position; 12.3 s without a fix."]
    assert left_out_json(several)["left_out"][0] == {"amount": 7, "unit": "row", "why": "without a position"}
    assert counting([]) == () and left_out_lines([]) == []
