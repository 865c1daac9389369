"""Suspension springs harden with travel: a cubic term added to the linear rate, and maybe a quadratic one.

F = k x + k2 x^2 + k3 x^3, with x the travel from where the car rests. One that is stiffer to one side, as air springs,
cones, coils that touch and all springs under a load are, has k2, which is 0 unless it is said.
"""

from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Values
from logger.vehicle.laws import CornerLaws


class ProgressiveSpring(ForceEffect):
    title = "cubic hardening or softening of the suspension springs"
    parameters = (
        Parameter("cubic_stiffness_n_per_m3", 1e6, -2e7, 1e9, 0.0, Scale.LINEAR, (3e5, 3e6, 3e7),
                  "force per cube of the travel from rest, of each suspension"),
        Parameter("quadratic_stiffness_n_per_m2", 5e4, -5e5, 5e5, None, Scale.LINEAR, (-5e4, 5e4),
                  "force per square of the travel from rest: above 0 stiffer in extension", default=0.0),
        AXLE,
    )
    refinements = ("quadratic_stiffness_n_per_m2",)
    source = "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations (1979), 2.3 (the equation of Duffing)"
    signature = "the spring is stiffer at large travel: the body bounces faster on bumps than on a smooth road"
    shown_by = "drive slowly over large bumps or dips, so that the suspension travels several centimetres"

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        return laws.with_spring(lambda travel_m: travel_m * travel_m * (
            p.quadratic_stiffness_n_per_m2 + p.cubic_stiffness_n_per_m3 * travel_m))


EFFECT = ProgressiveSpring()
