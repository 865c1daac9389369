"""On a test rig the wheel and the body go up and down along guides that stand on the ground, and rub on them.

While it slides the force against the wheel carrier is F sign(u'), with u' how fast it rises against the ground; while
it sticks, whatever keeps it stuck, up to F. It may grow with the speed as in ``dry_friction``.

A bench quarter car carries both plates, wheel and body, on rails of one kind, so both may rub: the wheel's guide by one
force, the body's, at the body's end of each suspension, by a second, which is 0 unless it is said. On a road nothing
holds a car against the ground: a search tries this effect on rigs alone, or where it is asked for by name.

A single mass has one guide, which stands on the ground while its base moves.
"""

from dataclasses import replace

from logger.vehicle.effect import (
    STATIC_RATIO,
    STRIBECK_VELOCITY,
    TRANSITION_VELOCITY,
    ForceEffect,
    Parameter,
    Scale,
    Sought,
    Values,
)
from logger.vehicle.laws import CornerLaws, Stribeck


class FrameFriction(ForceEffect):
    title = "on a rig: Coulomb friction of wheel and body against their guides"
    parameters: tuple[Parameter, ...] = (
        Parameter("friction_force_n", 20.0, 0.0, 2000.0, 0.0, Scale.LINEAR, (5.0, 20.0, 80.0),
                  "of each wheel carrier, or of a single mass, against its guide"),
        Parameter("body_friction_force_n", 10.0, 0.0, 2000.0, None, Scale.LINEAR, (0.0, 10.0),
                  "of the body against its guide, at each suspension", default=0.0),
        TRANSITION_VELOCITY, STATIC_RATIO, STRIBECK_VELOCITY,
    )
    against_ground = True
    source = "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083: friction in guides"
    signature = "small motions of wheel and body die away at once, even when the suspension does not move"
    shown_by = "shake the rig with small amplitudes, slowly, so that wheel and body hardly move"
    sought = Sought.ON_RIGS
    refinements = (STATIC_RATIO.name, STRIBECK_VELOCITY.name)
    also_by: tuple[str, ...] = ("body_friction_force_n",)

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        if p.friction_force_n == 0 and p.body_friction_force_n == 0:
            return laws
        return replace(laws, wheel_friction_n=laws.wheel_friction_n + p.friction_force_n,
                       body_friction_n=laws.body_friction_n + p.body_friction_force_n,
                       guide_transition_mps=p.transition_velocity_m_per_s,
                       guide_stribeck=Stribeck(p.static_to_sliding_ratio, p.stribeck_velocity_m_per_s))


class _MassFriction(FrameFriction):
    title = "on a rig: Coulomb friction of the mass against its guide"
    parameters = tuple(one for one in FrameFriction.parameters if not one.name.startswith("body"))
    signature = "small motions of the mass against the ground die away at once, even when its spring does not move"
    shown_by = "shake the rig with small amplitudes, slowly, so that the mass hardly moves"
    also_by = ()

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        return super().laws(Values(**{**vars(p), "friction_force_n": 0.0,
                                      "body_friction_force_n": p.friction_force_n}), laws)


EFFECT = FrameFriction()
EFFECT.variants = {"single_mass": _MassFriction()}
