"""What a frequency weighting of vibration is: the analog formula of its standard, and digital sections made from it.

Problem: a standard (ISO 2631-1, ISO 8041-1) defines a weighting by poles and zeros in continuous time, one of them at
100 Hz, above half the rate of a 100 Hz record. The plain bilinear transform is several dB wrong there.

Solution: the formula is kept as the truth, exactly as the standard writes it. A whole record is weighted by the formula
itself, through its Fourier transform. A stream needs sections: fitted to the formula at the desk, for any rate, by
``logger.dsp.design``; those of the rate the service runs at are stored beside the formula and checked against it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from logger.arrays import Array, Complex

Polynomial = tuple[float, ...]

# Rows b0, b1, b2, a0, a1, a2 for ``logger.dsp.filters.BlockFilter``.
Sections = tuple[tuple[float, float, float, float, float, float], ...]

# Every set of sections runs this many whole samples behind the formula: output k + 5 belongs to the instant of input k.
# Without them, magnitude and phase cannot both be met up to near half the sample rate (see ``logger.dsp.design``).
DELAY_SAMPLES = 5

LOWEST_RATE_HZ = 80.0  # of a record that is weighted

# After this many periods of the lower band limit a weighting has forgotten a blow to one part in 10^12.
MEMORY_PERIODS = 10.0


@dataclass(frozen=True)
class Weighting:
    """A frequency weighting: band limits, acceleration-velocity transition, upward step.

    f1, f2       high-pass and low-pass, Butterworth of second order [Hz]
    f3, f4, q4   zero and poles of the transition [Hz], quality factor of the poles
    f5, q5       zeros of the upward step; f6, q6 its poles
    sections     per sample rate [Hz], digital sections within 0.02 dB of the formula, DELAY_SAMPLES behind it
    gain         factor over all
    printed      per frequency [Hz], the factor that its standard prints: three or more, where it prints a table
    comfort_words    ISO 2631-1's words for comfort (clause C.2.3) are said of its values
    is_sickness  its values are of motion sickness, and have a dose (clause 9)
    health_factor    k of its axis for health (clause 7.2.3); None: it is none of health
    horizontal   name of the weighting of x and y that are combined with a z weighted by this one; empty: none are
    counts_up_to_hz    what lies above is no part of what it stands for (clause 1)

    A part whose frequencies are infinite is absent (f3 alone infinite: a transition without zero); one that is there
    has a quality factor, else ValueError. Source: ISO 2631-1:1997 Annex A; Eq 2.13-2.17 of Blum (2015). Eq 2.16 is
    misprinted there: the denominator of the upward step has f6 and Q6, as here.
    """

    name: str
    f1_hz: float
    f2_hz: float
    f3_hz: float = math.inf
    f4_hz: float = math.inf
    q4: float = math.nan
    f5_hz: float = math.inf
    q5: float = math.nan
    f6_hz: float = math.inf
    q6: float = math.nan
    sections: Mapping[int, Sections] = field(default_factory=dict)
    gain: float = 1.0
    printed: Mapping[float, float] = field(default_factory=dict)
    comfort_words: bool = False
    is_sickness: bool = False
    health_factor: float | None = None
    horizontal: str = ""
    counts_up_to_hz: float = 80.0

    def __post_init__(self) -> None:
        for number, pole_hz, q in ((4, self.f4_hz, self.q4), (5, self.f5_hz, self.q5), (6, self.f6_hz, self.q6)):
            if math.isfinite(pole_hz) and not q > 0.0:
                raise ValueError(f"{self.name}: expected q{number}, as there is f{number}_hz")

    def factors(self) -> tuple[tuple[Polynomial, Polynomial], ...]:
        """The weighting as a product of (numerator, denominator), polynomials in s [rad/s], highest power first.

        The high-pass comes first (Eq 2.13) and carries the gain, then the low-pass (Eq 2.14), then what there is of
        Eq 2.15 and 2.16.
        """
        w1, w2, w3, w4, w5, w6 = (
            2.0 * math.pi * f for f in (self.f1_hz, self.f2_hz, self.f3_hz, self.f4_hz, self.f5_hz, self.f6_hz)
        )
        root2 = math.sqrt(2.0)
        parts: list[tuple[Polynomial, Polynomial]] = [
            ((self.gain, 0.0, 0.0), (1.0, root2 * w1, w1**2)),
            ((w2**2,), (1.0, root2 * w2, w2**2)),
        ]
        if math.isfinite(w4):
            zero = (w4**2 / w3,) if math.isfinite(w3) else ()
            parts.append(((*zero, w4**2), (1.0, w4 / self.q4, w4**2)))
        if math.isfinite(w6):
            parts.append(((1.0, w5 / self.q5, w5**2), (1.0, w6 / self.q6, w6**2)))
        return tuple(parts)

    def response(self, f_hz: npt.ArrayLike) -> Complex:
        """Complex response of the analog weighting at ``f_hz`` [Hz], Eq 2.17."""
        s = 2j * np.pi * np.asarray(f_hz, dtype=np.float64)
        product = np.ones_like(s)
        for numerator, denominator in self.factors():
            product *= np.polyval(numerator, s) / np.polyval(denominator, s)
        return product

    def weigh(self, accel_mps2: npt.ArrayLike, rate_hz: float) -> Array:
        """The weighted acceleration of a whole record (n,), n > 0, sampled at ``rate_hz`` [Hz]; magnitude and phase are
        the formula's.

        The record is taken as band-limited below half its rate. Its mean is taken off first: every weighting lets
        nothing constant through, and a gravity that begins with the record would count as a blow. Before and after
        the record there is silence, long enough for nothing to come round from its end to its beginning.
        """
        accel = np.asarray(accel_mps2, dtype=np.float64)
        least = len(accel) + math.ceil(MEMORY_PERIODS / self.f1_hz * rate_hz)
        # a multiple of a power of two, which a fast transform likes, at most 1/16 longer
        step = 1 << max(least.bit_length() - 5, 1)
        size = -(-least // step) * step
        spectrum = np.fft.rfft(accel - accel.mean(), size)
        spectrum *= self.response(np.fft.rfftfreq(size, 1.0 / rate_hz))
        return np.fft.irfft(spectrum, size)[: len(accel)]
