"""A mass on a spring at each wheel: an absorber, a motor in the wheel. One on the body is ``occupant`` of the list.

It is more than the model's masses.
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_AT_WHEELS = """
def structure(self, p, structure):
    if p.mass_kg == 0:
        return structure
    omega = 2 * np.pi * p.frequency_hz
    stiffness, damping = p.mass_kg * omega**2, 2 * p.damping_ratio * omega * p.mass_kg
    for wheel in range(len(structure.wheels)):
        structure = hung(structure, p.mass_kg, stiffness, damping, structure.wheels[wheel])
    return structure
"""


class HungMass(Family):
    title = "a mass on a spring at each wheel"
    related_effects = ("occupant", "body_bending", "payload", "cg_shift")
    kind = "BodyEffect"
    source = "J. P. Den Hartog, Mechanical Vibrations (1956), chapter 3: a mass on a spring on a mass"
    signature = "near its own frequency, the wheel that carries it moves less than the model says; just beside it, more"
    shown_by = "drive with it and without it, or put a second sensor where it hangs"

    def drafts(self, context: LawContext) -> list[Draft]:
        wheel_kg = context.vehicle.front.unsprung_mass_kg
        mass_kg = rounded(0.05 * wheel_kg)
        return [self.draft((
            Parameter("mass_kg", mass_kg, 0.0, rounded(wheel_kg), 0.0, Scale.LINEAR, (mass_kg,), "at each wheel"),
            Parameter("frequency_hz", 12.0, 0.8, 30.0, None, Scale.LOG, (5.0, 8.0, 12.0, 18.0),
                      "of that mass on its spring"),
            Parameter("damping_ratio", 0.15, 0.005, 2.0, None, Scale.LOG, (0.15,), "of its spring")), _AT_WHEELS)]

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return (f"a mass of {say('mass_kg')} on a spring at each wheel, {say('frequency_hz')} with a damping ratio of "
                f"{say('damping_ratio')}")


FAMILY = HungMass()
