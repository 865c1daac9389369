"""What stands under the wheels of a rig, against sines whose values and means are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from logger.profiles.excitation import Excitation
from logger.profiles.track import Way

QUARTER = SimpleNamespace(behind_m=np.zeros(1), left_m=np.zeros(1), contact_patch_m=0.2, on_base=False)
FULL = SimpleNamespace(behind_m=np.array([0.0, 0.0, 2.5, 2.5]), left_m=np.array([1.0, -1.0, 1.0, -1.0]),
                       contact_patch_m=0.2, on_base=False)
OMEGA = 2 * np.pi * 10.0


def sine(rate_hz: float, start_s: float = 0.0) -> Excitation:
    time_s = start_s + np.arange(round(2 * rate_hz)) / rate_hz
    return Excitation(rate_hz, 0.003 * np.sin(OMEGA * time_s), start_s)


def still(time_s: np.ndarray) -> Way:
    return Way(np.zeros(len(time_s)), time_s)


@pytest.mark.parametrize(("rate_hz", "off"), [(500.0, 2e-5), (100.0, 1e-3)])
@pytest.mark.parametrize("start_s", [0.0, -0.31])
def test_a_sine_and_its_means_over_steps_come_back(rate_hz: float, off: float, start_s: float) -> None:
    time_s = 0.3 + np.arange(1000) / 1013.0
    elevation, mean = sine(rate_hz, start_s).under_wheels(still(time_s), QUARTER)
    ends = -np.cos(OMEGA * time_s) / OMEGA
    assert elevation[:, 0] == pytest.approx(0.003 * np.sin(OMEGA * time_s), abs=0.003 * off)
    assert mean[:, 0] == pytest.approx(0.003 * np.diff(ends) / np.diff(time_s), abs=0.003 * off)


def test_before_it_begins_and_after_it_ends_nothing_moves() -> None:
    one = Excitation(100.0, np.linspace(0.01, 0.03, 11), 0.5)
    elevation, mean = one.under_wheels(still(np.array([-1.0, 0.2, 0.5, 0.55, 0.6, 2.0])), QUARTER)
    assert elevation[:, 0] == pytest.approx([0.01, 0.01, 0.01, 0.02, 0.03, 0.03])
    assert mean[:, 0] == pytest.approx([0.01, 0.01, 0.015, 0.025, 0.03])


def test_rear_wheels_stand_on_the_second_column_whatever_the_wheelbase() -> None:
    both = Excitation(100.0, np.stack([np.full(8, 0.001), np.full(8, 0.002)], axis=1))
    elevation, _ = both.under_wheels(still(np.array([0.0, 0.01])), FULL)
    assert elevation[0] == pytest.approx([0.001, 0.001, 0.002, 0.002])
    one = Excitation(100.0, np.full(8, 0.001))
    assert one.under_wheels(still(np.array([0.0, 0.01])), FULL)[0][0] == pytest.approx([0.001] * 4)
    assert both.under_axle(still(np.array([0.0])), 2.5, 0.2) == pytest.approx([0.002])


def test_a_record_that_begins_later_sees_it_earlier() -> None:
    assert (sine(100.0).begun(0.25).start_s, sine(100.0).begun(0.25).end_s) == pytest.approx((-0.25, 1.74))


@pytest.mark.parametrize("elevation_m", [np.zeros(3), np.zeros((9, 3)), np.full(9, np.nan)])
def test_what_is_none_is_refused(elevation_m: np.ndarray) -> None:
    with pytest.raises(ValueError, match="excitation: expected"):
        Excitation(100.0, elevation_m)
