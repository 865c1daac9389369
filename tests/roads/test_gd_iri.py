"""Degree of roughness and IRI: the computed relation against roads that were driven, and against the printed one."""

import numpy as np
import pytest

from logger.roads import iso8608
from logger.roads.elevation_spectrum import gd_of_road, iri_of_road, iri_per_root_gd, relative_spread
from logger.roads.iri import iri, rectified_slope

SPACING_M = 0.05


def test_it_is_the_printed_constant() -> None:
    """Eq 4.39 was fitted to 400 roads: 0.5386. Computed without any road: 0.8 % more."""
    assert iri_per_root_gd() == pytest.approx(iso8608.IRI_PER_ROOT_GD, rel=0.01)


@pytest.mark.parametrize("waviness", [1.5, 2.0, 3.0])
def test_stretches_of_long_roads_have_this_mean_and_spread(waviness: float) -> None:
    slope = np.concatenate([
        rectified_slope(iso8608.generate(64, 20_000, SPACING_M, seed, waviness), SPACING_M)[1000:] for seed in (1, 2)])
    for length_m in (20, 100, 250):
        steps = round(length_m / SPACING_M)
        stretches = 1000 * slope[: len(slope) // steps * steps].reshape(-1, steps).mean(axis=1)
        expected = iri_of_road(64, length_m, waviness)
        assert stretches.mean() == pytest.approx(expected.value, rel=0.01)
        assert stretches.std() == pytest.approx(expected.std, rel=0.15)


def test_the_exponent_is_one_half() -> None:
    """Eq 4.37, 4.38 on roads of Gd 2 to 4096 cm3."""
    gd_n0_cm3 = np.geomspace(2, 4096, 40)
    found = [iri(iso8608.generate(gd, 500, SPACING_M, seed), SPACING_M) for seed, gd in enumerate(gd_n0_cm3)]
    exponent, log_constant = np.polyfit(np.log(gd_n0_cm3), np.log(found), 1)
    assert exponent == pytest.approx(0.5, abs=0.005)
    assert np.exp(log_constant) == pytest.approx(0.5386, rel=0.02)


def test_there_and_back() -> None:
    there = iri_of_road(64, 100)
    back = gd_of_road(there.value, 100)
    assert back.value == pytest.approx(64)
    assert back.std / back.value == pytest.approx(2 * there.std / there.value)


def test_four_times_the_length_has_half_the_spread() -> None:
    assert relative_spread(8000) == pytest.approx(relative_spread(2000) / 2, rel=0.01)
    assert relative_spread(11) > relative_spread(20) > relative_spread(100)
