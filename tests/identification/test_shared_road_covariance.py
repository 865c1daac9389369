"""Passes over one bump share its roughness: standard errors have to say so, and only then."""

from __future__ import annotations

import numpy as np
import pytest

from logger.api.identify.answer import common_words
from logger.identification.drive_model import DriveModel
from logger.identification.noise_models import RoadNoise
from logger.identification.prediction_error_fit import FitOptions, fit
from logger.identification.shared_road_covariance import CommonRoughness, may_have_common, with_common_roughness
from logger.identification.unknown_inputs import Bump, RoadInput, expanded, free_input
from logger.profiles.track import Track
from logger.roads.iso8608 import generate
from logger.roads.obstacles import speed_bump
from logger.runs import Run
from logger.studies.drives import RATE_HZ, rav4, recorded
from logger.vehicle.named_parameters import free

CAR, MASS, SPACING_M = rav4(), "sprung_mass_kg", 0.05
FLAT = Track(1.0, np.zeros(2))


def drive_over(speed_mps: float, road_seed: int, seed: int, off_m: float) -> Run:
    """Over a bump of 8 cm on a road of class A that the record knows nothing of."""
    place_m = np.arange(-30.0, 80.0, SPACING_M)
    rough = generate(16.0, SPACING_M * (len(place_m) + 1), SPACING_M, road_seed)[: len(place_m)]
    time_s = np.arange(round(54 / speed_mps * RATE_HZ)) / RATE_HZ
    way_m = speed_mps * time_s
    road = Track(SPACING_M, speed_bump(place_m, 20.0, 0.08, 3.6) + rough, -30.0)
    readings = recorded(CAR, road, way_m, 0.05, seed)
    return Run("run", 100.0, readings, way_m + off_m, np.full(len(time_s), speed_mps), FLAT)


def fitted(speeds_mps: tuple[float, ...], roads: tuple[int, ...]) -> tuple[DriveModel, CommonRoughness, float]:
    """What the drives have in common, and the standard error of the mass without that."""
    records = [drive_over(speed, road, 10 * road + number, 0.6 * number)
               for number, (speed, road) in enumerate(zip(speeds_mps, roads, strict=True))]
    road = RoadInput(bump=Bump(20.5, 0.08, 3.6))
    numbers = [free(CAR, MASS)] + [free_input(road, one) for one in expanded("each.bump.start_m", len(records))]
    model = DriveModel(CAR, numbers, records, road)
    found = fit(model, model.measured, FitOptions(noise=[RoadNoise(model.road_spectra)]))
    return model, with_common_roughness(model, found), found.standard_errors[MASS]


@pytest.mark.slow
@pytest.mark.parametrize(("speeds_mps", "least", "most"), [
    ((4.5, 4.5, 4.5), 1.4, 1.75),  # the root of three at most
    ((3.6, 4.5, 5.4), 1.15, 1.6),
])
def test_three_passes_over_one_bump(speeds_mps: tuple[float, ...], least: float, most: float) -> None:
    model, common, alone = fitted(speeds_mps, (7, 7, 7))
    assert 0.4 < common.share <= 1
    assert least < common.fit.standard_errors[MASS] / alone < most
    assert common.fit.covariance[0, 0] == pytest.approx(common.fit.standard_errors[MASS] ** 2)
    assert "are over one road" in " ".join(common_words(model, common))


@pytest.mark.slow
def test_three_bumps_alike() -> None:
    model, common, alone = fitted((4.5, 4.5, 4.5), (7, 8, 9))
    assert (common.share, common.growth, common.fit.standard_errors[MASS]) == (0.0, 1.0, alone)
    assert may_have_common(model)
    assert list(common_words(model, common)) == []


def test_one_drive_has_nothing_in_common() -> None:
    model, common, _ = fitted((4.5,), (7,))
    assert not may_have_common(model)
    assert common.share == 0.0


@pytest.mark.slow
def test_errors_of_passes_over_one_bump_are_as_large_as_they_are_said_to_be() -> None:
    reported = [fitted((4.5, 4.5), (seed, seed))[1].fit for seed in range(1, 11)]
    errors = np.array([one.parameters[MASS] / 875 - 1 for one in reported])
    expected = np.array([one.standard_errors[MASS] / 875 for one in reported])
    assert 0.6 < np.sqrt((errors**2).mean()) / expected.mean() < 1.5
