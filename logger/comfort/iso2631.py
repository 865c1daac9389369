"""How a vibration feels, by ISO 2631-1: figures of a weighted acceleration and the word that goes with it.

Problem: one number cannot say both how a road shakes and how hard it hits. The standard has several, all from
the weighted acceleration: its r.m.s. over the stretch, the largest running r.m.s. over one second, the fourth-power
dose, and the crest factor that says which of them to believe.

Solution: plain functions of the weighted samples, the standard's rule for which of them to use, and running r.m.s.
values that work on a stream and do not drift however long the stream is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.dsp.sections import BlockFilter

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

# Above these the r.m.s. does not say all (clauses 6.2.1 and 6.3.3).
CREST_LIMIT = 9.0
MTVV_LIMIT = 1.5
VDV_LIMIT = 1.75

# Multiplying factors of x, y and z for people who sit (clauses 7.2.3 and 8.2.2.1).
HEALTH_FACTORS = (1.4, 1.4, 1.0)
COMFORT_FACTORS = (1.0, 1.0, 1.0)


def a_w(weighted_mps2: Floats) -> float:
    """R.m.s. of the weighted acceleration (n,), n > 0 [m/s2]. Eq 2.9; ISO 2631-1 clause 6.1."""
    return float(np.sqrt(np.mean(np.square(weighted_mps2))))


def vdv(weighted_mps2: Floats, dt_s: float) -> float:
    """Vibration dose value of weighted acceleration (n,) at steps of ``dt_s`` [m/s^1.75]. Eq 2.12; clause 6.3.2."""
    return float((np.sum(np.square(np.square(weighted_mps2))) * dt_s) ** 0.25)


def crest_factor(weighted_mps2: Floats) -> float:
    """Largest weighted acceleration (n,) over its r.m.s.; nan when nothing moves. Clause 6.2.1.

    Up to CREST_LIMIT the r.m.s. says all; above, MTVV or VDV belongs beside it.
    """
    rms_mps2 = a_w(weighted_mps2)
    return float(np.abs(weighted_mps2).max()) / rms_mps2 if rms_mps2 > 0.0 else math.nan


def comfort_word(a_w_mps2: float) -> str:
    """The word of Table 2.5 for a weighted r.m.s. [m/s2]. Raises ValueError for a negative value or nan."""
    for lowest_mps2, word in COMFORT_WORDS:
        if a_w_mps2 >= lowest_mps2:
            return word
    raise ValueError(f"a weighted r.m.s. cannot be {a_w_mps2}")


def total(axes_mps2: Sequence[float], factors: Sequence[float]) -> float:
    """Vibration total value of weighted r.m.s. values of several axes [m/s2]. ISO 2631-1 Eq 10, clause 6.5."""
    return math.hypot(*(factor * axis for factor, axis in zip(factors, axes_mps2, strict=True)))


def motion_sickness_dose(a_w_mps2: float, duration_s: float) -> float:
    """Motion sickness dose value MSDVz of a Wf-weighted r.m.s. [m/s2] over a duration [s], in m/s^1.5. Clause 9.2.1."""
    return a_w_mps2 * math.sqrt(duration_s)


@dataclass(frozen=True)
class AxisFigures:
    """What ISO 2631-1 says in numbers of one weighted axis over ``duration_s``.

    mtvv_mps2               with the linear running r.m.s. over 1 s, Eq 2.10 and 2.11
    mtvv_exponential_mps2   with exponential averaging, time constant 1 s
    crest_factor            nan when nothing moves, as the two ratios are
    """

    duration_s: float
    a_w_mps2: float
    mtvv_mps2: float
    mtvv_exponential_mps2: float
    vdv_mps175: float
    crest_factor: float

    @property
    def mtvv_ratio(self) -> float:
        """MTVV / a_w. ISO 2631-1 Eq 7."""
        return self.mtvv_mps2 / self.a_w_mps2 if self.a_w_mps2 > 0.0 else math.nan

    @property
    def vdv_ratio(self) -> float:
        """VDV / (a_w T^(1/4)). ISO 2631-1 Eq 8."""
        return self.vdv_mps175 / (self.a_w_mps2 * self.duration_s**0.25) if self.a_w_mps2 > 0.0 else math.nan

    def beside_a_w(self) -> tuple[str, ...]:
        """Which of ``mtvv`` and ``vdv`` have to be reported beside a_w; empty: a_w is enough.

        A crest factor above 9 calls for either, so for both; a ratio above 1.5 or 1.75 calls for its own value.
        Clauses 6.2.2 and 6.3.3.
        """
        shocks = self.crest_factor > CREST_LIMIT
        wanted = {"mtvv": shocks or self.mtvv_ratio > MTVV_LIMIT, "vdv": shocks or self.vdv_ratio > VDV_LIMIT}
        return tuple(name for name, needed in wanted.items() if needed)


def axis_figures(weighted_mps2: Floats, rate_hz: float) -> AxisFigures:
    """All figures of a weighted axis (n,), n > 0, sampled at ``rate_hz`` [Hz]."""
    return AxisFigures(
        duration_s=len(weighted_mps2) / rate_hz,
        a_w_mps2=a_w(weighted_mps2),
        mtvv_mps2=float(RunningRms(rate_hz).process(weighted_mps2).max()),
        mtvv_exponential_mps2=float(ExponentialRms(rate_hz).process(weighted_mps2).max()),
        vdv_mps175=vdv(weighted_mps2, 1.0 / rate_hz),
        crest_factor=crest_factor(weighted_mps2),
    )


class ExponentialRms:
    """Running r.m.s. with exponential averaging of time constant ``tau_s``, for every sample of a stream. ISO 2631-1
    Eq 3, clause 6.3.1; the integral is exact for squares that stay as they are from sample to sample.

    Before the first sample there is taken to have been no vibration.
    """

    def __init__(self, rate_hz: float, tau_s: float = 1.0) -> None:
        kept = math.exp(-1.0 / (rate_hz * tau_s))
        self._mean = BlockFilter([[1.0 - kept, 0.0, 0.0, 1.0, -kept, 0.0]])

    def process(self, weighted_mps2: Floats) -> Floats:
        """Running r.m.s. at each of the next samples (n,) [m/s2]."""
        return np.sqrt(self._mean.process(np.square(weighted_mps2)))


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
