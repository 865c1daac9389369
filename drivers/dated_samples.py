"""Decoded samples that wait for their times.

Problem: where the times of samples are recovered from arrivals (``drivers.sample_clock``), they are known a second or
so after the samples. Solution: samples are queued here beside the clock, and come out as a block with their times.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.readings import AccelerationBlock
from drivers.sample_clock import NO_TIME, SampleClock

WORTH_TELLING = 0.005
"""Share of lost samples from which on a person is asked to look for the cause."""


class Samples(NamedTuple):
    """Samples without times: arrivals (n,) [us], acceleration (n, 3) [m/s2], clipped (n,), good (n,).

    after_loss    others may be missing between them and those before
    good          a bad one takes the place of a sample, and is left out in the end
    """

    after_loss: bool
    arrivals_us: npt.NDArray[np.int64]
    accel_mps2: npt.NDArray[np.float64]
    clipped: npt.NDArray[np.bool_]
    good: npt.NDArray[np.bool_]


class DatedSamples:
    """Samples in, blocks with times out. What comes out over time does not depend on when ``take`` is called.

    good, bad    samples so far
    undated      left out because they came at a rate that cannot be used, or too many were lost among them
    """

    def __init__(self, rate_hz: float, tolerance: float) -> None:
        self.clock = SampleClock(rate_hz, tolerance)
        self._rate_hz = rate_hz
        self._waiting: list[Samples] = []
        self._times: list[npt.NDArray[np.int64]] = []
        self._ended = False
        self.good = 0
        self.bad = 0
        self.undated = 0

    def add(self, samples: Samples) -> None:
        """More samples, in order."""
        if samples.after_loss:
            self._times.append(self.clock.restart())
        self._times.append(self.clock.feed(samples.arrivals_us))
        self._waiting.append(samples)
        good = int(samples.good.sum())
        self.good += good
        self.bad += len(samples.good) - good

    def flush(self) -> None:
        """No more will come: the next ``take`` gives all."""
        self._ended = True

    def take(self) -> AccelerationBlock:
        """The oldest samples, as far as their times are certain; may be none."""
        if self._ended:
            self._times.append(self.clock.restart())
        t_us = np.concatenate([np.empty(0, dtype=np.int64), *self._times])
        self._times = []
        if len(t_us) == 0:
            return AccelerationBlock(t_us, np.empty((0, 3)), np.empty(0, dtype=np.bool_))
        _, arrivals, accels, clips, goods = zip(*self._waiting, strict=True)
        arrivals_us, accel_mps2, clipped, good = (np.concatenate(part) for part in (arrivals, accels, clips, goods))
        n = len(t_us)
        self._waiting = [Samples(False, arrivals_us[n:], accel_mps2[n:], clipped[n:], good[n:])]
        dated = t_us != NO_TIME
        self.undated += int(np.count_nonzero(~dated))
        keep = good[:n] & dated
        return AccelerationBlock(t_us[keep], accel_mps2[:n][keep], clipped[:n][keep], self.clock.rate_hz)

    def doubt(self, check: str) -> str:
        """What is wrong with the samples that come, and what to ``check``; empty: nothing."""
        if self.clock.refused_hz is not None:
            return (f"it gives about {self.clock.refused_hz:.0f} samples a second, unsteadily or too few, where "
                    f"{self._rate_hz:g} are expected: no rows are made of them. {check}")
        if self.clock.too_many_lost:
            return f"more samples are lost than can be located: no rows are made of those that come. {check}"
        if self.clock.lost_share >= WORTH_TELLING:
            return f"{100 * self.clock.lost_share:.1f} of 100 samples are lost, and their rows flagged gap. {check}"
        return ""
