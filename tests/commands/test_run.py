"""What the service's command does where nothing can run: it says so, and under systemd it does not spin."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from logger.commands import run as command
from logger.commands.main import main
from logger.errors import BadInput
from logger.service import serve
from logger.service.systemd_notify import Stop


@pytest.fixture(autouse=True)
def waited(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[float]]:
    """How long the command has waited [s]; its signals go back to what they were."""
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGINT)}
    seen: list[float] = []
    monkeypatch.setattr(Stop, "wait", lambda self, seconds: seen.append(seconds) or False)
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    yield seen
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("watched", [False, True])
def test_wrong_settings_are_not_tried_every_few_seconds(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, waited: list[float], watched: bool) -> None:
    if watched:
        monkeypatch.setitem(os.environ, "NOTIFY_SOCKET", "/run/nobody")
    (tmp_path / "ridelog.yaml").write_text("log: 7\n")
    with pytest.raises(BadInput, match="expected a mapping"):
        main(["run", "--config", str(tmp_path / "ridelog.yaml")])
    assert waited == [command.PAUSE_S] * watched


@pytest.mark.parametrize("watched", [False, True])
def test_nor_is_a_disk_that_lets_nothing_begin(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, waited: list[float], watched: bool) -> None:
    def refuse(*_: object) -> None:
        raise OSError(5, "Input/output error")

    if watched:
        monkeypatch.setitem(os.environ, "NOTIFY_SOCKET", "/run/nobody")
    monkeypatch.setattr(serve, "serve", refuse)
    (tmp_path / "ridelog.yaml").write_text("vehicle: rav4-2009\n")
    assert main(["run", "--config", str(tmp_path / "ridelog.yaml")]) == 1
    assert waited == [command.PAUSE_S] * watched
