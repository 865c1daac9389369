"""Fig 2.13 against the car's transfer function written out, and against the IRI of finely sampled waves."""

import numpy as np
import pytest

from logger.roads.iri import iri, slope_gain


def test_gain_is_the_transfer_function_of_the_golden_car() -> None:
    """-(kt / mu) s^2 over the characteristic polynomial, times the sinc of the 250 mm average."""
    n = np.geomspace(0.01, 10.0, 50)
    s = 2j * np.pi * n * 80 / 3.6
    polynomial = 0.15 * s**4 + (0.15 + 1) * 6 * s**3 + ((0.15 + 1) * 63.3 + 653) * s**2 + 6 * 653 * s + 63.3 * 653
    exact = np.abs(653 * s**2 / polynomial)
    assert slope_gain(n, tire_base_m=0) == pytest.approx(exact, rel=1e-9)
    assert slope_gain(n) == pytest.approx(exact * np.abs(np.sinc(0.25 * n)), rel=1e-9)


def test_gain_peaks_at_body_bounce_and_wheel_hop() -> None:
    n = np.linspace(0.01, 2.0, 4000)
    gain = slope_gain(n)
    peaks = n[1:-1][(gain[1:-1] > gain[:-2]) & (gain[1:-1] > gain[2:])]
    assert peaks == pytest.approx([0.065, 0.42], rel=0.05)
    assert gain[n < 0.2].max() == pytest.approx(1.5, abs=0.2)
    assert slope_gain([1 / 100, 1 / 0.25]) == pytest.approx([0, 0], abs=0.08)


@pytest.mark.parametrize("wavelength_m", [1.25, 2.5, 15.0, 40.0])
def test_a_wave_has_that_iri(wavelength_m: float) -> None:
    spacing_m = 0.005
    distance = spacing_m * np.arange(round(840 / spacing_m))
    profile = 0.002 * np.sin(2 * np.pi * distance / wavelength_m)
    # The mean of a rectified sine is 2 / pi of its amplitude, and the slope has 2 pi n times that of the height.
    expected = 4000.0 * 0.002 / wavelength_m * float(slope_gain(1 / wavelength_m))
    assert iri(profile, spacing_m) == pytest.approx(expected, rel=0.02)
