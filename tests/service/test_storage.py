"""What the storage says at its start about the files it finds."""

from __future__ import annotations

import errno
import logging
from pathlib import Path

import pytest

from logger.commands.status import advice
from logger.service import storage as storage_module
from logger.service.status import SensorStatus, ServiceStatus, StorageStatus, read_status, write_status
from logger.service.storage import LOOK_US, Storage
from logger.store.log.log_writer import SegmentLog
from logger.store.log.row_format import read_log

from ..support.faults.crashes import FACTS, WHOLE_DISK, window
from ..support.faults.disk_models import RefusingFiles


def storage_in(folder: Path, files: RefusingFiles | None = None) -> Storage:
    return Storage(folder, FACTS, 10**6, None, WHOLE_DISK, lambda: 0, files or RefusingFiles())


def killed(folder: Path, session: int = 1) -> None:
    log = SegmentLog(folder, session, FACTS, 10**6, RefusingFiles())
    log.append(window(1, utc=True))


def test_a_repair_that_failed_is_not_called_one(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    killed(tmp_path)
    files = RefusingFiles()
    files.error = errno.EROFS
    files.refuses = lambda kind: True
    with caplog.at_level(logging.INFO):
        status = storage_in(tmp_path, files).status()
    said = [(record.levelname, record.getMessage()) for record in caplog.records if "00001-001" in record.getMessage()]
    words = ("00001-001.csv.part could not be repaired: the disk has become read-only; it stays as it is until the "
             "next start")
    assert said == [("WARNING", words)]
    assert status.notices == (words,)


def test_a_repair_says_what_it_kept(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    killed(tmp_path)
    with (tmp_path / "00001-001.csv.part").open("a") as part:
        part.write("?\n2,torn")
    with caplog.at_level(logging.INFO):
        assert storage_in(tmp_path).status().notices == ()
    assert "finished 00001-001.csv: 1 row; left out 1 damaged line and a torn one" in [
        record.getMessage() for record in caplog.records]


def test_what_was_put_aside_is_named_until_it_is_gone(tmp_path: Path) -> None:
    killed(tmp_path)
    (tmp_path / "00001-001.json").write_text("{")
    first = storage_in(tmp_path)
    assert [words.partition(":")[0] for words in first.status().notices] == ["00001-001.json"]
    first.close()
    second = storage_in(tmp_path)
    assert second.status().notices == ("put aside at an earlier start: 00001-001.json.aside",)
    second.close()
    (tmp_path / "00001-001.json.aside").unlink()
    assert storage_in(tmp_path).status().notices == ()


def test_notices_are_shown_with_what_to_do_and_are_bounded(tmp_path: Path) -> None:
    for session in range(1, 3 * storage_module.SHOWN_NOTICES):
        killed(tmp_path, session)
        (tmp_path / f"{session:05d}-001.json").write_text("{")
    storage = storage_in(tmp_path).status()
    assert len(storage.notices) == storage_module.SHOWN_NOTICES + 1
    sensor = SensorStatus("bma220", "/dev/i2c-1", "ok")
    write_status(tmp_path / "status.json", ServiceStatus("standing", 1, "0", 1.0, 1, sensor, sensor, storage=storage))
    status = read_status(tmp_path / "status.json")
    assert status is not None
    assert status.storage == storage
    steps = advice(status)
    assert steps[0].startswith("Log folder: 00001-001.json: damaged: expected a JSON object")
    assert "replace it" in steps[storage_module.SHOWN_NOTICES + 1]
    assert StorageStatus().notices == ()


def test_a_disk_that_became_read_only_is_noticed_though_it_refuses_nothing(tmp_path: Path) -> None:
    """A kernel that makes every disk read-only in an emergency lets open files be written to, and keeps nothing."""
    class Emergency(RefusingFiles):
        read_only = False

        def is_read_only(self, directory: Path) -> bool:
            return self.read_only

    files, now_us = Emergency(), 0
    storage = Storage(tmp_path, FACTS, 10**6, None, WHOLE_DISK, lambda: now_us, files)
    storage.log.append(window(1, utc=True))
    files.read_only = True
    now_us += LOOK_US
    storage.tend()
    storage.log.append(window(2, utc=True))
    status = storage.status()
    assert status.trouble == "the disk has become read-only"
    assert status.rows_waiting == 1
    files.read_only = False
    for _ in range(20):
        now_us += LOOK_US
        storage.tend()
    assert storage.status().trouble == ""
    storage.close()
    segments = [record.segment for path in sorted(tmp_path.glob("*.csv")) for record in read_log(path).records]
    assert segments == [1, 2]
