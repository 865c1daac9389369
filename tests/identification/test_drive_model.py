"""Predictions against the stepping simulation, and their derivatives against differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from logger.identification.drive_model import DriveModel
from logger.identification.prediction_error_fit import fit
from logger.profiles.track import Track
from logger.runs import CLIPPED, NO_READING, READING, Run
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.studies.drives import recorded
from logger.vehicle.named_parameters import changed, free, names
from logger.vehicle.vehicle import SensorPlace, Vehicle

from ..support.drives.bumps import bump_record, road_record

Array = npt.NDArray[np.float64]

HALF = read_vehicle(vehicle_file("rav4-2009"))
AWAY = replace(read_vehicle(vehicle_file("bmw-320i")), sensor=SensorPlace(0.7, 0.2))


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def values_of(model: DriveModel) -> Array:
    return np.array([one.start for one in model.parameters])


@pytest.mark.parametrize("car", [HALF, AWAY, read_vehicle(vehicle_file("golden-car"))], ids=lambda one: one.name)
@pytest.mark.parametrize("kind", ["bump", "road"])
def test_it_is_what_stepping_gives(car: Vehicle, kind: str) -> None:
    record = (bump_record(car, noise_mps2=0.0) if kind == "bump"
              else road_record(car, 30.0, 18.0, 3, noise_mps2=0.0, swing_mps=3.0))
    model = DriveModel(car, [], [record])
    assert rms(model.predict(np.empty(0))[0] - model.measured[0]) < 2e-5 * rms(model.measured[0])


def test_a_car_with_little_damping_on_a_road_that_climbs() -> None:
    car = changed(HALF, {"both.suspension_damping_n_s_per_m": 150.0})
    distance = np.arange(2000) * 0.12
    track = Track(0.05, 0.05 * np.arange(6000) * 0.05 + 0.01 * np.sin(np.arange(6000) * 0.05))
    measured = recorded(car, track, distance, 0.0, 0)
    model = DriveModel(car, [], [Run("run", 100.0, measured, distance, np.full(2000, 12.0), track)])
    assert rms(model.predict(np.empty(0))[0] - model.measured[0]) < 1e-4 * rms(model.measured[0])


def test_two_tracks_and_another_rate() -> None:
    generator = np.random.default_rng(1)
    track = Track(0.1, generator.standard_normal((400, 2)).cumsum(axis=0) * 0.002)
    car = replace(AWAY, sensor=SensorPlace(0.0, 0.5))
    distance = 2 + 14 * np.arange(200) / 100
    measured = recorded(car, track, distance, 0.0, 0)
    record = Run("run", 100.0, measured, distance, np.full(200, 14.0), track, skip_s=0.0)
    assert rms(DriveModel(car, [], [record]).predict(np.empty(0))[0] - measured) < 1e-4 * rms(measured)
    half_rate = Run("half", 50.0, measured[::2], distance[::2], record.speed_mps[::2], track, skip_s=0.0)
    slow = DriveModel(car, [], [half_rate]).predict(np.empty(0))[0]
    spectrum, slow_spectrum = (np.fft.rfft(one * np.hanning(len(one)))[2:30] for one in (measured, slow))
    assert np.abs(slow_spectrum * 2 - spectrum).max() < 0.02 * np.abs(spectrum).max()


@pytest.mark.parametrize("car", [HALF, AWAY], ids=["half", "full"])
def test_derivatives_are_those_of_the_prediction(car: Vehicle) -> None:
    record = road_record(car, 12.0, 15.0, 5)
    single = [name for name in names(car) if "anti_roll" not in name and "both" not in name]
    model = DriveModel(car, [free(car, name) for name in single], [record])
    values = values_of(model)
    predictions, slopes = model.predict(values), model.slopes(values)
    assert predictions[0] == pytest.approx(model.predict(values)[0], abs=1e-9)
    for index, name in enumerate(single):
        step = 1e-3 * max(abs(values[index]), 0.1) * (np.arange(len(values)) == index)
        difference = (model.predict(values + step)[0] - model.predict(values - step)[0]) / (2 * step[index])
        size = max(rms(difference), 1e-6 * rms(predictions[0]) / max(abs(values[index]), 0.1))
        assert rms(slopes[0][:, index] - difference) < 1e-3 * size, name


def test_a_road_has_the_spectrum_that_the_car_gives_it() -> None:
    record = road_record(HALF, 300.0, 15.0, 8, gd_n0_cm3=64.0, noise_mps2=0.0, swing_mps=0.0)
    model = DriveModel(HALF, [], [record])
    segments = model.measured[0][: 512 * 58].reshape(58, 512) * np.hanning(512)
    welch = (np.abs(np.fft.rfft(segments)) ** 2).mean(axis=0) * 2 / (100 * (np.hanning(512) ** 2).sum())
    f_hz = np.arange(257) * 100 / 512
    reported = 64.0 * model.road_spectra(np.empty(0), f_hz)[0]
    for low_hz, high_hz in ((0.8, 2), (2, 4), (4, 9), (9, 20), (20, 30)):
        band = (f_hz >= low_hz) & (f_hz < high_hz)
        assert welch[band].sum() == pytest.approx(reported[band].sum(), rel=0.12)


def test_records_that_are_none() -> None:
    record = bump_record(HALF)
    with pytest.raises(ValueError, match="columns of one length"):
        replace(record, speed_mps=record.speed_mps[1:])
    with pytest.raises(ValueError, match="longer than 6 s"):
        replace(record, skip_s=6.0)
    with pytest.raises(ValueError, match=r"found rear\.unsprung_mass_kg twice"):
        DriveModel(HALF, [free(HALF, f"{part}.unsprung_mass_kg") for part in ("rear", "both")], [record])
    with pytest.raises(ValueError, match="no parameter"):
        DriveModel(HALF, [replace(free(HALF, "sprung_mass_kg"), name="mass")], [record])


def gapped(seed: int, clipped_mps2: float = np.inf) -> Run:
    """A drive with gaps of 50 ms, in which anything stands, and clipped at a level."""
    record = road_record(HALF, 20.0, 15.0, 3, noise_mps2=0.02, swing_mps=2.0)
    usable = np.full(record.count, READING)
    usable[(np.arange(record.count) % 90) < 5] = NO_READING
    measured = np.where(usable == NO_READING, np.random.default_rng(seed).normal(0, 9, record.count),
                        np.clip(record.measured_mps2, -clipped_mps2, clipped_mps2))
    usable[(usable == READING) & (np.abs(measured) == clipped_mps2)] = CLIPPED
    return replace(record, measured_mps2=measured, usable=usable)


def test_what_stands_in_gaps_does_not_change_a_fit() -> None:
    found = []
    for seed in (1, 2):
        model = DriveModel(HALF, [free(HALF, "sprung_mass_kg")], [gapped(seed)])
        found.append(fit(model, model.measured).parameters["sprung_mass_kg"])
    assert found[0] == pytest.approx(found[1], rel=1e-6)
    assert found[0] == pytest.approx(HALF.sprung_mass_kg, rel=0.01)


def test_a_clipped_drive_is_fitted_as_one_that_is_not() -> None:
    record = gapped(1, clipped_mps2=0.8)
    assert record.usable is not None and (record.usable == CLIPPED).sum() > 50
    model = DriveModel(changed(HALF, {"sprung_mass_kg": 950.0}), [free(HALF, "sprung_mass_kg")], [record])
    assert fit(model, model.measured).parameters["sprung_mass_kg"] == pytest.approx(HALF.sprung_mass_kg, rel=0.003)
    as_read = DriveModel(HALF, [free(HALF, "sprung_mass_kg")], [replace(record, usable=np.where(
        record.usable == CLIPPED, READING, record.usable))])
    assert abs(fit(as_read, as_read.measured).parameters["sprung_mass_kg"] / HALF.sprung_mass_kg - 1) > 0.01
