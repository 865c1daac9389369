"""Ride comfort and health by ISO 2631-1, of a record, and of a day."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array
from logger.bounds import time_hint
from logger.dsp.filters import BlockFilter
from logger.dsp.weightings.weighting import LOWEST_RATE_HZ, Weighting

# Table 2.5 (ISO 2631-1 Annex C.2.3): lower bounds [m/s2]. The ranges overlap on purpose; here the more severe word
# holds wherever two would do.
COMFORT_WORDS = (
    (2.0, "extremely_uncomfortable"),
    (1.25, "very_uncomfortable"),
    (0.8, "uncomfortable"),
    (0.5, "fairly_uncomfortable"),
    (0.315, "a_little_uncomfortable"),
    (0.0, "not_uncomfortable"),
)

# Above these the r.m.s. does not say all (clauses 6.2.1 and 6.3.3).
CREST_LIMIT = 9.0
MTVV_LIMIT = 1.5
VDV_LIMIT = 1.75

# Multiplying factors of x, y and z for people who sit (clauses 7.2.3 and 8.2.2.1).
HEALTH_FACTORS = (1.4, 1.4, 1.0)
COMFORT_FACTORS = (1.0, 1.0, 1.0)


def a_w(weighted_mps2: Array) -> float:
    """R.m.s. of the weighted acceleration (n,), n > 0 [m/s2]. Eq 2.9; ISO 2631-1 clause 6.1."""
    return float(np.sqrt(np.mean(np.square(weighted_mps2))))


def vdv(weighted_mps2: Array, dt_s: float) -> float:
    """Vibration dose value of weighted acceleration (n,) at steps of ``dt_s`` [m/s^1.75]. Eq 2.12; clause 6.3.2."""
    return float((np.sum(np.square(np.square(weighted_mps2))) * dt_s) ** 0.25)


def crest_factor(weighted_mps2: Array) -> float:
    """Largest weighted acceleration (n,) over its r.m.s.; nan when nothing moves. Clause 6.2.1.

    Up to CREST_LIMIT the r.m.s. says all; above, MTVV or VDV belongs beside it.
    """
    rms_mps2 = a_w(weighted_mps2)
    return float(np.abs(weighted_mps2).max()) / rms_mps2 if rms_mps2 > 0.0 else math.nan


def comfort_word(a_w_mps2: float) -> str:
    """The word of Table 2.5 for a weighted r.m.s. [m/s2]. Raises ValueError for a negative value or nan."""
    for lowest_mps2, word in COMFORT_WORDS:
        if a_w_mps2 >= lowest_mps2:
            return word
    raise ValueError(f"a weighted r.m.s. cannot be {a_w_mps2}")


def total(axes_mps2: Sequence[float], factors: Sequence[float]) -> float:
    """Vibration total value of weighted r.m.s. values of several axes [m/s2]. ISO 2631-1 Eq 10, clause 6.5."""
    return math.hypot(*(factor * axis for factor, axis in zip(factors, axes_mps2, strict=True)))


def motion_sickness_dose(a_w_mps2: float, duration_s: float) -> float:
    """Motion sickness dose value MSDVz of a Wf-weighted r.m.s. [m/s2] over a duration [s], in m/s^1.5. Clause 9.2.1."""
    return a_w_mps2 * math.sqrt(duration_s)


@dataclass(frozen=True)
class AxisFigures:
    """What ISO 2631-1 says in numbers of one weighted axis over ``duration_s``.

    mtvv_mps2               with the linear running r.m.s. over 1 s, Eq 2.10 and 2.11
    mtvv_exponential_mps2   with exponential averaging, time constant 1 s
    crest_factor            nan when nothing moves, as the two ratios are
    """

    duration_s: float
    a_w_mps2: float
    mtvv_mps2: float
    mtvv_exponential_mps2: float
    vdv_mps175: float
    crest_factor: float

    @property
    def mtvv_ratio(self) -> float:
        """MTVV / a_w. ISO 2631-1 Eq 7."""
        return self.mtvv_mps2 / self.a_w_mps2 if self.a_w_mps2 > 0.0 else math.nan

    @property
    def vdv_ratio(self) -> float:
        """VDV / (a_w T^(1/4)). ISO 2631-1 Eq 8."""
        return self.vdv_mps175 / (self.a_w_mps2 * self.duration_s**0.25) if self.a_w_mps2 > 0.0 else math.nan

    def beside_a_w(self) -> tuple[str, ...]:
        """Which of ``mtvv`` and ``vdv`` have to be reported beside a_w; empty: a_w is enough.

        A crest factor above 9 calls for either, so for both; a ratio above 1.5 or 1.75 calls for its own value.
        Clauses 6.2.2 and 6.3.3.
        """
        shocks = self.crest_factor > CREST_LIMIT
        wanted = {"mtvv": shocks or self.mtvv_ratio > MTVV_LIMIT, "vdv": shocks or self.vdv_ratio > VDV_LIMIT}
        return tuple(name for name, needed in wanted.items() if needed)


def axis_figures(weighted_mps2: Array, rate_hz: float) -> AxisFigures:
    """All figures of a weighted axis (n,), n > 0, sampled at ``rate_hz`` [Hz].

    Problem: one number cannot say both how a road shakes and how hard it hits. The standard has several, all from
    the weighted acceleration: its r.m.s. over the stretch, the largest running r.m.s. over one second, the fourth-power
    dose, and the crest factor that says which of them to believe.

    Solution: plain functions of the weighted samples, the standard's rule for which of them to use, and running r.m.s.
    values that work on a stream and do not drift however long the stream is.
    """
    return AxisFigures(duration_s=len(weighted_mps2) / rate_hz, a_w_mps2=a_w(weighted_mps2),
                       mtvv_mps2=float(RunningRms(rate_hz).process(weighted_mps2).max()),
                       mtvv_exponential_mps2=float(ExponentialRms(rate_hz).process(weighted_mps2).max()),
                       vdv_mps175=vdv(weighted_mps2, 1.0 / rate_hz), crest_factor=crest_factor(weighted_mps2))


class ExponentialRms:
    """Running r.m.s. with exponential averaging of time constant ``tau_s``, for every sample of a stream. ISO 2631-1
    Eq 3, clause 6.3.1; the integral is exact for squares that stay as they are from sample to sample.

    Before the first sample there is taken to have been no vibration.
    """

    def __init__(self, rate_hz: float, tau_s: float = 1.0) -> None:
        kept = math.exp(-1.0 / (rate_hz * tau_s))
        self._mean = BlockFilter([[1.0 - kept, 0.0, 0.0, 1.0, -kept, 0.0]])

    def process(self, weighted_mps2: Array) -> Array:
        """Running r.m.s. at each of the next samples (n,) [m/s2]."""
        return np.sqrt(self._mean.process(np.square(weighted_mps2)))


class RunningRms:
    """Running r.m.s. over the last ``tau_s``, for every sample of a stream. Eq 2.10; clause 6.3.1, linear averaging.

    Its largest value over a stretch is the MTVV of that stretch (Eq 2.11). Before the first sample there is taken
    to have been no vibration, so the value grows during the first ``tau_s``.

    Time is cut into blocks of one window. A window is then the end of the block before and the beginning of this one,
    each summed from scratch: nothing is ever subtracted, so nothing drifts, and no split of the stream changes a bit.
    """

    def __init__(self, rate_hz: float, tau_s: float = 1.0) -> None:
        self._length = max(1, round(rate_hz * tau_s))
        self.reset()

    def reset(self) -> None:
        """Forget the past."""
        self._squares = np.zeros(self._length)
        self._tails = np.zeros(self._length)
        self._filled = 0
        self._sum = 0.0

    def process(self, weighted_mps2: Array) -> Array:
        """Running r.m.s. at each of the next samples (n,) [m/s2]."""
        mean_square = np.empty(len(weighted_mps2))
        done = 0
        while done < len(weighted_mps2):
            start = self._filled
            stop = min(self._length, start + len(weighted_mps2) - done)
            here = slice(done, done + stop - start)
            self._squares[start:stop] = np.square(weighted_mps2[here])
            sums = np.cumsum(np.concatenate([[self._sum], self._squares[start:stop]]))[1:]
            mean_square[here] = (sums + self._tails[start:stop]) / self._length
            self._filled, self._sum = stop, float(sums[-1])
            done = here.stop
            if stop == self._length:
                # what is left of this block after each sample of the next has pushed one out
                self._tails = np.append(np.cumsum(self._squares[:0:-1])[::-1], 0.0)
                self._filled, self._sum = 0, 0.0
        return np.sqrt(mean_square)


HOURS_OF_REFERENCE = 8.0
S_PER_HOUR = 3600.0


@dataclass(frozen=True)
class ExposureLimits:
    """A value from which to act, and one not to be exceeded.

    Problem: the same shaking is harmless for a minute and harmful for a working life, and there is no agreement on how
    strength and duration trade: a^n t is constant (Eq 2.18 of Blum 2015) with n = 2 for one school, n = 4 for the
    other.

    Solution: both, side by side. The European directive has a value for each, of which a state chooses one: A(8) goes
    with n = 2, the vibration dose value with n = 4. The caution zone has a pair of lines for each, which lie close
    together between 4 and 8 hours a day; there the zone has most behind it.

    All values are those of the axis that is worst once multiplied by its health factor
    (``logger.comfort.iso2631.HEALTH_FACTORS``), for people who sit.
    """

    action: float
    limit: float

    def verdict(self, value: float) -> str:
        """``below_action_value``, ``above_action_value`` or ``above_limit_value``; a value is exceeded, not met."""
        if value > self.limit:
            return "above_limit_value"
        return "above_action_value" if value > self.action else "below_action_value"


# Directive 2002/44/EC article 3(2): A(8) [m/s2] and VDV [m/s^1.75] of the whole body.
A8_MPS2 = ExposureLimits(0.5, 1.15)
VDV_MPS175 = ExposureLimits(9.1, 21.0)


def a8(a_w_mps2: float, hours: float) -> float:
    """Daily exposure A(8) [m/s2] of ``hours`` a day at a weighted r.m.s. [m/s2]. Directive 2002/44/EC Annex B."""
    return a_w_mps2 * math.sqrt(hours / HOURS_OF_REFERENCE)


def hours_to_a8(a_w_mps2: float, a8_mps2: float) -> float:
    """Hours a day at a weighted r.m.s. [m/s2] that make the daily exposure ``a8_mps2``; inf when nothing moves."""
    return HOURS_OF_REFERENCE * (a8_mps2 / a_w_mps2) ** 2 if a_w_mps2 > 0.0 else math.inf


def daily_vdv(vdv_mps175: float, measured_s: float, hours: float) -> float:
    """Dose [m/s^1.75] of ``hours`` a day like the ``measured_s`` seconds that gave ``vdv_mps175``. The fourth power of
    the dose grows with time (ISO 2631-1 Eq 5)."""
    return vdv_mps175 * (hours * S_PER_HOUR / measured_s) ** 0.25


def hours_to_vdv(vdv_mps175: float, measured_s: float, wanted_mps175: float) -> float:
    """Hours a day that make the dose ``wanted_mps175``; the inverse of ``daily_vdv``, inf when nothing moves."""
    if vdv_mps175 == 0.0:
        return math.inf
    return measured_s / S_PER_HOUR * (wanted_mps175 / vdv_mps175) ** 4


@dataclass(frozen=True)
class CautionZone:
    """Below it no effect on health is clearly documented; above it one is likely."""

    lower: float
    upper: float

    def verdict(self, value: float) -> str:
        """``below_zone``, ``in_zone`` (a bound belongs to it) or ``above_zone``."""
        if value > self.upper:
            return "above_zone"
        return "in_zone" if value >= self.lower else "below_zone"


# As a dose of the whole day [m/s^1.75] (ISO 2631-1 clause B.3.1): for rides with shocks.
CAUTION_ZONE_VDV_MPS175 = CautionZone(8.5, 17.0)
# The lines for n = 2 as drawn in Figure B.1: level up to 10 minutes, then a^2 t constant (Eq B.1).
_LEVEL_MPS2 = CautionZone(3.0, 6.0)


def caution_zone(hours: float, exponent: int) -> CautionZone:
    """The health guidance caution zone of weighted r.m.s. [m/s2] for ``hours`` a day, under a^n t constant with n =
    ``exponent``, 2 or 4.

    ISO 2631-1 Annex B, Figure B.1; Fig 2.20 of Blum (2015). The lines for n = 4 are doses of 8.5 and 17 m/s^1.75. Those
    for n = 2 have no formula there; they are read off the figure and meet the others at 6.0 hours. Raises ValueError
    for another exponent.
    """
    # Estimated dose of steady vibration: eVDV = 1.4 a_w T^(1/4) (ISO 2631-1 Eq B.3), and the doses that bound the
    # zone.
    dose_per_rms = 1.4
    level_until_hours = 1.0 / 6.0
    if exponent == 2:
        factor = math.sqrt(level_until_hours / max(hours, level_until_hours))
        return CautionZone(_LEVEL_MPS2.lower * factor, _LEVEL_MPS2.upper * factor)
    if exponent == 4:
        per_mps2 = dose_per_rms * (hours * S_PER_HOUR) ** 0.25
        return CautionZone(CAUTION_ZONE_VDV_MPS175.lower / per_mps2, CAUTION_ZONE_VDV_MPS175.upper / per_mps2)
    raise ValueError(f"the zone is drawn for exponents 2 and 4, not {exponent}")


LEAST_TAKEN_HZ = 40.0
"""Below, what a record shows (``dsp.whole_record``: to 0.45 of its rate) ends within the 4 to 12.5 Hz that Wk counts
most, or close above, and beside the 10 to 15 Hz at which wheels hop."""


@dataclass(frozen=True)
class RideComfort:
    """Figures by axis, and what each was weighted by: ``z`` always, ``x`` and ``y`` where all three are combined.

    weighted_mps2  (n,) the weighted vertical acceleration
    daily_hours    hours a day of such riding, for the health values
    left_out       an axis was recorded and not combined
    taken_hz       samples a second that were taken, where they were laid on another grid; None: ``rate_hz``
    seen_to_hz     nothing above it was recorded, as somebody says [Hz]; None: nobody does
    """

    rate_hz: float
    daily_hours: float
    axes: dict[str, AxisFigures]
    by: dict[str, Weighting]
    weighted_mps2: Array
    left_out: bool
    taken_hz: float | None = None
    seen_to_hz: float | None = None

    @property
    def weighting(self) -> Weighting:
        return self.by["z"]

    @property
    def vertical(self) -> AxisFigures:
        return self.axes["z"]

    @property
    def health_factors(self) -> dict[str, float]:
        """By axis (ISO 2631-1 clause 7.2.3); empty where the weighting is none of health."""
        if self.weighting.health_factor is None:
            return {}
        return {axis: k for axis in "xyz" if axis in self.by and (k := self.by[axis].health_factor) is not None}

    @property
    def unseen_from_hz(self) -> float | None:
        """Where the record ends and the weighting does not [Hz]; None when the record holds all that counts."""
        rate_hz = self.rate_hz if self.taken_hz is None else min(self.rate_hz, self.taken_hz)
        end_hz = rate_hz / 2 if self.seen_to_hz is None else min(rate_hz / 2, self.seen_to_hz)
        return end_hz if end_hz < self.weighting.counts_up_to_hz else None


def ride_comfort(accel_mps2: dict[str, Array | None], rate_hz: float, weighting: Weighting,
                 horizontal: Weighting | None, daily_hours: float | None = None, taken_hz: float | None = None,
                 seen_to_hz: float | None = None) -> RideComfort:
    """Weigh the axes of a record that belong together and take their figures.

    accel_mps2     (n,) by axis, ``z``, ``x`` and ``y``; None: not recorded
    weighting      of ``z``; ``horizontal`` that of the others beside it, None: they are not combined with it
    daily_hours    None: as long as the record
    taken_hz       of a record that was laid on this grid, the rate at which its samples were taken [Hz]
    seen_to_hz     what the record's facts say [Hz]; None: nothing

    ValueError for fewer than 80 samples a second, fewer than 40 that were taken, or less than 1 s.
    """
    shortest_s = 1.0
    # Rounded times make an 80 Hz record look a little slower.
    rate_rounding = 1e-3
    vertical = accel_mps2["z"]
    assert vertical is not None
    duration_s = len(vertical) / rate_hz
    if rate_hz < LOWEST_RATE_HZ * (1.0 - rate_rounding):
        raise ValueError(f"expected at least {LOWEST_RATE_HZ:g} samples a second, found {rate_hz:.4g}"
                         f"{time_hint(rate_hz)}")
    if taken_hz is not None and taken_hz < LEAST_TAKEN_HZ:
        raise ValueError(f"expected at least {LEAST_TAKEN_HZ:g} measured samples a second, found {taken_hz:.4g}")
    if duration_s < shortest_s:
        raise ValueError(f"expected at least {shortest_s:g} s, found {duration_s:.3g} s")
    weighted_mps2 = _weighed(weighting, vertical, rate_hz)
    axes, by = {"z": axis_figures(weighted_mps2, rate_hz)}, {"z": weighting}
    others = {axis: accel for axis, accel in accel_mps2.items() if axis != "z" and accel is not None}
    combined = horizontal is not None and len(others) == len("xy")
    if horizontal is not None and combined:
        for axis, accel in others.items():
            axes[axis], by[axis] = axis_figures(_weighed(horizontal, accel, rate_hz), rate_hz), horizontal
    hours = daily_hours if daily_hours is not None else duration_s / 3600.0
    return RideComfort(rate_hz, hours, axes, by, weighted_mps2, bool(others) and not combined, taken_hz, seen_to_hz)


def _weighed(weighting: Weighting, accel_mps2: Array, rate_hz: float) -> Array:
    """(n,); nothing at all of an axis that stands still: what a filter makes of a constant is its rounding."""
    still = 1e-12  # Of the level: a constant that was laid on another grid differs from itself by some parts in 1e15.
    if np.ptp(accel_mps2) <= still * np.abs(accel_mps2).max():
        return np.zeros(len(accel_mps2))
    return weighting.weigh(accel_mps2, rate_hz)
