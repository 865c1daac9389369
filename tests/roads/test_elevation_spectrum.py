"""Spectra of profiles against scipy, printed equations and roads whose spectrum is known by their making."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.roads import iso8608
from logger.roads.elevation_spectrum import Spectrum, band_edges, classify, smooth, spectrum


def random_walk(gd_n0_cm3: float, length_m: float, spacing_m: float, seed: int) -> np.ndarray:
    """Steps of independent height: the slope's spectrum is level, so the road has waviness 2, at all wavelengths.

    A one-sided level S of the slope means a variance S / (2 spacing), and Gd(n0) = S / (2 pi n0)^2.
    """
    level = gd_n0_cm3 * 1e-6 * (2 * np.pi * 0.1) ** 2
    steps = np.random.default_rng(seed).normal(0, np.sqrt(level / (2 * spacing_m)) * spacing_m,
                                               round(length_m / spacing_m))
    return np.concatenate([[0.0], np.cumsum(steps)])


@pytest.mark.parametrize("length_m", [200.0, 1000.0, 8000.0])
def test_it_is_the_welch_spectrum_of_the_slope(length_m: float) -> None:
    from scipy import signal

    spacing_m = 0.1
    road = random_walk(64, length_m, spacing_m, 1)
    found = spectrum(road, spacing_m)
    size = round(1 / (found.step_cpm * spacing_m))
    n, slope_psd = signal.welch(np.diff(road) / spacing_m, 1 / spacing_m, "hann", size, size // 2, detrend="constant")
    assert found.wave_number_cpm == pytest.approx(n[1:])
    expected = slope_psd[1:-1] / (2 * np.sin(np.pi * n[1:-1] * spacing_m) / spacing_m) ** 2
    assert found.psd_m3[:-1] == pytest.approx(expected, rel=1e-9)


def test_a_cosine_holds_half_its_amplitude_squared() -> None:
    x = 0.05 * np.arange(40_001)
    found = spectrum(0.01 * np.cos(2 * np.pi * 0.37 * x) + 0.003 * x, 0.05)
    near = np.abs(found.wave_number_cpm - 0.37) < 0.05
    assert found.psd_m3[near].sum() * found.step_cpm == pytest.approx(0.01**2 / 2, rel=1e-3)


def test_a_tilt_or_a_hill_changes_nothing() -> None:
    road = random_walk(64, 2000, 0.1, 2)
    x = 0.1 * np.arange(len(road))
    plain, steep = classify(road, 0.1), classify(road + 0.08 * x + 300, 0.1)
    assert steep.gd_n0_cm3 == pytest.approx(plain.gd_n0_cm3, rel=1e-6)
    hill = classify(road + 20 * np.sin(np.pi * x / 2000) ** 2, 0.1)
    assert hill.gd_n0_cm3 == pytest.approx(plain.gd_n0_cm3, rel=0.01)
    assert hill.waviness == pytest.approx(plain.waviness, abs=0.02)


def printed_smoothing(psd: np.ndarray, step: float, low: float, high: float) -> float:
    """Eq 2.4 to 2.6 word for word; ``psd[j]`` is the value at j steps."""
    first, last = int(low / step + 0.5), int(high / step + 0.5)
    total = ((first + 0.5) * step - low) * psd[first] + (high - (last - 0.5) * step) * psd[last]
    total += sum(psd[j] * step for j in range(first + 1, last))
    return float(total / (high - low))


@settings(max_examples=60)
@given(st.floats(0.6, 30), st.floats(1.1, 40), st.integers(0, 2**31))
def test_smoothing_is_that_of_equation_2_4(low_steps: float, width_steps: float, seed: int) -> None:
    step = 0.004
    psd = np.random.default_rng(seed).exponential(size=100)
    edges = np.array([low_steps, low_steps + width_steps]) * step
    found = smooth(Spectrum(psd[1:], step, 100.0), edges).psd_m3
    assert found == pytest.approx([printed_smoothing(psd, step, *edges)], rel=1e-9)


def test_a_band_inside_one_step_has_its_value() -> None:
    bands = smooth(Spectrum(np.array([5.0, 7.0, 9.0]), 0.1, 100.0), np.array([0.16, 0.24]))
    assert bands.psd_m3 == pytest.approx([7.0])
    with pytest.raises(ValueError, match=r"0\.05 \.\.\. 0\.35"):
        smooth(Spectrum(np.array([5.0, 7.0, 9.0]), 0.1, 100.0), np.array([0.01, 0.24]))


def test_smoothing_bands_of_the_standard() -> None:
    edges = band_edges(iso8608.LOWEST_CPM, iso8608.HIGHEST_CPM)
    centres = np.sqrt(edges[1:] * edges[:-1])
    octaves, thirds, twelfths = centres[:2], centres[2:10], centres[10:]
    assert octaves == pytest.approx([0.0156, 0.0312], rel=0.005)
    assert thirds == pytest.approx([0.05, 0.063, 0.08, 0.1, 0.125, 0.16, 0.2, 0.25], rel=0.02)
    assert twelfths[1:] / twelfths[:-1] == pytest.approx(np.full(39, 2 ** (1 / 12)))
    assert edges[[0, -1]] == pytest.approx([0.0110, 2.83], rel=0.005)


def test_independent_roads_and_the_errors_that_were_promised() -> None:
    """Random walks have no edge at 0.011 cycles per metre and no set amplitudes; errors must be as large as stated."""
    for length_m, count in ((150, 80), (1000, 40)):
        reported = [classify(random_walk(100, length_m, 0.1, seed), 0.1) for seed in range(count)]
        log_gd = np.log([one.gd_n0_cm3 / 100 for one in reported])
        promised = np.mean([one.gd_n0_std_cm3 / one.gd_n0_cm3 for one in reported])
        assert abs(log_gd.mean()) < 3 * promised / np.sqrt(count) + 0.02
        assert log_gd.std() == pytest.approx(promised, rel=0.25)
        waviness = np.array([one.waviness for one in reported])
        promised = np.mean([one.waviness_std for one in reported])
        assert abs(waviness.mean() - 2) < 3 * promised / np.sqrt(count) + 0.02
        assert waviness.std() == pytest.approx(promised, rel=0.25)


@pytest.mark.parametrize("waviness", [1.5, 2.0, 2.5, 3.0])
def test_generated_roads_come_back(waviness: float) -> None:
    """Slope and level within 5 %, as a mean over seeds."""
    reported = [classify(iso8608.generate(256, 1000, 0.05, seed, waviness), 0.05) for seed in range(20)]
    assert np.exp(np.mean([np.log(one.gd_n0_cm3) for one in reported])) == pytest.approx(256, rel=0.05)
    assert np.mean([one.waviness for one in reported]) == pytest.approx(waviness, rel=0.02)
    assert all(one.road_class == "C" for one in reported)


@pytest.mark.parametrize("letter", ["A", "D", "H"])
def test_a_class_is_found_again(letter: str) -> None:
    gd_n0_cm3 = iso8608.CLASS_GD_N0_CM3[letter]
    letters = [classify(iso8608.generate(gd_n0_cm3, 200, 0.1, seed), 0.1).road_class for seed in range(100)]
    assert letters.count(letter) >= 95


def test_coarse_samples_limit_the_line_and_change_little() -> None:
    fine = iso8608.generate(64, 3000, 0.05, 4)
    reported, coarse = classify(fine, 0.05), classify(fine[::5], 0.25)
    assert (reported.lowest_cpm, reported.highest_cpm) == pytest.approx((0.011, 2.83), rel=0.005)
    assert coarse.highest_cpm == pytest.approx(1.0)
    assert coarse.gd_n0_cm3 == pytest.approx(reported.gd_n0_cm3, rel=0.05)
    assert coarse.waviness == pytest.approx(reported.waviness, abs=0.06)
    assert classify(fine, 0.05, widest_step_m=0.25).highest_cpm == pytest.approx(1.0)


def test_a_road_that_bends_off_the_line_is_less_certain() -> None:
    straight = iso8608.generate(64, 3000, 0.1, 6)
    x = 0.1 * np.arange(len(straight))
    washboard = straight + 0.01 * np.sin(2 * np.pi * x / 0.7)
    assert classify(washboard, 0.1).gd_n0_std_cm3 > 3 * classify(straight, 0.1).gd_n0_std_cm3


def test_what_is_possible_is_named() -> None:
    near_a_limit = classify(iso8608.generate(128, 150, 0.1, 1), 0.1)
    assert near_a_limit.classes == ("B", "C")
    assert near_a_limit.road_class in near_a_limit.classes
    assert classify(iso8608.generate(256, 2000, 0.1, 1), 0.1).classes == ("C",)


@pytest.mark.parametrize(("elevation", "spacing_m", "widest_m", "message"), [
    (np.zeros(999), 0.1, None, "too short.*at least 100 m, found 99.8 m"),
    (np.zeros(500), 0.4, None, "at most 0.3 m apart, found 0.4 m"),
    (np.full(2000, np.nan), 0.1, None, "finite"),
    (np.full(2000, 1e200), 0.1, None, "below 10000 m"),
    (np.zeros(2000), 0.1, None, "perfectly smooth"),
    (np.zeros(2000), 0.1, 2.0, "at most 0.625 m apart, found a step of 2 m"),
])
def test_what_cannot_be_classed(elevation: np.ndarray, spacing_m: float, widest_m: float | None, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        classify(elevation, spacing_m, widest_m)
