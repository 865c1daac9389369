"""What repeats in a residual, along the way or in time: where its fit may begin.

A tone whose frequency is not known to a fraction of a cycle over all of a run is no start for a fit by slopes. The
residual of each run, white in its bands, is laid on the way in even steps and the periodograms of all runs are
added; the loudest wave number is refined where the sum of squares of all coherent sums is largest.
"""

from __future__ import annotations


import numpy as np
import numpy.typing as npt

from logger.lab.laws.families.family import Look

Array = npt.NDArray[np.float64]

_SLOWEST_MPS = 1.0
_FINER = 8
"""Times the resolution of the longest run, so that a peak is met within a sixteenth of a cycle."""
_LOUD = 12.0
"""A peak with so many times the mean power of its neighbours: noise alone has one in some thousand in a hundred
runs."""


def white_residuals(look: Look) -> list[Array]:
    """Residuals (n - first,) per run, white in their bands, in units of the noise."""
    posterior = look.posterior
    found = []
    for run, bands, residual in zip(look.runs, posterior.bands, posterior.residuals(look.state), strict=True):
        white = bands.whitener(residual).in_time(residual)
        found.append(np.asarray(white[: run.count - run.first]))
    return found


def along_the_way(look: Look, per_m: tuple[float, float], speed_power: float = 0.0) -> float | None:
    """The wave number at which something repeats along the way, whatever the speed [1/m]; None where nothing does.

    per_m          between these
    speed_power    it grows with the speed to this power
    """
    signals, ways = [], []
    for run, residual, moved in zip(look.runs, white_residuals(look), look.posterior.moved_m(look.state.record),
                                    strict=True):
        speed = np.maximum(run.speed_mps[run.first:], _SLOWEST_MPS)
        signals.append(residual * (speed / speed.mean()) ** speed_power)
        ways.append((run.distance_m + moved)[run.first:])
    longest_m = max(float(np.ptp(one)) for one in ways)
    if not longest_m > 0:
        return None
    grid = np.arange(*per_m, 1 / (_FINER * longest_m))
    power = sum(_power(signal, way, grid) for signal, way in zip(signals, ways, strict=True))
    return _peak(grid, np.asarray(power))


def _peak(grid: Array, power: Array) -> float | None:
    best = int(power.argmax())
    if power[best] < _LOUD * float(np.median(power)):
        return None
    if 0 < best < len(grid) - 1:  # of a parabola through the three highest
        before, top, after = power[best - 1 : best + 2]
        bend = before - 2 * top + after
        offset = 0.5 * float(before - after) / float(bend) if bend else 0.0
        return float(grid[best] + offset * (grid[1] - grid[0]))
    return float(grid[best])


def _power(signal: Array, way: Array, grid: Array, at_once: int = 64) -> Array:
    """Of coherent sums over a way (n,) at wave numbers (g,)."""
    found = np.empty(len(grid))
    # Over equal steps of a wave number the phase factor of each sample is multiplied by another one.
    step = np.exp(-2j * np.pi * (grid[1] - grid[0]) * way)
    for first in range(0, len(grid), at_once):
        turned = signal * np.exp(-2j * np.pi * grid[first] * way)
        for index in range(first, min(first + at_once, len(grid))):
            found[index] = abs(turned.sum()) ** 2
            turned = turned * step
    return found / len(signal)
