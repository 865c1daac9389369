"""Wc: fore-and-aft vibration of a seat's back.

Source: ISO 2631-1:1997 Tables 2, 4 and A.2; Table 2.8 of Blum (2015).
"""

from logger.dsp.weightings.weighting import Weighting

WEIGHTING = Weighting("wc",
    f1_hz=0.4, f2_hz=100.0, f3_hz=8.0, f4_hz=8.0, q4=0.63,
    printed={1.0: 0.991, 8.0: 0.891, 80.0: 0.0844},
    comfort_words=True,
)
