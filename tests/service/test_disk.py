"""Full, failing and read-only disks: the storage goes on, says so, writes everything once it can, loses nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from logger.store.log.log_writer import SegmentLog

from ..support.faults.crashes import FACTS, window
from ..support.faults.disk_models import RefusingFiles
from ..support.faults.disks import HAZARDS
from ..support.faults.trials import Hazard, cases_for_tests, label


@pytest.mark.parametrize(("hazard", "case"), cases_for_tests(HAZARDS, quick=6), ids=label)
def test_what_is_promised_is_held(tmp_path: Path, hazard: Hazard, case: object) -> None:
    assert hazard.trial(tmp_path, case).wrong == ()


@pytest.mark.parametrize("kind", ["write", "sync"])
def test_a_part_that_failed_takes_nothing_more(tmp_path: Path, kind: str) -> None:
    files = RefusingFiles()
    log = SegmentLog(tmp_path, 1, FACTS, 100_000, files)
    log.append(window(1, utc=True))
    log.sync()
    files.refuses = lambda asked: asked == kind
    with pytest.raises(OSError, match="error"):
        log.append(window(2, utc=True))
        log.sync()
    files.refuses = lambda asked: False
    with pytest.raises(ValueError, match="go_on"):
        log.append(window(2, utc=True))
    with pytest.raises(ValueError, match="go_on"):
        log.sync()
    assert log.rows_on_disk == 1
