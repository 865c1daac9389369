"""Exact constants, the unit conversions of the edges, and a common road. Inside, everything is SI."""

STANDARD_GRAVITY_MPS2 = 9.80665
LBF_N = 0.45359237 * STANDARD_GRAVITY_MPS2
FOOT_M = 0.3048
MILE_M = 1609.344
KNOT_MPS = 1852.0 / 3600.0
KMH_MPS = 1.0 / 3.6
MPH_MPS = MILE_M / 3600.0
INCH_PER_MILE_M_PER_KM = 1000.0 * FOOT_M / 12 / MILE_M
WINDOW_M = 25 * FOOT_M
US_PER_S = 1_000_000
DAY_US = 86_400 * US_PER_S
COMMON_IRI, COMMON_SPEED_MPS = 2.5, 15.0
"""Road [m/km] and speed on which cars and laws are looked at where nothing is known of either."""
LENGTH_UNITS_M = {"m": 1.0, "km": 1000.0, "mi": MILE_M, "ft": FOOT_M}
"""Units that a length may be given in."""
