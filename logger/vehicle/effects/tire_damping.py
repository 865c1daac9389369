"""A tire is rubber, and rubber is no perfect spring: it also resists how fast it is pressed.

The force on the wheel is k d + c d', with d the tire's deflection. The linear models leave c
out (Eq 4.12 of Blum 2015).
"""

from dataclasses import replace

from logger.vehicle.effect import ForceEffect, Parameter, Scale, Values
from logger.vehicle.laws import CornerLaws


class TireDamping(ForceEffect):
    title = "viscous damping of the tires"
    parameters = (
        Parameter("tire_damping_n_s_per_m", 150.0, 0.0, 3000.0, 0.0, Scale.LINEAR, (60.0, 300.0),
                  "of each tire, beside its stiffness"),
    )
    needs_wheel = True
    source = "J. Y. Wong, Theory of Ground Vehicles (2008), chapter 7: tire damping 50 to several hundred N s/m"
    signature = "wheel hop is weaker than in the model and higher frequencies stronger; nothing changes below 5 Hz"
    shown_by = "drive a rough, patched road at 15 to 25 m/s, where the wheels hop"

    def laws(self, p: Values, laws: CornerLaws) -> CornerLaws:
        return replace(laws, tire_damping_n_s_per_m=laws.tire_damping_n_s_per_m + p.tire_damping_n_s_per_m)


EFFECT = TireDamping()
