"""On a test rig a second spring, a flexure, a rubber cord or a cable may hold the wheel or the body to the ground.

The force against each is k u, with u how far it has risen over the ground. A mass between two springs of which a shaker
moves one follows less than the whole of that motion. On a road nothing holds a car against the ground: a search tries
this effect on rigs alone, or where it is asked for by name.

A single mass has one such spring, which stands on the ground while its base moves.
"""

from dataclasses import replace

from logger.vehicle.effect import BodyEffect, Parameter, Scale, Sought, Values
from logger.vehicle.structure import Structure, held_to_ground


class FrameSpring(BodyEffect):
    title = "on a rig: springs that hold wheel and body to the ground"
    parameters: tuple[Parameter, ...] = (
        Parameter("body_stiffness_n_per_m", 1e4, 0.0, 1e6, 0.0, Scale.LINEAR, (2e3, 2e4),
                  "between the body, at each suspension, or a single mass, and the ground"),
        Parameter("wheel_stiffness_n_per_m", 0.0, 0.0, 1e6, None, Scale.LINEAR, (0.0, 2e4),
                  "between each wheel carrier and the ground", default=0.0),
    )
    against_ground = True
    source = "S. S. Rao, Mechanical Vibrations: motion of the support through one of several springs"
    signature = "below its natural frequency the body follows less than the whole motion of what moves it"
    shown_by = "move the base or the road slowly, far below the natural frequency, and then through it"
    sought = Sought.ON_RIGS
    also_by: tuple[str, ...] = ("wheel_stiffness_n_per_m",)

    def structure(self, p: Values, structure: Structure) -> Structure:
        return held_to_ground(structure, "stiffness", p.body_stiffness_n_per_m, p.wheel_stiffness_n_per_m)


class _MassSpring(FrameSpring):
    title = "on a rig: a spring that holds the mass to the ground"
    parameters = (replace(FrameSpring.parameters[0], meaning="between the mass and the ground"),)
    signature = "below its natural frequency the mass follows less than the whole motion of its base"
    shown_by = "move the base slowly, far below the natural frequency, and then through it"
    also_by = ()

    def structure(self, p: Values, structure: Structure) -> Structure:
        return held_to_ground(structure, "stiffness", p.body_stiffness_n_per_m)


EFFECT = FrameSpring()
EFFECT.variants = {"single_mass": _MassSpring()}
