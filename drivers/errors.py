"""Errors of the drivers, one small tree.

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
"""


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


def shortened(text: str, longest: int = 80) -> str:
    """A piece of a bad input in quotes, fit for one line of complaint whatever it holds."""
    return ascii(text if len(text) <= longest else text[:longest] + "...")
