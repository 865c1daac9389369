"""Forces beyond those of the linear car, against the simulation of the car with its own laws."""

import numpy as np
import pytest

from logger.estimation.bent_forces import BentForces
from logger.estimation.car_response import WAVE_NUMBERS_CPM
from logger.profiles.track import Track
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose, recorded
from logger.vehicle.effect import chosen
from logger.vehicle.linearise import MovedCar, known_car
from logger.vehicle.simulate import Passage

RAV4 = read_vehicle(vehicle_file("rav4-2009"))
COUNT, RATE_HZ, SPEED_MPS = 2048, 100.0, 20.0
CYCLES, HEIGHTS_M = (32, 224), (0.01, 0.002)  # of the block: body bounce and wheel hop


@pytest.mark.parametrize(("name", "values"), [
    ("damper_asymmetry", {"rebound_to_bump_ratio": 1.3}),
    ("progressive_spring", {"cubic_stiffness_n_per_m3": 1e7}),
    ("damper_blow_off", {"knee_velocity_m_per_s": 0.1, "slope_ratio": 0.8}),
    ("dry_friction", {"friction_force_n": 20.0, "transition_velocity_m_per_s": 0.1}),
])
def test_with_them_the_linear_car_reads_as_the_other_does(name: str, values: dict[str, float]) -> None:
    """Weak laws, so that the linear car moves nearly as the other; what is left is of second order."""
    one = shipped_effects()[name]
    car = compose(RAV4, [chosen(one, values)])
    lengths_m = [SPEED_MPS * COUNT / RATE_HZ / cycles for cycles in CYCLES]
    at_m = np.arange(0, 1000, 0.02)
    track = Track(0.02, np.asarray(sum(height * np.sin(2 * np.pi * at_m / length)
                                       for height, length in zip(HEIGHTS_M, lengths_m, strict=True))))
    place_m = SPEED_MPS * np.arange(2 * COUNT) / RATE_HZ
    seen = recorded(car, Passage(track, RATE_HZ, place_m))[COUNT:]
    moved = known_car(car)
    assert isinstance(moved, MovedCar)
    linear = moved.at(SPEED_MPS, WAVE_NUMBERS_CPM, 2e-6 * (WAVE_NUMBERS_CPM / 0.1) ** -2.0)
    under = np.zeros((2, COUNT // 2 + 1), dtype=complex)
    plain = np.zeros(COUNT // 2 + 1, dtype=complex)
    for cycles, height, length in zip(CYCLES, HEIGHTS_M, lengths_m, strict=True):
        wave = -0.5j * COUNT * height
        delays = np.exp(-2j * np.pi * np.array([0.0, linear.structure.behind_m.max()]) / length)
        under[:, cycles] = wave * delays * np.sinc(RAV4.contact_patch_m / length)
        plain[cycles] = wave * complex(linear.response(np.array([SPEED_MPS / length]), SPEED_MPS)[0])
    forces = BentForces(moved, linear, SPEED_MPS, COUNT, RATE_HZ)
    beyond, variance = forces.reading(under, np.zeros(len(WAVE_NUMBERS_CPM)), np.ones(len(WAVE_NUMBERS_CPM)))
    without = np.sqrt(np.mean((seen - np.fft.irfft(plain, COUNT)) ** 2))
    left = np.sqrt(np.mean((seen - np.fft.irfft(plain, COUNT) - beyond) ** 2))
    assert left < 0.5 * without
    assert variance == pytest.approx(0.0, abs=1e-4)
