"""The laws of a corner: what a spring, a damper and a tire answer to how far and how fast they are moved.

Signs: a suspension's travel and rate are those of its extension, negative in compression; a force is what it answers
against that, positive in extension (it pulls body and wheel together), as k x and c x' are. A tire's deflection is the
wheel's height over the road from rest, negative when it is pressed.

Laws are elementwise functions of arrays. A simulation tabulates them, so they may be asked far outside what a car does.
Effects wrap them; none of them knows whose car it is in. What no table holds, a force by anything else that moves, by
place or time, or with a memory, is a ``MotionLaw``: a simulation compiles it and asks it number by number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from logger.arrays import Array

Law = Callable[[Array], Array]
Law2 = Callable[[Array, Array], Array]


class Between(Enum):
    """The two ends that a force acts on. It is positive where it pulls body and wheel together, or the wheel, or the
    body's end of the suspension, down."""

    BODY_AND_WHEEL = 0
    WHEEL_AND_GROUND = 1
    BODY_AND_GROUND = 2


class Seen(NamedTuple):
    """What a ``MotionLaw`` sees at a wheel, at one instant: numbers in a simulation, arrays of one shape elsewhere.

    travel_m, rate_mps              of the suspension, and its rate
    deflection_m, deflection_mps    of the tire, and its rate
    wheel_mps, body_mps             how fast the wheel, and the body's end of the suspension, rise against the ground
    distance_m                      where this wheel stands along the road
    time_s                          since the record's first sample
    speed_mps                       of the car along the road
    run                             which one it is of the runs that are looked at together, from 0 on
    memory                          the law's own states
    """

    travel_m: Any
    rate_mps: Any
    deflection_m: Any
    deflection_mps: Any
    wheel_mps: Any
    body_mps: Any
    distance_m: Any
    time_s: Any
    speed_mps: Any
    run: Any
    memory: tuple[Any, ...]


MOST_MEMORY = 4
"""States that a law may have."""


@dataclass(frozen=True)
class MotionLaw:
    """A force by all that moves at a wheel, maybe with states of its own.

    between    what it acts on
    force      (p, seen) -> force [N]
    p          its numbers
    rates      (p, seen) -> how fast each state grows [1/s], a tuple; None: it has no states
    memory     its states at rest
    """

    between: Between
    force: Callable[[Any, Seen], Any]
    p: SimpleNamespace
    rates: Callable[[Any, Seen], tuple[Any, ...]] | None = None
    memory: tuple[float, ...] = ()


class Stribeck(NamedTuple):
    """How much more than its sliding force a friction is: ``ratio`` at rest, and less the quicker it slides, with
    ``rate_mps`` [m/s] at which 1 / e of the excess is left (B. Armstrong-Helouvry and others, Automatica 30, 1994)."""

    ratio: float = 1.0
    rate_mps: float = 1.0

    def times(self, rate_mps: Array) -> Array:
        """Factors (n,) of the sliding force at these rates (n,)."""
        return np.asarray(1.0 + (self.ratio - 1.0) * np.exp(-((rate_mps / self.rate_mps) ** 2)))


COULOMB = Stribeck()
"""Of a friction that holds as much as it rubs."""


@dataclass(frozen=True)
class CornerLaws:
    """One suspension and its tire.

    damping_n_s_per_m       of the linear damper
    stiffness_n_per_m       of the linear spring
    damper                  the damper's force by its own rate: rate [m/s] -> force [N]; grows with the rate
    mount_n_per_m           stiffness of a mount in series with the damper; infinite: none
    mount_play_m            play in series with both, either way from rest; of a mount that is no spring it is not felt
    springs                 forces by travel beyond the linear spring: travel [m] -> force [N]
    dry_friction_n          Coulomb friction parallel to the damper: this force against any motion, up to it at rest
    friction_transition_mps this times tanh(rate / transition) instead, unless 0
    stribeck                and times this
    wheel_friction_n        Coulomb friction of the wheel against a guide that stands on the ground, as on a test rig
    body_friction_n         the same of the body's end of the suspension
    guide_transition_mps    as friction_transition_mps, of these two, as guide_stribeck is of stribeck
    others                  further forces: (travel, rate) -> force
    motions                 and by anything that moves
    tire_damping_n_s_per_m  of the tire
    tires                   forces by deflection beyond the linear tire: deflection [m] -> force [N]
    tire_pulls              whether the tire holds on to the road, as the linear model has it
    rear                    whether it is a corner of the rear axle, for laws that the two axles do not share
    """

    damping_n_s_per_m: float
    stiffness_n_per_m: float
    damper: Law
    mount_n_per_m: float = np.inf
    mount_play_m: float = 0.0
    springs: tuple[Law, ...] = ()
    dry_friction_n: float = 0.0
    friction_transition_mps: float = 0.0
    stribeck: Stribeck = COULOMB
    wheel_friction_n: float = 0.0
    body_friction_n: float = 0.0
    guide_transition_mps: float = 0.0
    guide_stribeck: Stribeck = COULOMB
    others: tuple[Law2, ...] = ()
    motions: tuple[MotionLaw, ...] = ()
    tire_damping_n_s_per_m: float = 0.0
    tires: tuple[Law, ...] = ()
    tire_pulls: bool = True
    rear: bool = False

    @property
    def rubs(self) -> bool:
        """Whether there is dry friction in it."""
        return self.dry_friction_n > 0 or self.wheel_friction_n > 0 or self.body_friction_n > 0

    def friction_n(self, rate_mps: Array) -> Array:
        """Dry friction (n,) of the suspension at these rates (n,) [N]."""
        transition = self.friction_transition_mps
        grown = np.tanh(rate_mps / transition) if transition > 0 else np.sign(rate_mps)
        return np.asarray(self.dry_friction_n * grown * self.stribeck.times(rate_mps))

    def by_rate_n(self, rate_mps: Array) -> Array:
        """Force (n,) of damper and friction at these rates (n,), at no travel [N]."""
        forces = (one(np.zeros_like(rate_mps), rate_mps) for one in self.others)
        return np.asarray(sum(forces, self.damper(rate_mps) + self.friction_n(rate_mps)))

    def by_travel_n(self, travel_m: Array) -> Array:
        """Force (n,) beyond the linear spring at these travels (n,), at no rate [N]."""
        still = np.zeros_like(travel_m)
        return np.asarray(sum((one(travel_m) for one in self.springs), still)
                          + sum((one(travel_m, still) for one in self.others), still))

    def with_spring(self, law: Law) -> CornerLaws:
        """With one more force by travel."""
        return replace(self, springs=(*self.springs, law))

    def with_damper(self, law: Law) -> CornerLaws:
        """With one more force of the damper by its own rate; a mount is in series with that, too."""
        damper = self.damper
        return replace(self, damper=lambda rate_mps: damper(rate_mps) + law(rate_mps))

    def with_force(self, law: Law2) -> CornerLaws:
        """With one more force by travel and rate."""
        return replace(self, others=(*self.others, law))

    def with_law(self, between: Between, force: Callable[[Any, Seen], Any], p: SimpleNamespace,
                 rates: Callable[[Any, Seen], tuple[Any, ...]] | None = None,
                 memory: tuple[float, ...] = ()) -> CornerLaws:
        """With one more force by all that moves; see ``MotionLaw``."""
        return replace(self, motions=(*self.motions, MotionLaw(between, force, p, rates, memory)))

    def with_tire(self, law: Law) -> CornerLaws:
        """With one more force by the tire's deflection."""
        return replace(self, tires=(*self.tires, law))


def linear(damping_n_s_per_m: float, rear: bool = False, stiffness_n_per_m: float = 0.0) -> CornerLaws:
    """The laws of the linear car, which its matrices hold already."""
    return CornerLaws(damping_n_s_per_m, stiffness_n_per_m, lambda rate: damping_n_s_per_m * rate, rear=rear)
