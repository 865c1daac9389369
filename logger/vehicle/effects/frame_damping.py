"""On a test rig the wheel and the body go along guides that stand on the ground, whose grease and air drag on them.

The force against each is c u', with u' how fast it rises against the ground. On a road nothing holds a car against the
ground: a search tries this effect on rigs alone, or where it is asked for by name.

A single mass has one guide, which stands on the ground while its base moves.
"""

from dataclasses import replace

from logger.vehicle.effect import BodyEffect, Parameter, Scale, Sought, Values
from logger.vehicle.structure import Structure, held_to_ground


class FrameDamping(BodyEffect):
    title = "on a rig: viscous drag of wheel and body against their guides"
    parameters: tuple[Parameter, ...] = (
        Parameter("wheel_damping_n_s_per_m", 30.0, 0.0, 1e4, 0.0, Scale.LINEAR, (10.0, 60.0),
                  "of each wheel carrier against its guide"),
        Parameter("body_damping_n_s_per_m", 0.0, 0.0, 1e4, None, Scale.LINEAR, (0.0, 30.0),
                  "of the body against its guide, at each suspension, or of a single mass", default=0.0),
    )
    against_ground = True
    source = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083: drag of guides"
    signature = "wheel hop or bounce die away faster than the damper between wheel and body allows"
    shown_by = "shake the rig through bounce and wheel hop, strongly enough that nothing sticks"
    sought = Sought.ON_RIGS
    also_by: tuple[str, ...] = ("body_damping_n_s_per_m",)

    def structure(self, p: Values, structure: Structure) -> Structure:
        return held_to_ground(structure, "damping", p.body_damping_n_s_per_m, p.wheel_damping_n_s_per_m)


class _MassDamping(FrameDamping):
    title = "on a rig: viscous drag of the mass against its guide"
    parameters = (replace(FrameDamping.parameters[0], name="body_damping_n_s_per_m",
                          meaning="of the mass against its guide"),)
    signature = "the mass is damped against the ground, beyond what the damper to its base does"
    shown_by = "shake the base slowly and quickly: drag on the ground resists it even below the natural frequency"
    also_by = ()

    def structure(self, p: Values, structure: Structure) -> Structure:
        return held_to_ground(structure, "damping", p.body_damping_n_s_per_m)


EFFECT = FrameDamping()
EFFECT.variants = {"single_mass": _MassDamping()}
