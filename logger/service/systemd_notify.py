"""Tell systemd how the service is doing, without needing systemd.

Problem. A service of Type=notify must say when it is ready and that it is alive, by datagrams to a socket named
in the environment. It must do that in milliseconds, from its own loop, never wait for the other side, and be the
same program where no systemd is.

Solution. A datagram socket that does not block, and nothing at all where the environment names no socket. What
cannot be delivered is dropped: the watchdog exists to notice. Source: sd_notify(3), sd_watchdog_enabled(3).
"""

from __future__ import annotations

import logging
import os
import socket
from collections.abc import Mapping

logger = logging.getLogger(__name__)


class Notifier:
    """Sends states to the socket that ``NOTIFY_SOCKET`` names; does nothing without one."""

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        name = environment.get("NOTIFY_SOCKET", "")
        self._address = _address(name)
        self._socket: socket.socket | None = None
        if self._address is not None:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)
        elif name:
            logger.warning("NOTIFY_SOCKET is %r: expected a path, or a name after @; systemd is not notified", name)

    def ready(self) -> None:
        """The service is up: it samples, or retries what is absent."""
        self._send("READY=1")

    def watchdog(self) -> None:
        """The service is alive. To be called from the sampling path, at least every ``watchdog_interval_s``."""
        self._send("WATCHDOG=1")

    def status(self, text: str) -> None:
        """One line for ``systemctl status``."""
        self._send("STATUS=" + " ".join(text.split()))

    def stopping(self) -> None:
        """The service has begun to stop."""
        self._send("STOPPING=1")

    def close(self) -> None:
        """Release the socket; what is sent afterwards is dropped."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _send(self, state: str) -> None:
        if self._socket is None or self._address is None:
            return
        try:
            self._socket.sendto(state.encode(), self._address)
        except OSError as error:
            logger.debug("systemd was not notified of %s: %s", state, error)


def watchdog_interval_s(environment: Mapping[str, str] = os.environ, pid: int | None = None) -> float | None:
    """How often ``Notifier.watchdog`` is due: half of ``WATCHDOG_USEC`` [s]. None when nobody watches this process.

    ``WATCHDOG_PID``, where it is set, names the process that is watched; ``pid`` is this one unless given.
    """
    usec = environment.get("WATCHDOG_USEC", "")
    watched = environment.get("WATCHDOG_PID", "")
    if not (usec.isdecimal() and int(usec) > 0):
        return None
    if watched and watched != str(os.getpid() if pid is None else pid):
        return None
    return int(usec) / 2e6


def _address(name: str) -> str | None:
    """The socket's address: a path as it is, an abstract name with a zero byte for its @. None: neither."""
    if name.startswith("/"):
        return name
    if len(name) > 1 and name.startswith("@"):
        return "\0" + name[1:]
    return None
