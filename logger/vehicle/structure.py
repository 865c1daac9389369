"""A car as linear equations of motion, and what a road does to it in frequency and in time.

Every linear model of a car is the same problem with other matrices, so each model file states only its
matrices and this one asks the questions. Conventions, stated once for all models:

    M q'' + C q' + K q = R z

- q[0] is the body at its centre of gravity, up positive, from rest under gravity; a pitch is nose up positive;
- z holds the road's elevation under each wheel, up positive, the front wheel first;
- tires are springs only, so R holds tire stiffnesses;
- the car drives forward: a wheel that stands ``behind_m`` behind the front wheel meets the road ``behind_m / speed``
  later (Eq 4.10 and 4.11 of Blum 2015), and each tire averages the road over the contact patch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Structure:
    """Matrices of one car. n degrees of freedom, w wheels.

    mass, damping, stiffness    (n, n) [kg, N s/m, N/m; with lengths where a row or column is a pitch]
    road                        (n, w) force per elevation under each wheel [N/m]
    behind_m                    (w,) how far behind the front wheel each wheel stands [m]
    contact_patch_m             [m]
    """

    mass: Array
    damping: Array
    stiffness: Array
    road: Array
    behind_m: Array
    contact_patch_m: float

    def state_space(self) -> tuple[Array, Array]:
        """A (2n, 2n) and B (2n, w) of x' = A x + B z with x = (q, q'). Row n is the body's acceleration."""
        n = len(self.mass)
        inverse = np.linalg.inv(self.mass)
        a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ self.stiffness, -inverse @ self.damping]])
        b = np.vstack([np.zeros_like(self.road), inverse @ self.road])
        return a, b


def body_acceleration_response(
    structure: Structure, f_hz: npt.ArrayLike, speed_mps: npt.ArrayLike
) -> npt.NDArray[np.complex128]:
    """Body acceleration at the centre of gravity per elevation under the front wheel [1/s2], at constant speed.

    ``f_hz`` [Hz] and ``speed_mps`` [m/s], greater than 0, are broadcast against each other. A moving average over the
    contact patch is a sinc in the road's wave number f / speed.
    """
    f, speed = np.broadcast_arrays(np.asarray(f_hz, float), np.asarray(speed_mps, float))
    omega = 2 * np.pi * f[..., None, None]
    dynamic_stiffness = structure.stiffness + 1j * omega * structure.damping - omega**2 * structure.mass
    wave_number = f / speed
    delays = np.exp(-2j * np.pi * wave_number[..., None] * structure.behind_m)
    force = (delays @ structure.road.T)[..., None]
    body = np.linalg.solve(dynamic_stiffness, force)[..., 0, 0]
    return -((2 * np.pi * f) ** 2) * body * np.sinc(wave_number * structure.contact_patch_m)
