"""How full a serial line is, by when its bytes come.

Problem: a device that has more to send than its line carries puts the rest into a buffer, and what it sends is late by
what waits there. Solution: a buffer that is not empty leaves its line no pause. Of a line that has paused lately,
nothing waits; of one that has not, something may.

A line carries a tenth of its baud rate in bytes a second (a start and a stop bit each). Its true rate differs by what
two quartz clocks and their dividers do (``TOLERANCE``), and a look at it is late by what gathers bytes: the host's
sleep between two looks and a USB adapter (``LOOK_S``). What brings more bytes than that has no such line: a receiver on
USB.
"""

from __future__ import annotations

from collections import deque
from statistics import median

BITS_PER_BYTE = 10
TOLERANCE = 0.03
"""UARTs that understand each other differ by less than 0.05, half a bit in ten; most by 0.02 at the most."""
LOOK_S = 0.08
"""``SerialSource`` sleeps 0.06 s at most; FTDI adapters gather for 0.016 s."""
WINDOW_US = 10_000_000
_US_PER_S = 1_000_000
_NEEDS_KEPT = 9


class LineLoad:
    """Counts the bytes of the last ten seconds.

    bytes_per_s         what the line carries
    needs_bytes_per_s   what the device has had to send, where it said for which time that was; 0: not known
    """

    def __init__(self, baud: int) -> None:
        self.bytes_per_s = baud / BITS_PER_BYTE
        self._looks: deque[tuple[int, int]] = deque()  # time [us], bytes so far
        self._total = 0
        self._needs: deque[float] = deque(maxlen=_NEEDS_KEPT)
        self.needs_bytes_per_s = 0.0

    def begin(self, t_us: int) -> None:
        """Nothing has come up to ``t_us`` [us], the first time that is known."""
        self.note(t_us, 0)

    def note(self, t_us: int, size: int) -> None:
        """So many bytes more have come by ``t_us`` [us]."""
        self._total += size
        looks = self._looks
        if looks and looks[-1][0] == t_us:
            looks[-1] = t_us, self._total
            return
        looks.append((t_us, self._total))
        while len(looks) > 2 and looks[1][0] <= t_us - WINDOW_US:
            looks.popleft()

    def needs(self, size: int, for_us: int) -> None:
        """So many bytes were what the device had to say of ``for_us`` [us] of its own time."""
        self._needs.append(size * _US_PER_S / for_us)
        if len(self._needs) == _NEEDS_KEPT:
            self.needs_bytes_per_s = max(self.needs_bytes_per_s, median(self._needs))

    @property
    def is_full(self) -> bool:
        """The line has not paused for ten seconds."""
        return self._looks[-1][0] - self._looks[0][0] >= WINDOW_US and self.may_wait

    @property
    def share(self) -> float:
        """Bytes of the last seconds over what the line carries; 1 while that is not known."""
        (begin_us, before), (end_us, total) = self._looks[0], self._looks[-1]
        return (total - before) / self.bytes_per_s * _US_PER_S / (end_us - begin_us) if end_us > begin_us else 1.0

    @property
    def may_wait(self) -> bool:
        """What comes may have waited: the line has not been seen to pause in the last seconds."""
        observed_s = (self._looks[-1][0] - self._looks[0][0]) / _US_PER_S
        pause_s = observed_s * (1.0 - self.share)
        return abs(pause_s) <= TOLERANCE * observed_s + LOOK_S
