"""The service as a process of the system: what it tells systemd, its turn, and its end."""

import contextlib
import logging
import os
import resource
import select
import signal
import socket
from collections.abc import Iterator, Mapping

PRIORITY = 10
log = logging.getLogger(__name__)


def go_first() -> None:
    """Make the calling thread, and all that it starts from now on, real-time (round robin), if that is permitted.

    Problem. A sample is taken when its thread runs, so the service wants to go before all else. systemd can see to that
    (``CPUSchedulingPolicy=rr``), but a kernel with scheduling of real-time groups refuses it, and then systemd does not
    start the service at all.

    Solution. The unit only permits it (``LimitRTPRIO=``), and the service asks for it itself. Refused, it goes on with
    the niceness that the unit gives it, and says so. Where nothing is permitted, as in a terminal, nothing is asked
    for.
    """
    permitted, _ = resource.getrlimit(resource.RLIMIT_RTPRIO)
    if permitted != resource.RLIM_INFINITY and permitted < PRIORITY:
        return
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(PRIORITY))
    except OSError as error:
        log.warning("no real-time priority (%s): on a busy machine samples can be late", error.strerror)


class Stop:
    """Asked for once, by a handler or another thread; from then on it is set.

    Problem: a handler runs in the main thread between any two steps of it. If that thread waits for a
    ``threading.Event`` and just holds the event's lock, which is not reentrant, a handler that sets the event waits for
    its own thread for ever. Solution: the handler only writes a byte to a pipe, and the one who waits looks at the
    pipe.
    """

    def __init__(self) -> None:
        self._reader, self._writer = os.pipe()
        os.set_blocking(self._writer, False)
        self._asked = False

    def set(self) -> None:
        self._asked = True
        with contextlib.suppress(BlockingIOError):  # a full pipe holds the request already
            os.write(self._writer, b"!")

    def is_set(self) -> bool:
        return self._asked

    def wait(self, seconds: float) -> bool:
        """Wait until it is asked for, but no longer than so many seconds; whether it was."""
        select.select([self._reader], [], [], seconds)
        return self._asked

    def close(self) -> None:
        """Give the pipe back."""
        os.close(self._reader)
        os.close(self._writer)


@contextlib.contextmanager
def stopped_by_signals() -> Iterator[Stop]:
    """A wish that Ctrl-C and SIGTERM utter, while inside."""
    stop = Stop()
    wanted = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: stop.set()) for number in wanted]
    try:
        yield stop
    finally:
        for number, handler in zip(wanted, before, strict=True):
            signal.signal(number, handler)
        stop.close()


logger = logging.getLogger(__name__)


class Notifier:
    """Sends states to the socket that ``NOTIFY_SOCKET`` names; does nothing without one.

    Problem. A service of Type=notify must say when it is ready and that it is alive, by datagrams to a socket named
    in the environment. It must do that in milliseconds, from its own loop, never wait for the other side, and be the
    same program where no systemd is.

    Solution. A datagram socket that does not block, and nothing at all where the environment names no socket. What
    cannot be delivered is dropped: the watchdog exists to notice. Source: sd_notify(3), sd_watchdog_enabled(3).
    """

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
