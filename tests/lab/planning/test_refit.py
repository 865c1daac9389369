"""What a refit leaves, where the right answer is known: a car with other numbers and nothing else, and small things."""

from __future__ import annotations

import numpy as np
import pytest

from logger.arrays import Array
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.plan import LinearisedDrives, PlannedDrive, refitted_gain

from .test_outlook import planned


def there_of(drive: PlannedDrive) -> LinearisedDrives:
    linear = drive.model()
    levels = [np.concatenate(drive.levels(drive.run, bands)) for bands in linear.posterior.bands]
    return LinearisedDrives(linear, levels, linear.state.predictions)


def change_of(drive: PlannedDrive, logs: Array) -> Array:
    """What other numbers of the car do to the record."""
    still = [np.zeros(one.count) for one in drive.posterior.record_errors]
    return np.asarray(drive.posterior.predict((), logs, still, rough=True)[0] - drive.run.measured_mps2)


def precision_of(drive: PlannedDrive) -> Array:
    return drive.posterior.prior.precision


def to_first_order(linear: LinearModel, change: Array) -> float:
    """What the car's numbers leave of a change of the prediction."""
    information = linear.information([one[None] for one in linear.whitened([change])])
    return float(1 / np.linalg.inv(information)[-1, -1])


@pytest.mark.parametrize("number", ["front.tire_stiffness_n_per_m", "sprung_mass_kg"])
def test_a_car_with_other_numbers_leaves_no_more_than_what_its_prior_costs(number: str) -> None:
    drive = planned(0.02)
    names = drive.posterior.prior.names
    logs = np.where(np.array(names) == number, np.log(1.2), 0.0)
    change, precision = change_of(drive, logs), precision_of(drive)
    gain = refitted_gain([there_of(drive)], [[change]], precision)
    costs = float(precision @ logs**2)
    assert 0 < gain < 1.01 * costs
    assert to_first_order(drive.model(), change) > 1.3 * gain


def test_what_is_small_leaves_what_first_order_says() -> None:
    drive, rng = planned(0.5), np.random.default_rng(4)
    change = 0.01 * rng.standard_normal(drive.run.count)
    expected = to_first_order(drive.model(), change)
    assert refitted_gain([there_of(drive)], [[change]], precision_of(drive)) == pytest.approx(expected, rel=0.05)


def test_what_is_far_above_the_noise_leaves_no_more_than_a_car_that_did_not_move() -> None:
    drive, rng = planned(0.02), np.random.default_rng(4)
    change, there = rng.standard_normal(drive.run.count), there_of(drive)
    bands, = there.linear.posterior.bands
    unmoved = float(bands.freedom @ np.log1p(bands.power(change) / there.levels[0]))
    assert refitted_gain([there], [[change]], precision_of(drive)) <= unmoved
