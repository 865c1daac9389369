"""What a number out of a file can be, and how many numbers may be made of it: one place for every reader.

Problem: a file of a few lines can hold an acceleration of 1e-160 m/s2, whose square is 0, or a clock that steps by 1e-8
s, for which a filter of gigabytes would be made. Solution: each quantity has a largest size, beyond which it is refused
with its line, and a least one, far below what any instrument resolves, under which it is 0; and who makes as many
numbers as a file's lengths and rates ask for counts them first.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array
from logger.errors import BadInput

SURE_SIGMA, UNUSUAL_SIGMA, CONFLICT_SIGMA = 2.0, 3.0, 4.0
"""Standard deviations that a number is off by chance once in 22 times, 370 and 16,000 (normal distribution): beyond the
first it surely differs; beyond the second it is unusual, of a dozen right numbers one in thirty comparisons; beyond the
third it is in conflict with what was known of it."""
FALSE_SHARE = 0.05
"""Of what is said to have changed, the share that has not."""
MOST_SAMPLES = 10_000_000
"""28 hours at 100 Hz, 500 km of road at 0.05 m: 80 MB a column, so that a desk command stays below half a gigabyte."""
MOVING_MPS = 3.0
"""A car that is faster drives, whatever its receiver errs by."""
BACK_M = 1.0
"""A distance may go back so far, as one that is corrected by GPS does."""
DISCREPANCY = 0.003
"""Share of the signal in a band by which two right simulations of one car may differ. They differ most where a car has
dry friction, whose force is delayed by part of a step. A judgement: with 1 %, searches called right models unexplained.
"""
FASTEST_HZ = 1e6
"""No accelerometer is read faster."""
QUIETEST_MPS2 = 1e-6
"""No accelerometer has less noise: a ten-millionth of g. What moves less does not move."""
EVEN_SAMPLES = 1e-3
"""A time, or a place, within so many samples of one is at that sample: rates are read off times that were rounded."""
LONGEST_HOLE_S = 0.5
"""Over a shorter hole readings lie on a straight line, on which filters run on."""
ROUNDING_STEPS = 0.2
"""How far a time may be from an even grid, as digits are rounded: such a share of a step."""


@dataclass(frozen=True)
class Quantity:
    """A measured quantity: its unit, its largest size, and the size below which it is 0."""

    unit: str
    largest: float
    least: float

    def taken(self, name: str, values: Array, place: Callable[[int], str]) -> Array:
        """The values (n,) of a column as they count.

        place    of the row with this number, as complaints begin: "file:line"

        Raises BadInput for one that is larger than anything that is measured.
        """
        size = np.abs(values)
        if (wild := ~(size <= self.largest)).any():
            row = int(np.argmax(wild))
            within = f"{self.largest:g} {self.unit}".replace("e+0", "e").rstrip()
            raise BadInput(f"{place(row)}: expected {name} within {within}, found {values[row]:g}")
        return np.where(size < self.least, 0.0, values)


TIME = Quantity("s", 1e10, 1e-12)
"""Seconds since 1970, and more."""
ACCELERATION = Quantity("m/s2", 1e6, 1e-9)
"""A larger one is something else, and its fourth power may not be a number. A smaller one is about as much as the
quietest ground moves (J. Peterson, USGS 93-322, 1993: 6e-10 m/s2 per root hertz and more)."""
SPEED = Quantity("m/s", 150.0, 1e-9)
FORCE = Quantity("N", 1e9, 1e-12)
DISTANCE = Quantity("m", 1e9, 1e-9)
ELEVATION = Quantity("m", 1e4, 1e-12)
DELAY = Quantity("s", 1000.0, 1e-6)
"""Of a receiver or a recorder against another."""
SCALE = Quantity("", 1000.0, 0.001)
"""Of one signal over another: a unit that was mistaken is a thousand."""
LATITUDE, LONGITUDE = Quantity("degrees", 90.0, 0.0), Quantity("degrees", 360.0, 0.0)
SIGNAL = Quantity("", 1e12, 1e-30)
"""Of any sensor, in any unit: beyond, squares lose their digits, or are lost."""


def time_hint(rate_hz: float) -> str:
    """What a record with too few samples a second may have instead of seconds; else nothing."""
    likely = [unit for unit, steps in (("ms", 1e3), ("us", 1e6), ("ns", 1e9)) if 10 <= rate_hz * steps <= 1e4]
    return f" (t_s in {likely[0]}? Write seconds)" if likely and rate_hz < 1 else ""


def samples_between(span: float, step: float, words: str) -> int:
    """How many steps a span has, where so many numbers are to be made. Raises BadInput, which begins with ``words``,
    for more than ``MOST_SAMPLES``."""
    if not span <= MOST_SAMPLES * step:
        raise BadInput(f"{words}: expected at most {MOST_SAMPLES} samples, found {span:.4g} in steps of {step:.4g}")
    return int(span / step)
