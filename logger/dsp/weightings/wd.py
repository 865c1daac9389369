"""Wd: horizontal vibration of people who sit, stand or lie.

Source: ISO 2631-1:1997 Tables 1, 3 and A.1; Table 2.7 of Blum (2015).
"""

from logger.dsp.weightings.weighting import Weighting

WEIGHTING = Weighting("wd",
    f1_hz=0.4, f2_hz=100.0, f3_hz=2.0, f4_hz=2.0, q4=0.63,
    printed={0.5: 0.853, 2.0: 0.890, 31.5: 0.0632},
    comfort_words=True, health_factor=1.4,
)
