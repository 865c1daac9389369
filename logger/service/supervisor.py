"""Keeping one device alive: open, poll, and after a fault close, wait and open again.

The wait doubles from half a second to half a minute, so that a cable that is out costs nothing and one that is
put back is found soon. Whatever leaves a source is retried, for no fault of one may end the other; what is a mistake of
the program goes to the log with its trace. A wrong setting is not retried.
"""

import logging
from collections.abc import Callable
from contextlib import suppress

from drivers.dump import Event
from drivers.errors import BadReply, DeviceError, SettingsLost, Unforeseen, as_device_error
from drivers.sources import Source
from logger.service.status import SensorState
from logger.store.log.log_writer import LONGEST_WAIT_US
from logger.units import US_PER_S

FIRST_WAIT_US = US_PER_S // 2
SILENT_AFTER_US = 5 * US_PER_S
FAULTS_IN_A_ROW = 5
FAULTY_US = 300_000
log = logging.getLogger(__name__)


class Supervisor:
    """One source and its state: ``absent`` (never seen), ``ok``, ``silent`` (open, says nothing) or ``retrying``.

    A single failed read (a NACK, a time-out) costs one sample and the device is asked again at the next poll; after
    some in a row, and a third of a second of nothing else, it is closed and restarted. Starting takes many transfers,
    and on a bus that refuses every third one it is better not to have to. A device that has lost its settings is
    restarted at once; one that loses them again before it has given a reading is waited for as after any other fault.

    restarts, faults, settings_lost     how often each happened
    """

    def __init__(self, source: Source, now_us: Callable[[], int]) -> None:
        self.source = source
        self._now_us = now_us
        self._is_open = False
        self._seen = False
        self._heard_us = 0
        self._retry_us = 0
        self._wait_us = FIRST_WAIT_US
        self._faults = 0
        self._faulty_us = 0
        self.name = source.name
        self._doubt = ""
        self.error = ""
        self.restarts = 0
        self.faults = 0
        self.settings_lost = 0

    @property
    def retry_at_us(self) -> int | None:
        """When the device will be opened next; None while it is open."""
        return None if self._is_open else self._retry_us

    def state(self) -> SensorState:
        """``ok``, ``silent``, ``retrying`` or ``absent``."""
        if not self._is_open:
            return "retrying" if self._seen else "absent"
        return "ok" if self._now_us() - self._heard_us < SILENT_AFTER_US else "silent"

    def step(self) -> list[Event]:
        """One look at the device, and what it gives. Empty: nothing there, or not yet time to try again."""
        doubt, self._doubt = self._doubt, ""
        if doubt and self._is_open:
            self.restarts += 1
            self._give_up(BadReply(doubt), self._now_us())
        if not self._is_open and not self._try_open():
            return []
        try:
            with as_device_error():
                events = self.source.poll()
        except SettingsLost as error:
            self._lost(error)
            return []
        except DeviceError as error:
            self._fault(error)
            return []
        self._faults = 0
        if events:
            self._heard_us = events[-1].t_us
            self._wait_us = FIRST_WAIT_US
            self._seen = True
            self.error = ""
        return events

    def flush(self) -> list[Event]:
        """What the device holds back, as far as it vouches for it."""
        events: list[Event] = []
        with suppress(DeviceError), as_device_error():
            events = self.source.flush()
        return events

    def restart(self, doubt: str) -> None:
        """Ask for the device to be closed and opened at its next turn, though it answers. Any thread may."""
        self._doubt = doubt

    def close(self) -> list[Event]:
        """Let go of the device for good; gives what it held back."""
        events = self.flush()
        self._let_go()
        return events

    def _try_open(self) -> bool:
        now_us = self._now_us()
        if now_us < self._retry_us:
            return False
        try:
            with as_device_error():
                self.source.open()
        except DeviceError as error:
            self._give_up(error, now_us)
            return False
        log.info("%s: open", self.name)
        self._is_open = True
        self._heard_us = self._now_us()
        self._faults = 0
        return True

    def _lost(self, error: SettingsLost) -> None:
        is_new = not self.error
        now_us = self._now_us()
        self.faults += 1
        self.settings_lost += 1
        self.restarts += 1
        self._give_up(error, now_us)
        if is_new:
            self._retry_us = now_us
            self._try_open()

    def _fault(self, error: DeviceError) -> None:
        now_us = self._now_us()
        self._faulty_us = self._faulty_us if self._faults else now_us
        self.faults += 1
        self._faults += 1
        if self._faults >= FAULTS_IN_A_ROW and now_us - self._faulty_us >= FAULTY_US:
            self.restarts += 1
            self._give_up(error, now_us)

    def _give_up(self, error: DeviceError, now_us: int) -> None:
        if str(error) != self.error:
            trace = error if isinstance(error, Unforeseen) else None
            log.warning("%s: %s; trying again", self.name, error, exc_info=trace)
        self.error = str(error)
        self._let_go()
        self._retry_us = now_us + self._wait_us
        self._wait_us = min(2 * self._wait_us, LONGEST_WAIT_US)

    def _let_go(self) -> None:
        self._is_open = False
        with suppress(DeviceError), as_device_error():
            self.source.close()
