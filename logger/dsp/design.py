"""Digital sections for an analog weighting at any sample rate. A desk tool: it needs scipy, the service does not.

Problem: the usual transforms are right far below half the sample rate only. At 100 Hz, Wk by the bilinear transform
is 13 % low at 20 Hz, and its phase is wrong as well. The phase counts: a tenth of a sample of delay moves a sharp
edge into the next 25 ft window and changes the a_w of a window by some per cent.

Solution: fit the complex logarithm of the response, so that decibels and phase are minimised together.
1. The high-pass lies so low that the bilinear transform is exact for it; it is taken out of the fit.
2. Every other analog quadratic becomes a digital one, started at its matched-z place. What a causal filter of this size
   does well is the weighting a fraction of a sample early; that fraction is left free and found.
3. All-pass sections (Thiran) make up the difference to DELAY_SAMPLES whole samples, and all is fitted once more.
Whole samples can be taken out by counting, so magnitude and phase are both right. At half the sample rate a digital
filter's phase is a multiple of 180 degrees and the formula's is not: the two must part somewhere near it, and the
more delay is allowed, the narrower the band in which they do. With 5 samples it is a few hertz of a 100 Hz record. This
counts for a coarse sensor on a smooth road, whose single steps reach up to half the rate.

Sources: ISO 2631-1:1997 Annex A; T. I. Laakso et al., Splitting the unit delay, IEEE SP Magazine 13(1), 1996 (Thiran).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.arrays import Array, Complex
from logger.dsp.filters import butterworth_sos, frequency_response
from logger.dsp.resample import PASS_OF_RATE
from logger.dsp.weightings.weighting import DELAY_SAMPLES, LOWEST_RATE_HZ, Sections, Weighting

TOLERANCE_DB = 0.02
FIT_OF_RATE = 0.48  # the fit ends at this share of the sample rate
PHASE_WEIGHT = 0.3  # radians against nepers
PHASE_CORNER_OF_RATE = 0.2  # above it the phase fades out of the fit: a road has little to say there
GUARD_WEIGHT = 0.05  # keeps the magnitude sane between the end of the fit and half the rate
# Where the low-pass's second zero starts. From the first place the fit of Wb between 1000 and 1500 Hz ends in a valley
# beside the right one.
LOW_PASS_ZEROS = (-0.5, 0.0)
POINTS = 150
# A fit in a valley goes on for thousands and gains little: the folder's weightings are within 0.01 dB by then.
EVALUATIONS = 300
MOST_TURN_RAD, MOST_DAMPING_RATIO = 30.0, 20.0  # of a resonance in a sample, and its damping, that a fit may reach


@dataclass(frozen=True)
class DesignError:
    """How far digital sections are from the analog weighting, at its worst, within a band of frequencies."""

    magnitude_db: float
    phase_deg: float


@dataclass(frozen=True)
class _Quadratic:
    """A factor 1, z^-1, z^-2 of the cascade, written in two unconstrained numbers; sign -1 in the denominator."""

    encode: Callable[[float, float], Array]
    sign: int


def _reflection(u: float, v: float) -> Array:
    """Every stable denominator, in the hyperbolic arguments of its reflection coefficients."""
    a2 = math.tanh(v)
    return np.array([1.0, (1.0 + a2) * math.tanh(u), a2])


def _unit_gain(u: float, v: float) -> Array:
    """Every numerator that has gain 1 at 0 Hz."""
    return np.array([1.0 - u - v, u, v])


def _resonance(period_s: float) -> Callable[[float, float], Array]:
    """The matched-z image of s^2 + 2 d w s + w^2, in log w and log d."""

    most_omega, most_damping = math.log(MOST_TURN_RAD / period_s), math.log(MOST_DAMPING_RATIO)

    def encode(log_omega: float, log_damping: float) -> Array:
        # Beyond these the factor is 1 at all frequencies; farther on its parts overflow.
        omega, damping = math.exp(min(log_omega, most_omega)), math.exp(min(log_damping, most_damping))
        turn = omega * period_s * np.sqrt(complex(1.0 - damping**2))
        radius = math.exp(-damping * omega * period_s)
        return np.array([1.0, -2.0 * radius * np.cos(turn).real, radius**2])

    return encode


class _Fit:
    """Least squares on the complex logarithm of the response, for one weighting and one rate."""

    def __init__(self, weighting: Weighting, rate_hz: float) -> None:
        self.weighting = weighting
        self.period_s = 1.0 / rate_hz
        self.high_pass = butterworth_sos("high", weighting.f1_hz, rate_hz)
        lowest, highest = weighting.f1_hz / 4, min(FIT_OF_RATE * rate_hz, 8 * weighting.f2_hz)
        band = np.sort(np.concatenate([np.geomspace(lowest, highest, POINTS), np.linspace(lowest, highest, POINTS)]))
        f_hz = np.concatenate([band, np.linspace(highest, rate_hz / 2, POINTS // 5 + 2)[1:-1]])
        self.f_hz, self.in_band = f_hz, np.arange(len(f_hz)) < len(band)
        self.magnitude_weight = np.where(self.in_band, 1.0, GUARD_WEIGHT)
        fade = PHASE_WEIGHT / (1.0 + (f_hz / (PHASE_CORNER_OF_RATE * rate_hz)) ** 4)
        self.phase_weight = np.where(self.in_band, fade, 0.0)
        self.powers = np.exp(-2j * np.pi * f_hz * self.period_s) ** np.arange(3)[:, np.newaxis]
        self.target = np.log(weighting.response(f_hz) / frequency_response(self.high_pass, f_hz, rate_hz))
        self.turn_per_sample = 2j * np.pi * f_hz * self.period_s
        self.quadratics: list[_Quadratic] = []

    def coefficients(self, x: Array) -> list[Array]:
        return [q.encode(*x[2 * n : 2 * n + 2]) for n, q in enumerate(self.quadratics)]

    def add(self, encode: Callable[[float, float], Array], sign: int) -> None:
        self.quadratics.append(_Quadratic(encode, sign))

    def misfit(self, x: Array) -> Complex:
        """log of digital over analog, given the numbers of the quadratics, the log gain, and the delay in samples."""
        total = x[-2] - self.target + self.turn_per_sample * x[-1]
        for quadratic, q in zip(self.quadratics, self.coefficients(x), strict=True):
            total = total + quadratic.sign * np.log(q @ self.powers)
        return total.real + 1j * np.angle(np.exp(1j * total.imag))

    def slopes(self, x: Array) -> Complex:
        """Derivative of the misfit by every number, (frequencies, numbers)."""
        columns: list[npt.NDArray[Any]] = []
        small = 1e-6
        for n, (quadratic, q) in enumerate(zip(self.quadratics, self.coefficients(x), strict=True)):
            u, v = x[2 * n : 2 * n + 2]
            for du, dv in ((small, 0.0), (0.0, small)):
                change = (quadratic.encode(u + du, v + dv) - quadratic.encode(u - du, v - dv)) / (2 * small)
                columns.append(quadratic.sign * (change @ self.powers) / (q @ self.powers))
        columns += [np.ones(len(self.f_hz), dtype=np.complex128), self.turn_per_sample]
        return np.stack(columns, axis=1)

    def solve(self, start: Array, free_delay: bool) -> Array:
        from scipy.optimize import least_squares

        delay = [] if free_delay else [start[-1]]
        count = len(start) - len(delay)

        def weighted(values: Complex) -> Array:
            broad = (slice(None),) + (np.newaxis,) * (values.ndim - 1)
            return np.concatenate([self.magnitude_weight[broad] * values.real, self.phase_weight[broad] * values.imag])

        found = least_squares(lambda x: weighted(self.misfit(np.append(x, delay))), start[:count],
                              jac=lambda x: weighted(self.slopes(np.append(x, delay))[:, :count]), x_scale="jac",
                              method="lm", max_nfev=EVALUATIONS, ftol=1e-8, xtol=1e-8, gtol=1e-14)
        return np.append(found.x, delay)

    def start_from_analog(self, low_pass_zero: float) -> Array:
        """One denominator and one numerator for every analog factor but the high-pass."""
        resonance = _resonance(self.period_s)
        numbers: list[float] = []
        for numerator, denominator in self.weighting.factors()[1:]:
            omega = math.sqrt(denominator[2])
            if omega * self.period_s < 1.5:
                self.add(resonance, -1)
                numbers += [math.log(omega), math.log(denominator[1] / (2 * omega))]
            else:  # beyond what the sample rate can hold: somewhere harmless
                self.add(_reflection, -1)
                numbers += [0.3, 0.0]
            if len(numerator) == 3:
                omega = math.sqrt(numerator[2])
                self.add(resonance, 1)
                numbers += [math.log(omega), math.log(numerator[1] / (2 * omega))]
            else:
                zeros = [low_pass_zero, 0.0]
                if len(numerator) == 2:
                    zeros = [-0.5, math.exp(-numerator[1] / numerator[0] * self.period_s)]
                q = np.poly(zeros)
                self.add(_unit_gain, 1)
                numbers += list(q[1:] / q.sum())
        return np.array([*numbers, 0.0, -0.5])

    def with_all_pass(self, x: Array) -> Array:
        """Put in the all-pass sections that carry the delay found free on to the whole samples promised."""
        from scipy.signal import tf2sos

        numbers = list(x[:-2])
        missing = max(DELAY_SAMPLES - x[-1], 0.1)
        for row in tf2sos([1.0], _thiran(missing, math.ceil(missing))):
            denominator = row[3:]
            numerator = np.append(denominator[1::-1], 0.0) if denominator[2] == 0.0 else denominator[::-1]
            self.add(_reflection, -1)
            self.add(_unit_gain, 1)
            numbers += [math.atanh(denominator[1] / (1.0 + denominator[2])), math.atanh(denominator[2])]
            numbers += list(numerator[1:] / numerator.sum())
        return np.array([*numbers, x[-2], float(DELAY_SAMPLES)])

    def level(self, x: Array) -> Array:
        """The same numbers with the gain that suits them."""
        x[-2] -= np.median(self.misfit(x).real)
        return x

    def rows(self, x: Array) -> Array:
        sides: dict[int, list[Array]] = {1: [], -1: []}
        for quadratic, q in zip(self.quadratics, self.coefficients(x), strict=True):
            sides[quadratic.sign].append(q)
        sections = [np.concatenate(pair) for pair in zip(sides[1], sides[-1], strict=True)]
        sections[0][:3] *= math.exp(x[-2])
        return np.vstack([self.high_pass, *sections])


def _thiran(delay_samples: float, order: int) -> Array:
    """Denominator of the all-pass of maximally flat delay (Thiran), stable for delays above order - 1."""
    place = delay_samples - order + np.arange(order + 1)
    return np.array([(-1) ** k * math.comb(order, k) * np.prod(place / (place + k)) for k in range(order + 1)])


def design_error(weighting: Weighting, sections: Sections, rate_hz: float, band_hz: Array) -> DesignError:
    """Worst departure of ``sections`` from the formula at the frequencies ``band_hz`` [Hz], their delay taken out."""
    delay = np.exp(2j * np.pi * band_hz / rate_hz * DELAY_SAMPLES)
    ratio = frequency_response(sections, band_hz, rate_hz) * delay / weighting.response(band_hz)
    return DesignError(magnitude_db=float(np.abs(20.0 * np.log10(np.abs(ratio))).max()),
                       phase_deg=float(np.degrees(np.abs(np.angle(ratio))).max()))


def design_sections(weighting: Weighting, rate_hz: float) -> Sections:
    """Sections whose magnitude is within 0.02 dB of the formula up to ``PASS_OF_RATE``, DELAY_SAMPLES late.

    rate_hz: at least 80 Hz. Raises ValueError for a lower rate, and where the promise could not be kept.
    """
    if not rate_hz >= LOWEST_RATE_HZ:
        raise ValueError(f"weightings are designed for sample rates from {LOWEST_RATE_HZ:g} Hz, not {rate_hz:g} Hz")
    for low_pass_zero in LOW_PASS_ZEROS:
        sections, error_db = _fitted(weighting, rate_hz, low_pass_zero)
        if error_db <= TOLERANCE_DB:
            return sections
    raise ValueError(f"{weighting.name} at {rate_hz:g} Hz: {error_db:.3f} dB from the formula")


def _fitted(weighting: Weighting, rate_hz: float, low_pass_zero: float) -> tuple[Sections, float]:
    fit = _Fit(weighting, rate_hz)
    early = fit.solve(fit.level(fit.start_from_analog(low_pass_zero)), free_delay=True)
    rows = fit.rows(fit.solve(fit.level(fit.with_all_pass(early)), free_delay=False))
    sections = tuple((b0, b1, b2, a0, a1, a2) for b0, b1, b2, a0, a1, a2 in rows.tolist())
    error = design_error(weighting, sections, rate_hz, fit.f_hz[fit.f_hz <= PASS_OF_RATE * rate_hz])
    return sections, error.magnitude_db
