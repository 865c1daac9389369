"""A mass on a spring somewhere on the body: a trailer, an engine on its mounts, a load that swings.

It is more than the model's sprung mass, in a half car that of one side. At the centre of gravity it is ``occupant`` of
the list.
"""

from __future__ import annotations

from logger.lab.laws.draft import Draft
from logger.lab.laws.families.family import Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_SHARE, _MOST = 0.05, 1.0  # of the sprung mass: tried, and what may be
_METHOD = """
def structure(self, p, structure):
    if p.mass_kg == 0:
        return structure
    mass, omega = structure.sides * p.mass_kg, 2 * np.pi * p.frequency_hz
    place = structure.body @ np.array([1.0, p.ahead_m, 0.0])
    return hung(structure, mass, mass * omega**2, 2 * p.damping_ratio * omega * mass, place)
"""


class HungMass(Family):
    name = "hung_mass"
    title = "a mass on a spring on the body"
    related_effects = ("occupant", "body_bending", "payload", "cg_shift")
    shown_by = "drive with it and without it, or put a second sensor where it hangs"

    def drafts(self, context: LawContext) -> list[Draft]:
        car = context.vehicle
        if car.rear is None:
            return []  # a car that does not pitch has one place, and a mass there is on the list
        mass_kg = rounded(_SHARE * car.sprung_mass_kg)
        base_m = car.front.cg_distance_m + car.rear.cg_distance_m
        places = tuple(rounded(one) for one in (-car.rear.cg_distance_m - 0.3 * base_m, car.front.cg_distance_m))
        return [Draft(
            family=self.name, kind="BodyEffect", title=self.title, shown_by=self.shown_by,
            parameters=(
                Parameter("mass_kg", mass_kg, 0.0, rounded(_MOST * car.sprung_mass_kg), 0.0, Scale.LINEAR, (mass_kg,),
                          "in a half car on one side"),
                Parameter("frequency_hz", 3.0, 0.8, 30.0, None, Scale.LOG, (1.5, 2.2, 3.2, 4.5, 7.0, 12.0),
                          "of that mass on its spring"),
                Parameter("damping_ratio", 0.15, 0.005, 2.0, None, Scale.LOG, (0.15,), "of its spring"),
                Parameter("ahead_m", places[0], rounded(-2 * base_m), rounded(2 * base_m), None, Scale.LINEAR, places,
                          "where it hangs, ahead of the centre of gravity", step=rounded(0.02 * base_m))),
            source="J. P. Den Hartog, Mechanical Vibrations (1956), chapter 3: a mass on a spring on a mass",
            signature="around its own frequency the body moves less than the model says, and beside it more",
            imports=("from logger.vehicle.structure import hung",), method=_METHOD)]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        way = "ahead of" if found.values["ahead_m"] > 0 else "behind"
        place = say("ahead_m", 1.0 if found.values["ahead_m"] > 0 else -1.0, "m").replace("± -", "± ")
        return (f"a mass of {say('mass_kg')} on a spring, {say('frequency_hz')} with a damping ratio of "
                f"{say('damping_ratio')}, {place} {way} the centre of gravity")


FAMILY = HungMass()
