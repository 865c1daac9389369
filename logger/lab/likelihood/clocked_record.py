"""The error of a rig's record: its recorder's alone.

Problem: what moves a rig is recorded by the same clock as what the rig does. There is no distance that could be off,
and a distance error that was fitted nevertheless would take away what physics does. Solution: the record of a run that
is driven by time has the two numbers of its recorder (gain, droop), and none of a distance.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.distance_error import ErrorSize, RecordError
from logger.lab.likelihood.priors import Tolerance
from logger.runs import Run

Array = npt.NDArray[np.float64]


def record_error(run: Run, tolerance: Tolerance) -> RecordError:
    """How the record of a run may be off, over a road or on a rig."""
    return ClockedRecord(run, np.empty((0, run.count)), tolerance, 1.0) if run.timed else RecordError.of(run, tolerance)


class ClockedRecord(RecordError):
    """How the record of a rig may be off: numbers k of its recorder (gain, droop)."""

    @property
    def coefficients(self) -> int:
        """None: there is no distance."""
        return 0

    @property
    def trend(self) -> Array:
        """There is none (2, 0)."""
        return np.empty((2, 0))

    def precision(self, size: ErrorSize) -> Array:
        """Inverse covariance of k (2, 2)."""
        return np.diag([self.tolerance.gain**-2, self.tolerance.droop**-2])

    def trend_precisions(self, size: ErrorSize) -> Array:
        """None (0,)."""
        return np.empty(0)

    def log_determinant(self, size: ErrorSize) -> float:
        """Of the precision."""
        return -2 * float(np.log([self.tolerance.gain, self.tolerance.droop]).sum())

    def moved_m(self, k: Array) -> Array:
        """Nothing (n,)."""
        return np.zeros(self.run.count)

    def without_trend(self, k: Array) -> Array:
        """The same (2,)."""
        return k

    def through(self, moved_m: Array) -> Array:
        """A recorder as it is (2,)."""
        return np.zeros(self.count)
