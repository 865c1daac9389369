"""A half car on two actuators, against equations of motion written here and solved by scipy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import StateSpace, lsim

from logger.profiles.excitation import Excitation
from logger.runs import RecordFacts, Run, Signal
from logger.simulation.virtual_drive import SimulatedRuns, steps_hz
from logger.vehicle.compose import Car, compose
from logger.vehicle.named_parameters import changed, read, sized
from logger.vehicle.vehicle import Axle, Vehicle

M, INERTIA, MU, K, C, KT, A, B = 5.0, 0.12, 0.4, 900.0, 12.0, 5400.0, 0.14, 0.18
BENCH = Vehicle("bench", "half_car", M, INERTIA, Axle(A, MU, K, C, KT), Axle(B, MU, K, C, KT), 0.2)
RATE_HZ, EXCITED_HZ, FINE = 200.0, 250.0, 20
SIGNALS = (Signal("pitch_rad_per_s", "pitch_rate"), Signal("rear_mps2", "acceleration", "rear_wheel"),
           Signal("front_m", "travel", "front_suspension"))


def tables(lasts_s: float) -> np.ndarray:
    """Heights under the front and the rear wheel (n, 2) [m], random up to 20 Hz, rising from rest."""
    n = round(lasts_s * EXCITED_HZ)
    f_hz, rng = np.fft.rfftfreq(n, 1 / EXCITED_HZ), np.random.default_rng(4)
    size = np.where((f_hz > 0.5) & (f_hz < 20.0), 1 / np.maximum(f_hz, 0.5), 0.0)
    z = np.fft.irfft(size * np.exp(2j * np.pi * rng.random((2, len(f_hz)))), n)
    return np.asarray((0.002 * z / z.std() * np.minimum(np.arange(n) / EXCITED_HZ, 1.0)).T)


def by_hand(heights: np.ndarray, at_s: np.ndarray, car: Vehicle = BENCH) -> np.ndarray:
    """Accelerations of the body and of the rear wheel, pitch rate and front travel (4, n)."""
    assert car.pitch_inertia_kg_m2 and car.rear
    axles = [car.front, car.rear]
    mass = np.diag([car.sprung_mass_kg, car.pitch_inertia_kg_m2, *(one.unsprung_mass_kg for one in axles)])
    ends = np.array([[1, car.front.cg_distance_m, -1, 0], [1, -car.rear.cg_distance_m, 0, -1]])  # of the suspensions
    tires = np.diag([one.tire_stiffness_n_per_m for one in axles])
    stiffness = ends.T @ np.diag([one.suspension_stiffness_n_per_m for one in axles]) @ ends
    stiffness[2:, 2:] += tires
    damping = ends.T @ np.diag([one.suspension_damping_n_s_per_m for one in axles]) @ ends
    a = np.block([[np.zeros((4, 4)), np.eye(4)], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    b = np.vstack([np.zeros((6, 2)), np.linalg.solve(mass[2:, 2:], tires)])
    rows = np.vstack([a[4], a[7], np.eye(8)[5], np.append(ends[0], np.zeros(4))])
    direct = np.vstack([b[4], b[7], np.zeros((2, 2))])
    time_s = np.arange((len(heights) - 1) * FINE + 1) / EXCITED_HZ / FINE
    under = CubicSpline(np.arange(len(heights)) / EXCITED_HZ, heights)(time_s)
    _, found, _ = lsim(StateSpace(a, b, rows, direct), under, time_s)
    return np.asarray(CubicSpline(time_s, found)(at_s).T)


@pytest.mark.parametrize("begins_s", [0.0, 0.73])
def test_each_axle_stands_on_its_own_table_and_every_signal_is_right(begins_s: float) -> None:
    heights = tables(8.0)
    time_s = begins_s + np.arange(round(6.5 * RATE_HZ)) / RATE_HZ
    nothing = np.zeros(len(time_s))
    run = Run("bench", RATE_HZ, nothing + 1.0, nothing, nothing, Excitation(EXCITED_HZ, heights, -begins_s),
              facts=RecordFacts(signals=SIGNALS), more=np.ones((3, len(time_s))))
    (joined,) = SimulatedRuns([run], steps_hz(BENCH)).predict(compose(BENCH))
    body, rear, pitch, travel = by_hand(heights, time_s)
    expected = np.stack([body, *(one - one.mean() for one in (pitch, rear, travel))])
    for one, other in zip(joined.reshape(4, -1), expected, strict=True):
        assert one[40:-40] == pytest.approx(other[40:-40], abs=4e-3 * float(np.abs(other).max()))


def test_one_table_moves_both_axles_at_once() -> None:
    heights = tables(6.0)
    run = Run("bench", RATE_HZ, *np.zeros((3, 1000)), Excitation(EXCITED_HZ, heights[:, 0]))
    both = replace(run, track=Excitation(EXCITED_HZ, np.stack([heights[:, 0]] * 2, axis=1)))
    one, other = SimulatedRuns([run, both]).predict(compose(BENCH))
    assert one == pytest.approx(other, abs=1e-12)


def test_a_quicker_vehicle_is_stepped_more_finely_and_a_car_as_ever() -> None:
    assert steps_hz(BENCH) == 2000.0
    assert steps_hz(replace(BENCH, front=replace(BENCH.front, tire_stiffness_n_per_m=60.0 * KT))) == 8000.0
    car = Vehicle("car", "quarter_car", 400.0, None, Axle(0.0, 40.0, 2e4, 1500.0, 2e5), None, 0.2)
    assert steps_hz(car) == 1000.0


def test_a_force_of_a_moved_mass_holds_no_vibration_that_is_faster_than_its_steps() -> None:
    """The bench hums at 990 Hz, by micrometres: as a mass times an acceleration that is as much as it moves on purpose.
    A recorder of 100 samples a second sees nothing of that, nor does it come back at 10 Hz where 500 steps a second
    are simulated."""
    rate_hz, count = 8000.0, 8 * 8000
    time_s = np.arange(count) / rate_hz
    slow, hum = 0.01 * np.sin(2 * np.pi * 3 * time_s), 9e-8 * np.sin(2 * np.pi * 990 * time_s + 0.7)
    at = 2.0 + np.arange(300) / 100
    facts = RecordFacts(main=Signal("force_n", "force", "front_suspension"))
    run = Run("part", 100.0, np.zeros(300), np.zeros(300), np.zeros(300), Excitation(
        rate_hz, slow + hum, -2.0, moves_part=True), facts=facts)
    vehicle = Vehicle("part", "component", 50.0, None, Axle(0.0, 0.0, 0.0, 30.0, 0.0), None, 0.0)
    (force_n,) = SimulatedRuns([run], 500.0).predict(compose(vehicle))
    phase = 2 * np.pi * 3
    expected = 0.01 * (30.0 * phase * np.cos(phase * at) - 50.0 * phase**2 * np.sin(phase * at))
    assert np.abs(force_n - expected).max() < 0.01 * np.abs(expected).max()


def test_derivatives_by_all_numbers_of_a_rig_are_those_of_its_equations_of_motion() -> None:
    heights, names = tables(5.0), sized(BENCH)
    time_s = 0.73 + np.arange(round(3.5 * RATE_HZ)) / RATE_HZ
    nothing = np.zeros(len(time_s))
    run = Run("bench", RATE_HZ, nothing + 1.0, nothing, nothing, Excitation(EXCITED_HZ, heights, -0.73),
              facts=RecordFacts(signals=SIGNALS), more=np.ones((3, len(time_s))))

    def moved(logs: np.ndarray) -> Vehicle:
        return changed(BENCH, {name: read(BENCH, name) * float(np.exp(one))
                               for name, one in zip(names, logs, strict=True)})

    here = np.linspace(-0.2, 0.2, len(names))
    which, (found,) = SimulatedRuns([run], 4 * steps_hz(BENCH)).linear_slopes(lambda logs: compose(moved(logs)), here)
    assert which == list(range(len(names)))
    for index, one in zip(which, found, strict=True):
        way = 1e-3 * (np.arange(len(names)) == index)
        high, low = (by_hand(heights, time_s, moved(here + by)) for by in (way, -way))
        expected = (high - low) / 2e-3
        for slope, right in zip(one.reshape(4, -1)[[0, 2, 1, 3]], expected, strict=True):
            off = (slope - right)[40:-40]
            assert np.abs(off - off.mean()).max() <= 5e-3 * np.abs(right).max()


@pytest.mark.parametrize("damping_ratio", [0.002, 1.0])  # rings on behind the record; two modes are one
def test_derivatives_of_a_mass_obey_its_dimensions_and_are_those_of_simulations(damping_ratio: float) -> None:
    mass_kg, stiffness = 3.0, 3.0 * (2 * np.pi * 4.0)**2
    vehicle = Vehicle("rig", "single_mass", mass_kg, None, Axle(
        0.0, 0.0, stiffness, 2 * damping_ratio * np.sqrt(stiffness * mass_kg), 0.0), None, 0.0)
    nothing, names = np.zeros(1200), sized(vehicle)
    run = Run("rig", RATE_HZ, nothing + 1.0, nothing, nothing, Excitation(EXCITED_HZ, tables(6.5)[:, 0], 0.0))

    def car(logs: np.ndarray) -> Car:
        return compose(changed(vehicle, {name: read(vehicle, name) * float(np.exp(one))
                                         for name, one in zip(names, logs, strict=True)}))

    runs = SimulatedRuns([run], 500.0)
    which, (found,) = runs.linear_slopes(car, np.zeros(len(names)))
    assert which == [0, 1, 2] and len(names) == 3
    assert np.abs(found.sum(axis=0)).max() < 1e-6 * np.abs(found).max()  # all forces and masses larger by one factor
    for one, way in zip(found, 1e-4 * np.eye(3), strict=True):
        (high,), (low,) = runs.predict(car(way)), runs.predict(car(-way))
        assert np.abs(one - (high - low) / 2e-4).max() < 1e-5 * np.abs(one).max()
