"""Whether the measured forces that drive a rig are what they say.

Problem: a force of another sign, in another unit or on another part is no effect of the rig, but effects imitate it: on
a bench quarter car whose actuator pulled where its record pushed, a passenger of twice the body's mass. Solution: a
gain of all forces is a number more of the linearised model. What a rig lacks, as friction, takes away from a force.
"""

import numpy as np

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.selection.holdout import most_of
from logger.profiles.excitation import Excitation


def force_gain(linear: LinearModel) -> float | None:
    """How many times what they say the forces that drive a rig count, to first order with the car's numbers free, where
    the correction is larger than the force and explains most of the residual: another sign, unit or place."""
    posterior, runs = linear.posterior, linear.posterior.runs.runs
    if linear.numbers is None or not any(isinstance(run.track, Excitation) and run.track.forces for run in runs):
        return None
    columns = [np.vstack([numbers, -by_size]) for numbers, by_size in zip(
        linear.numbers, posterior.size_slopes(linear.state), strict=True)]
    residuals = posterior.residuals(linear.state)
    white, left = (np.hstack(linear.whitened(one)) for one in (columns, residuals))
    prior = np.diag([*posterior.prior.deviations**-2, 0.0])
    change = np.linalg.lstsq(white @ white.T + prior, white @ left, rcond=None)[0]
    gain = float(1 + change[-1])
    then = [one - change @ more for one, more in zip(residuals, columns, strict=True)]
    before, after = (sum(float((run.main(one)[run.first:]**2).sum()) for run, one in zip(runs, some, strict=True))
                     for some in (residuals, then))
    return gain if abs(gain - 1) > 1 and after < most_of(before) else None
