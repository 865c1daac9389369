"""The period of a sampler from the times at which some of its samples arrived at once.

The problem: samples that are lost at even intervals look like a slower sensor. How many arrived in how much time does
not distinguish one from the other.

The solution: what arrives at once does so a multiple of the true period after any other such sample, however many are
lost between them: the arrivals stand on a comb. Its period is where the periodogram of the instants is largest
(Schuster 1898), which is the mean resultant length of their phases (Mardia and Jupp 2000, 2.3): 1 where all have one
phase, 0.9 with a jitter of a quarter of the period, 0.64 with half of it. By chance m phases come to R or more with
probability exp(-m R^2) (Rayleigh's test).
"""

from __future__ import annotations

from math import log, sqrt

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

CHANCE = 1e-6  # of a comb where there is none: tried each 1.28 s, once in 15 days of driving
CLEARER = 2.0  # than the phases by the rate at which samples come; measured: 4 or more with losses, 1.2 at most without
NEARLY = 0.008  # a timer farther off drifts by a sample in half a second, which shows in the jitter
TICKED = 0.7
TIMER_US = 20_000.0  # of adapters: 16 ms, if they are left as they come
BIN_US = 250.0  # of a period of 1 ms, the shortest, a quarter: the resultant is 10 % low there, 1 % at 3 ms
NEXT = 1.1  # a period so much longer has, over any length that is looked at, another comb
STEPS_PER_CYCLE = 8  # of the whole span: a comb between two of the periods tried loses 1 % at most


def sampling_period(instants_us: Floats, count: int, slope_us: float, longest_gap_us: float,
                    lost_most: float) -> float | None:
    """The period [us] of the comb on which the arrivals stand, where it says that samples are lost; else None.

    instants_us      (m,) arrivals [us], those with the least latency of each piece of time
    count            samples that came from the first of them to the last
    slope_us         arrivals per sample [us]: the period of a sensor that loses nothing
    longest_gap_us   usual time between two of the arrivals [us]
    lost_most        largest share of samples that may be lost
    """
    if count < 2 or slope_us <= 0:  # all of them at one moment have no period
        return None
    step_us = slope_us / count / STEPS_PER_CYCLE
    tried = int(slope_us * lost_most / step_us) - STEPS_PER_CYCLE
    shorter = slope_us * (1 - lost_most) + step_us * np.arange(tried, dtype=np.float64)
    if len(shorter) == 0:
        return None
    lengths = resultant(instants_us, shorter)
    best = int(np.argmax(lengths))
    if lengths[best] < sqrt(log(max(1.0, len(shorter) / STEPS_PER_CYCLE) / CHANCE) / len(instants_us)):
        return None
    near = slope_us + step_us * np.arange(-STEPS_PER_CYCLE, STEPS_PER_CYCLE + 1, dtype=np.float64)
    if lengths[best] < CLEARER * resultant(instants_us, near).max():
        return None
    period_us = float(shorter[best])
    multiples = period_us * np.arange(2, 1 + max(2, int(longest_gap_us / period_us)), dtype=np.float64)
    coarser = max(resultant(instants_us, multiples).max(), _coarsest(instants_us, period_us))
    if coarser >= lengths[best]:
        return None  # the comb of an adapter's timer or of what reads the line: of the sampler's own all teeth are seen
    return period_us


def is_ticked(instants_us: Floats, period_us: float, longest_us: float) -> bool:
    """Tell whether arrivals (m,) [us] stand on the ticks of a timer of nearly a multiple of the samples' period, up to
    ``longest_us``: of the samples themselves all teeth are seen, not every second or third."""
    step = 1.0 / (STEPS_PER_CYCLE * (instants_us[-1] - instants_us[0]))
    frequencies = [
        np.arange((1 - NEARLY) / multiple_us, (1 + NEARLY) / multiple_us, step)
        for multiple_us in period_us * np.arange(2, 1 + longest_us // period_us)
    ]
    tried = np.concatenate([np.empty(0), *frequencies])
    return len(tried) > 0 and float(resultant(instants_us, 1.0 / tried).max()) > TICKED


def _coarsest(instants_us: Floats, period_us: float) -> float:
    """How far instants (m,) [us] have one phase in the longer period, up to ``TIMER_US``, where they have it most: of
    an adapter's timer, which samples of another period fill unevenly. By the Fourier transform of their histogram; 0
    where there is no longer period."""
    bins = np.rint((instants_us - instants_us[0]) / BIN_US).astype(np.int64)
    length = 1 << int(STEPS_PER_CYCLE // 2 * (bins[-1] + 1)).bit_length()
    first, end = (int(length * BIN_US / us) for us in (TIMER_US, NEXT * period_us))
    if end <= first:
        return 0.0
    lines = np.abs(np.fft.rfft(np.bincount(bins), length)[first:end])
    return float(lines.max()) / len(instants_us)


def resultant(instants_us: Floats, periods_us: Floats) -> Floats:
    """(p,): how far instants (m,) have one phase in each period (p,): from 0, none, to 1, all."""
    phases = (2j * np.pi / periods_us)[:, None] * (instants_us - instants_us[0])[None, :]
    return np.asarray(np.abs(np.exp(phases).mean(axis=1)))
