"""The datagrams that systemd gets, received by a socket that stands in for it."""

import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from logger.service.systemd_notify import Notifier, watchdog_interval_s


@pytest.fixture(params=["path", "abstract"])
def manager(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[tuple[str, socket.socket]]:
    """A bound socket, and the name systemd would put into NOTIFY_SOCKET for it."""
    name = str(tmp_path / "notify") if request.param == "path" else f"@ridelog-test-{os.getpid()}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver:
        receiver.bind(name.replace("@", "\0", 1) if name.startswith("@") else name)
        receiver.settimeout(5)
        yield name, receiver


def test_each_state_is_one_datagram(manager: tuple[str, socket.socket]) -> None:
    name, receiver = manager
    notifier = Notifier({"NOTIFY_SOCKET": name})
    notifier.ready()
    notifier.watchdog()
    notifier.status("recording,\n4.2 km")
    notifier.stopping()
    notifier.close()
    notifier.watchdog()
    expected = [b"READY=1", b"WATCHDOG=1", b"STATUS=recording, 4.2 km", b"STOPPING=1"]
    assert [receiver.recv(4096) for _ in expected] == expected
    receiver.setblocking(False)
    with pytest.raises(BlockingIOError):
        receiver.recv(4096)


@pytest.mark.parametrize("name", [None, "", "/nobody/listens/here", "@nobody-listens-here", "vsock:2:1234", "@"])
def test_without_a_listener_nothing_happens(name: str | None) -> None:
    notifier = Notifier({} if name is None else {"NOTIFY_SOCKET": name})
    notifier.ready()
    notifier.status("x")
    notifier.close()


def test_a_manager_that_does_not_read_never_blocks_the_service(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver:
        receiver.bind(str(tmp_path / "notify"))
        notifier = Notifier({"NOTIFY_SOCKET": str(tmp_path / "notify")})
        for _ in range(5000):
            notifier.watchdog()
        notifier.close()


@pytest.mark.parametrize(("environment", "interval_s"), [
    ({}, None),
    ({"WATCHDOG_USEC": "20000000"}, 10.0),
    ({"WATCHDOG_USEC": "20000000", "WATCHDOG_PID": "42"}, 10.0),
    ({"WATCHDOG_USEC": "20000000", "WATCHDOG_PID": "43"}, None),
    ({"WATCHDOG_USEC": "0"}, None),
    ({"WATCHDOG_USEC": "soon"}, None),
])
def test_interval_is_half_of_what_systemd_allows(environment: dict[str, str], interval_s: float | None) -> None:
    assert watchdog_interval_s(environment, pid=42) == interval_s
