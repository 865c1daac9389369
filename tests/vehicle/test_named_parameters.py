"""Free numbers of a vehicle, by the names of its file."""

from __future__ import annotations

import pytest

from logger.shipped import vehicle_file, vehicle_names
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.named_parameters import Free, changed, free, names, read

CAR = read_vehicle(vehicle_file("rav4-2009"))


@pytest.mark.parametrize("vehicle", vehicle_names())
def test_what_was_changed_is_read_back_and_nothing_else_moves(vehicle: str) -> None:
    car = read_vehicle(vehicle_file(vehicle))
    for name in names(car):
        other = changed(car, {name: read(car, name) + 0.125})
        assert read(other, name) == pytest.approx(read(car, name) + 0.125)
        touched = {"front." + name[5:], "rear." + name[5:], name} if name.startswith("both.") else {
            name, name.replace("front.", "both."), name.replace("rear.", "both.")}
        assert all(read(other, one) == read(car, one) for one in names(car) if one not in touched)


def test_each_model_has_its_own_names() -> None:
    quarter, full = (names(read_vehicle(vehicle_file(one))) for one in ("golden-car", "rav4-2009-full"))
    assert not {name for name in quarter if name.startswith(("rear.", "both.", "sensor.")) or "cg_distance" in name}
    assert {"roll_inertia_kg_m2", "track_width_m", "sensor.left_m"} <= set(full)
    assert "front.anti_roll_stiffness_n_m_per_rad" in full
    assert "sensor.ahead_m" in names(CAR)


def test_both_axles_get_one_value() -> None:
    uneven = changed(CAR, {"rear.suspension_stiffness_n_per_m": 25_088.0})
    assert read(uneven, "both.suspension_stiffness_n_per_m") == pytest.approx(24_088)
    even = changed(uneven, {"both.suspension_stiffness_n_per_m": 20_000.0})
    assert (even.front.suspension_stiffness_n_per_m, even.rear and even.rear.suspension_stiffness_n_per_m) == (2e4, 2e4)


def test_bounds_of_their_own() -> None:
    assert free(CAR, "sprung_mass_kg") == Free("sprung_mass_kg", 875, 43.75, 17_500)
    assert free(CAR, "sprung_mass_kg", 700, (500, 1000)) == Free("sprung_mass_kg", 700, 500, 1000)
    assert (free(CAR, "sensor.ahead_m").low, free(CAR, "sensor.ahead_m").by_factors) == (-3.0, False)
    assert free(CAR, "contact_patch_m", 0.5).high == 1.0


def test_dampers_and_springs_are_no_lengths() -> None:
    for name in names(CAR):
        one, factor = free(CAR, name), 3 if name.endswith(("cg_distance_m", "track_width_m", "contact_patch_m")) else 20
        if not name.startswith("sensor."):
            assert (one.low, one.high) == pytest.approx((one.start / factor, one.start * factor)), name


def test_what_cannot_be_free() -> None:
    with pytest.raises(ValueError, match="no parameter 'mass'; expected one of sprung_mass_kg, "):
        read(CAR, "mass")
    with pytest.raises(ValueError, match="start between its bounds"):
        free(CAR, "sprung_mass_kg", 700, (800, 900))
    with pytest.raises(ValueError, match="start and bounds above 0"):
        free(read_vehicle(vehicle_file("rav4-2009-full")), "front.anti_roll_stiffness_n_m_per_rad")


@pytest.mark.parametrize(("start", "bounds"), [(0.0, (0.0, 2000.0)), (700.0, (0.0, 2000.0)), (700.0, (-1.0, 2000.0)),
                                               (-700.0, (-2000.0, -100.0)), (-700.0, None)])
def test_a_mass_is_more_than_nothing(start: float, bounds: tuple[float, float] | None) -> None:
    with pytest.raises(ValueError, match="sprung_mass_kg: expected a start and bounds above 0"):
        free(CAR, "sprung_mass_kg", start, bounds)
    assert free(CAR, "sensor.ahead_m", 0.0, (-1.0, 1.0)).start == 0.0
