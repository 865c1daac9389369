"""A spring that is a column of gas: an air bellows, an air mount, a gas strut, the gas under a damper's piston.

The pressure of a gas goes as its volume to the power of -n, n being 1 where it is squeezed slowly and 1.4 where it is
quick. So a column of length L whose stiffness at rest is k pushes back, at an extension x, with

    F = k L / n (1 - (1 + x / L)^-n)

more and more in compression, less and less in extension. A column is compressed to a twentieth at most.
"""

import numpy as np

from logger.arrays import Array
from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Sought, Values
from logger.vehicle.laws import CornerLaws

_SHORTEST = 0.05


class AirSpring(ForceEffect):
    title = "a spring of air or gas: stiffer in compression, softer in extension"
    parameters = (
        Parameter("column_length_m", 0.15, 0.005, 10.0, float("inf"), Scale.RECIPROCAL, (0.05, 0.15, 0.5),
                  "of the gas at rest: its volume over its area"),
        Parameter("polytropic_exponent", 1.0, 0.5, 3.0, None, Scale.LINEAR, (1.0,),
                  "1.3 unless said; 1: squeezed slowly; 1.4: so quickly that it keeps its heat", default=1.3),
        AXLE,
    )
    refinements = ("polytropic_exponent",)
    source = "G. Quaglia, M. Sorli, Vehicle System Dynamics 35 (2001) 443: air suspension, polytropic gas"
    signature = "the waves have sharper ends where the spring is short than where it is long"
    shown_by = "move it over much of its travel, slowly and fast"
    sought = Sought.ON_RIGS
    needs_spring = True

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        length_m, power, stiffness = p.column_length_m, p.polytropic_exponent, laws.stiffness_n_per_m
        if np.isinf(length_m):
            return laws

        def beyond_linear(travel_m: Array) -> Array:
            longer = np.log1p(np.maximum(travel_m / length_m, _SHORTEST - 1))
            return np.asarray(-stiffness * (length_m / power * np.expm1(-power * longer) + travel_m))

        return laws.with_spring(beyond_linear)


EFFECT = AirSpring()
