"""The command: what it prints and returns, and the note that it keeps from the first file to the pulled stick."""

from __future__ import annotations

import errno
import json
from pathlib import Path

import pytest

from logger.commands import export as export_command
from logger.commands.main import main
from logger.commands.status import stick_lines
from logger.errors import BadInput, CheckFailed
from logger.service.config import Config, LogConfig
from logger.store.export import export as export_of_store
from logger.store.export.export import exported_names
from logger.store.export.sticks import read_note

pytestmark = pytest.mark.usefixtures("folders_as_sticks")


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    folder = tmp_path / "log"
    folder.mkdir()
    for name in ("00001-001.csv", "00001-001.json"):
        (folder / name).write_text("content\n")
    return folder


@pytest.fixture
def stick(tmp_path: Path) -> Path:
    folder = tmp_path / "stick"
    folder.mkdir()
    return folder


@pytest.fixture
def note(tmp_path: Path) -> Path:
    (tmp_path / "notes").mkdir()
    return tmp_path / "notes" / "sda1.json"


def reported(note: Path) -> str:
    read = read_note(note)
    assert read is not None
    line, = stick_lines([read])
    return line


def test_a_person_is_shown_what_was_copied(logs: Path, stick: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for said in ("ok: 2 files copied (0.0 MB), 0 already there\n", "ok: 0 files copied (0.0 MB), 2 already there\n"):
        assert main(["export", "--from", str(logs), "--to", str(stick)]) == 0
        assert capsys.readouterr().out == said
    assert exported_names(logs) == {"00001-001.csv", "00001-001.json"}


def test_a_program_gets_one_object(logs: Path, stick: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (logs / "00001.dump").write_text("content\n")
    assert main(["export", "--from", str(logs), "--to", str(stick), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["complete"] is True
    assert said["copied"] == ["00001-001.csv", "00001-001.json", "00001.dump"]
    assert said["failures"] == said["already_there"] == []
    assert (stick / "ridelog" / said["logger"] / "00001.dump").is_file()


def test_the_logs_are_those_of_the_settings(
        logs: Path, stick: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "ridelog.yaml").write_text("log:\n  directory: log\n")
    assert main(["export", "--config", str(tmp_path / "ridelog.yaml"), "--to", str(stick)]) == 0
    assert "2 files copied" in capsys.readouterr().out


def test_what_could_not_be_copied_is_reported_with_its_reason(
        logs: Path, stick: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (stick / "ridelog").write_text("a file where a folder should be\n")
    assert main(["export", "--from", str(logs), "--to", str(stick)]) == 1
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("WRONG: 2 files NOT copied: ridelog/")
    assert second.startswith("    00001-001.csv and 1 more: ridelog/")
    assert first.endswith("on the stick: Not a directory. 0 files copied (0.0 MB), 0 already there")


def test_a_reason_from_outside_cannot_forge_a_line(
        logs: Path, stick: Path, note: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    evil = "\x1b[2J\nok: 2 files copied"
    result = export_of_store.ExportResult("0" * 12, failures=(export_of_store.Failure(evil, evil),), set_aside=(evil,))
    monkeypatch.setattr(export_command, "export", lambda *_, **__: result)
    assert main(["export", "--from", str(logs), "--to", str(stick), "--note", str(note)]) == 1
    lines = capsys.readouterr().out.split("\n")
    assert len(lines) == 4
    assert all(line.isprintable() for line in (*lines, reported(note)))


@pytest.mark.parametrize("arguments", [[], ["--to"], ["--to", "a", "--removed"], ["--to", "a", "--unmounted", "b"]])
def test_wrong_use_is_status_2(arguments: list[str]) -> None:
    with pytest.raises((SystemExit, BadInput)) as leaving:
        main(["export", *arguments])
    assert 2 in (getattr(leaving.value, "code", None), getattr(leaving.value, "exit_status", None))


def test_the_note_says_when_the_stick_may_be_pulled_and_goes_with_it(logs: Path, stick: Path, note: Path) -> None:
    assert main(["export", "--from", str(logs), "--to", str(stick), "--note", str(note)]) == 0
    assert reported(note) == "stick sda1: 2 files copied (0.0 MB), 0 already there; leave it in"
    assert main(["export", "--unmounted", str(stick), "--note", str(note)]) == 0
    assert reported(note) == "stick sda1: 2 files copied (0.0 MB), 0 already there; it may be pulled"
    assert main(["export", "--removed", "--note", str(note)]) == 0
    assert not note.exists()
    assert main(["export", "--removed", "--note", str(note)]) == 0


def test_a_stick_is_named_by_its_device_each_time_it_is_plugged_in(logs: Path, stick: Path, note: Path) -> None:
    again = note.with_name("sda1.28.json")
    again.touch()
    assert reported(again) == "stick sda1: plugged in, waits for its turn; leave it in"
    assert main(["export", "--from", str(logs), "--to", str(stick), "--note", str(again)]) == 0
    assert reported(again).startswith("stick sda1: 2 files copied")


def test_a_copy_that_never_began_is_not_called_complete(stick: Path, note: Path) -> None:
    note.touch()
    main(["export", "--unmounted", str(stick), "--note", str(note)])
    assert reported(note) == "stick sda1: WRONG, copying did not end as it should; it may be pulled"


def test_the_light_goes_out_after_the_note_was_removed(note: Path, tmp_path: Path) -> None:
    led = tmp_path / "led"
    led.mkdir()
    (led / "trigger").write_text("none [mmc0]\n")
    note.touch()
    export_command.sticks.show_on_led(led, note.parent)
    assert (led / "trigger").read_text() == "heartbeat"
    note.unlink()
    assert main(["export", "--removed", "--note", str(note), "--led", str(led)]) == 0
    assert (led / "trigger").read_text() == "mmc0"


def test_a_stick_that_could_not_be_mounted_is_not_written_to(logs: Path, stick: Path, note: Path) -> None:
    assert main(["export", "--from", str(logs), "--to", str(stick), "--mounted", "--note", str(note)]) == 1
    assert list(stick.iterdir()) == []
    main(["export", "--unmounted", str(stick), "--note", str(note)])
    assert reported(note).startswith("stick sda1: WRONG, ")
    assert reported(note).endswith("expected one with FAT or exFAT; it may be pulled")


def test_a_stick_that_is_still_mounted_must_stay(note: Path) -> None:
    assert main(["export", "--unmounted", "/proc", "--note", str(note)]) == 1
    assert reported(note).endswith("leave it in")


def test_a_copy_that_was_killed_is_not_called_complete(stick: Path, note: Path) -> None:
    note.write_text('{"stick": "sda1", "state": "copying", "ok": true, "text": "copying, 1 of 9 files"}')
    main(["export", "--unmounted", str(stick), "--note", str(note)])
    assert reported(note) == "stick sda1: WRONG, copying did not end as it should; it may be pulled"


def test_an_export_that_the_logger_cannot_remember_is_no_success(
        logs: Path, stick: Path, note: Path, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(export_of_store, "mark_exported", refuse)
    assert main(["export", "--from", str(logs), "--to", str(stick), "--note", str(note)]) == 1
    said = capsys.readouterr().out
    assert said.startswith("WRONG: 2 files copied")
    assert "does not count as exported, and the logs stay on the card: Read-only file system" in said
    main(["export", "--unmounted", str(stick), "--note", str(note)])
    assert reported(note).startswith("stick sda1: WRONG, 2 files copied")


def test_a_note_that_cannot_be_written_stops_no_export(
        logs: Path, stick: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    for note in (tmp_path / "missing" / "sda1.json", tmp_path / "file" / "sda1.json"):
        assert main(["export", "--from", str(logs), "--to", str(stick), "--note", str(note)]) == 0
        assert "no note can be kept" in capsys.readouterr().err
        assert main(["export", "--unmounted", str(stick), "--note", str(note)]) == 0
        assert main(["export", "--removed", "--note", str(note)]) == 0
    assert exported_names(logs) == {"00001-001.csv", "00001-001.json"}


@pytest.mark.parametrize("settings", ["log: 7\n", "nonsense: [\n", None])
def test_a_mistake_in_the_settings_keeps_no_log_in_the_car(
        logs: Path, stick: Path, tmp_path: Path, settings: str | None, monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "ridelog.yaml"
    if settings is not None:
        config.write_text(settings)
    usual = Config(log=LogConfig(logs))
    monkeypatch.setattr(export_command, "Config", lambda: usual)
    assert main(["export", "--config", str(config), "--to", str(stick)]) == 0
    said = capsys.readouterr()
    assert "2 files copied" in said.out
    assert "ridelog.yaml" in said.err
    assert f"the logs in {logs} are copied" in said.err


def paired(tmp_path: Path, logs: Path, mode: str, more: str = "") -> Path:
    config = tmp_path / "ridelog.yaml"
    config.write_text(f"log: {{directory: {logs}}}\npairing: {{mode: {mode}}}\n{more}")
    return config


def test_a_stick_that_is_not_paired_is_refused_in_its_note(
        logs: Path, stick: Path, note: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "is_mount", lambda path: True)
    config, other = paired(tmp_path, logs, "first_stick"), tmp_path / "other"
    other.mkdir()
    asked = ["export", "--mounted", "--config", str(config), "--note", str(note)]
    assert main([*asked, "--to", str(stick)]) == 0
    with pytest.raises(CheckFailed, match="not the stick"):
        main([*asked, "--to", str(other)])
    assert reported(note).startswith("stick sda1: WRONG, this is not the stick")
    assert list(other.iterdir()) == []


@pytest.mark.parametrize("mode", ["first_stick", "key_file"])
def test_a_mistake_in_settings_with_a_pairing_gives_no_logs_away(
        logs: Path, stick: Path, tmp_path: Path, mode: str, monkeypatch: pytest.MonkeyPatch) -> None:
    usual = Config(log=LogConfig(logs))
    monkeypatch.setattr(export_command, "Config", lambda: usual)
    for more in ("nonsense: 7\n", "nonsense: [\n"):
        with pytest.raises(BadInput):
            main(["export", "--config", str(paired(tmp_path, logs, mode, more)), "--to", str(stick)])
    assert list(stick.iterdir()) == []


@pytest.mark.parametrize("settings", [
    None, b"pairing:\n  mode:\n    first_stick\nnonsense: [\n", "pairing: {mode: first_stick}\nx: [\n".encode("utf-16"),
    b"pairing: {mode: first_stick}\n#" + b"x" * 300_000, b"log: [\n",
], ids=["missing", "on the next line", "UTF-16", "too long", "nothing of it"])
def test_a_logger_that_was_paired_gives_no_logs_away_whatever_became_of_its_settings(
        logs: Path, stick: Path, tmp_path: Path, settings: bytes | None, monkeypatch: pytest.MonkeyPatch) -> None:
    usual = Config(log=LogConfig(logs))
    monkeypatch.setattr(export_command, "Config", lambda: usual)
    own = tmp_path / "own"
    own.mkdir()
    monkeypatch.setattr(Path, "is_mount", lambda path: True)
    config = paired(tmp_path, logs, "first_stick")
    assert main(["export", "--mounted", "--config", str(config), "--to", str(own)]) == 0
    if settings is None:
        (tmp_path / "ridelog.yaml").unlink()
    else:
        (tmp_path / "ridelog.yaml").write_bytes(settings)
    with pytest.raises(BadInput):
        main(["export", "--config", str(tmp_path / "ridelog.yaml"), "--to", str(stick)])
    assert list(stick.iterdir()) == []


@pytest.mark.parametrize("settings", [
    b"pairing:\n  mode:\n    first_stick\nnonsense: [\n", "pairing: {mode: first_stick}\nx: [\n".encode("utf-16"),
    b"pairing: {mode: first_stick}\n#" + b"x" * 300_000,
], ids=["on the next line", "UTF-16", "too long"])
def test_settings_that_may_ask_for_a_pairing_give_no_logs_away(
        logs: Path, stick: Path, tmp_path: Path, settings: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    usual = Config(log=LogConfig(logs))
    monkeypatch.setattr(export_command, "Config", lambda: usual)
    (tmp_path / "ridelog.yaml").write_bytes(settings)
    with pytest.raises(BadInput):
        main(["export", "--config", str(tmp_path / "ridelog.yaml"), "--to", str(stick)])
    assert list(stick.iterdir()) == []


def test_settings_that_cannot_be_read_are_in_the_note(stick: Path, note: Path, tmp_path: Path) -> None:
    (tmp_path / "ridelog.yaml").write_text("log: 7\n")
    with pytest.raises(Exception, match="expected a mapping"):
        main(["export", "--config", str(tmp_path / "ridelog.yaml"), "--to", str(stick), "--note", str(note)])
    assert "expected a mapping" in reported(note)
