"""How a vibration feels, by ISO 2631-1: figures of a weighted acceleration and the word that goes with it.

Problem: one number cannot say both how a road shakes and how hard it hits. The standard has several, all from
the weighted acceleration: its r.m.s. over the stretch, the largest running r.m.s. over one second, the fourth-power
dose, and the crest factor that tells which of them to believe.

Solution: plain functions of the weighted samples, and a running r.m.s. that works on a stream and does not drift
however long the stream is.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

# Table 2.5 (ISO 2631-1 Annex C.2.3): lower bounds [m/s2]. The ranges overlap on purpose; here the more severe word
# holds wherever two would do.
COMFORT_WORDS = (
    (2.0, "extremely_uncomfortable"),
    (1.25, "very_uncomfortable"),
    (0.8, "uncomfortable"),
    (0.5, "fairly_uncomfortable"),
    (0.315, "a_little_uncomfortable"),
    (0.0, "not_uncomfortable"),
)


def a_w(weighted_mps2: Floats) -> float:
    """R.m.s. of the weighted acceleration (n,), n > 0 [m/s2]. Eq 2.9; ISO 2631-1 clause 6.1."""
    return float(np.sqrt(np.mean(np.square(weighted_mps2))))


def vdv(weighted_mps2: Floats, dt_s: float) -> float:
    """Vibration dose value of weighted acceleration (n,) at steps of ``dt_s`` [m/s^1.75]. Eq 2.12; clause 6.3.2."""
    return float((np.sum(np.square(np.square(weighted_mps2))) * dt_s) ** 0.25)


def crest_factor(weighted_mps2: Floats) -> float:
    """Largest weighted acceleration (n,) over its r.m.s.; nan when nothing moves. Clause 6.2.1.

    Up to 9 the r.m.s. tells the whole story; above, MTVV or VDV belongs beside it.
    """
    rms_mps2 = a_w(weighted_mps2)
    return float(np.abs(weighted_mps2).max()) / rms_mps2 if rms_mps2 > 0.0 else math.nan


def comfort_word(a_w_mps2: float) -> str:
    """The word of Table 2.5 for a weighted r.m.s. [m/s2]. Raises ValueError for a negative value or nan."""
    for lowest_mps2, word in COMFORT_WORDS:
        if a_w_mps2 >= lowest_mps2:
            return word
    raise ValueError(f"a weighted r.m.s. cannot be {a_w_mps2}")


class RunningRms:
    """Running r.m.s. over the last ``tau_s``, for every sample of a stream. Eq 2.10; clause 6.3.1, linear averaging.

    Its largest value over a stretch is the MTVV of that stretch (Eq 2.11). Before the first sample there is taken
    to have been no vibration, so the value grows during the first ``tau_s``.

    Time is cut into blocks of one window. A window is then the end of the block before and the beginning of this
    one, each summed from scratch: nothing is ever subtracted, so nothing drifts, and no split of the stream changes
    a bit.
    """

    def __init__(self, rate_hz: float, tau_s: float = 1.0) -> None:
        self._length = max(1, round(rate_hz * tau_s))
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self._squares = np.zeros(self._length)
        self._tails = np.zeros(self._length)
        self._filled = 0
        self._sum = 0.0

    def process(self, weighted_mps2: Floats) -> Floats:
        """Running r.m.s. at each of the next samples (n,) [m/s2]."""
        mean_square = np.empty(len(weighted_mps2))
        done = 0
        while done < len(weighted_mps2):
            start = self._filled
            stop = min(self._length, start + len(weighted_mps2) - done)
            here = slice(done, done + stop - start)
            self._squares[start:stop] = np.square(weighted_mps2[here])
            sums = np.cumsum(np.concatenate([[self._sum], self._squares[start:stop]]))[1:]
            mean_square[here] = (sums + self._tails[start:stop]) / self._length
            self._filled, self._sum = stop, float(sums[-1])
            done = here.stop
            if stop == self._length:
                # what is left of this block after each sample of the next has pushed one out
                self._tails = np.append(np.cumsum(self._squares[:0:-1])[::-1], 0.0)
                self._filled, self._sum = 0, 0.0
        return np.sqrt(mean_square)
