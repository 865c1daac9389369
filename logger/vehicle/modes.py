"""Natural frequencies, damping ratios and shapes of a car.

A car has as many vibrations of its own as degrees of freedom, and three ways of quoting them that differ by a few per
cent: with every coordinate but one held still (the simple formulas, as the values under Table 4.2 of Blum 2015 are
computed), all coupled but without dampers (the eigenvalue analysis of its 4.3.3), and as they really ring, with
dampers. Each is one function here, so that a number can be set beside its like.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array, Complex
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.structure import Structure


@dataclass(frozen=True)
class Mode:
    """One vibration exp(s t) of a car with its dampers.

    frequency_hz     |s| / 2 pi: the natural frequency without regard to damping [Hz]
    damping_ratio    -Re s / |s|; 1 for a motion that creeps back without swinging
    shape            (n,) motion of the coordinates, the largest 1; complex where they do not move in step
    """

    frequency_hz: float
    damping_ratio: float
    shape: Complex

    @property
    def damped_frequency_hz(self) -> float:
        """Frequency at which it really swings [Hz]; 0 for a motion that creeps."""
        return self.frequency_hz * float(np.sqrt(max(0.0, 1.0 - self.damping_ratio**2)))


def modes(structure: Structure) -> list[Mode]:
    """Vibrations of a car that stands on tires, with its dampers, the slowest first.

    A pair of conjugate roots is one mode. A vibration damped beyond critical has two real roots instead and becomes
    two modes of damping ratio 1.
    """
    return _of_state_matrix(structure.state_space()[0], len(structure.mass))


def modes_of_car(car: LinearCar) -> list[Mode]:
    """The same of a car with laws of its own at the corners: a mount in series with a damper is one state more, its
    compression y, with y' = J q' - k y / c and the force k y on the suspension; so are the states of laws by all that
    moves."""
    structure, corners = car.structure, car.corners
    n, travel, wheels = len(structure.mass), structure.travel, structure.wheels
    mounted = [i for i, one in enumerate(corners) if np.isfinite(one.mount_n_per_m) and one.damper_n_s_per_m > 0]
    mounts, dampers = (np.array([getattr(corners[i], name) for i in mounted]) for name in (
        "mount_n_per_m", "damper_n_s_per_m"))
    (damping, stiffness), pressed = car.matrices, travel[mounted]
    damping = damping - (pressed.T * dampers) @ pressed  # which is that of rigid mounts
    inverse, slip = np.linalg.inv(structure.mass), mounts / dampers
    pulls, by_place, by_rate, own = pressed.T * mounts, np.zeros((len(mounted), n)), pressed, -np.diag(slip)
    for i, one in enumerate(corners):
        j, u = travel[i], wheels[i]
        places, rates = np.stack([j, 0 * j, u, 0 * u, 0 * u]), np.stack([0 * j, j, 0 * u, u, u])
        for law in one.motions:
            along, count = law.along(j, u)[:, None], len(law.own)
            stiffness, damping = stiffness + along * (law.by @ places), damping + along * (law.by @ rates)
            pulls = np.hstack([pulls, along * law.through])
            by_place, by_rate = np.vstack([by_place, law.into @ places]), np.vstack([by_rate, law.into @ rates])
            own = np.block([[own, np.zeros((len(own), count))], [np.zeros((count, len(own))), law.own]])
    return _of_state_matrix(np.block([
        [np.zeros((n, n)), np.eye(n), np.zeros((n, len(own)))],
        [-inverse @ stiffness, -inverse @ damping, -inverse @ pulls],
        [by_place, by_rate, own],
    ]), n)


def _of_state_matrix(matrix: Array, n: int) -> list[Mode]:
    """Of x' = A x, the first n states coordinates."""
    roots, vectors = np.linalg.eig(matrix)
    shapes = vectors[:n]
    found = []
    for index in np.argsort(np.abs(roots)):
        root, shape = roots[index], shapes[:, index]
        if root.imag >= 0:
            largest = shape[np.abs(shape).argmax()]
            ratio = float(-root.real / abs(root)) if root else 1.0  # what moves freely does not swing
            found.append(Mode(float(abs(root)) / (2 * np.pi), ratio, shape / largest + 0j))
    return found


def vibrating(found: Sequence[Mode]) -> list[Mode]:
    """Those that swing."""
    return [one for one in found if one.damping_ratio < 1]


def mode_errors(car: LinearCar, off: Sequence[LinearCar]) -> tuple[list[Mode], Array, Array]:
    """The swinging modes of a car, and standard errors of their frequencies [Hz] and damping ratios, by how they lie
    in the cars that it may be instead; NaN where there are none, or a mode is none there."""
    found = vibrating(modes_of_car(car))
    changes = np.full((len(off), 2, len(found)), np.nan)
    for change, other in zip(changes, off, strict=True):
        others = vibrating(modes_of_car(other))
        if len(others) == len(found):
            change[0] = [one.frequency_hz - own.frequency_hz for one, own in zip(others, found, strict=True)]
            change[1] = [one.damping_ratio - own.damping_ratio for one, own in zip(others, found, strict=True)]
    errors = np.sqrt((changes**2).sum(axis=0)) if len(off) else np.full((2, len(found)), np.nan)
    return found, errors[0], errors[1]


def undamped_frequencies_hz(structure: Structure) -> Array:
    """Frequencies (n,) [Hz] of the car without its dampers, increasing: roots of det(K - omega^2 M).

    A motion without any spring, such as of a car without tires, has frequency 0.
    """
    if structure.held:  # its bench moves it, whatever it is
        return np.zeros(len(structure.mass))
    inverse = np.linalg.inv(np.linalg.cholesky(structure.mass))
    squares = np.linalg.eigvalsh(inverse @ structure.stiffness @ inverse.T)
    return np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)


def body_and_wheels_hz(structure: Structure) -> tuple[Array, Array]:
    """Undamped frequencies of the body (b,), the slow ones, and of the wheels (w,) [Hz], increasing; a mass on a base
    has no wheels, and moves without a spring at no frequency."""
    every = undamped_frequencies_hz(structure)
    wheels = 0 if structure.on_base else len(structure.wheels)
    body = every[:len(every) - wheels]
    return body[body > 0], every[len(every) - wheels:]
