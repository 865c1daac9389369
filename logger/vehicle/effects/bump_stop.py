"""Rubber stops end the travel of a suspension, in compression and, where there is one, in extension.

Beyond a clearance c of compression from rest a stop adds the force k (compression - c). One in extension has a
clearance of its own and the same stiffness k. A stop of two stages, a spring before a block of rubber, is s times as
stiff beyond r times the clearance.
"""

import numpy as np

from logger.vehicle.effect import AXLE, ForceEffect, Parameter, Scale, Values
from logger.vehicle.laws import CornerLaws


class BumpStop(ForceEffect):
    title = "a stiff stop at the end of the suspension's travel"
    parameters = (
        Parameter("clearance_m", 0.04, 0.001, 0.3, None, Scale.LINEAR, (0.01, 0.02, 0.03, 0.045, 0.06),
                  "compression from rest at which the stop is met"),
        Parameter("stop_stiffness_n_per_m", 1e5, 0.0, 2e6, 0.0, Scale.LINEAR, (1e5,), "of the stop alone"),
        Parameter("extension_clearance_m", 0.04, 0.001, 1.0, None, Scale.LINEAR, (1.0, 0.01, 0.02, 0.04, 0.06),
                  "extension from rest at which a stop is met; 1: at none", default=1.0),
        Parameter("second_clearance_ratio", 1.5, 1.0, 10.0, None, Scale.LOG, (1.5,),
                  "compression at which a second stage is met over clearance_m", default=1.5),
        Parameter("second_stiffness_ratio", 4.0, 0.1, 100.0, None, Scale.LOG, (1.0, 4.0),
                  "stiffness beyond the second stage over that before it", default=1.0),
        AXLE,
    )
    refinements = ("extension_clearance_m", "second_clearance_ratio", "second_stiffness_ratio")
    source = "J. Reimpell, H. Stoll, J. W. Betzler, The Automotive Chassis (2001), 5.3: additional springs"
    signature = "short hard impacts upward where the suspension is most compressed; elsewhere the model fits"
    shown_by = "drive over a large bump fast enough for the suspension to bottom out"

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        second_m, stiffer = p.second_clearance_ratio * p.clearance_m, p.second_stiffness_ratio - 1
        return laws.with_spring(lambda travel_m: p.stop_stiffness_n_per_m * (
            np.minimum(travel_m + p.clearance_m, 0.0) + stiffer * np.minimum(travel_m + second_m, 0.0)
            + np.maximum(travel_m - p.extension_clearance_m, 0.0)))


EFFECT = BumpStop()
