"""Putting an accelerometer's samples on a uniform time grid, and thinning a fast grid to a slow one.

Problem: a sensor read by a program is read a little early or late, some readings are missing, and a sensor with a
clock of its own keeps a rate that is not quite ours. Filters want equal steps.

Solution: the readings carry their true times, so the signal at a grid instant can be interpolated from the eight
readings around it (Lagrange's polynomial for uneven spacing). A reading that sits on its grid instant comes through
unchanged. Short holes are bridged and marked; a long one ends the run, and the next run has a grid of its own.

Both parts are streams: how the samples were split into calls changes nothing, not even in the last bit.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from logger.arrays import Array, Bools, Rows
from logger.dsp.filters import kaiser_half_length, low_pass_taps
from logger.units import US_PER_S

Times = npt.NDArray[np.int64]

NODES = 8
AFTER = NODES // 2  # readings waited for after a grid instant
MAX_GAP_S = 0.035
CLOSEST_STEPS = 0.5
HOLE_STEPS = 1.5
LINE_STEPS = 3.6


@dataclass(frozen=True)
class GridRun:
    """Consecutive samples of a uniform grid, arrays (n,), n > 0.

    Sample k lies at t0_us + k / rate_hz, in whole microseconds counted from the first sample of its stretch.
    nearest: the reading nearest to it as it was read, or the value itself where readings were thinned out;
    clipped: that reading was at the end of its range; bridged: it stands where a reading was missing.
    each, each_clipped: (n, k) for a grid that k readings per sample were thinned out to, the readings from the sample
    on up to the next, NaN where one was missing; None where they were not.
    new_start: the first sample of all or the first after a hole; otherwise it follows the run before it.
    """

    t0_us: int
    rate_hz: int
    values: Array
    nearest: Array
    clipped: Bools
    bridged: Bools
    new_start: bool
    each: Array | None = None
    each_clipped: Bools | None = None


@dataclass(frozen=True)
class _Readings(Rows):
    """Readings not yet done with, arrays (n,)."""

    t_us: Times
    values: Array
    clipped: Bools


_NO_READINGS = _Readings(np.empty(0, dtype=np.int64), np.empty(0), np.empty(0, dtype=np.bool_))


class GridResampler:
    """Jittered samples in, a uniform grid out; four samples late.

    rate_hz    rate of the grid

    Two readings further apart than ``MAX_GAP_S`` are not joined: the run ends and a new one begins at the second. A
    step is that of the grid, or the readings' own spacing where it is known (``expect``).

    Between readings up to 3.5 steps apart the eight-point polynomial holds (for 100 Hz and three missing readings it is
    within 0.4 % at 10 Hz); over longer holes, that only a fast grid can have within so much, a straight line.
    Readings less than half a step after the last one, or not after it at all, are left out and counted in ``dropped``:
    a polynomial through two close readings would multiply their noise.
    """

    def __init__(self, rate_hz: int) -> None:
        self._rate_hz = rate_hz
        self._step_us = US_PER_S / rate_hz
        self._spacing_us = self._step_us
        self.dropped = 0
        self._held = _NO_READINGS
        self._origin_us = 0
        self._made = 0

    def expect(self, spacing_s: float | None) -> None:
        """The readings lie so far apart [s] when none is missing; None: a step of the grid, as at the start."""
        self._spacing_us = self._step_us if spacing_s is None else spacing_s * US_PER_S

    def push(self, t_us: Times, values: Array, clipped: Bools) -> list[GridRun]:
        """More readings, arrays (n,) with times [us]; gives the runs that have become certain."""
        new = _Readings(t_us, values, clipped).of(self._keep(t_us))
        if not len(new):
            return []
        before_us = np.concatenate([self._held.t_us[-1:] if len(self._held) else new.t_us[:1], new.t_us[:-1]])
        gaps = np.flatnonzero(new.t_us - before_us > MAX_GAP_S * US_PER_S).tolist()
        runs = []
        for low, high in pairwise([0, *gaps, len(new)]):
            self._held = _Readings.joined([self._held, new.of(slice(low, high))])
            if high in gaps:
                runs += self.flush()
        return runs + self._advance(ended=False)

    def flush(self) -> list[GridRun]:
        """The end of the current run, up to its last reading. What is pushed later starts a new run."""
        runs = self._advance(ended=True)
        self._held = _NO_READINGS
        self._made = 0
        return runs

    def _keep(self, t_us: Times) -> Bools:
        """Which readings are far enough after the one kept before them."""
        closest_us = CLOSEST_STEPS * self._spacing_us
        keep = np.ones(len(t_us), dtype=np.bool_)
        last_us = int(self._held.t_us[-1]) if len(self._held) else None
        first_step_us = closest_us if last_us is None or not len(t_us) else int(t_us[0]) - last_us
        if first_step_us < closest_us or (t_us[1:] - t_us[:-1] < closest_us).any():
            for number, now_us in enumerate(t_us.tolist()):
                if last_us is not None and now_us - last_us < closest_us:
                    keep[number] = False
                else:
                    last_us = now_us
            self.dropped += int(np.count_nonzero(~keep))
        return keep

    def _advance(self, ended: bool) -> list[GridRun]:
        """The grid as far as the readings settle it: to the last reading of a run that has ended, else to the last
        instant that has four readings after it and eight about it."""
        t_us = self._held.t_us
        if not len(t_us) or (len(t_us) < NODES and not ended):
            return []
        if self._made == 0:
            self._origin_us = int(t_us[0])
        end_us = int(t_us[-1]) + 1 if ended else int(t_us[-AFTER])
        # the smallest grid number at or after end_us
        until = -((self._origin_us - end_us) * self._rate_hz // US_PER_S)
        first, self._made = self._made, max(self._made, until)
        if first == self._made:
            return []
        grid_us = self._origin_us + np.arange(first, self._made, dtype=np.int64) * US_PER_S // self._rate_hz
        run = self._interpolated(grid_us, new_start=first == 0)
        next_us = self._origin_us + self._made * US_PER_S // self._rate_hz
        following = int(np.searchsorted(t_us, next_us, side="right")) - 1
        spare = max(0, following + 1 - NODES)
        self._held = self._held.of(slice(spare, None))
        return [run]

    def _interpolated(self, grid_us: Times, new_start: bool) -> GridRun:
        t_us, readings = self._held.t_us, self._held.values
        count = min(NODES, len(t_us))
        before = np.minimum(np.searchsorted(t_us, grid_us, side="right") - 1, max(0, len(t_us) - 2))
        after = np.minimum(before + 1, len(t_us) - 1)
        since_us, until_us = grid_us - t_us[before], t_us[after] - grid_us
        start = np.minimum(np.maximum(before + 1 - AFTER, 0), len(t_us) - count)
        nodes = start + np.arange(count)[:, np.newaxis]
        values = _lagrange(t_us[nodes], readings[nodes], grid_us)
        apart_us = t_us[after] - t_us[before]
        far = np.flatnonzero(apart_us > LINE_STEPS * self._spacing_us)
        if len(far):
            share = since_us[far] / apart_us[far]
            values[far] = (1.0 - share) * readings[before[far]] + share * readings[after[far]]
        nearest = np.where(since_us <= until_us, before, after)
        lonely = np.minimum(since_us, until_us) >= 0.5 * self._spacing_us
        bridged = lonely & (apart_us > HOLE_STEPS * self._spacing_us)
        clipped = self._held.clipped[nearest]
        return GridRun(int(grid_us[0]), self._rate_hz, values, readings[nearest], clipped, bridged, new_start)


def _lagrange(t_us: Times, values: Array, at_us: Times) -> Array:
    """Polynomial through ``values`` at ``t_us``, both (nodes, n), taken at ``at_us`` (n,).

    A weight is the product of (t_j - at) / (t_j - t_i) over the other nodes j, so on a node it is exactly 1 or 0.
    """
    nodes = len(t_us)
    since = (t_us - at_us).astype(np.float64)
    around = np.concatenate([since, since])
    weights = np.ones(since.shape)
    for turn in range(1, nodes):
        other = around[turn : turn + nodes]
        weights *= other / (other - since)
    total = weights[0] * values[0]
    for weight, value in zip(weights[1:], values[1:], strict=True):
        total += weight * value
    return total


PASS_HZ = 38.0
GRID_RATE_HZ = 100
PASS_OF_RATE = PASS_HZ / GRID_RATE_HZ
STOP_DB = 65.0
BLOCK = 16
BRIDGED_SHARE = 0.5


def decimation_taps(factor: int) -> Array:
    """Linear-phase low-pass for thinning ``factor`` x 100 Hz to 100 Hz: a sinc in a Kaiser window, (2 h + 1,).

    Passes 0-38 Hz within 0.01 dB and stops what would fold into that band, from 62 Hz up, by 64 dB; half the
    amplitude at 50 Hz. h is a multiple of ``factor``.
    """
    width = 2.0 * math.pi * (1 - 2 * PASS_OF_RATE) / factor
    half = factor * math.ceil(kaiser_half_length(STOP_DB, width) / factor)
    return low_pass_taps(half, factor, 1.0, STOP_DB)


class Decimator:
    """A grid of ``factor`` x 100 Hz in, a grid of 100 Hz out, without delay in its times.

    The filter is symmetric, and an output is given the time of its middle; it comes half a filter later (85 ms). A run
    is taken to have stood at its first value before it began and to stay at its last after it ended, so the slow run
    covers the same stretch. An output is clipped when one of the ``factor`` inputs about it is, and bridged when half
    of them are: one reading that came late is no hole. Factor 1 passes everything through. The readings themselves are
    given along. Raises ValueError for a factor below 1.

    The work is laid out like that of ``logger.dsp.filters``: one matrix for a fixed block, zeros for what has
    not arrived, so that no split of the input changes a bit.
    """

    def __init__(self, factor: int) -> None:
        if factor < 1:
            raise ValueError(f"cannot decimate by {factor}")
        self._factor = factor
        taps = decimation_taps(factor)
        self._half = len(taps) // 2
        self._rows = np.zeros((BLOCK, (BLOCK - 1) * factor + len(taps)))
        for row in range(BLOCK):
            self._rows[row, row * factor : row * factor + len(taps)] = taps
        self._inputs = np.zeros(self._rows.shape[1])
        self._each = np.zeros((2, 0))
        self._last: float | None = None

    def push(self, run: GridRun) -> list[GridRun]:
        """The next run of the fast grid; gives the slow runs that are ready."""
        if self._factor == 1:
            return [run]
        ready = []
        if run.new_start:
            ready += self.flush()
            self._begin(run)
        self._last = float(run.values[-1])
        own = np.stack([np.where(run.bridged, np.nan, run.nearest), run.clipped])
        return ready + self._advance(run.values, np.stack([run.clipped, run.bridged]), own)

    def flush(self) -> list[GridRun]:
        """The end of the current run. What is pushed later has to start a new run."""
        if self._last is None:
            return []
        own = np.zeros((2, self._half))
        own[0] = np.nan
        rest = self._advance(np.full(self._half, self._last), np.zeros((2, self._half), dtype=np.bool_), own)
        self._last = None
        return rest

    def _begin(self, run: GridRun) -> None:
        self._inputs[:] = 0.0
        self._inputs[: self._half] = run.values[0]
        self._filled, self._given = self._half, 0
        self._marks = np.zeros((2, self._factor // 2), dtype=np.bool_)
        self._each = np.zeros((2, 0))
        self._next_us, self._new_start = run.t0_us, True

    def _advance(self, values: Array, marks: Bools, own: Array) -> list[GridRun]:
        self._marks = np.concatenate([self._marks, marks], axis=1)
        self._each = np.concatenate([self._each, own], axis=1)
        pieces = []
        size, span = len(self._inputs), 2 * self._half + 1
        done = 0
        while done < len(values):
            count = min(size - self._filled, len(values) - done)
            self._inputs[self._filled : self._filled + count] = values[done : done + count]
            self._filled += count
            done += count
            ready = max(0, (self._filled - span) // self._factor + 1)
            if ready > self._given:
                pieces.append((self._rows @ self._inputs)[self._given : ready])
                self._given = ready
            if self._filled == size:
                self._filled = size - BLOCK * self._factor
                self._inputs[: self._filled] = self._inputs[BLOCK * self._factor :]
                self._inputs[self._filled :] = 0.0
                self._given = 0
        return [self._run(np.concatenate(pieces))] if pieces else []

    def _run(self, values: Array) -> GridRun:
        used = len(values) * self._factor
        shares = self._marks[:, :used].reshape(2, len(values), self._factor).mean(axis=2)
        clipped, bridged = shares[0] > 0.0, shares[1] >= BRIDGED_SHARE
        each, each_clipped = self._each[:, :used].reshape(2, len(values), self._factor)
        run = GridRun(self._next_us, GRID_RATE_HZ, values, values, clipped, bridged, self._new_start, each,
                      each_clipped > 0)
        self._marks, self._each = self._marks[:, used:], self._each[:, used:]
        self._next_us += len(values) * US_PER_S // GRID_RATE_HZ
        self._new_start = False
        return run



