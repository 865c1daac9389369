"""One small file that cannot be read or removed stops nothing: a new session begins, and the file is named."""

from __future__ import annotations

import errno
import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from logger.service import serve
from logger.service.config import Config, LogConfig
from logger.service.systemd_notify import Stop
from logger.store.log.log_name import next_session
from logger.store.log.log_writer import SegmentLog

from ...support.faults.crashes import window
from ...support.faults.disk_models import RefusingFiles
from ...support.faults.small_files import HAZARDS, NAMES, THINGS, DeadFile, at_most_s, left_by_a_kill, replace_by
from ...support.faults.trials import Hazard, cases_for_tests, label


@pytest.mark.parametrize(("hazard", "case"), cases_for_tests(HAZARDS, quick=20), ids=label)
def test_a_session_begins(tmp_path: Path, hazard: Hazard, case: object) -> None:
    assert hazard.trial(tmp_path, case).wrong == ()


@pytest.mark.parametrize("thing", THINGS)
def test_the_service_starts_among_things_that_are_no_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, thing: str,
                                                           caplog: pytest.LogCaptureFixture) -> None:
    """All names are bad at once, and it is the service itself that is started."""
    left_by_a_kill(tmp_path / "log")
    for name in NAMES:
        replace_by(tmp_path / "log" / name, THINGS[thing])
    seen: dict[str, Any] = {}

    class Loop:
        def __init__(self, core: object, storage: Any, *rest: Any) -> None:
            seen.update(status=storage.status(), session=storage.log.session)

        def run(self, stop: Stop) -> None:
            pass

    monkeypatch.setattr(serve, "MainLoop", Loop)
    monkeypatch.setattr(serve, "go_first", lambda: None)
    log = replace(LogConfig(tmp_path / "log"), record_dump=True, keep_free_bytes=0)
    with caplog.at_level(logging.WARNING), at_most_s(30):
        serve.serve(Config(log=log, status_file=tmp_path / "status.json"), Stop())
    assert seen["status"].trouble == ""
    assert seen["status"].recording_trouble == ""
    assert seen["session"] == 3
    for name in ("last-session", "00002-002.json") if thing != "link to nothing" else ():
        assert any(name in record.getMessage() for record in caplog.records)


def test_a_counter_that_cannot_be_replaced_gives_no_number_twice(tmp_path: Path) -> None:
    """Not even when all logs were copied away and removed in between."""
    files = DeadFile("last-session", ("open", "create", "rename", "remove"), errno.EIO)
    (tmp_path / "last-session").write_text("half")
    numbers = []
    warnings: list[str] = []
    for _ in range(3):
        numbers.append(next_session(tmp_path, files, warnings.append))
        log = SegmentLog(tmp_path, numbers[-1], {}, 10**6, RefusingFiles())
        log.append(window(1, utc=True))
        log.close()
        for path in tmp_path.glob("0*"):
            path.unlink()
    assert numbers == [1, 2, 3]
    assert any("last-session" in words for words in warnings)
