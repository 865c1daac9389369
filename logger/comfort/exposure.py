"""What a day of vibration does to health: daily exposure, its legal limits, and the caution zone of ISO 2631-1.

Problem: the same shaking is harmless for a minute and harmful for a working life, and there is no agreement on how
strength and duration trade: a^n t is constant (Eq 2.18 of Blum 2015) with n = 2 for one school, n = 4 for the other.

Solution: both, side by side. The European directive has a value for each, of which a state chooses one: A(8) goes with
n = 2, the vibration dose value with n = 4. The caution zone has a pair of lines for each, which lie close together
between 4 and 8 hours a day; there the zone has most behind it.

All values are those of the axis that is worst once multiplied by its health factor
(``logger.comfort.iso2631.HEALTH_FACTORS``), for people who sit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

HOURS_OF_REFERENCE = 8.0
S_PER_HOUR = 3600.0


@dataclass(frozen=True)
class ExposureLimits:
    """A value from which to act, and one not to be exceeded."""

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
# Estimated dose of steady vibration: eVDV = 1.4 a_w T^(1/4) (ISO 2631-1 Eq B.3), and the doses that bound the zone.
_DOSE_PER_RMS = 1.4
# The lines for n = 2 as drawn in Figure B.1: level up to 10 minutes, then a^2 t constant (Eq B.1).
_LEVEL_MPS2 = CautionZone(3.0, 6.0)
_LEVEL_UNTIL_HOURS = 1.0 / 6.0


def caution_zone(hours: float, exponent: int) -> CautionZone:
    """The health guidance caution zone of weighted r.m.s. [m/s2] for ``hours`` a day, under a^n t constant with n =
    ``exponent``, 2 or 4.

    ISO 2631-1 Annex B, Figure B.1; Fig 2.20 of Blum (2015). The lines for n = 4 are doses of 8.5 and 17 m/s^1.75. Those
    for n = 2 have no formula there; they are read off the figure and meet the others at 6.0 hours. Raises ValueError
    for another exponent.
    """
    if exponent == 2:
        factor = math.sqrt(_LEVEL_UNTIL_HOURS / max(hours, _LEVEL_UNTIL_HOURS))
        return CautionZone(_LEVEL_MPS2.lower * factor, _LEVEL_MPS2.upper * factor)
    if exponent == 4:
        per_mps2 = _DOSE_PER_RMS * (hours * S_PER_HOUR) ** 0.25
        return CautionZone(CAUTION_ZONE_VDV_MPS175.lower / per_mps2, CAUTION_ZONE_VDV_MPS175.upper / per_mps2)
    raise ValueError(f"the zone is drawn for exponents 2 and 4, not {exponent}")
