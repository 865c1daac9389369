"""Logs that are cut, damaged or half removed: nothing intact is lost, nothing damaged accepted, and it is said."""

from __future__ import annotations

from pathlib import Path

import pytest

from fault_trials import Hazard, cases_for_tests, label
from log_damage import HAZARDS


@pytest.mark.parametrize(("hazard", "case"), cases_for_tests(HAZARDS), ids=label)
def test_what_is_promised_is_held(tmp_path: Path, hazard: Hazard, case: object) -> None:
    assert hazard.trial(tmp_path, case).wrong == ()
