"""The state in which a run begins that nobody recorded: of what was let go, and of a part with a memory.

Problem: what is pulled and let go, or was struck before its record begins, is in a state that nobody wrote down, and so
is a part with a memory, which came to its first sample from above or from below; every number of the car that is tried
has its own best one. Solution: the state is eliminated wherever the run is predicted (variable projection: G. Golub and
V. Pereyra, SIAM J. Numer. Anal. 10, 1973). The records of a linear car are linear in it, so that one solution of least
squares finds it; from there Gauss-Newton steps lead to that of a car whose laws are bent. What each step shows corrects
the derivatives for the next (C. G. Broyden, Math. Comp. 19, 1965), and those of a car that hardly differs serve as
well: a simulation a step, and not one more for each number of the state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array
from logger.runs import READING, Past, Run
from logger.vehicle.compose import Car
from logger.vehicle.simulate import Passage

Recorded = Callable[[Car, Passage, Run], Array]
"""What a run's signals, joined ((1 + s) n,), would read of a car on a passage."""

_STATE_STEP, _MOST_STATE_STEPS = 1e-3, 12
_SMALL_GAIN = 0.1  # of minus twice the log-likelihood: what promises less is the last step, a third of a standard error
_UNSEEN, _SMALL_STATE = 1e-4, 1e-6


@dataclass(frozen=True, eq=False)
class Beginning:
    """A state (2 n + k,) in which a run begins, as ``Passage.begins``, and how what its signals record changes with it
    (m, 2 n + k); the ``usual`` size of each number of the state, 0 of those that are known."""

    state: Array
    columns: Array
    usual: Array


def begins_unknown(car: Car, run: Run) -> bool:
    """Whether the initial state of a run matters: of what nothing drives, or of a part with a memory."""
    return run.past is Past.FREE or (run.past is Past.OF_PART and car.memories > 0)


def beginning(car: Car, passage: Passage, run: Run, recorded: Recorded, near: Beginning | None = None) -> Beginning:
    """The state with which the car's records come nearest to what the run measured; the search for it begins at that of
    a car that hardly differs (``near``), where there is one.

    Each signal counts by its own size, and its zero is free. What the record does not show of the state stays at rest:
    memories have a normal prior of one unit of their law, which for friction is that it slides.
    """
    if car.structure.held:
        run, passage = _one_cycle(car, passage, run)
    weighed = _WeighedRecord(run, recorded)
    count = 2 * len(car.structure.mass) + car.memories
    passage.under_wheels(passage.driven(car.structure))  # asked for once, for all states
    # What hangs on a car has a state as soon as it weighs something.
    # One cycle is another number of samples of another road.
    alike = near is not None and near.columns.shape == (len(weighed.measured), count)
    if near is not None and alike and car.bends_laws and len(weighed.measured):
        return _bent_beginning(car, passage, weighed, near, is_near=True)
    plain = _linear_beginning(car, passage, weighed, count)
    if not car.bends_laws or not len(weighed.measured):
        return plain
    return _bent_beginning(car, passage, weighed, plain, is_near=False)


def _linear_beginning(car: Car, passage: Passage, weighed: _WeighedRecord, count: int) -> Beginning:
    """The beginning (``count``) of the car without its laws, which is found in one step."""
    wanted, plain, moves = weighed.measured, car.linear, 2 * len(car.structure.mass)
    columns, state, usual = np.zeros((len(wanted), count)), np.zeros(count), np.ones(count)
    if car.structure.held or not len(wanted):
        usual[:moves] = 0.0  # the bench moves it
        return Beginning(state, columns, usual)
    # What nothing drives is still, and each signal counts without its mean.
    still = np.zeros_like(wanted) if weighed.run.past is Past.FREE else weighed.of(plain, passage)
    # Small, as records are clipped at what no sensor reads: 1 m is that of what is let go at 160 Hz.
    small = map(passage.begun_with, _SMALL_STATE * np.eye(moves))
    columns[:, :moves] = np.stack([weighed.of(plain, one) - still for one in small], axis=1) / _SMALL_STATE
    seen = np.linalg.norm(columns[:, :moves], axis=0)
    usual[:moves] = np.divide(np.linalg.norm(wanted), seen, out=np.zeros_like(seen), where=seen > 0)
    return Beginning(_towards(columns, wanted - still, usual, state, moves), columns, usual)


def _bent_beginning(car: Car, passage: Passage, weighed: _WeighedRecord, start: Beginning, is_near: bool) -> Beginning:
    """The beginning with a car whose laws are bent, by steps whose first derivatives are those of one that ``is_near``.
    """
    state, columns, usual, own = start.state, start.columns.copy(), start.usual, is_near
    moves = len(usual) - car.memories
    here = weighed.of(car, passage.begun_with(state))
    for _ in range(_MOST_STATE_STEPS):
        if fresh := not own:
            for index, one in enumerate(_STATE_STEP * usual):
                if one > 0:
                    beside = passage.begun_with(state + one * (np.arange(len(usual)) == index))
                    columns[:, index] = (weighed.of(car, beside) - here) / one
            own = True
        way = _towards(columns, weighed.measured - here, usual, state, moves)
        least, gained = weighed.misfit(here, state[moves:]), 0.0
        if weighed.misfit(here + columns @ way, (state + way)[moves:]) > least - _SMALL_GAIN:
            return Beginning(state + way, columns, usual)
        for share in (1.0, 0.5, 0.25, 0.1, 0.02) if fresh else (1.0,):
            step = share * way
            there = weighed.of(car, passage.begun_with(state + step))
            gained = least - weighed.misfit(there, (state + step)[moves:])
            if gained > 0:
                break
        if gained > 0:
            usually = np.divide(step, usual**2, out=np.zeros_like(step), where=usual > 0)
            columns += np.outer(there - here - columns @ step, usually / (usually @ step))
            state, here = state + step, there
        if fresh and gained < _SMALL_GAIN:
            break
        own = gained > 0
    return Beginning(state, columns, usual)


def _one_cycle(car: Car, passage: Passage, run: Run) -> tuple[Run, Passage]:
    """The beginning of a run of a part: after it has moved through its stroke and back, what it remembered is gone."""
    places = passage.under_wheels(car.structure)[0][: run.count * passage.steps, 0]
    gone = np.searchsorted(np.cumsum(np.abs(np.diff(places))), 2 * np.ptp(places)) // passage.steps
    count = max(int(gone), 2 * run.first) + 2
    return run.part(slice(count)), passage.cut(count)


def _towards(columns: Array, left: Array, usual: Array, state: Array, moves: int) -> Array:
    """The change of a state (c,) of these ``usual`` sizes that makes up for what is ``left`` (m,), by its ``columns``
    (m, c); the memories, which follow ``moves`` others, have their prior."""
    spread = np.sqrt(np.mean(left**2)) or 1.0
    prior = np.arange(len(state)) >= moves
    rows = np.vstack([columns * usual, np.diag(spread * prior)])
    return np.asarray(usual * np.linalg.lstsq(rows, np.concatenate([left, -spread * prior * state]), rcond=_UNSEEN)[0])


class _WeighedRecord:
    """What a run's signals read, joined (m,): each without its mean, by its own size."""

    def __init__(self, run: Run, recorded: Recorded) -> None:
        self.run, self._recorded = run, recorded
        read = run.read if run.usable is None else run.usable == READING
        self._counted = read & (np.arange(run.count) >= run.first)
        measured = np.stack([run.measured_mps2, *run.more])[:, self._counted]
        self._sizes = measured.std(axis=1, keepdims=True) if self._counted.any() else np.ones((len(measured), 1))
        self._sizes[self._sizes == 0] = 1.0
        self.measured = self._weighed(measured)

    def of(self, car: Car, begun: Passage) -> Array:
        """What a car would have read in their place."""
        joined = self.run.in_band(self._recorded(car, begun, self.run))
        return self._weighed(joined.reshape(-1, self.run.count)[:, self._counted])

    def misfit(self, predicted: Array, memories: Array) -> float:
        """Minus twice the log-likelihood of what was predicted (m,), with noise of any level, and of memories (k,)."""
        squares = np.sum((self.measured - predicted) ** 2) + np.finfo(float).tiny
        return len(predicted) * float(np.log(squares)) + float(memories @ memories)

    def _weighed(self, samples: Array) -> Array:
        if not samples.size:
            return np.empty(0)
        return np.asarray((samples - samples.mean(axis=1, keepdims=True)) / self._sizes).ravel()
