"""Spans of time in which a signal is doubted, as far back as rows may not have been written yet."""

from __future__ import annotations

from collections import deque

import numpy as np
import numpy.typing as npt

_KEPT = 64


class DoubtedSpans:
    """The last spans, each from the first to the last instant that is doubted, both included [us]."""

    def __init__(self) -> None:
        self._spans: deque[tuple[int, int]] = deque(maxlen=_KEPT)

    @property
    def last_us(self) -> int | None:
        """Where the newest ends; None: there is none."""
        return self._spans[-1][1] if self._spans else None

    def begin(self, first_us: int, last_us: int) -> None:
        """One more span, as far as it has come."""
        self._spans.append((first_us, last_us))

    def end_at(self, last_us: int) -> None:
        """The newest lasts, or lasted, until then."""
        self._spans[-1] = (self._spans[-1][0], last_us)

    def covers(self, begin_us: int, end_us: int) -> bool:
        """Tell whether some of [begin, end) is doubted."""
        return any(begin_us <= last_us and first_us < end_us for first_us, last_us in self._spans)

    def during(self, t_us: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """Tell of instants (n,) [us] whether they are doubted."""
        doubted = np.zeros(len(t_us), dtype=np.bool_)
        for first_us, last_us in self._spans:
            doubted |= (first_us <= t_us) & (t_us <= last_us)
        return doubted
