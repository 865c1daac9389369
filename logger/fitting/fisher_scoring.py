"""Fisher scoring: the numbers that make a likelihood the largest, of which slopes and information are known.

The value of a likelihood with a road integrated out is never computed, its slopes and their covariance, the
information, are; the latter at many times the price. Each step solves the information for the slopes (R. A. Fisher
1925). It serves on from step to step, and learns from each how the slopes really change (C. G. Broyden 1965), as long
as the expected gain falls: few simulated drives give a few numbers' slopes another steepness than their mean has.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from logger.arrays import Array, Bools
from logger.fitting.information_matrix import whitening

_FALLING = 0.5
"""Share of the expected gain before, above which the information is taken again: at a half steps still converge."""


class Scored(Protocol):
    """What a likelihood makes of a point x (m,): slopes (m,), and the information (m, m) where it was asked for."""

    @property
    def slopes(self) -> Array: ...

    @property
    def information(self) -> Array: ...


S = TypeVar("S", bound=Scored)


@dataclass(frozen=True, eq=False)
class Maximum(Generic[S]):
    """Where scoring ended.

    x              (m,)
    at             what was made of that point
    information    (m, m), as it was taken last
    steps          that were taken
    converged      whether what was left was less than asked for
    """

    x: Array
    at: S
    information: Array
    steps: int
    converged: bool


@dataclass(frozen=True, eq=False)
class _Curvature:
    """What is known of how slopes change: the information taken last, of the numbers that were free to move the
    ``whitening`` and the ``correction`` (r, r) learned since, and the step that was taken, in standard errors: the
    slopes before (r,), and itself (r,), 0 where it was cut short."""

    information: Array
    moving: Bools
    whitening: Array
    correction: Array
    slopes: Array
    along: Array

    @staticmethod
    def of(information: Array, moving: Bools) -> "_Curvature":
        """As the information says."""
        whiten = whitening(information[np.ix_(moving, moving)])
        nothing = np.zeros(len(whiten))
        return _Curvature(information, moving, whiten, np.eye(len(whiten)), nothing, nothing)

    def after(self, slopes: Array) -> "_Curvature":
        """Corrected by the slopes (r,) that the step led to."""
        if not (size := float(self.along @ self.along)) > 0:
            return self
        missed = self.slopes - slopes - self.correction @ self.along
        return replace(self, correction=self.correction + np.outer(missed, self.along) / size)


def maximise(score: Callable[[Array, bool], S], start: Array, low: Array, high: Array, longest: Array, *,
             close: float, most_steps: int) -> Maximum[S]:
    """The point that a likelihood is largest at, uphill from a start (m,).

    score        of a point, with the information if that is asked for
    low, high    bounds (m,)
    longest      change of each number (m,) in one step
    close        the end is reached where so many standard errors are left
    """
    x = np.clip(start, low, high)
    at = score(x, True)
    curvature, before, steps = None, np.inf, 0
    information = at.information
    while True:
        moving = ~(((x <= low) & (at.slopes < 0)) | ((x >= high) & (at.slopes > 0)))
        if curvature is None or curvature.information is not information or (curvature.moving != moving).any():
            curvature = _Curvature.of(information, moving)
        slopes = curvature.whitening @ at.slopes[moving]
        left = float(slopes @ slopes)
        if left < close**2 or steps == most_steps:
            return Maximum(x, at, information, steps, left < close**2)
        if left > _FALLING * before and information is not at.information:
            at, before = score(x, True), np.inf
            information = at.information
            continue
        curvature, before = curvature.after(slopes), left
        along = np.asarray(np.linalg.solve(curvature.correction, slopes), float)
        step = np.zeros_like(x)
        step[moving] = curvature.whitening.T @ along
        taken = np.clip(x + np.clip(step, -longest, longest), low, high) - x
        curvature = replace(curvature, slopes=slopes, along=along * np.allclose(taken, step))
        x = x + taken
        at, steps = score(x, False), steps + 1
