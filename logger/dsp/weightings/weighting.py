"""What a frequency weighting of ISO 2631-1 is: the standard's analog formula, and digital sections made from it.

Problem: the standard defines a weighting by poles and zeros in continuous time, one of them at 100 Hz, above half
the rate of a 100 Hz record. The plain bilinear transform is several dB wrong there.

Solution: the formula is kept as the truth, exactly as the standard writes it; sections fitted to it (by
``logger.dsp.design``, at the desk) are stored beside it per sample rate, and always checked against it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Polynomial = tuple[float, ...]


# Rows b0, b1, b2, a0, a1, a2 for ``logger.dsp.sections.BlockFilter``.
Sections = tuple[tuple[float, float, float, float, float, float], ...]

# Every set of sections runs this many whole samples behind the formula: output k + 5 belongs to the instant of input k.
# Without them, magnitude and phase cannot both be met up to near half the sample rate (see ``logger.dsp.design``).
DELAY_SAMPLES = 5


@dataclass(frozen=True)
class Weighting:
    """A frequency weighting: band limits, acceleration-velocity transition, upward step.

    sections: per sample rate [Hz], digital sections within 0.02 dB of the formula, DELAY_SAMPLES behind it.
    Frequencies in Hz, quality factors as ratios; a part whose frequencies are infinite is absent (f3 alone infinite:
    a transition without zero). Source: ISO 2631-1:1997 Annex A; Eq 2.13-2.17 of Blum (2015). Eq 2.16 is misprinted
    there: the denominator of the upward step has f6 and Q6, as here.
    """

    name: str
    f1_hz: float
    f2_hz: float
    f3_hz: float
    f4_hz: float
    q4: float
    f5_hz: float
    q5: float
    f6_hz: float
    q6: float
    sections: Mapping[int, Sections]

    def factors(self) -> tuple[tuple[Polynomial, Polynomial], ...]:
        """The weighting as a product of (numerator, denominator), polynomials in s [rad/s], highest power first.

        The high-pass comes first (Eq 2.13), then the low-pass (Eq 2.14), then what there is of Eq 2.15 and 2.16.
        """
        w1, w2, w3, w4, w5, w6 = (
            2.0 * math.pi * f for f in (self.f1_hz, self.f2_hz, self.f3_hz, self.f4_hz, self.f5_hz, self.f6_hz)
        )
        root2 = math.sqrt(2.0)
        parts: list[tuple[Polynomial, Polynomial]] = [
            ((1.0, 0.0, 0.0), (1.0, root2 * w1, w1**2)),
            ((w2**2,), (1.0, root2 * w2, w2**2)),
        ]
        if math.isfinite(w4):
            zero = (w4**2 / w3,) if math.isfinite(w3) else ()
            parts.append(((*zero, w4**2), (1.0, w4 / self.q4, w4**2)))
        if math.isfinite(w6):
            parts.append(((1.0, w5 / self.q5, w5**2), (1.0, w6 / self.q6, w6**2)))
        return tuple(parts)

    def response(self, f_hz: npt.ArrayLike) -> npt.NDArray[np.complex128]:
        """Complex response of the analog weighting at ``f_hz`` [Hz], Eq 2.17."""
        s = 2j * np.pi * np.asarray(f_hz, dtype=np.float64)
        product = np.ones_like(s)
        for numerator, denominator in self.factors():
            product *= np.polyval(numerator, s) / np.polyval(denominator, s)
        return product
