"""A force in the suspensions by their rate: a damper that is no straight line.

A power of the rate, or a smooth curve through points, which may differ in bump and rebound. (Of a part alone on its
bench there is more to it: ``damper_as_a_whole``.)
"""

from logger.lab.laws.curves import RATE, CurveFamily


class ForceByRate(CurveFamily):
    title = "a force that depends on suspension rate"
    related_effects = ("damper_blow_off", "damper_asymmetry", "dry_friction")
    shown_by = "drive the same road slowly and fast, or a smooth and a rough one"
    motion = RATE
    force = "damper force"
    answers, tried = "suspension_damping_n_s_per_m", 1.0
    source = ("the resistance of orifices grows with the square of the oil's speed, that of valves less than in "
              "proportion (J. C. Dixon, The Shock Absorber Handbook, 2007, chapter 6)")
    signature = "the damping changes as the road gets rougher"
    usual_share, reach_share = 0.95, 0.9995
    powers, power_ends = (0.4, 2.0, 3.0), (0.1, 5.0)
    ends = ((-1, "at the fastest"),)


FAMILY = ForceByRate()
