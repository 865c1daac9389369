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

DRIFT = 0.005
"""Share of its rate through which a clock has to drift to be reported: a quartz clock keeps to a hundredth of that."""

BURSTS_S = 0.2
"""Samples that come so much at a time are kept by something on the way: our own reading makes 0.1 s at most."""

LONGEST_BURSTS_S = 0.45
"""More at a time are late for rows: a sample is dated a second after its arrival and given up 2 s after it was taken
(measured: the oldest of 0.4 s are dated after 1.6 s, of 0.5 s after 2.0 s, of 1 s after 3.0 s)."""

JUDGED_SAMPLES = 500


class UndatedSamples(NamedTuple):
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
    burst_s      for so long samples are kept on the way and then come together [s], by the last
                 ``JUDGED_SAMPLES``: twice the middle one's delay, as delays are even from none to that long
    """

    def __init__(self, rate_hz: float, tolerance: float) -> None:
        self.clock = SampleClock(rate_hz, tolerance)
        self._rate_hz = rate_hz
        self._tolerance = tolerance
        self._waiting: list[UndatedSamples] = []
        self._times: list[npt.NDArray[np.int64]] = []
        self._ended = False
        self.good = 0
        self.bad = 0
        self.undated = 0
        self.burst_s = 0.0
        self._late_us = np.empty(0, dtype=np.int64)

    def add(self, samples: UndatedSamples) -> None:
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
        self._waiting = [UndatedSamples(False, arrivals_us[n:], accel_mps2[n:], clipped[n:], good[n:])]
        dated = t_us != NO_TIME
        self.undated += int(np.count_nonzero(~dated))
        self._late_us = np.concatenate([self._late_us, (arrivals_us[:n] - t_us)[dated]])
        if len(self._late_us) >= JUDGED_SAMPLES:
            self.burst_s = 2e-6 * float(np.median(self._late_us))
            self._late_us = self._late_us[:0]
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
        return self.burst_doubt

    @property
    def burst_doubt(self) -> str:
        """That samples come too late to make rows, and what to do; empty: they do not."""
        if self.burst_s < LONGEST_BURSTS_S:
            return ""
        return (f"its samples come some {self.burst_s:.1g} s at a time, as something on the way keeps them: too late "
                "for rows, which stay empty. Have the sensor, or what brings its samples, send each as it is taken, "
                "or three times a second")

    @property
    def note(self) -> str:
        """How the samples come, where that is worth knowing and does no harm; empty: as they should."""
        slow_hz, fast_hz = self.clock.rates_hz
        if fast_hz - slow_hz > DRIFT * fast_hz:
            return (f"its clock drifts: {slow_hz:.1f} to {fast_hz:.1f} samples a second so far. Its samples are dated "
                    "by when they come: nothing has to be done")
        if abs(slow_hz / self._rate_hz - 1) > self._tolerance:
            return (f"it gives {slow_hz:.1f} samples a second where {self._rate_hz:g} are expected, and is taken at "
                    "that rate: right if that is its own; if it has another one, samples are lost on the way")
        if BURSTS_S <= self.burst_s < LONGEST_BURSTS_S:
            return (f"its samples come some {self.burst_s:.1g} s at a time, as something on the way keeps them. They "
                    "are dated by their even rate: nothing has to be done")
        return ""
