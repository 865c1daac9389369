"""Fits to coarse readings at places that are only about known: right numbers, with standard errors that are true."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ridelog
from logger.runs import RecordFacts

from ..benchmarks.coarse_identify import PLACE_STD_M, STEP_MPS2, TRUE, wandering


def drive(seed: int, step_mps2: float, noise_mps2: float, off_m: float) -> ridelog.Run:
    car = ridelog.read_vehicle("rav4-2009").with_numbers(TRUE)
    run = ridelog.simulate(car, ridelog.random_road(iso_class="B", length_m=140.0, seed=seed), 11.0,
                           noise_mps2=noise_mps2, step_mps2=step_mps2, seed=seed)
    away_m = off_m * wandering(len(run.distance_m), run.rate_hz, np.random.default_rng(seed))
    return replace(run, distance_m=run.distance_m + away_m)


def test_what_nobody_says_of_a_record_changes_nothing() -> None:
    run = drive(1, 0.0, 0.05, 0.0)
    found = ridelog.identify("rav4-2009", run, list(TRUE))
    assert (found.as_json()["rounding_by_bounds"], found.as_json()["moved_m"]) == (False, 0.0)
    assert "rounded" not in found.text and "Places" not in found.text


@pytest.mark.slow
def test_coarse_readings_are_bounds_where_the_file_says_so() -> None:
    """Noise of an eighth of a step: taken as noise, rounding makes 2.3 times of it (0.613 / sqrt(12) = 0.177 m/s2)."""
    run = drive(2, STEP_MPS2, 0.08, 0.0)
    plain = ridelog.identify("rav4-2009", run, list(TRUE))
    found = ridelog.identify("rav4-2009", replace(run, facts=RecordFacts(step_mps2=STEP_MPS2)), list(TRUE))
    assert found.as_json()["rounding_by_bounds"] and "Readings are rounded" in found.text
    for name, value in TRUE.items():
        assert abs(found.parameters[name] - value) < 3 * found.standard_errors[name]
        assert found.standard_errors[name] < 0.9 * plain.standard_errors[name]
    assert found.error_after == pytest.approx(plain.error_after, rel=0.02)  # of readings as they were read


@pytest.mark.slow
def test_places_that_are_off_are_found_and_their_errors_are_counted() -> None:
    run = drive(3, 0.0, 0.1, PLACE_STD_M)
    exact = ridelog.identify("rav4-2009", drive(3, 0.0, 0.1, 0.0), list(TRUE))
    found = ridelog.identify("rav4-2009", replace(run, facts=RecordFacts(place_std_m=PLACE_STD_M)), list(TRUE))
    assert 0.02 < found.as_json()["moved_m"] < 4 * PLACE_STD_M and "Positions are uncertain" in found.text
    assert found.error_after < 1.1 * exact.error_after
    for name, value in TRUE.items():
        assert abs(found.parameters[name] - value) < 3 * found.standard_errors[name]
        assert found.standard_errors[name] > 0.99 * exact.standard_errors[name]
