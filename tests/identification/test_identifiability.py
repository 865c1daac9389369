"""What the data cannot tell is refused in words, and what they can is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.identification.drive_model import DriveModel
from logger.identification.identifiability import SILENT, TOGETHER, WEAK, NotIdentifiable, statistical, structural
from logger.identification.prediction_error_fit import fit
from logger.runs import Run
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.named_parameters import changed, free, names
from logger.vehicle.vehicle import SensorPlace, Vehicle

from ..support.drives.bumps import bump_record, road_record

CAR = read_vehicle(vehicle_file("rav4-2009"))
BUMP = bump_record(CAR)
PLACES = ("cg_distance_m", "contact_patch_m", "ahead_m")
EVERYTHING = [name for name in names(CAR) if not name.startswith("both") and not name.endswith(PLACES)]
INERTIA, DAMPER = "pitch_inertia_kg_m2", "rear.suspension_damping_n_s_per_m"


def refusal(car: Vehicle, record: Run, *wanted: str) -> NotIdentifiable:
    model = DriveModel(car, [free(car, name) for name in wanted], [record])
    with pytest.raises(NotIdentifiable) as caught:
        fit(model, model.measured)
    return caught.value


@pytest.mark.parametrize("noise_mps2", [0.05, 0.0])
@pytest.mark.parametrize("others", [(), ("sprung_mass_kg",), ("front.suspension_stiffness_n_per_m",)])
def test_the_inertia_of_a_symmetric_car_read_at_its_centre(others: tuple[str, ...], noise_mps2: float) -> None:
    error = refusal(CAR, bump_record(CAR, noise_mps2=noise_mps2), INERTIA, *others)
    assert INERTIA in str(error)
    assert error.exit_status == 1
    assert error.findings[0].direction.keys() == {INERTIA}


def test_a_sensor_ahead_of_the_centre_sees_the_inertia() -> None:
    car = replace(CAR, sensor=SensorPlace(1.0))
    model = DriveModel(car, [free(car, INERTIA, 1400.0)], [bump_record(car)])
    found = fit(model, model.measured)
    assert found.parameters[INERTIA] == pytest.approx(1100, abs=4 * found.standard_errors[INERTIA])
    assert found.standard_errors[INERTIA] < 0.004 * 1100


@pytest.mark.parametrize("known", ["front.tire_stiffness_n_per_m", None])
def test_masses_rates_and_dampers_share_one_scale(known: str | None) -> None:
    car = changed(replace(CAR, sensor=SensorPlace(0.6)), {"rear.suspension_stiffness_n_per_m": 26_000.0})
    record = road_record(car, 60.0, 15.0, 2)
    wanted = [name for name in EVERYTHING if name != known]
    if known is None:
        error = refusal(car, record, *wanted)
        assert "share one scale" in str(error)
        assert [finding.kind for finding in error.findings] == [TOGETHER]
        assert set(error.findings[0].direction) == set(EVERYTHING)
    else:
        model = DriveModel(car, [free(car, name) for name in wanted], [record])
        found = fit(model, model.measured)
        assert max(found.standard_errors[name] / found.parameters[name] for name in wanted) < 0.2


def test_a_flat_road_says_nothing_of_a_damper() -> None:
    error = refusal(CAR, bump_record(CAR, height_m=1e-4), DAMPER)
    assert f"does not determine {DAMPER}" in str(error)
    assert error.findings[0].kind == WEAK
    assert refusal(CAR, bump_record(CAR, height_m=0.0), DAMPER).findings[0].kind == SILENT


def test_structure_is_read_off_the_derivatives() -> None:
    generator = np.random.default_rng(0)
    one, two = generator.standard_normal((2, 100))
    derivatives = np.stack([one, two, 2 * one - 3 * two, np.zeros(100)], axis=1)
    findings = structural(["a", "b", "c", "d"], derivatives, 10.0, 1e-7)
    assert [finding.kind for finding in findings] == [SILENT, TOGETHER]
    assert findings[1].direction == pytest.approx({"a": -2 / 3, "b": 1.0, "c": 1 / 3})
    assert not structural(["a", "b"], derivatives[:, :2], 10.0, 1e-7)


def test_weakness_is_read_off_the_covariance() -> None:
    assert not statistical(["a", "b"], np.diag([0.2, 0.1]) ** 2)
    assert [finding.direction for finding in statistical(["a", "b"], np.diag([0.2, 0.7]) ** 2)] == [{"b": 1.0}]
    both = np.array([[1.0, 0.999], [0.999, 1.0]])
    found, = statistical(["a", "b"], both)
    assert "nearly share one scale" in found.words
    found, = statistical(["a", "b"], both * [[1, -1], [-1, 1]])
    assert "a by +1.0% and b by -1.0%" in found.words or "a by -1.0% and b by +1.0%" in found.words


def test_of_what_was_known_before_any_error_is_an_estimate() -> None:
    apart = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.0], [0.0, 0.0, 0.01]])
    found, = statistical(["a", "b", "c"], apart, np.array([0.5, np.inf, 0.5]))
    assert found.direction == {"a": 1.0}
    assert not statistical(["a", "b", "c"], apart, np.array([2.0, np.inf, np.inf]))
