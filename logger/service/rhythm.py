"""How often a receiver sends.

Problem: one fix a second is usual, but receivers send from ten times a second to once in five seconds, and one that
sends each two seconds has lost nothing between two of its fixes. Solution: the rhythm is learnt as it comes. Losses
make intervals longer, never shorter, so it is the lower quartile of the last ones.
"""

from __future__ import annotations

from collections import deque

_INTERVALS_KEPT = 16


class Rhythm:
    """usual_us   interval between two of its times [us]; None: not known yet"""

    def __init__(self) -> None:
        self._intervals_us: deque[int] = deque(maxlen=_INTERVALS_KEPT)
        self._last_us: int | None = None
        self.usual_us: int | None = None

    def take(self, t_us: int) -> None:
        """The next time [us]. One that is not later than the last begins anew."""
        if self._last_us is not None and t_us > self._last_us:
            self._intervals_us.append(t_us - self._last_us)
            self.usual_us = sorted(self._intervals_us)[len(self._intervals_us) // 4]
        self._last_us = t_us
