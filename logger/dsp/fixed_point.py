"""Second-order sections in integer arithmetic, bit for bit the same in Python and in C.

Problem: a small controller has no floating point. In plain integer sections the rounding goes round with the
recursion: poles close to 1 multiply it by thousands, and on silence it never dies (limit cycles).

Solution: direct form I, whose only inner nodes are the outputs of its sections, so that scaling can be proved
(``logger.dsp.fixed_scaling``); and the remainder of every rounding is fed back through the section's own denominator.
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

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.dsp.fixed_scaling import FRACTION_BITS, HALF, UNIT, FixedCascade, FixedSection, fixed_cascade
from logger.dsp.sections import Floats, SectionRows
from logger.units import STANDARD_GRAVITY_MPS2

Integers = npt.NDArray[np.int64]

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
    def for_acceleration(cls, sos: SectionRows) -> FixedFilter:
        """The sections ``sos`` in 32 bits for accelerations within +-16 g, in m/s2."""
        return cls(fixed_cascade(sos, FULL_SCALE_MPS2))

    def reset(self, value: float = 0.0) -> None:
        """Forget the past: start as if the input had been ``value`` for ever."""
        x = int(self.counts(np.array([value]))[0])
        for section in self._sections:
            x = section.reset(x)

    def process(self, x: Floats) -> Floats:
        """Filter the next samples, (n,) -> (n,), in the units of the cascade's input and output."""
        return self.process_counts(self.counts(x)).astype(np.float64) * self._cascade.output_step

    def counts(self, x: Floats) -> Integers:
        """Inputs (n,) as integers, clipped to full scale."""
        if np.isnan(x).any():
            raise ValueError("expected numbers, found a NaN")
        largest = self._cascade.largest_input
        return np.clip(np.rint(x / self._cascade.input_step), -largest, largest).astype(np.int64)

    def process_counts(self, x: Integers) -> Integers:
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
        outputs = []
        for x in inputs:
            w = b0 * x + b1 * x1 + b2 * x2 + ((HALF - a1 * w1 - a2 * w2) >> FRACTION_BITS)
            x1, x2, w1, w2 = x, x1, w, w1
            outputs.append((w + HALF) >> FRACTION_BITS)
        self._inputs, self._words = (x1, x2), (w1, w2)
        return outputs
