"""What goes wrong with sensors and their wires: every fault of the table, and that nobody asks the system's clock."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import drivers
import logger

from ..support.faults.sensors import HAZARDS
from ..support.faults.trials import Hazard, cases_for_tests, label

WALL_CLOCKS = {("time", "time"), ("time", "time_ns"), ("time", "localtime"), ("time", "gmtime"), ("time", "ctime"),
               ("time", "strftime"), ("datetime", "now"), ("datetime", "utcnow"), ("datetime", "today"),
               ("date", "today"), ("time", "CLOCK_REALTIME")}


def test_nobody_asks_the_systems_clock() -> None:
    asked = []
    for package in (drivers, logger):
        for path in Path(str(package.__file__)).parent.rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name | ast.Attribute):
                    owner = node.value.id if isinstance(node.value, ast.Name) else node.value.attr
                    if (owner, node.attr) in WALL_CLOCKS:
                        asked.append(f"{path}:{node.lineno}")
    assert asked == []


LONG = ("an hour without a fix", "GPS date jumps for good", "system clock set back", "frozen accelerometer",
        "GPS date jumps for seconds")


@pytest.mark.parametrize(("hazard", "case"), cases_for_tests(HAZARDS, 1, LONG), ids=label)
def test_what_is_promised_is_held(tmp_path: Path, hazard: Hazard, case: object) -> None:
    assert hazard.trial(tmp_path, case).wrong == ()
