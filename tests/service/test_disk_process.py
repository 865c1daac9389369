"""The real command: killed at random under load, and with a limit of the system on its files."""

from __future__ import annotations

from pathlib import Path

import pytest

from ..support.faults.kills import KILLS, SERVICES, WRITES_NO_MORE


@pytest.mark.slow
def test_a_dozen_kills(tmp_path: Path) -> None:
    case, = KILLS.some()
    found = KILLS.trial(tmp_path, case)
    assert found.wrong == ()
    assert found.trials == 2 * SERVICES
    assert found.figures["dumps"] > SERVICES


@pytest.mark.slow
def test_a_service_that_may_write_no_more_stays_up_and_goes_on(tmp_path: Path) -> None:
    assert WRITES_NO_MORE.trial(tmp_path, None).wrong == ()
