"""Information matrices: their inverse as far as they have one, and what remains of one when numbers are integrated out.

Rows may differ by powers of ten, as a mass and an offset do; so every matrix is scaled to a unit diagonal first.

Fisher scoring: the numbers that make a likelihood the largest, of which slopes and information are known.

The value of a likelihood with a road integrated out is never computed, its slopes and their covariance, the
information, are; the latter at many times the price. Each step solves the information for the slopes (R. A. Fisher
1925). It serves on from step to step, and learns from each how the slopes really change (C. G. Broyden 1965), as long
as the expected gain falls: few simulated drives give a few numbers' slopes another steepness than their mean has.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from logger.arrays import Array, Bools, Indices

RANK = 1e-8
"""Share of the largest eigenvalue, of a unit diagonal, below which a direction counts as not known at all: information
by differences or by simulated drives is right to a few digits, and these are squares."""


def whitening(information: Array) -> Array:
    """W (r, m) with W' W the inverse of the information (m, m), as far as it has one: 0 for a number of which next to
    nothing is known, a standard error of 1e8 in its unit."""
    diagonal = np.diag(information)
    known = diagonal > np.finfo(float).eps
    scale = np.where(known, 1 / np.sqrt(np.where(known, diagonal, 1.0)), 0.0)
    powers, directions = np.linalg.eigh(information * np.outer(scale, scale))
    kept = powers > RANK * max(powers[-1], np.finfo(float).tiny) if len(powers) else powers > 0
    return np.asarray(directions[:, kept].T / np.sqrt(powers[kept])[:, None] * scale)


def inverse(information: Array) -> Array:
    """The inverse (m, m) of the information, as far as it has one."""
    whiten = whitening(information)
    return np.asarray(whiten.T @ whiten)


def inverse_with_prior(information: Array) -> Array:
    """The inverse (m, m) of information of which a prior may be all that is known of some direction, many powers of ten
    below the rest: only what is within rounding counts as nothing."""
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaling = np.outer(scale, scale)
    return np.asarray(scaling * np.linalg.pinv(scaling * information, rcond=1e-15, hermitian=True))


def correlation_of(covariance: Array) -> Array:
    """Correlations (m, m) of estimates with this covariance."""
    deviations = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return np.asarray(covariance / np.outer(deviations, deviations))


def integrated_out(information: Array, nuisance: Indices) -> Array:
    """Information on the other numbers when those of these indices are integrated out (Schur complement)."""
    own = np.setdiff1d(np.arange(len(information)), nuisance)
    projected = whitening(information[np.ix_(nuisance, nuisance)]) @ information[np.ix_(nuisance, own)]
    return np.asarray(information[np.ix_(own, own)] - projected.T @ projected)


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
