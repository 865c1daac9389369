"""Natural frequencies, damping ratios and shapes of a car.

A car has as many vibrations of its own as degrees of freedom, and three ways of quoting them that differ by a few per
cent: with every coordinate but one held still (the simple formulas, as the values under Table 4.2 of Blum 2015 are
computed), all coupled but without dampers (the eigenvalue analysis of its 4.3.3), and as they really ring, with
dampers. Each is one function here, so that a number can be set beside its like.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.vehicle.structure import Structure

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Mode:
    """One vibration exp(s t) of a car with its dampers.

    frequency_hz     |s| / 2 pi: the natural frequency without regard to damping [Hz]
    damping_ratio    -Re s / |s|; 1 for a motion that creeps back without swinging
    shape            (n,) motion of the coordinates, the largest 1; complex where they do not move in step
    """

    frequency_hz: float
    damping_ratio: float
    shape: npt.NDArray[np.complex128]

    @property
    def damped_frequency_hz(self) -> float:
        """Frequency at which it really swings [Hz]; 0 for a motion that creeps."""
        return self.frequency_hz * float(np.sqrt(max(0.0, 1.0 - self.damping_ratio**2)))


def modes(structure: Structure) -> list[Mode]:
    """Vibrations of a car that stands on tires, with its dampers, the slowest first.

    A pair of conjugate roots is one mode. A vibration damped beyond critical has two real roots instead and becomes
    two modes of damping ratio 1.
    """
    roots, vectors = np.linalg.eig(structure.state_space()[0])
    shapes = vectors[:len(structure.mass)]
    found = []
    for index in np.argsort(np.abs(roots)):
        root, shape = roots[index], shapes[:, index]
        if root.imag >= 0:
            largest = shape[np.abs(shape).argmax()]
            found.append(Mode(float(abs(root)) / (2 * np.pi), float(-root.real / abs(root)), shape / largest + 0j))
    return found


def undamped_frequencies_hz(structure: Structure) -> Array:
    """Frequencies (n,) [Hz] of the car without its dampers, increasing: roots of det(K - omega^2 M).

    A motion without any spring, such as of a car without tires, has frequency 0.
    """
    inverse = np.linalg.inv(np.linalg.cholesky(structure.mass))
    squares = np.linalg.eigvalsh(inverse @ structure.stiffness @ inverse.T)
    return np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)


def one_at_a_time(structure: Structure) -> tuple[Array, Array]:
    """Frequency (n,) [Hz] and damping ratio (n,) of each coordinate while the others are held still.

    sqrt(k / m) / 2 pi and c / 2 sqrt(k m), with k, c, m from the diagonals of K, C, M: for Table 4.2 these are the
    quoted 1.16 Hz and 0.28 of the body and 10.97 Hz of the wheels.
    """
    m, c, k = (np.diag(matrix) for matrix in (structure.mass, structure.damping, structure.stiffness))
    return np.sqrt(k / m) / (2 * np.pi), c / (2 * np.sqrt(k * m))
