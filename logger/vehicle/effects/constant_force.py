"""Something pushes all the time: a weight on an axis that is not level, or the zero of the sensor of the force.

A spring takes such a force up where it comes to rest, and nobody sees it. What moves without a spring drifts under it.
"""

from __future__ import annotations

from types import SimpleNamespace

from logger.vehicle.effect import ForceEffect, Parameter, Scale, Sought
from logger.vehicle.laws import CornerLaws
from logger.vehicle.vehicle import Vehicle


class ConstantForce(ForceEffect):
    name = "constant_force"
    title = "a constant force on a part that no spring holds"
    parameters = (
        Parameter("push_n", 20.0, -1e4, 1e4, 0.0, Scale.LINEAR, (-20.0, 20.0), "up positive"),
    )
    source = "A. Janot, M. Gautier, M. Brunot, EMPS, Workshop on Nonlinear System Identification Benchmarks (2019)"
    signature = "the motion drifts, in the same direction forth and back"
    shown_by = "push the axis forth and back over its whole travel"
    sought = Sought.ON_RIGS

    def obstacle(self, vehicle: Vehicle, two_tracks: bool) -> str | None:
        is_free = vehicle.model == "single_mass" and vehicle.front.suspension_stiffness_n_per_m == 0
        return None if is_free else "a spring takes it up at rest"

    def laws(self, p: SimpleNamespace, laws: CornerLaws) -> CornerLaws:
        return laws if p.push_n == 0 else laws.with_spring(lambda travel_m: 0.0 * travel_m - p.push_n)


EFFECT = ConstantForce()
