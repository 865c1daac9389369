"""Standard errors of numbers that hang together, and the cars that they leave possible."""

import numpy as np
import pytest

from logger.shipped import vehicle_file
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.effect import chosen
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.uncertain import NumberErrors, cars_off

RAV4 = read_vehicle(vehicle_file("rav4-2009"))
GAIN = shipped_effects()["sensor_gain"]


def masses(errors: NumberErrors) -> list[float]:
    cars = cars_off(RAV4, (), errors)
    return [float(one.structure.mass[0, 0]) for one in cars if isinstance(one, LinearCar)]


def test_each_independent_number_gives_a_car_a_standard_error_away() -> None:
    (heavier,) = masses(NumberErrors({"sprung_mass_kg": 87.5}))
    assert abs(np.log(heavier / 875.0)) == pytest.approx(0.1)
    assert len(masses(NumberErrors({"sprung_mass_kg": 20.0, "front.unsprung_mass_kg": 3.0}))) == 2


def test_numbers_that_hang_together_move_together() -> None:
    """As mass and all that carries it do, where a fit sees but their ratio."""
    errors = NumberErrors({"sprung_mass_kg": 87.5, "pitch_inertia_kg_m2": 110.0}, ((), (1.0,)))
    (one,) = cars_off(RAV4, (), errors)
    assert isinstance(one, LinearCar)
    assert one.structure.mass[0, 0] / 875.0 == pytest.approx(one.structure.mass[1, 1] / 1100.0)


def test_an_effects_own_errors_count_where_no_others_are_known() -> None:
    reported = chosen(GAIN, {"gain": 1.0}, standard_errors={"gain": 0.05})
    (alone,) = cars_off(RAV4, (reported,), None)
    (known,) = cars_off(RAV4, (reported,), NumberErrors({"sensor_gain.gain": 0.1}))
    gains = [abs(one.sensors[0].values["gain"] - 1) for one in (alone, known) if isinstance(one, LinearCar)]
    assert gains == pytest.approx([0.05, 0.1], rel=0.1)
    assert cars_off(RAV4, (), None) == ()


def test_a_covariance_gives_them_and_what_is_not_known_is_left_out() -> None:
    covariance = np.array([[4.0, 3.0, np.inf], [3.0, 9.0, 0.0], [np.inf, 0.0, np.inf]])
    covariance[0, 2] = covariance[2, 0] = 0.0
    found = NumberErrors.of_covariance(["a", "b", "c"], covariance)
    assert found.standard_errors == {"a": 2.0, "b": 3.0}
    assert found.matrix() == pytest.approx(np.array([[1.0, 0.5], [0.5, 1.0]]))


def test_a_number_that_the_car_does_not_have_is_refused() -> None:
    with pytest.raises(ValueError, match="wings"):
        cars_off(RAV4, (), NumberErrors({"wings": 1.0}))
