"""We: rotation of a seat, about any axis.

Source: ISO 2631-1:1997 Tables 2, 4 and A.2; Table 2.8 of Blum (2015). Its input is an angular acceleration [rad/s2],
of which the words for comfort say nothing.
"""

from logger.dsp.weightings.weighting import Weighting

WEIGHTING = Weighting("we",
    f1_hz=0.4, f2_hz=100.0, f3_hz=1.0, f4_hz=1.0, q4=0.63,
    printed={0.5: 0.862, 1.0: 0.880, 80.0: 0.0105},
)
