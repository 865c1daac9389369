"""The laws of a corner: what a spring, a damper and a tire answer to how far and how fast they are moved.

Signs: a suspension's travel and rate are those of its extension, negative in compression; a force is what it answers
against that, positive in extension (it pulls body and wheel together), as k x and c x' are. A tire's deflection is the
wheel's height over the road from rest, negative when it is pressed.

Laws are elementwise functions of arrays. A simulation tabulates them, so they may be asked far outside what a car does.
Effects wrap them; none of them knows whose car it is in.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Law = Callable[[Array], Array]
Law2 = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class CornerLaws:
    """One suspension and its tire.

    damping_n_s_per_m       of the linear damper
    damper                  the damper's force by its own rate: rate [m/s] -> force [N]; grows with the rate
    mount_n_per_m           stiffness of a mount in series with the damper; infinite: none
    springs                 forces by travel beyond the linear spring: travel [m] -> force [N]
    dry_friction_n          Coulomb friction beside the damper: this force against any motion, up to it at rest
    friction_transition_mps this times tanh(rate / transition) instead, unless 0
    others                  further forces: (travel, rate) -> force
    tire_damping_n_s_per_m  of the tire
    tires                   forces by deflection beyond the linear tire: deflection [m] -> force [N]
    tire_pulls              whether the tire holds on to the road, as the linear model has it
    """

    damping_n_s_per_m: float
    damper: Law
    mount_n_per_m: float = np.inf
    springs: tuple[Law, ...] = ()
    dry_friction_n: float = 0.0
    friction_transition_mps: float = 0.0
    others: tuple[Law2, ...] = ()
    tire_damping_n_s_per_m: float = 0.0
    tires: tuple[Law, ...] = ()
    tire_pulls: bool = True

    def with_spring(self, law: Law) -> CornerLaws:
        """With one more force by travel."""
        return replace(self, springs=(*self.springs, law))

    def with_force(self, law: Law2) -> CornerLaws:
        """With one more force by travel and rate."""
        return replace(self, others=(*self.others, law))

    def with_tire(self, law: Law) -> CornerLaws:
        """With one more force by the tire's deflection."""
        return replace(self, tires=(*self.tires, law))


def linear(damping_n_s_per_m: float) -> CornerLaws:
    """The laws of the linear car, which its matrices hold already."""
    return CornerLaws(damping_n_s_per_m, lambda rate: damping_n_s_per_m * rate)
