"""docs/reference/trials.md: what it says is what the bench says, and no promise on it is broken."""

from __future__ import annotations

from pathlib import Path

from ..benchmarks import faults

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "trials.md"


def test_no_promise_is_broken_and_no_goal_missed() -> None:
    bad = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if "BROKEN" in line or "MISSED" in line]
    assert bad == []


def test_its_head_is_that_of_the_bench() -> None:
    assert PAGE.read_text(encoding="utf-8").startswith(f"{faults.HEAD}\n## What `ridelog status` says\n")
