"""Daily exposure and the caution zone, against numbers worked out by hand."""

from __future__ import annotations

from math import inf

import pytest

from logger.comfort import iso2631
from logger.comfort.iso2631 import (
    A8_MPS2,
    CAUTION_ZONE_VDV_MPS175,
    VDV_MPS175,
    CautionZone,
    a8,
    caution_zone,
    daily_vdv,
    hours_to_a8,
    hours_to_vdv,
)


def test_daily_exposure_of_two_hours() -> None:
    assert a8(0.8, 2.0) == pytest.approx(0.4)
    assert a8(0.8, 8.0) == 0.8
    assert hours_to_a8(1.0, A8_MPS2.action) == pytest.approx(2.0)
    assert hours_to_a8(0.0, A8_MPS2.action) == inf


def test_dose_of_a_day_from_a_part_of_it() -> None:
    assert daily_vdv(3.0, 1800.0, 8.0) == pytest.approx(6.0)  # sixteen times as long: twice the dose
    assert hours_to_vdv(3.0, 1800.0, 6.0) == pytest.approx(8.0)
    assert hours_to_vdv(0.0, 1800.0, 6.0) == inf


@pytest.mark.parametrize(
    ("value", "verdict"),
    [(0.5, "below_action_value"), (0.51, "above_action_value"), (1.15, "above_action_value"),
     (1.16, "above_limit_value")],
)
def test_action_and_limit_value(value: float, verdict: str) -> None:
    assert A8_MPS2.verdict(value) == verdict
    assert VDV_MPS175.verdict(9.1) == "below_action_value"
    assert VDV_MPS175.verdict(21.1) == "above_limit_value"


@pytest.mark.parametrize(
    ("hours", "exponent", "lower", "upper"),
    [
        (1 / 60, 2, 3.0, 6.0),
        (1 / 6, 2, 3.0, 6.0),
        (8.0, 2, 0.433, 0.866),  # 3 and 6 times sqrt(10 / 480)
        (24.0, 2, 0.25, 0.5),
        (1 / 60, 4, 2.182, 4.363),  # 8.5 and 17 over 1.4 times 60^(1/4)
        (8.0, 4, 0.466, 0.932),
        (5.963, 2, 0.5015, 1.003),  # where both pairs of lines meet
        (5.963, 4, 0.5015, 1.003),
    ],
)
def test_caution_zone(hours: float, exponent: int, lower: float, upper: float) -> None:
    zone = caution_zone(hours, exponent)
    assert (zone.lower, zone.upper) == (pytest.approx(lower, rel=1e-3), pytest.approx(upper, rel=1e-3))


def test_where_a_value_stands() -> None:
    zone = CautionZone(1.0, 2.0)
    assert [zone.verdict(value) for value in (0.9, 1.0, 2.0, 2.1)] == ["below_zone", "in_zone", "in_zone", "above_zone"]
    assert CAUTION_ZONE_VDV_MPS175.verdict(8.4) == "below_zone"
    with pytest.raises(ValueError, match="2 and 4"):
        caution_zone(8.0, 3)


def test_the_limits_are_those_of_the_directive() -> None:
    """Directive 2002/44/EC, Article 3(2)."""
    assert (iso2631.A8_MPS2.action, iso2631.A8_MPS2.limit) == (0.5, 1.15)
    assert (iso2631.VDV_MPS175.action, iso2631.VDV_MPS175.limit) == (9.1, 21.0)
