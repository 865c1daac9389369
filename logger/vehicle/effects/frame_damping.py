"""On a test rig the wheel and the body go along guides that stand on the ground, whose grease and air drag on them.

The force against each is c u', with u' how fast it rises against the ground. On a road nothing holds a car against the
ground: a search tries this effect on rigs alone, or where it is asked for by name.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

from logger.vehicle.effect import BodyEffect, Parameter, Scale, Sought
from logger.vehicle.structure import Structure


class FrameDamping(BodyEffect):
    name = "frame_damping"
    title = "on a rig: viscous drag of wheel and body against their guides"
    parameters = (
        Parameter("wheel_damping_n_s_per_m", 30.0, 0.0, 1e4, 0.0, Scale.LINEAR, (10.0, 60.0),
                  "of each wheel carrier against its guide"),
        Parameter("body_damping_n_s_per_m", 0.0, 0.0, 1e4, None, Scale.LINEAR, (0.0, 30.0),
                  "of the body against its guide, at each suspension", default=0.0),
    )
    needs_wheel = True
    source = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083: drag of guides"
    signature = "wheel hop or bounce die away faster than the damper between wheel and body allows"
    shown_by = "shake the rig through bounce and wheel hop, strongly enough that nothing sticks"
    sought = Sought.ON_RIGS
    also_by = ("body_damping_n_s_per_m",)

    def structure(self, p: SimpleNamespace, structure: Structure) -> Structure:
        wheels, ends = structure.wheels, structure.travel + structure.wheels
        drag = p.wheel_damping_n_s_per_m * wheels.T @ wheels + p.body_damping_n_s_per_m * ends.T @ ends
        return replace(structure, damping=structure.damping + drag)


EFFECT = FrameDamping()
