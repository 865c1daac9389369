"""Rubber bushings and leaves give a little before they slide: the force depends on the way that they have come.

The force F z in each suspension has a memory z. With y the travel in which it would reach F at its first stiffness
F / y, and n the sharpness of the yield,

    z' = (x' / y) (1 - |z|^n (q - b + b sign(x' z)))

which is the law of Bouc and Wen with A = 1, beta = b and gamma = q - b. Where r is above 0, q is 1 and b is r / 2: it
yields, where it is let go its stiffness is r times its first one, and after a long way it is Coulomb friction. In its
plain form n and r are 1; with r = 2 it is the law of Dahl. Where r is below 0, q is 1 / r and b is 1 / 2: it hardens as
it is loaded, and at F is stiffer by its first stiffness where it is let go (J. P. Noel and M. Schoukens, Workshop on
Nonlinear System Identification Benchmarks, Brussels 2016). Any closed way takes energy, as beta is above 0.

What holds more at rest than it rubs slides at s F, with s of ``dry_friction`` and |z| / s in the place of |z|: with
n = 1 and r = 2 that is the friction of LuGre without its bristles' damping (C. Canudas de Wit and others, IEEE Trans.
Autom. Control 40, 1995). Without a yield travel it is ``dry_friction`` from the beginning: seals and bearings yield
within hundredths of a millimetre (B. Armstrong-Helouvry and others, Automatica 30, 1994).

A search tries it first of a part alone on its bench, as rubber does that; of a car, where it makes a search half as
long again, when all others leave something unexplained.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from logger.vehicle.effect import (
    AXLE,
    STATIC_RATIO,
    STRIBECK_VELOCITY,
    ForceEffect,
    Misalignment,
    Parameter,
    Scale,
    Sought,
    Values,
)
from logger.vehicle.laws import Between, CornerLaws, Seen

MOST = 10.0
"""A memory that yields gets far beyond 1 only by a step that is too long for a sharp yield over a short travel, and
what hardens is no more than so many times stiffer than at first (judgements)."""


def force(p: Any, seen: Seen) -> Any:
    """In the suspension [N]."""
    return p.yield_force_n * np.minimum(np.maximum(seen.memory[0], -MOST), MOST)


def rates(p: Any, seen: Seen) -> tuple[Any]:
    """How fast the memory grows [1/s]."""
    z, ratio = seen.memory[0], p.reversal_ratio
    loading, beta = (1.0, 0.5 * ratio) if ratio >= 0 else (1.0 / ratio, 0.5)
    more = (p.static_to_sliding_ratio - 1.0) * np.exp(-((seen.rate_mps / p.stribeck_velocity_m_per_s) ** 2))
    held = (np.abs(z) / (1.0 + more)) ** p.sharpness_ratio * (loading - beta + beta * np.sign(seen.rate_mps * z))
    return (seen.rate_mps / p.yield_travel_m * (1.0 - np.maximum(held, -MOST)),)


class Hysteresis(ForceEffect):
    title = "friction that yields before it slides (Bouc-Wen)"
    parameters = (
        Parameter("yield_force_n", 100.0, 0.0, 5000.0, 0.0, Scale.LINEAR, (30.0, 150.0),
                  "at which it slides"),
        Parameter("yield_travel_m", 0.002, 1e-5, 0.05, None, Scale.LOG, (0.0005, 0.004),
                  "over which the initial stiffness would reach that force"),
        Parameter("sharpness_ratio", 1.0, 0.2, 10.0, None, Scale.LOG, (0.5, 1.0, 2.0),
                  "exponent: the higher, the sharper the yield", default=1.0),
        Parameter("reversal_ratio", 1.0, -20.0, 4.0, None, Scale.LINEAR, (1.0, 2.0, -4.0),
                  "stiffness in unloading over the initial one; below 0: it hardens", default=1.0),
        replace(STATIC_RATIO, trials=(1.0, *STATIC_RATIO.trials)), STRIBECK_VELOCITY,
        AXLE,
    )
    source = ("R. Bouc, Proc. 4th Conf. on Nonlinear Oscillation, Prague (1967) 315; Y.-K. Wen, J. Eng. Mech. Div. "
              "ASCE 102 (1976) 249")
    signature = "small motions meet a stiffer spring, larger ones friction; each reversal begins stiff"
    shown_by = "drive a smooth road and a rough one slowly, so that the suspension moves by a few millimetres"
    sought = Sought.ON_PARTS
    sought_last = True
    refinements = ("sharpness_ratio", "reversal_ratio", STATIC_RATIO.name, STRIBECK_VELOCITY.name)

    def trials(self, seen: Misalignment | None = None) -> list[dict[str, float]]:
        """Rubber yields over a tenth of its travel, and hardens over all of it; what holds more at rest yields as LuGre
        has it."""
        return [{**one, "yield_force_n": 10 * one["yield_force_n"], "yield_travel_m": 10 * one["yield_travel_m"]}
                if one["reversal_ratio"] < 0 else one for one in super().trials(seen)
                if one[STATIC_RATIO.name] == 1 or (one["sharpness_ratio"], one["reversal_ratio"]) == (1, 2)]

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        if p.yield_force_n == 0:
            return laws
        return laws.with_law(Between.BODY_AND_WHEEL, force, p, rates, memory=(0.0,))


EFFECT = Hysteresis()
