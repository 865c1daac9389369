"""The real command: killed at random under load, and with a limit of the system on its files."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ..support.faults.kills import KILLS, SERVICES, WRITES_NO_MORE, ends_while_it_may_not_write


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


@pytest.mark.slow
def test_the_last_words_count_what_is_on_the_disk(tmp_path: Path) -> None:
    last, heard, rows = ends_while_it_may_not_write(tmp_path)
    said = re.search(r"stopped: (\d+) rows written, (\d+) lost: (.+)$", last)
    assert said is not None, last
    written, lost = int(said[1]), int(said[2])
    # A row whose sync the disk refused is counted as lost, though it may be found in its file after all.
    assert 20 < written <= rows <= written + lost
    assert lost > 10
    assert f"STATUS={said[0]}" in heard
