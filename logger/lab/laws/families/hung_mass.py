"""A mass on a spring: somewhere on the body (a trailer, an engine on its mounts, a load that swings), or at each wheel.

It is more than the model's masses, in a half car that of one side. At the centre of gravity it is ``occupant`` of the
list.
"""

from logger.lab.laws.draft import Draft, Family, FormatNumber, LawContext, rounded
from logger.vehicle.effect import Chosen, Parameter, Scale

_ON_BODY = """
def structure(self, p, structure):
    if p.mass_kg == 0:
        return structure
    mass, omega = structure.sides * p.mass_kg, 2 * np.pi * p.frequency_hz
    place = structure.body @ np.array([1.0, p.ahead_m, 0.0])
    return hung(structure, mass, mass * omega**2, 2 * p.damping_ratio * omega * mass, place)
"""
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
    title = "a mass on a spring on the body or the wheels"
    related_effects = ("occupant", "body_bending", "payload", "cg_shift")
    kind = "BodyEffect"
    source = "J. P. Den Hartog, Mechanical Vibrations (1956), chapter 3: a mass on a spring on a mass"
    signature = "near its own frequency, the part that carries it moves less than the model says; beside it, more"
    shown_by = "drive with it and without it, or put a second sensor where it hangs"

    def drafts(self, context: LawContext) -> list[Draft]:
        car = context.vehicle
        wheel_kg = car.front.unsprung_mass_kg
        at_wheels = self._draft("wheels", "a mass on a spring at each wheel", wheel_kg, "at each wheel",
                                (5.0, 8.0, 12.0, 18.0), (), _AT_WHEELS)
        if car.rear is None:
            return [at_wheels]  # a car that does not pitch has one place, and a mass there is on the list
        base_m = car.front.cg_distance_m + car.rear.cg_distance_m
        places = tuple(rounded(one) for one in (-car.rear.cg_distance_m - 0.3 * base_m, car.front.cg_distance_m))
        ahead = Parameter("ahead_m", places[0], rounded(-2 * base_m), rounded(2 * base_m), None, Scale.LINEAR, places,
                          "where it hangs, ahead of the centre of gravity", step=rounded(0.02 * base_m))
        return [self._draft("body", "a mass on a spring on the body", car.sprung_mass_kg, "in a half car on one side",
                            (1.5, 2.2, 3.2, 4.5, 7.0, 12.0), (ahead,), _ON_BODY), at_wheels]

    def _draft(self, variant: str, title: str, carrier_kg: float, where: str, trials_hz: tuple[float, ...],
               more: tuple[Parameter, ...], method: str) -> Draft:
        mass_kg = rounded(0.05 * carrier_kg)
        parameters = (
            Parameter("mass_kg", mass_kg, 0.0, rounded(carrier_kg), 0.0, Scale.LINEAR, (mass_kg,), where),
            Parameter("frequency_hz", trials_hz[len(trials_hz) // 2], 0.8, 30.0, None, Scale.LOG, trials_hz,
                      "of that mass on its spring"),
            Parameter("damping_ratio", 0.15, 0.005, 2.0, None, Scale.LOG, (0.15,), "of its spring"), *more)
        return self.draft(parameters, method, title=title, variant=variant)

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        said = (f"a mass of {say('mass_kg')} on a spring, {say('frequency_hz')} with a damping ratio of "
                f"{say('damping_ratio')}, ")
        if draft.variant == "wheels":
            return f"{said}at each wheel"
        way = "ahead of" if found.values["ahead_m"] > 0 else "behind"
        place = say("ahead_m", 1.0 if found.values["ahead_m"] > 0 else -1.0, "m").replace("± -", "± ")
        return f"{said}{place} {way} the centre of gravity"


FAMILY = HungMass()
