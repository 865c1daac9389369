"""What sensors on a structure M u'' + C u' + K u = f record: after a push and a release, or under random forces.

Both are exact at the sampling instants: the free motion through the matrix exponential, the random one with forces that
are constant over each of several steps within a sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from logger.modal.mode import Array, Complex
from logger.vehicle.state_space import driven_outputs, matrix_exponential, recursion, straight_step

_STEPS_PER_SAMPLE = 4


@dataclass(frozen=True)
class Masses:
    """A structure of n degrees of freedom: mass, damping, stiffness, each (n, n) [kg, N s/m, N/m]."""

    mass: Array
    damping: Array
    stiffness: Array

    def equations(self) -> tuple[Array, Array, Array, Array]:
        """A, B, C, D of the states (u, u'), the forces on each degree of freedom and the accelerations."""
        n = len(self.mass)
        below = np.linalg.solve(self.mass, np.hstack([-self.stiffness, -self.damping]))
        force = np.linalg.inv(self.mass)
        transition, drive = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, n))
        transition[:n, n:], transition[n:], drive[n:] = np.eye(n), below, force
        return transition, drive, np.asarray(below, dtype=np.float64), np.asarray(force, dtype=np.float64)

    def poles(self) -> tuple[Complex, Complex]:
        """Vibrating poles s (m,) [rad/s], slowest first, and their shapes (n, m)."""
        roots, vectors = np.linalg.eig(self.equations()[0])
        keep = np.flatnonzero(roots.imag > 0)
        keep = keep[np.argsort(np.abs(roots[keep]))]
        return roots[keep].astype(np.complex128), vectors[:len(self.mass), keep].astype(np.complex128)


def with_damping_ratios(mass: Array, stiffness: Array, ratios: Array) -> Masses:
    """A structure whose undamped modes get the given damping ratios (n,), slowest first, and keep their shapes."""
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    shapes = np.linalg.solve(inverse, vectors)  # L q: M times the mass-normalised shapes
    return Masses(mass, shapes * (2 * ratios * np.sqrt(squares)) @ shapes.T, stiffness)


def chain(mass_kg: Array, stiffness_n_per_m: Array) -> tuple[Array, Array]:
    """M and K of masses in a row, the first tied to the ground: spring k lies before mass k."""
    after = np.append(stiffness_n_per_m[1:], 0.0)
    return np.diag(mass_kg), np.diag(stiffness_n_per_m + after) - np.diag(after[:-1], 1) - np.diag(after[:-1], -1)


def free_decay(masses: Masses, displacement_m: Array, rate_hz: float, samples: int) -> Array:
    """Accelerations (samples, n) [m/s2] after the structure is let go from the displacements (n,) at rest."""
    transition, _, observe, _ = masses.equations()
    start = np.concatenate([displacement_m, np.zeros_like(displacement_m)])
    step = matrix_exponential(transition / rate_hz)
    states = recursion(step, np.zeros((samples - 1, len(start))), start)
    return np.vstack([start, states]) @ observe.T


def random_response(masses: Masses, force_n: Array, rate_hz: float) -> Array:
    """Accelerations (samples, n) [m/s2] under forces (samples * 4, n) [N], each held for a quarter of a sample.

    White forces have an infinite acceleration at the mass they push; what is returned is the part of the springs and
    dampers, as a sensor sees that whose band ends far below that of the force.
    """
    transition, drive, observe, _ = masses.equations()
    step, begin, end = straight_step(transition, drive, 1 / (rate_hz * _STEPS_PER_SAMPLE))
    start = np.zeros(len(transition))
    return driven_outputs(step, begin + end, observe, force_n, start)[1::_STEPS_PER_SAMPLE]
