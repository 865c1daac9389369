"""Wj: vertical vibration under the head of a person who lies.

Source: ISO 2631-1:1997 Tables 2, 4 and A.2; Table 2.8 of Blum (2015). It has no transition.
"""

from logger.dsp.weightings.weighting import Weighting

WEIGHTING = Weighting("wj",
    f1_hz=0.4, f2_hz=100.0,
    f5_hz=3.75, q5=0.91, f6_hz=5.32, q6=0.91,
    printed={1.0: 0.484, 5.0: 0.793, 8.0: 1.017},
    comfort_words=True,
)
