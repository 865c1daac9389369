"""A force of the tires by their deflection: a tire that is no straight spring.

A power of the deflection, or a smooth curve through points, which may differ where the tire is pressed and where it is
let go.
"""

from logger.lab.laws.curves import DEFLECTION, CurveFamily
from logger.lab.laws.draft import Draft, LawContext
from logger.vehicle.vehicle import OWN_NAMES


class TireForce(CurveFamily):
    title = "a force that depends on tire deflection"
    related_effects = ("bump_stop", "progressive_spring", "wheel_lift")
    shown_by = "drive a rough road, or over obstacles, fast, so that the tires deflect far"
    motion = DEFLECTION
    force = "tire force"
    answers = "tire_stiffness_n_per_m"
    source = "H. B. Pacejka, Tire and Vehicle Dynamics (2012), chapter 9: stiffness grows with the load"
    signature = "wheels hop at a different frequency where the road is rough"
    ends = ((0, "where it is pressed most"), (-1, "where it is let go"))

    def drafts(self, context: LawContext) -> list[Draft]:
        return [] if context.vehicle.model in OWN_NAMES else super().drafts(context)  # these have no tire


FAMILY = TireForce()
