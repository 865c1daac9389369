"""The prior over published cars: it holds them, and a car goes through its coordinates unchanged."""

import numpy as np
import pytest

from logger.shipped import vehicle_path
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.models import structure_of
from logger.vehicle.modes import undamped_frequencies_hz
from logger.vehicle.published_cars import NUMBERS, car_of, coordinates_of, published_prior

TWO_AXLES = ("rav4-2009", "sedan-2015", "ford-escort", "bmw-320i", "vw-vanagon")


@pytest.mark.parametrize("name", TWO_AXLES)
def test_shipped_cars_lie_within_the_prior_and_go_through_it_unchanged(name: str) -> None:
    vehicle, prior = read_vehicle(vehicle_path(name)), published_prior()
    x = coordinates_of(vehicle)
    off = x - prior.mean
    assert off @ np.linalg.solve(prior.covariance, off) < 25.0  # chi2 with 11 degrees exceeds it once in 100 cars
    assert vehicle.rear is not None
    again = car_of(x, vehicle.front.cg_distance_m + vehicle.rear.cg_distance_m)
    np.testing.assert_allclose(coordinates_of(again), x, atol=1e-12)


def test_a_car_has_the_frequencies_that_its_header_says() -> None:
    rav4 = read_vehicle(vehicle_path("rav4-2009"))
    car = car_of(coordinates_of(rav4), 2.94, sprung_mass_kg=500.0)
    np.testing.assert_allclose(undamped_frequencies_hz(structure_of(car)), (1.10, 1.45, 10.97, 10.98), atol=0.006)


def test_the_spread_is_that_of_handbooks() -> None:
    """Gillespie, Fundamentals of Vehicle Dynamics (1992), chapter 5: bounce at 1 to 1.5 Hz, 0.2 to 0.4 of critical
    damping, wheels that hop near 10 to 12 Hz."""
    prior = published_prior()
    middle, std = np.exp(prior.mean), np.sqrt(np.diag(prior.covariance))
    for name, low, high in (("bounce_hz", 1.0, 1.7), ("damping_ratio", 0.15, 0.45), ("hop_hz", 9.0, 14.0)):
        for end in ("front", "rear"):
            at = NUMBERS.index(f"{end}.{name}")
            assert low < middle[at] < high
            assert np.abs(np.log([low, high]) - prior.mean[at]).max() < 3 * std[at]
    assert np.linalg.eigvalsh(prior.covariance).min() > 0
