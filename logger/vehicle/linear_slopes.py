"""Derivatives of what a linear car records, by many of its numbers at once.

Problem: a fit asks for the derivatives by a dozen numbers of a car, and a simulation for each costs a dozen simulations
and is right to what a difference is. Solution: of a car x[k+1] = F x[k] + G v[k], y[k] = C x[k] + D u[k] over K steps
the sums X of x[k] z^-k, at z = exp(s h), are

    (z - F) X = z (x[0] - x[K] z^-K) + G V

without error, whatever still rings at the end, and so are their derivatives, with the same matrix on the left:

    (z - F) dX = z (dx[0] - dx[K] z^-K) + dF X + dG V

A recorder keeps the low frequencies alone, so that products of small matrices there are what each number costs. The
last state is that of a system in blocks of ``_BLOCK`` steps. Matrices are differentiated by central differences.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from logger.arrays import Array, Complex
from logger.vehicle.compose import Car, linear_step
from logger.vehicle.simulate import Passage
from logger.vehicle.structure import Output, Structure, recursion

STEP = 1e-4
"""Of the logarithm of a number: the error of a central difference goes by its square."""
_BLOCK = 64
_AT_ONCE = 4096  # frequencies, so that memory does not grow with their number
_APART = 1e6  # condition number of the modes of a car, of which two may nearly be one; it costs as many digits


@dataclass(frozen=True, eq=False)
class _Steps:
    """F (n, n) and G (n, m) of a step, C (c, n) and D (c, u), where the car starts (n,), and as F and G of a block of
    steps (n, n), (n, _BLOCK m)."""

    transition: Array
    gain: Array
    observe: Array
    direct: Array
    start: Array
    over_block: Array
    into_block: Array

    @staticmethod
    def of(passage: Passage, car: Car, outputs: Sequence[Output]) -> "_Steps":
        """Of a car on a passage."""
        structure = passage.driven(car.structure)
        start = structure.at_rest(passage.under_wheels(structure)[0][0])
        return _Steps(*linear_step(structure, passage.step_s), *structure.output_matrices(outputs), start,
                      *_block(structure, passage.step_s))

    def derivative(self, other: "_Steps") -> "_Steps":
        """By a number that is larger by ``STEP`` here, and smaller in the ``other``."""
        return _Steps(*((getattr(self, one) - getattr(other, one)) / (2 * STEP) for one in self.__dataclass_fields__))


@lru_cache(maxsize=64)
def _block(structure: Structure, step_s: float) -> tuple[Array, Array]:
    transition, gain = linear_step(structure, step_s)
    powers = np.eye(len(transition))[None]
    while len(powers) <= _BLOCK:
        powers = np.concatenate([powers, powers @ (powers[-1] @ transition)])
    return powers[_BLOCK], np.hstack(list(powers[_BLOCK - 1::-1] @ gain))


def is_steady(structure: Structure) -> bool:
    """Whether springs hold all of a car: of one that they do not hold z - F is singular."""
    return int(np.linalg.matrix_rank(structure.stiffness)) == len(structure.mass)


Read = tuple[Car, Sequence[Output]]
"""A car and what is read of it."""


def recorded_slopes(passage: Passage, here: Read, around: Sequence[tuple[Read, Read]]) -> Array:
    """What the recorder keeps (p + 1, c, N) of derivatives of a linear car by p numbers, and of itself as the last.

    around    cars of which one number is larger by ``STEP``, and smaller; the same comes under them
    """
    car, steps = here[0], _Steps.of(passage, *here)
    slopes = [_Steps.of(passage, *high).derivative(_Steps.of(passage, *low)) for high, low in around]
    structure = passage.driven(car.structure)
    driving = passage.means_and_rises(structure)
    blocks = -(-len(driving) // _BLOCK)
    rows = np.zeros((blocks * _BLOCK, driving.shape[1]))
    rows[:len(driving)] = driving
    rows = rows.reshape(blocks, -1)
    states = recursion(steps.over_block, rows @ steps.into_block.T, steps.start)
    begun = np.vstack([steps.start, states[:-1]])
    ends = _end(steps.over_block, np.stack([np.vstack([one.start, begun @ one.over_block.T + rows @ one.into_block.T])
                                            for one in slopes], axis=1))
    by_step, by_input = passage.transformed_inputs(structure)
    edges = np.stack([passage.impulse(-1), -passage.impulse(blocks * _BLOCK - 1)])
    onto = np.vstack([np.column_stack([one.transition, one.gain, one.start, end])
                      for one, end in zip(slopes, ends, strict=True)])
    n, c, f = len(steps.start), len(steps.observe), len(passage.s)
    found = np.empty((len(slopes) + 1, c, f), dtype=complex)
    for some in (slice(at, at + _AT_ONCE) for at in range(0, f, _AT_ONCE)):
        v, u, edge = by_step[:, some], by_input[:, some], edges[:, some]
        solved = _solver(steps.transition, np.exp(passage.s[some] * passage.step_s))
        x = solved((steps.gain @ v + np.column_stack([steps.start, states[-1]]) @ edge)[None])[0]
        right = (onto @ np.vstack([x, v, edge]).view(float)).view(complex)
        found[:-1, :, some] = steps.observe @ solved(right.reshape(len(slopes), n, -1))
        found[-1, :, some] = steps.observe @ x + steps.direct @ u
        read = np.vstack([np.column_stack([one.observe, one.direct]) for one in slopes])
        found[:-1, :, some] += (read @ np.vstack([x, u])).reshape(len(slopes), c, -1)
    return passage.kept(found, car.factor)


def _end(transition: Array, rows: Array) -> Array:
    """The last state (..., n) of x[k+1] = F x[k] + rows[k + 1] from x[0] = rows[0], of rows (K + 1, ..., n)."""
    while len(rows) > 1:
        if len(rows) % 2:
            rows = np.concatenate([np.zeros_like(rows[:1]), rows])
        rows, transition = rows[::2] @ transition.T + rows[1::2], transition @ transition
    return np.asarray(rows[0])


def _solver(transition: Array, z: Complex) -> Callable[[Complex], Complex]:
    """What solves (z - F) x = right (p, n, f) at z (f,)."""
    values, modes = np.linalg.eig(transition)
    if np.linalg.cond(modes) < _APART:
        into, by_mode = np.linalg.inv(modes), 1 / (z - values[:, None])
        return lambda right: modes @ (by_mode * (into @ right))
    inverse = np.linalg.inv(z[:, None, None] * np.eye(len(transition)) - transition)
    return lambda right: np.einsum("fij,pjf->pif", inverse, right)
