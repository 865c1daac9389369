"""The low-pass: what passes, what does not, and how many samples are left."""

from __future__ import annotations

import numpy as np
import pytest

from logger.dsp.filters import DecimatingLowPass

TIME_S = np.arange(2000) / 100


@pytest.mark.parametrize("f_hz", [0.0, 1.0, 12.0, 19.9])
def test_what_lies_below_passes_in_its_place(f_hz: float) -> None:
    one = DecimatingLowPass(100.0, 20.0)
    kept = one.apply(np.cos(2 * np.pi * f_hz * TIME_S))
    at_s = one.apply(TIME_S)  # a straight line passes as it is
    assert np.diff(at_s) == pytest.approx(1 / one.kept_hz) == pytest.approx(0.02)
    assert np.abs(kept - np.cos(2 * np.pi * f_hz * at_s)).max() < 0.003


@pytest.mark.parametrize("f_hz", [30.0, 37.0, 49.0])
def test_what_lies_above_does_not(f_hz: float) -> None:
    assert np.abs(DecimatingLowPass(100.0, 20.0).apply(np.cos(2 * np.pi * f_hz * TIME_S))).max() < 0.003


def test_the_gain_is_that_of_the_filter_and_columns_are_filtered_alike() -> None:
    one = DecimatingLowPass(100.0, 23.0)
    noise = np.random.default_rng(0).standard_normal((20_000, 2))
    kept = one.apply(noise)
    f_hz = np.linspace(0, 50, 2001)
    assert kept.var() == pytest.approx((one.gain(f_hz) ** 2).mean(), rel=0.03)
    assert kept[:, 1] == pytest.approx(one.apply(noise[:, 1]))


def test_no_cut_off_changes_nothing() -> None:
    one = DecimatingLowPass(100.0)
    assert one.apply(TIME_S) is TIME_S
    assert (one.kept_hz, one.gain(TIME_S).min()) == (100.0, 1.0)


def test_what_cannot_be() -> None:
    with pytest.raises(ValueError, match="below 50 Hz, found 60"):
        DecimatingLowPass(100.0, 60.0)
    with pytest.raises(ValueError, match="expected more than"):
        DecimatingLowPass(100.0, 20.0).apply(TIME_S[:20])
