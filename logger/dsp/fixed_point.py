"""Filters in integers, as on a controller: the order of their sections, their scales, and their run.

Which zeros go with which poles, and in which order, so that rounding between sections does the least harm.

Problem: the same filter can be cut into sections in many ways. Where a section has a high peak, its output needs a
coarse scale; where a low gain follows a high one, fine steps are thrown away. In 16 bits it decides between a
usable filter and none: as the sections of Wk at 100 Hz are stored, they would be 15 dB worse.

Solution, in two steps that each take a moment:

1. Two pairings are tried: that of the sections as they come, and one in which the poles nearest to the unit circle
   choose first, each taking the zeros with which the section's gain is flattest over frequency. (For Wk the latter is
   the best of all 5040.)
2. The order with the least noise is found exactly. The scale after some sections depends only on which they are, and
   so does what the others make of the rounding there; so the best order is the shortest way through the subsets.

Sections that are blind to a steady input stand first, though last would be 1.5 dB better: all others then see nothing
of gravity, and a car at rest gives zeros.

Source: A. V. Oppenheim and R. W. Schafer, Discrete-Time Signal Processing, 6.9.3 (pairing and ordering).

Integers for a cascade of second-order sections, chosen so that nothing in it can overflow, whatever comes in.

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

Second-order sections in integer arithmetic, bit for bit the same in Python and in C.

Problem: a small controller has no floating point. In plain integer sections the rounding goes round with the
recursion: poles close to 1 multiply it by thousands, and on silence it never dies (limit cycles).

Solution: direct form I, whose only inner nodes are the outputs of its sections, so that scaling can be proved
(``logger.dsp.fixed_point``); and the remainder of every rounding is fed back through the section's own denominator.
The recursion then runs on y + e / 2^30, a double word. Its rounding error is 2^-30 of a step, and what leaves a
section carries one single rounding of half a step that does not go round. With no input the double word decays to
less than half a step (checked when the integers are made), which is an output of exactly 0. A numerator that is
blind to a steady input stays so exactly.

The specification. Words: x, y have 32 (or 16) bits; coefficients b, a and remainders e 32; products and sums 64. All
divisions round down (floor), also below 0; 2^30 is the unit of the coefficients.

Input: x = value / input_step, rounded to the nearest integer (halves to even), clipped to +-(2^31 - 1) (or 2^15 - 1).
For every sample, one section after the other, the output of one being the input of the next:

    1.  carry = (2^29 - a1 e1 - a2 e2) / 2^30
    2.  w     = b0 x + b1 x1 + b2 x2 - a1 y1 - a2 y2 + carry
    3.  y     = (w + 2^29) / 2^30
    4.  e     = w - 2^30 y, so that -2^29 <= e < 2^29
    5.  x2 = x1, x1 = x, y2 = y1, y1 = y, e2 = e1, e1 = e

Output: value = y * output_step. No sum overflows, in any order of the additions, for any input within the clip.

Reset to a value, as if it had come in for ever: x as above; then per section, with B = b0 + b1 + b2 and
A = 2^30 + a1 + a2,

    1.  y  = (B x + A / 2) / A
    2.  e  = 2^30 (B x - A y) / A
    3.  x1 = x2 = x, y1 = y2 = y, e1 = e2 = e; the next section's x is y

Below, w stands for the pair y, e: steps 1 and 2 are (2^29 - a1 w1 - a2 w2) / 2^30 on whole numbers without limit. The
rounding makes every step depend on the last one, so this is a loop over samples; it takes about half a microsecond
for a sample and section.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from logger.arrays import ROUNDING, Array, Whole
from logger.dsp.filters import BlockFilter, SectionRows
from logger.units import STANDARD_GRAVITY_MPS2

_POINTS = 256
_FLOOR = 1e-2
_LONGEST = 1 << 14  # of responses for a choice; bounds are not taken from them


def is_blind(b: Array) -> bool:
    """Whether a numerator b0, b1, b2 lets nothing of a steady input through."""
    return bool(abs(b.sum()) < ROUNDING * np.abs(b).sum())


def quiet(rows: Array, impulse: Array) -> Array:
    """The same cascade, (n, 6) rows with a0 = 1, in the pairing and order for integers; gains stay with the zeros.

    impulse    (m,) 1 and then zeros, long enough for the cascade to decay
    """
    candidates = [(*_order(pairing, impulse[:_LONGEST]), pairing) for pairing in (rows, _flattest(rows))]
    _, order, pairing = min(candidates, key=lambda candidate: candidate[0])
    return pairing[order]


def _flattest(rows: Array) -> Array:
    delay = np.exp(-1j * np.pi * (np.arange(_POINTS) + 0.5) / _POINTS)
    powers = np.array([np.ones_like(delay), delay, delay**2])
    zeros_gain, poles_gain = np.abs(rows[:, :3] @ powers), np.abs(rows[:, 3:] @ powers)
    free, paired = list(range(len(rows))), rows.copy()
    for poles in np.argsort([-np.abs(np.roots(row[3:])).max(initial=0.0) for row in rows], kind="stable"):
        gains = zeros_gain[free] / poles_gain[poles]
        unevenness = np.log(gains / gains.max(axis=1, keepdims=True) + _FLOOR).std(axis=1)
        paired[poles, :3] = rows[free.pop(int(np.argmin(unevenness))), :3]
    return paired


def _order(rows: Array, impulse: Array) -> tuple[float, list[int]]:
    """Noise of the best order [input steps squared, times 12], and the indices of the sections in it.

    Sets of sections are bit masks.
    """
    responses, steps, energies = [impulse], [1.0], [1.0]
    for members in range(1, 1 << len(rows)):
        newest = members.bit_length() - 1
        response = BlockFilter(rows[newest : newest + 1]).process(responses[members ^ 1 << newest])
        responses.append(response)
        steps.append(float(np.abs(response).sum()))
        energies.append(float(np.sum(response**2)))
    everything = len(steps) - 1
    blind = [number for number, row in enumerate(rows) if is_blind(row[:3])]
    noises, lasts = [0.0], [0]
    for members in range(1, everything + 1):
        present = [number for number in range(len(rows)) if members >> number & 1]
        noise, last = min((noises[members ^ 1 << number], number) for number in present)
        barred = len(present) == 1 and blind and last not in blind
        noises.append(math.inf if barred else noise + steps[members] ** 2 * energies[everything ^ members])
        lasts.append(last)
    order: list[int] = []
    members = everything
    while members:
        order.append(lasts[members])
        members ^= 1 << lasts[members]
    return noises[everything], order[::-1]


FRACTION_BITS = 30
UNIT = 1 << FRACTION_BITS
DATA_BITS = (16, 32)
COARSEST_COEFFICIENTS_DB = -90.0

_FORGOTTEN = 1e-15
_SHORTEST = 64
_SLOWEST = 1.0 - 1e-5
_MARGIN = 1.000001
_SPARE = 0.999  # of the scale, for the rounding of the numerator

# A disturbance: its largest value, and the impulse response (n,) from where it enters to the node looked at.
_Path = tuple[float, Array]


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

    The sections come out in another pairing and order (``logger.dsp.fixed_point``). Raises ValueError for sections that
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


def _samples_until_forgotten(rows: Array) -> int:
    slowest = max(np.abs(np.roots(row[3:])).max(initial=0.0) for row in rows)
    if slowest > _SLOWEST:
        raise ValueError(f"expected stable sections with poles within {_SLOWEST}, found one at {slowest:.9g}")
    return _SHORTEST + math.ceil(math.log(_FORGOTTEN) / math.log(max(slowest, _FORGOTTEN)))


def _impulse(samples: int) -> Array:
    impulse = np.zeros(samples)
    impulse[0] = 1.0
    return impulse


def _fitted(row: Array, paths: list[_Path], data_bits: int) -> tuple[float, FixedSection, list[_Path]]:
    """One section at the finest scale that fits: the gain that takes it there, its integers, the paths to its output.

    What the input makes of the output and of the sum is proportional to the gain, so the gain follows at once.
    """
    a = _denominator(row[4:])
    recursion = sum(map(abs, a))
    rounding = _rounding(a, len(paths[0][1]))
    carry = (recursion + 1) // 2 + UNIT // 2 + 1
    largest_b, total_b = np.abs(row[:3]).max() * UNIT, np.abs(row[:3]).sum() * UNIT
    reach = _bound([(largest, _response(row[:3] * UNIT, a, response)) for largest, response in paths])
    room = largest_word(data_bits) - _bound(rounding)
    sum_room = largest_word(64) - carry - _bound(rounding) * recursion
    gain = _SPARE * min(room / reach, sum_room / (_bound(paths) * total_b + reach * recursion),
                        largest_word(32) / largest_b)
    b = _numerator(row[:3] * gain)
    reached = [(largest, _response(b, a, response)) for largest, response in paths] + rounding
    largest_output = math.ceil(_bound(reached))
    largest_sum = math.ceil(_bound(paths)) * sum(map(abs, b)) + largest_output * recursion + carry
    too_large = largest_output > largest_word(data_bits) or largest_sum > largest_word(64)
    if too_large or max(map(abs, b)) > largest_word(32):
        raise ValueError(f"expected a section that some scaling keeps from overflow, not b, a1, a2 = {b}, {a} / 2^30")
    return gain, FixedSection(b, a, largest_output, largest_sum), reached


def _numerator(b: Array) -> tuple[int, int, int]:
    """b0, b1, b2 as integers. What is blind to a steady input stays so exactly: then b1 makes the sum 0."""
    b0, b1, b2 = (round(value * UNIT) for value in b.tolist())
    if is_blind(b):
        b1 = -b0 - b2
    return b0, b1, b2


def _denominator(a: Array) -> tuple[int, int]:
    """a1, a2 as integers, still stable (the triangle |a1| < 1 + a2, a2 < 1)."""
    a1, a2 = (round(value * UNIT) for value in a.tolist())
    if not (a2 < UNIT and abs(a1) < UNIT + a2 and abs(a1) <= largest_word(32)):
        raise ValueError(f"expected a section that is stable with 32-bit coefficients, not a1, a2 = {a.tolist()}")
    return a1, a2


def _rounding(a: tuple[int, int], samples: int) -> list[_Path]:
    """What a section's own rounding does to its output: half a step at once, and 2^-31 of a step in its recursion.

    Raises ValueError if the latter alone could keep the output away from 0 without an input.
    """
    impulse = _impulse(samples)
    recursion = (0.5 / UNIT, _response((UNIT, 0, 0), a, impulse))
    if _bound([recursion]) >= 0.5:
        raise ValueError(f"expected a section that decays to zero with 32-bit coefficients, not a1, a2 = {a} / 2^30")
    return [recursion, (0.5, impulse)]


def _response(b: Iterable[float], a: tuple[int, int], x: Array) -> Array:
    """What a section of coefficients times 2^30 makes of x."""
    return BlockFilter([[*b, UNIT, *a]]).process(x)


def _bound(paths: list[_Path]) -> float:
    """Upper bound of a node: every disturbance at its largest, with the worst signs."""
    return _MARGIN * sum(largest * float(np.abs(response).sum()) for largest, response in paths)


def _energy_db(response: Array) -> float:
    return 10.0 * math.log10(max(float(np.sum(response**2)), 1e-300))


FULL_SCALE_MPS2 = 16 * STANDARD_GRAVITY_MPS2  # the widest range of any accelerometer here
FULL_SCALE_SLOPE = 1.0  # [m/m]: a kerb as high as the tire's footprint is long


class FixedFilter:
    """A cascade in integers that keeps its state between calls; stands in wherever a ``BlockFilter`` does.

    Any split of the input gives the same bits. Values beyond the cascade's full scale are clipped to it. A NaN raises
    ValueError.
    """

    def __init__(self, cascade: FixedCascade) -> None:
        self._cascade = cascade
        self._sections = [_Section(section) for section in cascade.sections]

    @classmethod
    def for_acceleration(cls, sos: SectionRows) -> "FixedFilter":
        """The sections ``sos`` in 32 bits for accelerations within +-16 g, in m/s2."""
        return cls(fixed_cascade(sos, FULL_SCALE_MPS2))

    def reset(self, value: float = 0.0) -> None:
        """Forget the past: start as if the input had been ``value`` for ever."""
        x = int(self.counts(np.array([value]))[0])
        for section in self._sections:
            x = section.reset(x)

    def process(self, x: Array) -> Array:
        """Filter the next samples, (n,) -> (n,), in the units of the cascade's input and output."""
        return self.process_counts(self.counts(x)).astype(np.float64) * self._cascade.output_step

    def counts(self, x: Array) -> Whole:
        """Inputs (n,) as integers, clipped to full scale."""
        if np.isnan(x).any():
            raise ValueError("expected numbers, found a NaN")
        largest = self._cascade.largest_input
        return np.clip(np.rint(x / self._cascade.input_step), -largest, largest).astype(np.int64)

    def process_counts(self, x: Whole) -> Whole:
        """The integers of the specification: inputs within full scale, (n,) -> (n,)."""
        y = x.tolist()
        for section in self._sections:
            y = section.process(y)
        return np.array(y, dtype=np.int64)


class _Section:
    """One section's integers and its last two inputs and double words, newest first."""

    def __init__(self, section: FixedSection) -> None:
        self._b = section.b
        self._a = section.a
        self._inputs = (0, 0)
        self._words = (0, 0)

    def reset(self, x: int) -> int:
        steady, rest = sum(self._b) * x, UNIT + sum(self._a)
        y = (steady + rest // 2) // rest
        word = y * UNIT + ((steady - rest * y) * UNIT) // rest
        self._inputs, self._words = (x, x), (word, word)
        return y

    def process(self, inputs: list[int]) -> list[int]:
        b0, b1, b2 = self._b
        a1, a2 = self._a
        x1, x2 = self._inputs
        w1, w2 = self._words
        half, outputs = UNIT // 2, []
        for x in inputs:
            w = b0 * x + b1 * x1 + b2 * x2 + ((half - a1 * w1 - a2 * w2) >> FRACTION_BITS)
            x1, x2, w1, w2 = x, x1, w, w1
            outputs.append((w + half) >> FRACTION_BITS)
        self._inputs, self._words = (x1, x2), (w1, w2)
        return outputs
