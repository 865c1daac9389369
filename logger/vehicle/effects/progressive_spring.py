"""Suspension springs harden with travel: a cubic term added to the linear rate, and maybe a quadratic one.

F = k x + k2 x^2 + k3 x^3, with x the travel from where the car rests. One that is stiffer to one side, as air springs,
cones, coils that touch and all springs under a load are, has k2, which is 0 unless it is said. Where springs that lie
across the travel, a distance h long, harden it as they incline, the cubic term levels off: with q = 1 + x^2 / h^2 it is
2 k3 x^3 / (q + sqrt(q)), which is what Pythagoras gives.
"""

import numpy as np

from logger.arrays import Array
from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Values
from logger.vehicle.laws import CornerLaws


class ProgressiveSpring(ForceEffect):
    title = "cubic hardening or softening of the springs"
    parameters = (
        Parameter("cubic_stiffness_n_per_m3", 1e6, -2e7, 1e9, 0.0, Scale.LINEAR, (3e5, 3e6, 3e7),
                  "force per cube of the travel from rest, of each suspension"),
        Parameter("quadratic_stiffness_n_per_m2", 5e4, -5e5, 5e5, None, Scale.LINEAR, (-5e4, 5e4),
                  "force per square of the travel from rest: above 0 stiffer in extension", default=0.0),
        Parameter("levelling_per_m2", 30.0, 0.0, 1e5, None, Scale.LINEAR, (30.0,),
                  "1 / h^2 of springs that lie across the travel and are h long; beyond h the cubic term levels off",
                  default=0.0),
        AXLE,
    )
    refinements = ("quadratic_stiffness_n_per_m2", "levelling_per_m2")
    terms = ("quadratic_stiffness_n_per_m2",)
    source = "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations (1979), 2.3 (the equation of Duffing)"
    signature = "the spring is stiffer at large travel: the body bounces faster on bumps than on a smooth road"
    shown_by = "drive slowly over large bumps or dips, so that the suspension travels several centimetres"

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        def force_n(travel_m: Array) -> Array:
            square = travel_m * travel_m
            beyond = 1 + p.levelling_per_m2 * square
            return square * (p.quadratic_stiffness_n_per_m2
                             + 2 * p.cubic_stiffness_n_per_m3 * travel_m / (beyond + np.sqrt(beyond)))

        return laws.with_spring(force_n)


EFFECT = ProgressiveSpring()
