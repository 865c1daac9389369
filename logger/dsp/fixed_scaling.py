"""Integers for a cascade of second-order sections, chosen so that nothing in it can overflow, whatever comes in.

Problem: with a word length given, too fine a scale overflows and too coarse a scale drowns the signal in rounding; and
a gain in the frequency domain says nothing about the peaks of a signal that nobody has seen yet.

Solution: the largest value a node can take for inputs within +-X is X times the sum of |h|, h its impulse response
(the L1 norm; the input whose signs are those of h, backwards, reaches it). Rounding adds sums of its own: half a step
at every section's output, half a step of 2^-30 in its recursion. So every node has a bound that no input can pass,
and each section's output gets the finest scale at which

- its bound fits the data word,
- the sum of the absolute values of all products fits 63 bits, so that the order of additions does not matter,
- its numerator fits 32 bits.

All responses are those of the rounded coefficients, followed until the slowest pole has decayed to 1e-15; a millionth
is added for what comes after and for the rounding of these floating-point sums.

The coefficients lie in +-2 and carry 30 binary places. Poles close to 1 are the sensitive ones: a Golden Car sampled
finer than about 5 mm would come out less than 90 dB above its error, and is refused.

Source: L. B. Jackson, On the interaction of roundoff noise and dynamic range in digital filters, Bell System
Technical Journal 49(2), 1970.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from logger.dsp.fixed_order import is_blind, quiet
from logger.dsp.sections import BlockFilter, Floats, SectionRows

FRACTION_BITS = 30
UNIT = 1 << FRACTION_BITS
HALF = UNIT // 2
LARGEST_COEFFICIENT = (1 << 31) - 1
LARGEST_SUM = (1 << 63) - 1
DATA_BITS = (16, 32)
COARSEST_COEFFICIENTS_DB = -90.0

_FORGOTTEN = 1e-15
_SHORTEST = 64
_SLOWEST = 1.0 - 1e-5
_MARGIN = 1.000001
_SPARE = 0.999  # of the scale, for the rounding of the numerator

# A disturbance: its largest value, and the impulse response (n,) from where it enters to the node looked at.
_Path = tuple[float, Floats]


@dataclass(frozen=True)
class FixedSection:
    """One section in integers, and what it can reach.

    b, a              b0, b1, b2 and a1, a2, each times 2^30
    largest_output    no output is larger than this [steps of the section's output]
    largest_sum       nor is the sum of the absolute values of all terms of one sample [2^-30 of such a step]
    """

    b: tuple[int, int, int]
    a: tuple[int, int]
    largest_output: int
    largest_sum: int


@dataclass(frozen=True)
class FixedCascade:
    """A cascade in integers.

    data_bits                32 or 16: the word that inputs and outputs of sections fit
    input_step, output_step  physical value of one count [unit of the input, of the output]
    coefficient_error_db     energy of what the rounding of coefficients changes in the impulse response, over its own
    """

    sections: tuple[FixedSection, ...]
    data_bits: int
    input_step: float
    output_step: float
    coefficient_error_db: float

    @property
    def largest_input(self) -> int:
        """The count of full scale; inputs beyond it have to be clipped."""
        return largest_word(self.data_bits)


def largest_word(data_bits: int) -> int:
    """The largest value of a signed word; its negative is the smallest one used."""
    return (1 << (data_bits - 1)) - 1


def fixed_cascade(sos: SectionRows, full_scale: float, data_bits: int = 32) -> FixedCascade:
    """The integers of ``sos``, (n, 6) rows b0, b1, b2, a0, a1, a2, for inputs up to +-``full_scale`` [their unit].

    The sections come out in another pairing and order (``logger.dsp.fixed_order``). Raises ValueError for sections that
    are unstable, that no 32-bit coefficient can hold, or whose response is off by more than -90 dB when they are
    rounded; for another word length than 16 or 32, or a full scale not above 0.
    """
    if data_bits not in DATA_BITS or not 0 < full_scale < math.inf:
        raise ValueError(f"expected 16 or 32 data bits and a full scale above 0, not {data_bits} and {full_scale}")
    exact = BlockFilter(sos)  # refuses what is no cascade
    rows = np.asarray(sos, dtype=np.float64)
    rows = rows / rows[:, 3:4]
    impulse = _impulse(_samples_until_forgotten(rows))
    paths: list[_Path] = [(float(largest_word(data_bits)), impulse)]
    sections, total_gain = [], 1.0
    for row in quiet(rows, impulse):
        gain, section, paths = _fitted(row, paths, data_bits)
        sections.append(section)
        total_gain *= gain
    wanted = exact.process(impulse)
    error_db = _energy_db(paths[0][1] / total_gain - wanted) - _energy_db(wanted)
    if error_db > COARSEST_COEFFICIENTS_DB:
        raise ValueError(f"expected sections that 32-bit coefficients can hold; rounded, their response is off by "
                         f"{error_db:.0f} dB. A lower sampling rate (a wider spacing) moves the poles away from 1")
    input_step = full_scale / largest_word(data_bits)
    return FixedCascade(tuple(sections), data_bits, float(input_step), float(input_step / total_gain), float(error_db))


def _samples_until_forgotten(rows: Floats) -> int:
    slowest = max(np.abs(np.roots(row[3:])).max(initial=0.0) for row in rows)
    if slowest > _SLOWEST:
        raise ValueError(f"expected stable sections with poles within {_SLOWEST}, found one at {slowest:.9g}")
    return _SHORTEST + math.ceil(math.log(_FORGOTTEN) / math.log(max(slowest, _FORGOTTEN)))


def _impulse(samples: int) -> Floats:
    impulse = np.zeros(samples)
    impulse[0] = 1.0
    return impulse


def _fitted(row: Floats, paths: list[_Path], data_bits: int) -> tuple[float, FixedSection, list[_Path]]:
    """One section at the finest scale that fits: the gain that takes it there, its integers, the paths to its output.

    What the input makes of the output and of the sum is proportional to the gain, so the gain follows at once.
    """
    a = _denominator(row[4:])
    recursion = sum(map(abs, a))
    rounding = _rounding(a, len(paths[0][1]))
    carry = (recursion + 1) * HALF // UNIT + HALF + 1
    largest_b, total_b = np.abs(row[:3]).max() * UNIT, np.abs(row[:3]).sum() * UNIT
    reach = _bound([(largest, _response(row[:3] * UNIT, a, response)) for largest, response in paths])
    room = largest_word(data_bits) - _bound(rounding)
    sum_room = LARGEST_SUM - carry - _bound(rounding) * recursion
    gain = _SPARE * min(
        room / reach,
        sum_room / (_bound(paths) * total_b + reach * recursion),
        LARGEST_COEFFICIENT / largest_b,
    )
    b = _numerator(row[:3] * gain)
    reached = [(largest, _response(b, a, response)) for largest, response in paths] + rounding
    largest_output = math.ceil(_bound(reached))
    largest_sum = math.ceil(_bound(paths)) * sum(map(abs, b)) + largest_output * recursion + carry
    if max(map(abs, b)) > LARGEST_COEFFICIENT or largest_output > largest_word(data_bits) or largest_sum > LARGEST_SUM:
        raise ValueError(f"expected a section that a scale fits, not b, a1, a2 = {b}, {a} / 2^30")
    return gain, FixedSection(b, a, largest_output, largest_sum), reached


def _numerator(b: Floats) -> tuple[int, int, int]:
    """b0, b1, b2 as integers. What is blind to a steady input stays so exactly: then b1 makes the sum 0."""
    b0, b1, b2 = (round(value * UNIT) for value in b.tolist())
    if is_blind(b):
        b1 = -b0 - b2
    return b0, b1, b2


def _denominator(a: Floats) -> tuple[int, int]:
    """a1, a2 as integers, still stable (the triangle |a1| < 1 + a2, a2 < 1)."""
    a1, a2 = (round(value * UNIT) for value in a.tolist())
    if not (a2 < UNIT and abs(a1) < UNIT + a2 and abs(a1) <= LARGEST_COEFFICIENT):
        raise ValueError(f"expected a section that is stable with 32-bit coefficients, not a1, a2 = {a.tolist()}")
    return a1, a2


def _rounding(a: tuple[int, int], samples: int) -> list[_Path]:
    """What a section's own rounding does to its output: half a step at once, and 2^-31 of a step in its recursion.

    Raises ValueError if the latter alone could keep the output away from 0 without an input.
    """
    impulse = _impulse(samples)
    recursion = (0.5 / UNIT, _response((UNIT, 0, 0), a, impulse))
    if _bound([recursion]) >= 0.5:
        raise ValueError(f"expected a section that falls silent in 32-bit coefficients, not a1, a2 = {a} / 2^30")
    return [recursion, (0.5, impulse)]


def _response(b: Iterable[float], a: tuple[int, int], x: Floats) -> Floats:
    """What a section of coefficients times 2^30 makes of x."""
    return BlockFilter([[*b, UNIT, *a]]).process(x)


def _bound(paths: list[_Path]) -> float:
    """Upper bound of a node: every disturbance at its largest, with the worst signs."""
    return _MARGIN * sum(largest * float(np.abs(response).sum()) for largest, response in paths)


def _energy_db(response: Floats) -> float:
    return 10.0 * math.log10(max(float(np.sum(response**2)), 1e-300))
