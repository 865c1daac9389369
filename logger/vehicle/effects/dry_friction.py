"""Bushings, seals and leaves rub: a force that opposes motion, whatever its speed, and holds the suspension at rest.

While the suspension slides the force is F sign(x'); while it sticks, whatever keeps it stuck, up to F. What rubs on
rubber gives way first: then the force is F tanh(x' / v), with v the rate at which it has nearly grown to F.
"""

from dataclasses import replace

from logger.vehicle.effect import (
    AXLE,
    STATIC_RATIO,
    STRIBECK_VELOCITY,
    TRANSITION_VELOCITY,
    ForceEffect,
    Parameter,
    Scale,
    Values,
)
from logger.vehicle.laws import CornerLaws, Stribeck


class DryFriction(ForceEffect):
    title = "Coulomb friction beside spring and damper"
    parameters = (
        Parameter("friction_force_n", 60.0, 0.0, 2000.0, 0.0, Scale.LINEAR, (20.0, 60.0, 180.0),
                  "of each suspension, or of the part"),
        TRANSITION_VELOCITY, STATIC_RATIO, STRIBECK_VELOCITY,
        AXLE,
    )
    source = "M. Mitschke, H. Wallentowitz, Dynamik der Kraftfahrzeuge (2014), chapter on suspension friction"
    signature = "on smooth stretches the springs lock and the body rides on its tires; rough ones change little"
    shown_by = "drive a smooth road slowly, so that the suspension hardly moves"

    refinements = (STATIC_RATIO.name, STRIBECK_VELOCITY.name)

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        if p.friction_force_n == 0:
            return laws
        return replace(laws, dry_friction_n=laws.dry_friction_n + p.friction_force_n,
                       friction_transition_mps=p.transition_velocity_m_per_s,
                       stribeck=Stribeck(p.static_to_sliding_ratio, p.stribeck_velocity_m_per_s))


EFFECT = DryFriction()
