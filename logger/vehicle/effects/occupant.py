"""People ride on seats: a mass on a spring and damper on the body, at its centre of gravity unless given a place.

The mass is more than what the model's sprung mass says, in a half car that of one side, as all its masses are;
frequency and damping ratio are those of the seat with it. An engine on its mounts or a trailer is the same elsewhere.
On a rig it is whatever swings there: a part of it that gives has a second mode, which is that of a mass on a spring.
"""

import numpy as np

from logger.arrays import Array
from logger.vehicle.effect import BodyEffect, Misalignment, Parameter, Scale, Values, resonances_hz
from logger.vehicle.structure import Structure, hung

_LIGHTLY_DAMPED = 0.05
"""As rubber under a machine or a clamped beam is (C. M. Harris, A. G. Piersol, Shock and Vibration Handbook, 2002)."""


class _AtCentre(BodyEffect):
    title = "a mass on a spring on the body, such as passengers on their seats"
    parameters: tuple[Parameter, ...] = (
        Parameter("mass_kg", 70.0, 0.0, 1000.0, 0.0, Scale.LINEAR, (60.0,),
                  "on the spring; in a half car on one side"),
        Parameter("frequency_hz", 4.0, 0.8, 15.0, None, Scale.LOG, (2.5, 4.0, 6.0, 12.0),
                  "of that mass on its spring"),
        Parameter("damping_ratio", 0.3, 0.003, 1.5, None, Scale.LOG, (0.25,), "of that spring"),
    )
    source = "M. J. Griffin, Handbook of Human Vibration (1990), chapter 9: seated people resonate at 4 to 6 Hz"
    signature = "at 3 to 6 Hz the body moves less than the model says, and a little more below"
    shown_by = "drive with and without the people, or on a road that excites 2 to 8 Hz"

    def structure(self, p: Values, structure: Structure) -> Structure:
        if p.mass_kg == 0:
            return structure
        mass, omega = structure.sides * p.mass_kg, 2 * np.pi * p.frequency_hz
        return hung(structure, mass, mass * omega**2, 2 * p.damping_ratio * omega * mass, self.attached(p, structure))

    def attached(self, p: Values, structure: Structure) -> Array:
        """The end of its spring moves as this (n,) times the structure's coordinates."""
        return structure.body[:, 0]


class Occupant(_AtCentre):
    parameters = (*_AtCentre.parameters, Parameter(
        "ahead_m", 0.5, -5.0, 5.0, None, Scale.LINEAR, (-2.0, -0.5, 0.5, 1.5),
        "where it stands, ahead of the centre of gravity", default=0.0))
    refinements = ("ahead_m",)

    def attached(self, p: Values, structure: Structure) -> Array:
        return np.asarray(structure.body @ np.array([1.0, p.ahead_m, 0.0]))


class _OnMass(_AtCentre):
    def trials(self, seen: Misalignment | None = None) -> list[dict[str, float]]:
        """As steel and rubber damp too, and frequencies as near to each other as what swings there resonates."""
        mass, frequency, damping = self.parameters
        return [{"mass_kg": mass.trials[0], "frequency_hz": frequency_hz, "damping_ratio": ratio}
                for ratio in (*damping.trials, _LIGHTLY_DAMPED)
                for frequency_hz in resonances_hz(frequency.low, frequency.high, ratio)[:-1]]


EFFECT = Occupant()
EFFECT.variants = {"quarter_car": _AtCentre(), "component": _AtCentre(), "single_mass": _OnMass()}
