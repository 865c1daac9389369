"""An accelerometer, or what brings its samples, that says each reading more than once.

Problem: a bridge that writes 200 lines a second of a sensor that takes 51 readings gives plausible numbers at an even
rate. Between the held readings stand steps that no car makes: a quiet road reads up to a quarter too rough. Solution:
samples are judged ``WINDOW`` at a time by the pattern of what repeats (``logger.dsp.repeated_samples``), which a coarse
sensor that rightly stays on one code does not have. From the window in which repeats were found until one in which
hardly any are, or which shows that none are held, or until no window has shown them for some minutes, rows are flagged
``repeated`` and left without figures, as far as they have not been written yet.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drivers.readings import AccelerationBlock
from logger.dsp.repeated_samples import LEAST_SHARE, are_fresh, find_repeats, fresh_samples
from logger.service.doubted_spans import DoubtedSpans

WINDOW = 2048
FALSE_ALARM = 1e-10
"""For each window: in ten years of driving 8 hours a day at 100 Hz, once in a thousand cars."""
PROOF_LASTS = 15
"""Windows, five minutes: a coarse sensor that rightly repeats some samples on a quiet road cannot show that it is well
again; what it was found to do does not count for longer."""


class Repetition:
    """Follows readings in order of time. What it finds does not depend on how they were cut into blocks.

    spans    in which samples were repeated
    share    of the samples of the last window that repeat the one before, while they are found to; else 0
    """

    def __init__(self) -> None:
        self._t_us = np.empty(0, dtype=np.int64)
        self._accel_mps2 = np.empty((0, 3))
        self.spans = DoubtedSpans()
        self._unproven = 0
        self.share = 0.0

    def take(self, block: AccelerationBlock) -> None:
        """More of them."""
        if not len(block):
            return
        self._t_us = np.concatenate([self._t_us, block.t_us])
        self._accel_mps2 = np.concatenate([self._accel_mps2, block.accel_mps2])
        while len(self._t_us) >= WINDOW:
            self._judge(self._t_us[:WINDOW], self._accel_mps2[:WINDOW])
            self._t_us, self._accel_mps2 = self._t_us[WINDOW:], self._accel_mps2[WINDOW:]
        if self.share and len(self._t_us):
            self.spans.end_at(int(self._t_us[-1]))

    @property
    def doubt(self) -> str:
        """What is wrong with the samples that come, and what to do; empty: nothing."""
        if not self.share:
            return ""
        return (f"{100 * self.share:.0f} of 100 samples repeat the one before: no figures are made of them. Have the "
                "sensor, or what brings its samples, send each reading once")

    def _judge(self, t_us: npt.NDArray[np.int64], accel_mps2: npt.NDArray[np.float64]) -> None:
        share = float((~fresh_samples(accel_mps2)[1:]).mean())
        repeats = share >= LEAST_SHARE and find_repeats(accel_mps2, FALSE_ALARM) is not None
        self._unproven = 0 if repeats else self._unproven + 1
        if self.share:
            over = share < LEAST_SHARE or are_fresh(accel_mps2) or self._unproven > PROOF_LASTS
            self.share = 0.0 if over else share
            if self.share:
                self.spans.end_at(int(t_us[-1]))
            return
        if repeats:
            self.share = share
            self.spans.begin(int(t_us[0]), int(t_us[-1]))
