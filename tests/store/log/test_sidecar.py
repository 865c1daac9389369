"""Sidecars: what was written is what is read, and nothing else."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from logger.store.integrity import FileCheck, verify
from logger.store.log.log_writer import SegmentLog
from logger.store.log.recovery import repair
from logger.store.log.sidecar import read_sidecar

from ...support.faults.crashes import FACTS, window


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A finished log of one row."""
    log = SegmentLog(tmp_path, 1, FACTS, 10**6)
    log.append(window(1, utc=True))
    log.close()
    return tmp_path / "00001-001.csv"


def stored(log: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(log.with_suffix(".json").read_text())
    return content


def store(log: Path, content: dict[str, Any]) -> FileCheck:
    log.with_suffix(".json").write_text(json.dumps(content, indent=2))
    check, = verify([log])
    return check


def test_the_checksum_stands_last_and_is_not_part_of_what_is_read(log: Path) -> None:
    assert list(stored(log))[-1] == "sha256"
    assert "sha256" not in (read_sidecar(log) or {})


def test_another_layout_of_the_same_content_is_as_good(log: Path) -> None:
    content = stored(log)
    assert store(log, dict(reversed(content.items()))).ok


@pytest.mark.parametrize("change", [
    {"sensor": {"driver": "bma220", "verified": False}}, {"sha256": "0" * 64}, {"sha256": None}, {"more": 1}])
def test_a_changed_sidecar_is_refused(log: Path, change: dict[str, Any]) -> None:
    check = store(log, stored(log) | change)
    assert check.problems == ("sidecar: expected content that matches its checksum",)
    with pytest.raises(ValueError, match="checksum"):
        read_sidecar(log)


@pytest.mark.parametrize("keys", [("sha256",), ("sha256", "format")])
def test_one_without_its_checksum_is_changed(log: Path, keys: tuple[str, ...]) -> None:
    content = {key: value for key, value in stored(log).items() if key not in keys}
    assert store(log, content).problems == ("sidecar: expected content that matches its checksum",)


def test_facts_of_any_json_value_fit_their_checksum(tmp_path: Path) -> None:
    facts = {"numbers": {10: 1.5, 9: -0.0}, "text": "Straße \ud83d", "pair": (1, 2)}
    log = SegmentLog(tmp_path, 1, facts, 10**6)
    log.append(window(1, utc=True))
    log.close()
    assert verify([tmp_path])[0].problems == ()


def test_a_damaged_sidecar_of_an_open_part_is_kept_beside(tmp_path: Path) -> None:
    log = SegmentLog(tmp_path, 1, FACTS, 10**6)
    log.append(window(1, utc=False))
    damaged = log.path.with_name("00001-001.json")
    damaged.write_bytes(damaged.read_bytes().replace(b"bma220", b"bma221"))
    text = damaged.read_bytes()
    repair(tmp_path)
    assert (tmp_path / "00001-001.json.aside").read_bytes() == text
    assert "sensor" not in (read_sidecar(tmp_path / "00001-001.csv") or {})
    assert verify([tmp_path])[0].ok


@pytest.mark.parametrize("text", [None, "{torn", "[]"], ids=["missing", "torn", "a list"])
def test_a_log_that_is_repaired_without_its_settings_says_so(tmp_path: Path, text: str | None) -> None:
    log = SegmentLog(tmp_path, 1, FACTS, 10**6)
    log.append(window(1, utc=True))
    log.sync()
    sidecar = tmp_path / "00001-001.json"
    sidecar.unlink() if text is None else sidecar.write_text(text)
    repair(tmp_path)
    assert (read_sidecar(tmp_path / "00001-001.csv") or {})["settings_lost"] is True
    check, = verify([tmp_path / "00001-001.csv"])
    assert check.ok
    assert check.notes == ("sidecar: settings and clock were lost before a repair",)
