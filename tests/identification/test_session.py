"""Around a fit: records that cannot be what they say are refused by their number, and none is fitted upside down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.identification.drive_model import DriveModel
from logger.identification.identifiability import NotIdentifiable
from logger.identification.session import drives_of, error_before, fit_options, upright_fit
from logger.profiles.track import Track
from logger.roads import iso8608
from logger.runs import Run
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.models import structure_of
from logger.vehicle.named_parameters import changed, free
from logger.vehicle.structure import body_point

from ..support.drives.linear_drive import drive

CAR = read_vehicle(vehicle_file("rav4-2009"))
ROAD = Track(0.05, iso8608.generate(64.0, 150.0, 0.05, 5))


def record(mass_kg: float = 875.0, rate_hz: float = 100.0, seconds: float = 8.0) -> Run:
    """15 m/s over the road in a car of this mass, a little noise on it."""
    structure = structure_of(changed(CAR, {"sprung_mass_kg": mass_kg}))
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    accel = drive(structure, [body_point(structure, 0.0, 0.0)], ROAD, time_s, 15.0 * time_s)[:, 0]
    noise = 0.05 * np.random.default_rng(1).standard_normal(len(accel))
    return Run("run", rate_hz, accel + noise, 15.0 * time_s, np.full(len(time_s), 15.0), ROAD)


def model_of(records: list[Run]) -> DriveModel:
    return DriveModel(CAR, [free(CAR, "sprung_mass_kg")], records)


def options(model: DriveModel):  # type: ignore[no-untyped-def]
    return fit_options(model, "white", None, 0)


def test_a_record_the_right_way_up_is_fitted() -> None:
    records = [record(800.0)]
    assert error_before(model_of(records)) > 0.05
    found = upright_fit(model_of, records, options)
    assert found.parameters["sprung_mass_kg"] == pytest.approx(800.0, rel=0.01)


def test_a_record_upside_down_is_refused() -> None:
    good = record()
    with pytest.raises(NotIdentifiable, match="upside down"):
        upright_fit(model_of, [replace(good, measured_mps2=-good.measured_mps2)], options)


def test_a_way_that_is_too_short_is_refused() -> None:
    with pytest.raises(ValueError, match="run: expected 20 to 20000 m of driving, found 13"):
        drives_of([record(seconds=2.9)])
