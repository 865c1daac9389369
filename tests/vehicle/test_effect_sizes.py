"""Effects in the sizes of a vehicle: those of cars stay, those of a rig follow by its dimensions."""

from dataclasses import replace

import pytest

from logger.shipped import vehicle_path
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.uncertain import dimensions_of, grows_with_mass, sized
from logger.vehicle.vehicle import Axle, Vehicle

RIG = Vehicle("bench", "quarter_car", 2.5, None, Axle(0.0, 0.4, 900.0, 12.0, 5400.0), None, 0.0)
CARS = ("rav4-2009", "sedan-2015", "ford-escort", "bmw-320i", "vw-vanagon", "rav4-2009-full")


@pytest.mark.parametrize("name", CARS)
def test_effects_of_cars_stay_what_they_are(name: str) -> None:
    car = read_vehicle(vehicle_path(name))
    assert all(sized(one, car) is one for one in shipped_effects().values())


def test_forces_springs_dampers_and_travels_of_a_rig_follow() -> None:
    """A hundredth of the mass, three times the frequency: forces go as m, springs as m / t2, travels as t2."""
    time = 10**-0.5
    starts = {one.name: one.start for effect in shipped_effects().values() for one in sized(effect, RIG).parameters}
    cars = {one.name: one.start for effect in shipped_effects().values() for one in effect.parameters}
    for name, factor in (("friction_force_n", 0.01), ("mount_stiffness_n_per_m", 0.01 / time**2),
                         ("tire_damping_n_s_per_m", 0.01 / time), ("clearance_m", time**2),
                         ("knee_velocity_m_per_s", time), ("cubic_stiffness_n_per_m3", 0.01 / time**6),
                         ("gain", 1.0), ("cutoff_hz", 1.0), ("delay_s", 1.0), ("offset_m", 1.0)):
        assert starts[name] == pytest.approx(cars[name] * factor), name


def test_bounds_hold_what_they_held_and_the_new_values() -> None:
    for effect in shipped_effects().values():
        for one, now in zip(effect.on(RIG).parameters, sized(effect, RIG).parameters, strict=True):
            assert now.low <= one.low <= one.high <= now.high
            assert all(now.low <= value <= now.high for value in (now.start, *now.trials))


def test_a_rig_with_a_wheelbase_has_places_of_its_size() -> None:
    rear = replace(RIG.front, cg_distance_m=0.15)
    bench = replace(RIG, model="half_car", sprung_mass_kg=5.0, pitch_inertia_kg_m2=0.1, front=rear, rear=rear)
    assert sized(shipped_effects()["sensor_offset"], bench).parameters[0].start == pytest.approx(0.03)


@pytest.mark.parametrize(("name", "mass", "length", "time"), [
    ("friction_force_n", 1, 1, -2), ("sprung_mass_kg", 1, 0, 0), ("front.suspension_stiffness_n_per_m", 1, 0, -2),
    ("pitch_inertia_kg_m2", 1, 2, 0), ("quadratic_damping_n_s2_per_m2", 1, -1, 0), ("clearance_m", 0, 1, 0),
    ("cubic_stiffness_n_per_m3", 1, -2, -2), ("transition_velocity_m_per_s", 0, 1, -1), ("damping_ratio", 0, 0, 0),
    ("contact_patch_m", 0, 1, 0)])
def test_the_powers_of_mass_length_and_time_in_a_unit(name: str, mass: int, length: int, time: int) -> None:
    assert dimensions_of(name) == (mass, length, time)
    assert grows_with_mass(name) == bool(mass)
