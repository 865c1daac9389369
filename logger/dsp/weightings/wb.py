"""Wb: vertical vibration in rail vehicles.

Source: ISO 2631-4:2001 Annex A; ISO 8041-1:2017. Its gain is not 1.
"""

from logger.dsp.weightings.weighting import Weighting

WEIGHTING = Weighting("wb",
    f1_hz=0.4, f2_hz=100.0,
    f3_hz=16.0, f4_hz=16.0, q4=0.55,
    f5_hz=2.5, q5=0.9, f6_hz=4.0, q6=0.95,
    gain=1.024,
    printed={15.915: 0.8126},  # ISO 8041-1 Table 1, at 100 rad/s
    comfort_words=True,
)
