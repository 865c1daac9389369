"""Errors of the drivers, and the two boundaries at which whatever a library raises becomes one of them.

DriverError
|- DeviceError        the outside world; the supervisor closes the device, waits and tries again
|  |- NotPresent      nothing answers: cable out, wrong address, no such port
|  |- Timeout         it was there and has gone silent, or the bus is held low
|  |- Unforeseen      a library's or the program's own mistake while it was asked; no driver reckoned with it
|  '- BadReply        something answers, but not what this device would say
|     |- WrongDevice  another chip or instrument sits at this place
|     '- SettingsLost it no longer holds what was written to it: restart it at once
|- SettingsError      a setting the device does not have; trying again cannot help
'- DumpError          a recorded dump that cannot be read: file, line, what was expected

Problem. pyserial lets the kernel's ``OSError`` and ``termios.error`` through where an adapter refuses a control
transfer, and raises ``TypeError`` or ``struct.error`` for a port that was torn away between two calls; files of the
kernel's drivers give any error number at any call. One that leaves a driver ends more than its own readings. Solution:
two boundaries. What a library raises is ``OSError`` with a number (``as_os_error``: ``drivers.hardware``); what leaves
a source is ``DeviceError``, whatever it was (``as_device_error``: around every call of a ``Source``).
"""

import errno
import os
import termios
from collections.abc import Iterator
from contextlib import contextmanager


class DriverError(Exception):
    """Root of everything a driver raises on purpose."""


class DeviceError(DriverError):
    """A fault of the outside world. Worth another try later."""


class NotPresent(DeviceError):
    """Nothing answers there."""


class Timeout(DeviceError):
    """The device or its bus has gone silent."""


class Unforeseen(DeviceError):
    """What no driver reckoned with. Its cause is what was raised."""


class BadReply(DeviceError):
    """The device answered something it never should."""


class WrongDevice(BadReply):
    """Another device answers at this place."""


class SettingsLost(BadReply):
    """The device no longer has the settings that it was given."""


class SettingsError(DriverError):
    """A setting that this device cannot have. ``key``: which of its settings; empty: several together, or unknown."""

    def __init__(self, words: str, key: str = "") -> None:
        super().__init__(words)
        self.key = key


class DumpError(DriverError):
    """A recorded dump that cannot be read."""


SHOWN = 80
"""Characters of a bad input that a line of complaint holds."""


def shortened(text: str) -> str:
    """A piece of a bad input in quotes, fit for one line of complaint whatever it holds."""
    return ascii(text if len(text) <= SHOWN else text[:SHOWN] + "...")


@contextmanager
def as_os_error(begins: str = "") -> Iterator[None]:
    """Raise whatever is raised in here as ``OSError`` with a number (EIO where there is none), whose words begin so."""
    try:
        yield
    except Exception as error:
        raise OSError(error_number(error) or errno.EIO, f"{begins}{words_of(error)}") from error


@contextmanager
def as_device_error() -> Iterator[None]:
    """Raise whatever is raised in here as ``DeviceError``; what a driver raises on purpose stays what it is."""
    try:
        yield
    except DriverError:
        raise
    except OSError as error:
        raise DeviceError(f"{error.filename}: {words_of(error)}" if error.filename else words_of(error)) from error
    except Exception as error:
        raise Unforeseen(words_of(error)) from error


def error_number(error: BaseException | None) -> int | None:
    """The kernel's number of an error, or of the one that it was made of; None: there is none."""
    while error is not None:
        if isinstance(error, OSError | termios.error) and error.args and isinstance(error.args[0], int):
            return error.args[0]
        error = error.__cause__ or error.__context__
    return None


def words_of(error: Exception) -> str:
    """What an error says, in one line, without its number; the name of its kind where it says nothing of a system."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    if isinstance(error, termios.error) and (number := error_number(error)) is not None:
        return os.strerror(number)
    if isinstance(error, OSError) and str(error):
        return str(error)
    return f"{type(error).__name__}: {error}" if str(error) else type(error).__name__


def why_forbidden(number: int, path: str | os.PathLike[str], access: str, group: str) -> str:
    """What to do where the opening of a device is refused with EACCES or EPERM.

    EACCES is that of its owner, group and mode. A device policy, of a service's unit or of a container, refuses with
    EPERM whatever the groups (Linux, Documentation/admin-guide/cgroup-v2.rst, "Device controller"; systemd makes one of
    DeviceAllow=).
    """
    if number == errno.EACCES:
        return f"not allowed; let the user join the group {group} (sudo usermod -aG {group} USER) and log in again"
    return ("forbidden by the device policy of the service (or of a container), not by its groups. Restart it (sudo "
            "systemctl restart ridelog). If it says so again: sudo systemctl edit ridelog, write [Service] and "
            f"DeviceAllow={os.path.realpath(path)} {access} on two lines, and restart it")
