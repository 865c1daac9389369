"""The error that the sensor's noise alone makes: no model comes below it.

The noise is read from the highest frequencies of what a model leaves, where no car moves a sensor and the recorder's
filter lets hardly anything pass.
"""

from __future__ import annotations

import numpy as np

from logger.lab.fitting import Problem, State


def noise_floor(problem: Problem, state: State) -> float:
    """rms(noise) / rms(measured) over all samples that count."""
    quiet = [one.quiet(left) for one, left in zip(problem.stretches, problem.residuals(state), strict=True)]
    power = sum(level * freedom for level, freedom in quiet) / sum(freedom for _, freedom in quiet)
    counted = np.concatenate([run.measured_mps2[run.first:] for run in problem.runs.runs])
    return float(np.sqrt(power / (counted**2).mean()))
