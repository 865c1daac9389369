"""Samples of a recorder that keeps no even time, on the grid of a run.

Problem: a phone samples at 51, 104 or 417 Hz, unevenly, writes each reading several times, gives times in bursts, and
stops for a while. Solution: repeats are dropped (``dsp.repeated_samples``), bursts spread (``dsp.bursts``), and what
lies between two long silences is laid on an even grid through an anti-alias filter (``dsp.uneven``); where a few
samples are missing, or were clipped, the grid says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.bounds import FASTEST_HZ
from logger.dsp.bursts import burst_ends, spread
from logger.dsp.range_ends import range_ends
from logger.dsp.repeated_samples import find_holds, find_repeats, fresh_times, resolution
from logger.dsp.stretches import stretches_of
from logger.dsp.uneven import mean_rate_hz, on_even_grid
from logger.extraction.stretches import LONGEST_HOLE_S

Array = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

LEAST_RATE_HZ = 40.0
"""Wheels hop at 10 to 15 Hz; a record shows what lies below 0.45 of its rate (``dsp.uneven``)."""
SEEN = 0.45
_FEWEST = 20  # samples of a piece: the filter's ends are continued by guesses
_FEW_STEPS = 3.5
_INSTANT_S = 1e-6
_EVEN = 0.2  # of a step, as records are read (``store.formats.record_file``)


@dataclass(frozen=True, eq=False)
class EvenSamples:
    """Samples on a grid, but where ``time_s`` jumps, since nothing was heard for half a second or more.

    time_s (n,), samples (n, axes), present (n,), clipped (n,)
    own_hz       the recorder's own rate
    repeats      share of the samples that only repeated the one before; these were dropped
    as_read      nothing had to be laid on the grid: the samples stood on it
    holds_s      how long the sensor stood still each time, which is left out [s]
    """

    time_s: Array
    samples: Array
    present: Bools
    clipped: Bools
    own_hz: float
    repeats: float
    as_read: bool
    holds_s: tuple[float, ...] = ()


def clipped_samples(samples: Array, range_end: float | None) -> Bools:
    """Which samples (n, axes) stand at an end of the range on some axis (n,): of the one that is known, or of one that
    is plain to see (``dsp.range_ends``)."""
    found = np.zeros(len(samples), dtype=np.bool_)
    for axis in samples.T:
        half = 0.5 * resolution(axis)
        if range_end is not None:
            found |= np.abs(axis) >= range_end - half
        for one in range_ends(axis):
            found |= np.sign(one.at) * axis >= abs(one.at) - half
    return found


def even_samples(time_s: Array, samples: Array, rate_hz: float, range_end: float | None = None) -> EvenSamples:
    """Lay samples (n, axes) at times (n,), not decreasing [s], on a grid. ValueError where that cannot be."""
    pieces = _pieces(time_s)
    if not pieces:
        raise ValueError(f"expected {_FEWEST} samples or more without a pause of {LONGEST_HOLE_S:g} s, found none")
    held = find_holds(time_s, samples)
    whole = [_taken(time_s[part], samples[part], held[part]) for part in pieces]
    clipped = clipped_samples(np.concatenate([one[1] for one in whole]), range_end)
    ends = np.cumsum([len(one[0]) for one in whole])[:-1]
    taken = [(one[0][part], one[1][part], ends_met[part]) for one, ends_met in zip(whole, np.split(clipped, ends),
                                                                              strict=True) for part in _pieces(one[0])]
    dropped = 1.0 - sum(len(one[0]) for one in whole) / sum(len(part) for part in pieces)
    longest = max(taken, key=lambda one: len(one[0]))[0] if taken else np.concatenate([one[0] for one in whole])
    if len(longest) < 2:
        raise ValueError("expected samples that were taken, each at a time of its own, found one")
    own_hz = mean_rate_hz(longest)
    if own_hz > FASTEST_HZ:
        raise ValueError(f"expected at most {FASTEST_HZ:g} samples a second, found {own_hz:.3g}: is the unit of the "
                         "time right?")
    if own_hz < LEAST_RATE_HZ:
        also = f" written at {len(time_s) / (time_s[-1] - time_s[0]):.3g} Hz" if dropped > 0 else ""
        raise ValueError(f"expected {LEAST_RATE_HZ:g} samples a second or more that were taken, found {own_hz:.3g}"
                         f"{also}: set the program to a higher rate")
    laid = [_laid(*one, own_hz, rate_hz) for one in taken]
    times_s, values, present, ends_met = (np.concatenate(part) for part in list(zip(*laid, strict=True))[:4])
    return EvenSamples(times_s, values, present, ends_met, own_hz, dropped, all(one[4] for one in laid),
                       tuple(float(end_s - begin_s) for begin_s, end_s in zip(*holes_of(time_s, held), strict=True)))


def holes_of(time_s: Array, held: Bools) -> tuple[Array, Array]:
    """Begin and end (k,) [s] of the holes that samples at times (n,) leave which were not taken (``find_holds``)."""
    first, end = stretches_of(held)
    return time_s[first - 1], time_s[np.minimum(end, len(time_s) - 1)]


def _pieces(time_s: Array) -> list[Any]:
    """Samples without a long pause among them."""
    ends = np.flatnonzero(np.diff(time_s) > LONGEST_HOLE_S) + 1
    return [part for part in np.split(np.arange(len(time_s)), ends) if len(part) >= _FEWEST]


def _taken(time_s: Array, samples: Array, held: Bools) -> tuple[Array, Array]:
    """What was taken, and when: without repeats, at times that grow."""
    if (ends := burst_ends(time_s)) is not None:
        time_s = spread(time_s, ends)
    grows = np.append(True, np.diff(time_s) > 0)
    time_s, samples, held = time_s[grows], samples[grows], held[grows]
    repeats = find_repeats(samples[~held])
    if repeats is None:
        return time_s[~held], samples[~held]
    return fresh_times(repeats, time_s[~held]), samples[~held][repeats.fresh]


def _laid(time_s: Array, samples: Array, clipped: Bools, own_hz: float, rate_hz: float
          ) -> tuple[Array, Array, Bools, Bools, bool]:
    """On the grid, and whether it stood there."""
    grid_s = time_s[0] + np.arange(int((time_s[-1] - time_s[0]) * rate_hz + 0.5) + 1) / rate_hz
    if len(grid_s) == len(time_s) and np.abs(time_s - grid_s).max() < _EVEN / rate_hz:
        return grid_s, samples, np.ones(len(grid_s), dtype=np.bool_), clipped, True
    laid = on_even_grid(time_s, samples, own_hz, rate_hz)
    grid_s = time_s[0] + np.arange(len(laid)) / rate_hz
    hole_s = _FEW_STEPS / min(own_hz, rate_hz)
    inside = np.zeros(len(grid_s) + 1)
    wide = np.flatnonzero(np.diff(time_s) > hole_s)
    np.add.at(inside, np.searchsorted(grid_s, time_s[wide] + _INSTANT_S), 1)
    np.add.at(inside, np.searchsorted(grid_s, time_s[wide + 1] - _INSTANT_S), -1)
    near = np.zeros(len(grid_s), dtype=np.bool_)
    apart_s = max(1.0 / own_hz, 1.0 / rate_hz)
    for at_s in time_s[clipped]:
        near[slice(*np.searchsorted(grid_s, [at_s - apart_s, at_s + apart_s]))] = True
    return grid_s, laid, np.cumsum(inside)[:-1] == 0, near, False
