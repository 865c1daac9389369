"""How the service is put together: what feeds systemd's watchdog, and that the limits of the settings arrive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from drivers.disk import FileSystem
from logger.service import serve
from logger.service.config import Config, LogConfig
from logger.service.main_loop import HANG_US, Listener, monotonic_us
from logger.service.storage import Storage
from logger.service.systemd_notify import Stop
from logger.store.export.sticks import Pairing
from logger.store.log.disk_quota import QuotaLimits


class Told:
    """Systemd's side: what it was notified of."""

    def __init__(self) -> None:
        self.words: list[str] = []

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *_: self.words.append(name)


@pytest.fixture
def built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """The parts of a service that was put together with settings of its own and has ended at once."""
    parts: dict[str, Any] = {"notified": Told()}

    class Loop:
        def __init__(self, core: object, storage: Storage, listeners: list[Listener], *rest: Any) -> None:
            parts.update(storage=storage, listeners=listeners, beat=rest[-1])

        def run(self, stop: Stop) -> None:
            parts["storage"].close()

    def storage(*arguments: Any, pairing: Pairing, **more: Any) -> Storage:
        parts["limits"] = next(argument for argument in arguments if isinstance(argument, QuotaLimits))
        parts["pairing"] = pairing
        return Storage(*arguments, pairing=pairing, **more)

    monkeypatch.setattr(serve, "MainLoop", Loop)
    monkeypatch.setattr(serve, "Storage", storage)
    monkeypatch.setattr(serve, "Notifier", lambda: parts["notified"])
    monkeypatch.setattr(serve, "go_first", lambda: None)
    log = replace(LogConfig(tmp_path / "log"), quota_bytes=123_456_789, keep_free_bytes=987_654)
    pairing = Pairing("first_stick")
    serve.serve(Config(log=log, pairing=pairing, status_file=tmp_path / "status.json"), Stop())
    parts["notified"].words.clear()
    return parts


def test_quota_and_floor_and_whose_copies_count_are_those_of_the_settings(built: dict[str, Any]) -> None:
    assert built["limits"] == QuotaLimits(123_456_789, 987_654)
    assert built["pairing"] == Pairing("first_stick")


def test_a_folder_that_is_made_is_on_the_disk_before_anything_in_it(tmp_path: Path,
                                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[Path] = []
    monkeypatch.setattr(FileSystem, "sync_directory", lambda _, directory: synced.append(directory))
    serve.make_log_folder(tmp_path / "var" / "lib" / "log")
    assert synced == [tmp_path, tmp_path / "var", tmp_path / "var" / "lib"]
    synced.clear()
    serve.make_log_folder(tmp_path / "var" / "lib" / "log")
    assert synced == []


def test_the_watchdog_is_fed_while_every_device_returns(built: dict[str, Any]) -> None:
    built["beat"](monotonic_us())
    assert built["notified"].words == ["watchdog", "status"]


@pytest.mark.parametrize("hanging", [0, 1])
def test_one_device_that_hangs_stops_the_watchdog(built: dict[str, Any], hanging: int) -> None:
    built["listeners"][hanging].looked_us -= HANG_US + 1_000_000
    built["beat"](monotonic_us())
    assert built["notified"].words == ["status"]
