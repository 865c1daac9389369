"""The state in which a run begins that nobody recorded: of what was let go, of a rig that was driven before and rings
for longer than what is left out of its run, and of a part with a memory.

Problem: what is pulled and let go, or was struck or shaken before its record begins, is in a state that nobody wrote
down, and so is a part with a memory, which came to its first sample from above or from below; every number of the car
that is tried has its own best one. Solution: the state has a normal prior as wide as the record is large, and is
eliminated wherever the run is predicted (variable projection: G. Golub and V. Pereyra, SIAM J. Numer. Anal. 10, 1973).
The records of a linear car are linear in it, so that least squares find it; from there Gauss-Newton steps lead to that
of a car whose laws are bent. What each step shows corrects the derivatives for the next (C. G. Broyden, Math. Comp. 19,
1965), and those of a car that hardly differs serve as well: a simulation a step, and not one more for each number of
the state.
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

_STATE_STEP, _MOST_STATE_STEPS = 1e-4, 12
_SMALL_GAIN = 0.1  # of minus twice the log-likelihood: what promises less is the last step, a third of a standard error
_SMALL_STATE = 1e-6
_PRIOR_ROUNDS = 3
_WIDE = 10.0
"""The prior of a motion is as wide as what would make signals so many times as large as they ever are: those of two
numbers of the state may cancel for a while (a judgement)."""


@dataclass(frozen=True, eq=False)
class Beginning:
    """A state (2 n + k,) in which a run begins, as ``Passage.begins``, and how what its signals record changes with it
    (m, 2 n + k); the ``usual`` size of each number of the state, 0 of those that are known."""

    state: Array
    columns: Array
    usual: Array


def begins_unknown(car: Car, run: Run) -> bool:
    """Whether the initial state of a run matters: of what nothing drives, of a rig whose record begins in a motion with
    a longer time constant than what is left out of it, or of a part with a memory."""
    if run.past is Past.DRIVEN:
        return run.begins_in_motion and car.structure.slowest_decay_per_s * run.skip_s < 1
    return run.past is Past.FREE or car.memories > 0


def beginning(car: Car, passage: Passage, run: Run, recorded: Recorded, near: Beginning | None = None,
              is_bent: bool = True) -> Beginning:
    """The state with which the car's records come nearest to what the run measured; the search for it begins at that of
    a car that hardly differs (``near``), where there is one. Not ``is_bent``: that of the car without its laws.

    Each signal counts by its own size, and its zero is free. Each number of the state has a normal prior about rest:
    that of a motion by what the signals ever were (``_WIDE``), that of a memory is one unit of its law, which for
    friction is that it slides.
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
    if not is_bent or not car.bends_laws or not len(weighed.measured):
        return plain
    return _bent_beginning(car, passage, weighed, plain, is_near=False)


def _linear_beginning(car: Car, passage: Passage, weighed: _WeighedRecord, count: int) -> Beginning:
    """The beginning (``count``) of the car without its laws, whose record is linear in it."""
    wanted, plain, moves = weighed.measured, car.linear, 2 * len(car.structure.mass)
    columns, state, usual = np.zeros((len(wanted), count)), np.zeros(count), np.ones(count)
    if car.structure.held or not len(wanted):
        usual[:moves] = 0.0  # the bench moves it
        return Beginning(state, columns, usual)
    still = weighed.whole(plain, passage)
    # Small, as records are clipped at what no sensor reads: 1 m is that of what is let go at 160 Hz.
    small = [weighed.whole(plain, passage.begun_with(one)) - still for one in _SMALL_STATE * np.eye(moves)]
    columns[:, :moves] = np.stack([weighed.counted(one) for one in small], axis=1) / _SMALL_STATE
    seen = np.array([np.abs(one).max() for one in small]) / _SMALL_STATE
    usual[:moves] = np.divide(_WIDE * weighed.largest, seen, out=np.zeros_like(seen), where=seen > 0)
    left = wanted - weighed.counted(still)
    for _ in range(_PRIOR_ROUNDS):  # the prior weighs as much as the noise that is left allows
        state = state + _towards(columns, left - columns @ state, usual, state)
    return Beginning(state, columns, usual)


def _bent_beginning(car: Car, passage: Passage, weighed: _WeighedRecord, start: Beginning, is_near: bool) -> Beginning:
    """The beginning with a car whose laws are bent, by steps whose first derivatives are those of one that ``is_near``.
    """
    state, columns, usual, own = start.state, start.columns.copy(), start.usual, is_near
    per_usual = np.divide(1.0, usual, out=np.zeros_like(usual), where=usual > 0)
    here = weighed.of(car, passage.begun_with(state))
    for _ in range(_MOST_STATE_STEPS):
        if fresh := not own:
            for index, one in enumerate(_STATE_STEP * usual):
                if one > 0:
                    beside = passage.begun_with(state + one * (np.arange(len(usual)) == index))
                    columns[:, index] = (weighed.of(car, beside) - here) / one
            own = True
        way = _towards(columns, weighed.measured - here, usual, state)
        least, gained = weighed.misfit(here, state * per_usual), 0.0
        if weighed.misfit(here + columns @ way, (state + way) * per_usual) > least - _SMALL_GAIN:
            return Beginning(state + way, columns, usual)
        for share in (1.0, 0.5, 0.25, 0.1, 0.02) if fresh else (1.0,):
            step = share * way
            there = weighed.of(car, passage.begun_with(state + step))
            gained = least - weighed.misfit(there, (state + step) * per_usual)
            if gained > 0:
                break
        if gained > 0:
            usually = step * per_usual**2
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


def _towards(columns: Array, left: Array, usual: Array, state: Array) -> Array:
    """The change of a state (c,) of these ``usual`` sizes that makes up for what is ``left`` (m,), by its ``columns``
    (m, c), under its prior."""
    spread = np.sqrt(np.mean(left**2)) or 1.0
    here = np.divide(state, usual, out=np.zeros_like(state), where=usual > 0)
    rows = np.vstack([columns * usual, spread * np.eye(len(state))])
    return np.asarray(usual * np.linalg.lstsq(rows, np.concatenate([left, -spread * here]))[0])


class _WeighedRecord:
    """What a run's signals read, joined (m,): each without its mean, by its own size."""

    def __init__(self, run: Run, recorded: Recorded) -> None:
        self.run, self._recorded = run, recorded
        read = run.read if run.usable is None else run.usable == READING
        self._counted = read & (np.arange(run.count) >= run.first)
        measured = np.stack([run.measured_mps2, *run.more])
        counted = measured[:, self._counted]
        self._sizes = counted.std(axis=1, keepdims=True) if self._counted.any() else np.ones((len(measured), 1))
        self._sizes[self._sizes == 0] = 1.0
        whole = measured[:, read] / self._sizes
        self.largest = float(np.abs(whole - whole.mean(axis=1, keepdims=True)).max(initial=0.0))
        self.measured = self.counted(measured / self._sizes)

    def of(self, car: Car, begun: Passage) -> Array:
        """What a car would have read in their place."""
        return self.counted(self.whole(car, begun))

    def whole(self, car: Car, begun: Passage) -> Array:
        """The same of all samples (1 + s, n), with their means."""
        joined = self.run.in_band(self._recorded(car, begun, self.run))
        return np.asarray(joined.reshape(-1, self.run.count) / self._sizes)

    def counted(self, whole: Array) -> Array:
        """What counts of whole signals (1 + s, n), joined (m,)."""
        samples = whole[:, self._counted]
        return np.asarray(samples - samples.mean(axis=1, keepdims=True)).ravel() if samples.size else np.empty(0)

    def misfit(self, predicted: Array, numbers: Array) -> float:
        """Minus twice the log-likelihood of what was predicted (m,), with noise of any level, and of the numbers (c,)
        of a state over their usual sizes."""
        squares = np.sum((self.measured - predicted) ** 2) + np.finfo(float).tiny
        return len(predicted) * float(np.log(squares)) + float(numbers @ numbers)
