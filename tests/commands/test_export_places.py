"""Where an export goes and whose it is: the disk of the logs, copied folders and cloned cards, and both at the desk."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from logger.commands.main import main
from logger.store.export.export import exported_names
from logger.store.export.sticks import HOMES_NAME, IDENTITY_NAME
from logger.store.log.log_reader import find_logs
from logger.store.log.log_writer import SegmentLog

from ..store.test_integrity import row

SHM = Path("/dev/shm")


@pytest.fixture
def stick(tmp_path: Path) -> Iterator[Path]:
    """A folder on another file system than that of the logs."""
    folder = SHM / f"ridelog-test-{tmp_path.name}"
    folder.mkdir()
    yield folder
    shutil.rmtree(folder)


def drive(folder: Path, session: int, began_us: int, rows: int = 5) -> None:
    """A finished log of a drive that began so long after the boot."""
    folder.mkdir(exist_ok=True)
    log = SegmentLog(folder, session, {"car": str(began_us)}, 10**6)
    for segment in range(rows):
        log.append(row(segment, began_us + segment * 500_000))
    log.close()


def exported(capsys: pytest.CaptureFixture[str], logs: Path, stick: Path, status: int = 0) -> dict[str, Any]:
    assert main(["export", "--from", str(logs), "--to", str(stick), "--json"]) == status
    said: dict[str, Any] = json.loads(capsys.readouterr().out)
    return said


@pytest.mark.parametrize("place", ["media_RIDELOG", "card/of/it", "link"])
def test_a_copy_on_the_disk_of_the_logs_is_no_export(
        tmp_path: Path, place: str, capsys: pytest.CaptureFixture[str]) -> None:
    drive(tmp_path / "logs", 1, 0)
    (tmp_path / "mounted").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "mounted")
    (tmp_path / place).mkdir(parents=True, exist_ok=True)
    assert main(["export", "--from", str(tmp_path / "logs"), "--to", str(tmp_path / place)]) == 1
    said = capsys.readouterr().out
    assert said.startswith("WRONG: 2 files copied")
    assert f"no stick is mounted at {tmp_path / place}, it is on the disk that holds the logs" in said
    assert exported_names(tmp_path / "logs") == set()
    assert exported(capsys, tmp_path / "logs", tmp_path / place, status=1)["complete"] is True


def test_another_disk_is_a_stick(tmp_path: Path, stick: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drive(tmp_path / "logs", 1, 0)
    assert exported(capsys, tmp_path / "logs", stick)["unmarked"] is None
    assert exported_names(tmp_path / "logs") == {"00001-001.csv", "00001-001.json"}


def test_a_card_that_was_copied_for_a_second_car_is_another_logger(
        tmp_path: Path, stick: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = tmp_path / "a", tmp_path / "b"
    drive(a, 1, 0)
    exported(capsys, a, stick)
    shutil.copytree(a, b)
    drive(a, 2, 1_000)
    drive(b, 2, 9_000)
    for _ in range(2):
        of_a, of_b = exported(capsys, a, stick), exported(capsys, b, stick)
        assert of_a["logger"] != of_b["logger"]
        assert of_a["set_aside"] == of_b["set_aside"] == []
    assert main(["verify", str(stick), "--json"]) == 0
    assert {path.name for path in (stick / "ridelog").iterdir()} == {of_a["logger"], of_b["logger"]}
    for name, logs in ((of_a["logger"], a), (of_b["logger"], b)):
        assert (stick / "ridelog" / name / "00002-001.csv").read_bytes() == (logs / "00002-001.csv").read_bytes()


def test_two_cars_that_had_one_number_already_lose_nothing(
        tmp_path: Path, stick: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Their cards were cloned and exported by a version that kept the number alone."""
    a, b = tmp_path / "a", tmp_path / "b"
    drive(a, 2, 1_000)
    drive(b, 2, 9_000)
    for card in (a, b):
        (card / IDENTITY_NAME).write_text("0123456789ab\n")
    folder = stick / "ridelog" / "0123456789ab"
    for turn in range(3):
        for card in (a, b):
            said = exported(capsys, card, stick)
            assert said["complete"] is True
            assert bool(said["set_aside"]) == (turn == 0 and card == b)
    old = sorted(path.name for path in folder.glob("*.old"))
    assert len(old) == 2
    assert {path.read_bytes() for path in folder.glob("00002-001.csv*")} == {
        (card / "00002-001.csv").read_bytes() for card in (a, b)}
    assert [path.name for path in find_logs(stick)] == ["00002-001.csv", old[0]]
    assert main(["verify", str(stick)]) == 0
    checked = capsys.readouterr().out
    assert f"{old[0]} (log): 5 good" in checked
    assert "as another log had that name" in checked
    (folder / old[0]).write_bytes(b"worn out\n")
    assert main(["verify", str(stick)]) == 1
    assert f"{old[0]}: corrupt" in capsys.readouterr().out
    assert exported(capsys, a, stick)["set_aside"] != []  # it is copied once more


def test_a_copy_that_was_damaged_is_set_aside_and_not_listed(
        tmp_path: Path, stick: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drive(tmp_path / "logs", 1, 0)
    folder = stick / "ridelog" / exported(capsys, tmp_path / "logs", stick)["logger"]
    (folder / "00001-001.csv").write_bytes(b"worn out\n")
    assert len(exported(capsys, tmp_path / "logs", stick)["set_aside"]) == 1
    assert ".old" not in (folder / "manifest.sha256").read_text()
    assert main(["verify", str(stick)]) == 0
    capsys.readouterr()


def test_an_older_state_of_a_log_is_no_drive_of_its_own(
        tmp_path: Path, stick: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drive(tmp_path / "logs", 1, 0)
    exported(capsys, tmp_path / "logs", stick)
    kept = {name: (tmp_path / "logs" / name).read_bytes() for name in (IDENTITY_NAME, HOMES_NAME)}
    shutil.rmtree(tmp_path / "logs")
    drive(tmp_path / "logs", 1, 0, rows=7)
    for name, content in kept.items():
        (tmp_path / "logs" / name).write_bytes(content)
    assert len(exported(capsys, tmp_path / "logs", stick)["set_aside"]) == 2
    assert [path.name for path in find_logs(stick)] == ["00001-001.csv"]
    assert main(["verify", str(stick)]) == 0
    capsys.readouterr()
