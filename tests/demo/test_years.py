"""The logs of ``demo --years``: what changed on the road is what ``passes`` finds."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from logger.commands.main import main

from ..support.drives.years import BROKEN_M, PAVED_M


def test_what_got_worse_and_better_is_where_the_road_was_changed(tmp_path: Path, capsys: pytest.CaptureFixture[str]
                                                                 ) -> None:
    assert main(["demo", "--years", "--json", "--out", str(tmp_path)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["drives"], (tmp_path / "changes.html").is_file()) == (6, True)
    step_m, sure = found["length_m"], [one for one in found["cells"] if one["change_false_share"] < 0.05]
    for (from_m, to_m), sign in ((BROKEN_M, 1), (PAVED_M, -1)):
        at_m = [(number + 0.5) * step_m for number, one in enumerate(found["cells"])
                if one in sure and sign * one["change_m_per_km"] > 0]
        assert len(at_m) >= 0.8 * (to_m - from_m) / step_m
        assert from_m - step_m < min(at_m) and max(at_m) < to_m + step_m


def test_a_period_without_drives_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "--years", "--unpack", "--out", str(tmp_path)]) == 0
    assert f"ridelog passes {tmp_path}/2025 {tmp_path}/2026 --split 2026" in capsys.readouterr().out
    assert main(["passes", str(tmp_path / "2025"), "--split", "2026"]) == 0
    assert "before the date: 3, from then on: 0, without a date: 0" in capsys.readouterr().out.replace("\n", " ")
