"""Something pushes all the time: a weight on an axis that is not level, or the zero of the sensor of the force.

What moves without a spring drifts under it. A linear spring takes it up where it comes to rest, and nobody sees it; one
that is not linear works around another place then, and is stiffer one way than the other.
"""

from logger.vehicle.effect import ForceEffect, Parameter, Scale, Sought, Values
from logger.vehicle.laws import CornerLaws
from logger.vehicle.vehicle import Vehicle


class ConstantForce(ForceEffect):
    title = "a constant force, such as a weight or the zero offset of the load cell"
    parameters = (Parameter("push_n", 20.0, -1e4, 1e4, 0.0, Scale.LINEAR, (-20.0, 20.0), "up positive"),)
    source = "A. Janot, M. Gautier, M. Brunot, EMPS, Workshop on Nonlinear System Identification Benchmarks (2019)"
    signature = "a free mass drifts; on a nonlinear spring the motion differs between the two directions"
    shown_by = "push it back and forth over its whole travel, weakly and strongly"
    sought = Sought.ON_RIGS
    underlies = True

    def obstacle(self, vehicle: Vehicle, two_tracks: bool) -> str | None:
        return None if vehicle.model == "single_mass" else "springs take it up at rest"

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        return laws if p.push_n == 0 else laws.with_spring(lambda travel_m: 0.0 * travel_m - p.push_n)


EFFECT = ConstantForce()
