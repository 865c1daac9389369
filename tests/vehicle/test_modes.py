"""Natural frequencies against the dissertation's tables, another library's eigen-solver and free decay."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eig, eigh, expm

from logger.shipped import vehicle_file, vehicle_names
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.models import GOLDEN_CAR, quarter_car, structure_of
from logger.vehicle.modes import modes, undamped_frequencies_hz
from logger.vehicle.structure import Structure
from logger.vehicle.vehicle import Axle, Vehicle

GOLDEN = quarter_car(GOLDEN_CAR)
SHIPPED = {name: structure_of(read_vehicle(vehicle_file(name))) for name in vehicle_names()}
RAV4 = SHIPPED["rav4-2009"]


def one_at_a_time(structure: Structure) -> tuple[np.ndarray, np.ndarray]:
    """Frequency (n,) [Hz] and damping ratio (n,) of each coordinate while the others are held still: sqrt(k / m) / 2 pi
    and c / 2 sqrt(k m), with k, c, m from the diagonals of K, C, M."""
    m, c, k = (np.diag(matrix) for matrix in (structure.mass, structure.damping, structure.stiffness))
    return np.sqrt(k / m) / (2 * np.pi), c / (2 * np.sqrt(k * m))


def test_golden_car_of_table_4_1_has_1_2_and_11_hz_and_damping_0_40() -> None:
    assert undamped_frequencies_hz(GOLDEN) == pytest.approx([1.2, 11.0], abs=0.05)
    # By hand: det(K - x M) = 0.15 x^2 - (716.3 + 0.15 * 63.3) x + 63.3 * 653 = 0.
    by_hand = np.sqrt(np.sort(np.roots([0.15, -(716.3 + 0.15 * 63.3), 63.3 * 653.0]))) / (2 * np.pi)
    assert undamped_frequencies_hz(GOLDEN) == pytest.approx(by_hand, rel=1e-12)
    body_hz, _ = undamped_frequencies_hz(GOLDEN)
    assert 6.0 / (2 * 2 * np.pi * body_hz) == pytest.approx(0.40, abs=0.005)  # c / 2 m omega at the natural frequency
    frequency_hz, damping_ratio = one_at_a_time(GOLDEN)
    assert frequency_hz == pytest.approx([1.27, 11.0], abs=0.005)
    assert damping_ratio[0] == pytest.approx(0.377, abs=0.001)
    slow, fast = modes(GOLDEN)
    assert (slow.frequency_hz, slow.damping_ratio) == pytest.approx((1.236, 0.333), abs=0.001)
    assert (fast.frequency_hz, fast.damping_ratio) == pytest.approx((10.755, 0.302), abs=0.001)


def test_rav4_of_table_4_2_has_1_16_and_10_97_hz_and_damping_0_28_by_the_simple_formulas() -> None:
    frequency_hz, damping_ratio = one_at_a_time(RAV4)
    assert frequency_hz[[0, 2, 3]] == pytest.approx([1.16, 10.97, 10.97], abs=0.005)
    assert damping_ratio[0] == pytest.approx(0.28, abs=0.005)


def test_rav4_has_1_1_and_11_hz_when_all_is_coupled() -> None:
    """4.3.3. Its ends are equal, so bounce and pitch are two quarter cars, whose frequencies have a closed form."""
    by_hand = []
    for mass_on_each in (875.0 / 2, 1100.0 / (2 * 1.47**2)):
        k, t, m = 23088.0, 238180.0, 55.0
        squares = np.roots([mass_on_each * m, -(mass_on_each * (k + t) + m * k), k * t])
        by_hand += list(np.sqrt(squares) / (2 * np.pi))
    found = undamped_frequencies_hz(RAV4)
    assert found == pytest.approx(sorted(by_hand), rel=1e-9)
    assert found == pytest.approx([1.10, 1.45, 10.97, 10.98], abs=0.005)


@pytest.mark.parametrize("name", SHIPPED)
def test_frequencies_and_damping_agree_with_another_solver(name: str) -> None:
    """scipy on the pencil (K, M), and on the first-order pencil [[0, I], [-K, -C]] - s [[I, 0], [0, M]]."""
    car = SHIPPED[name]
    n = len(car.mass)
    squares = eigh(car.stiffness, car.mass, eigvals_only=True)
    assert undamped_frequencies_hz(car) == pytest.approx(np.sqrt(squares) / (2 * np.pi), rel=1e-9)
    zero, one = np.zeros((n, n)), np.eye(n)
    roots = eig(np.block([[zero, one], [-car.stiffness, -car.damping]]), np.block([[one, zero], [zero, car.mass]]))[0]
    upper = sorted(roots[roots.imag > 0], key=abs)
    found = modes(car)
    assert [mode.frequency_hz for mode in found] == pytest.approx([abs(s) / (2 * np.pi) for s in upper], rel=1e-8)
    assert [mode.damping_ratio for mode in found] == pytest.approx([-s.real / abs(s) for s in upper], rel=1e-7)
    swings = [s.imag / (2 * np.pi) for s in upper]
    assert [mode.damped_frequency_hz for mode in found] == pytest.approx(swings, rel=1e-7)


@pytest.mark.parametrize("name", SHIPPED)
def test_a_mode_set_free_swings_and_fades_in_its_own_shape(name: str) -> None:
    car = SHIPPED[name]
    for mode in modes(car):
        omega = 2 * np.pi * mode.frequency_hz
        s = omega * (-mode.damping_ratio + 1j * np.sqrt(1 - mode.damping_ratio**2))
        start = np.concatenate([mode.shape, s * mode.shape])
        later = expm(car.state_space()[0] * 0.1) @ start
        assert later == pytest.approx(np.exp(0.1 * s) * start, rel=1e-6, abs=1e-6 * np.abs(start).max())
        assert np.abs(mode.shape).max() == pytest.approx(1.0)


def test_a_car_without_dampers_rings_at_its_undamped_frequencies() -> None:
    for car in SHIPPED.values():
        found = modes(replace(car, damping=np.zeros_like(car.damping)))
        assert [mode.frequency_hz for mode in found] == pytest.approx(undamped_frequencies_hz(car), rel=1e-6)
        assert [mode.damping_ratio for mode in found] == pytest.approx(np.zeros(len(found)), abs=1e-9)


def test_a_body_damped_beyond_critical_creeps_back() -> None:
    """One mass on a spring and a damper, by a wheel too light and a tire too stiff to matter: s^2 + 60 s + 100 = 0."""
    car = structure_of(Vehicle("slug", "quarter_car", 1.0, None, Axle(0.0, 1e-3, 100.0, 60.0, 1e9), None, 0.0))
    slow, fast, *_ = modes(car)
    assert [mode.frequency_hz * 2 * np.pi for mode in (slow, fast)] == pytest.approx(
        [30 - np.sqrt(800.0), 30 + np.sqrt(800.0)], rel=1e-4,
    )
    for mode in (slow, fast):
        assert mode.damping_ratio == pytest.approx(1.0)
        assert mode.damped_frequency_hz == pytest.approx(0.0, abs=1e-6)
