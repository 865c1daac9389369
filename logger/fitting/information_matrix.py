"""Information matrices: their inverse as far as they have one, and what remains of one when numbers are integrated out.

Rows may differ by powers of ten, as a mass and an offset do; so every matrix is scaled to a unit diagonal first.
"""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

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


def integrated_out(information: Array, nuisance: npt.NDArray[np.intp]) -> Array:
    """Information on the other numbers when those of these indices are integrated out (Schur complement)."""
    own = np.setdiff1d(np.arange(len(information)), nuisance)
    projected = whitening(information[np.ix_(nuisance, nuisance)]) @ information[np.ix_(nuisance, own)]
    return np.asarray(information[np.ix_(own, own)] - projected.T @ projected)
