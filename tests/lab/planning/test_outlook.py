"""What drives could show, beside plain least squares with the priors as rows of their own."""

from __future__ import annotations

import numpy as np
import pytest

from logger.arrays import Array
from logger.lab.likelihood.priors import Tolerance, VehiclePrior
from logger.lab.plan import (
    EffectGrid,
    FisherInformation,
    PlannedCar,
    PlannedDrive,
    SensorNoise,
    at_speed,
    outlook,
    repeat_run,
    representatives,
)
from logger.profiles.track import Track
from logger.roads import iso8608
from logger.runs import Run
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle

NAMES = ("sensor_gain", "sensor_offset", "payload")


def left_by(columns: Array, deviations: Array, change: Array) -> float:
    """Root of what is left of a change (n,) and of priors with these deviations (k,), by least squares over columns
    (k, n); infinite deviations: free."""
    rows = np.vstack([columns.T, np.diag(1 / deviations)])
    target = np.concatenate([change, np.zeros(len(columns))])
    found, *_ = np.linalg.lstsq(rows, target, rcond=None)
    return float(np.linalg.norm(target - rows @ found))


def test_what_remains_is_what_least_squares_leave() -> None:
    rng = np.random.default_rng(3)
    settings = EffectGrid.of([shipped_effects()[name] for name in NAMES])
    numbers, changes = rng.standard_normal((4, 60)), 5 * rng.standard_normal((len(settings.columns), 60))
    deviations = np.array([0.1, 0.3, 1.0, 3.0])
    every = np.vstack([numbers, changes])
    precision = deviations**-2.0
    information = FisherInformation((every @ every.T)[None], np.zeros(1))
    shown = representatives(settings, information, precision)
    found = outlook(settings, information, precision, shown)
    assert list(shown) == list(settings.first)
    for row, column in enumerate(shown):
        alone = left_by(numbers, deviations, changes[column])
        assert found.detectability[row] == pytest.approx(alone) == pytest.approx(found.pairwise[row, row])
        for other in set(range(len(NAMES))) - {row}:
            beside = [left_by(np.vstack([numbers, changes[one]]), np.append(deviations, np.inf), changes[column])
                      for one in settings.columns_of(other)]
            assert found.pairwise[row, other] == pytest.approx(min(beside))


def test_a_repeated_run_leaves_out_no_more_than_the_run() -> None:
    """A part's of a second: of that of a drive, two, there would be nothing left."""
    still = np.zeros(250)
    again = repeat_run(Run("part", 250.0, still, still, still, Track(1.0, np.zeros(2)), skip_s=0.1), [], 60.0)
    assert (again.rate_hz, again.first, again.count) == (250.0, 25, 250)


def test_an_effect_is_as_likely_named_as_not_where_it_just_stands_out() -> None:
    settings = EffectGrid.of([shipped_effects()["wheel_lift"]])
    information = FisherInformation(np.diag([1.0, 36.0])[None], np.zeros(1))
    found = outlook(settings, information, np.array([1.0]), settings.first)
    assert found.chances[0] == pytest.approx(0.5)


def planned(noise_mps2: float, speed_mps: float = 12.0) -> PlannedDrive:
    road = Track(0.05, iso8608.generate(256, 150.0, 0.05, seed=2))
    vehicle = read_vehicle(vehicle_file("rav4-2009"))
    count = len(VehiclePrior.of(vehicle, Tolerance()).names)
    there = PlannedCar(vehicle, vehicle, Tolerance(numbers=0.025), (), np.zeros(count))
    return PlannedDrive(at_speed("planned", road, vehicle, speed_mps), there, SensorNoise(noise_mps2))


def of_drive(drive: PlannedDrive, settings: EffectGrid) -> Array:
    changes = np.array([drive.change(one) for one in settings.columns])
    precision = drive.posterior.prior.precision
    total = drive.information(changes, ())
    return outlook(settings, total, precision, representatives(settings, total, precision)).detectability


def test_a_gain_stands_out_by_no_more_than_the_recorders_own_gain_allows() -> None:
    """A recorder's gain is known to 0.5 %: one of 5 % is ten deviations of it, however quiet the sensor is."""
    settings = EffectGrid.of([shipped_effects()[name] for name in NAMES])
    quiet, loud = (of_drive(planned(noise), settings) for noise in (0.005, 0.5))
    assert 5.0 < quiet[0] < 10.0
    assert (loud < quiet).all()


def test_noise_ten_times_as_loud_hides_ten_times_as_much_where_nothing_else_is_unknown() -> None:
    settings = EffectGrid.of([shipped_effects()["dry_friction"]])
    found = [of_drive(planned(noise), settings)[0] for noise in (1.0, 10.0)]
    assert found[0] == pytest.approx(10 * found[1], rel=0.15)
