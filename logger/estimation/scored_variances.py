"""Variances that a drive tells little by little: scoring in the evidence, block by block."""

import numpy as np

from logger.arrays import Array

BLOCK_SHARE = 0.1  # of a block of 20 s is new
FORGOTTEN = 0.02
"""Of what was heard of a drive, per block: it is known from the last 100 s."""
LARGEST_STEP = 0.7
"""Of a scoring step in a logarithm, so that it does not overshoot where the evidence is not yet a parabola."""


class ScoredVariances:
    """Variances (k,), of which only their ``common`` values are known before, but for ``log_std`` of their logarithms.

    values    as learned
    """

    def __init__(self, common: Array, log_std: float) -> None:
        self.values = common
        self._common_logs, self._precision = np.log(common), log_std**-2
        self._curvature: Array | float = 0.0

    def learn(self, slope: Array, curvature: Array) -> None:
        """One step, by slope and expected curvature (k,) of a block's log evidence in the logarithms."""
        logs = np.log(self.values)
        self._curvature = (1 - FORGOTTEN) * self._curvature + BLOCK_SHARE * curvature
        pulled_back = FORGOTTEN * self._precision * (logs - self._common_logs)
        step = (BLOCK_SHARE * slope - pulled_back) / (self._curvature + self._precision)
        self.values = np.exp(logs + np.clip(step, -LARGEST_STEP, LARGEST_STEP))
