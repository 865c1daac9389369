"""Wf: slow vertical vibration that makes people motion sick.

Source: ISO 2631-1:1997 Tables 1, 3 and A.1; Table 2.7 of Blum (2015). The transition has no zero: f3 is infinite.
"""

from logger.dsp.weightings.weighting import Weighting

WEIGHTING = Weighting("wf",
    f1_hz=0.08, f2_hz=0.63,
    f4_hz=0.25, q4=0.86,
    f5_hz=0.0625, q5=0.80, f6_hz=0.1, q6=0.80,
    printed={0.1: 0.695, 0.16: 1.006, 0.5: 0.224},
    is_sickness=True, counts_up_to_hz=0.5,
)
