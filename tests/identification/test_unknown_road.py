"""Roads that nobody measured: the parts against dense algebra and the stepping simulation, the whole against truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from logger.identification.identifiability import APART, SILENT, TOGETHER, WEAK, NotIdentifiable
from logger.identification.unknown_road.marginal_likelihood import GD_N0, NOISE, Options
from logger.identification.unknown_road.road_fit import RoadFit, RoadProblem, fit_roads
from logger.identification.unknown_road.road_operator import Crossing, RoadDrive, grid_under
from logger.profiles.track import Track
from logger.roads.iso8608 import generate
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.studies.drives import recorded
from logger.vehicle.linear_car import AxleResponse
from logger.vehicle.named_parameters import changed, free
from logger.vehicle.vehicle import SensorPlace, Vehicle

Array = npt.NDArray[np.float64]

HALF, FULL, QUARTER = (read_vehicle(vehicle_file(name)) for name in ("rav4-2009", "rav4-2009-full", "golden-car"))
AWAY = changed(HALF, {"rear.suspension_stiffness_n_per_m": 27_000.0, "sensor.ahead_m": 0.6})
MASS, DAMPERS, INERTIA = "sprung_mass_kg", "both.suspension_damping_n_s_per_m", "pitch_inertia_kg_m2"
SPACING_M, NOISE_MPS2, GD = 0.05, 0.05, 64.0


def track(length_m: float, seed: int) -> Track:
    return Track(SPACING_M, generate(GD, length_m + 150, SPACING_M, seed), -100.0)


def driven(car: Vehicle, road: Track, speed_mps: float, length_m: float, seed: int, off_m: float = 0.0) -> RoadDrive:
    time_s = np.arange(round(100 * length_m / speed_mps)) / 100
    distance_m = speed_mps * time_s + 1.5 * (1 - np.cos(time_s / 2))
    return RoadDrive(100.0, recorded(car, road, distance_m, NOISE_MPS2, seed), distance_m + off_m)


def response(car: Vehicle, *names: str, start: float = 1.0) -> AxleResponse:
    return AxleResponse(car, [free(car, name, start * free(car, name).start) for name in names], 100.0)


def found(car: Vehicle, roads: list[list[RoadDrive]], *names: str, start: float = 1.1, **options: float) -> RoadFit:
    return fit_roads(response(car, *names, start=start), roads, Options(**{"probes": 6, "last_probes": 6, **options}))


@pytest.mark.parametrize("car", [HALF, AWAY, FULL, QUARTER], ids=["half", "away", "full", "quarter"])
def test_readings_are_those_of_the_simulation(car: Vehicle) -> None:
    road = track(150.0, 1)
    drive = driven(car, road, 14.0, 120.0, 1)
    clean = recorded(car, road, drive.distance_m, 0.0, 1)
    model = response(car, MASS)
    grid = grid_under([drive], model.behind_m, SPACING_M, 0.0)
    crossing = Crossing(drive, grid, model.behind_m, model.contact_patch_m)
    place = grid.start_m + SPACING_M * np.arange(grid.count)
    elevation = np.interp(place, road.start_m + SPACING_M * np.arange(len(road.elevation_m)), road.elevation_m)
    waves = np.ones(len(grid.wave_number_cpm), complex)
    gains = model.responses(np.array([free(car, MASS).start]), crossing.f_hz)[0]
    reported = crossing.readings(crossing.under_axles(elevation[None], waves), gains)[0]
    assert np.sqrt(np.mean((reported - clean + clean.mean()) ** 2)) < 0.02 * np.sqrt(np.mean(clean**2))


def test_the_way_back_is_the_transposed_way() -> None:
    generator = np.random.default_rng(0)
    drive = driven(HALF, track(100.0, 1), 14.0, 40.0, 1)
    model = response(HALF, MASS)
    grid = grid_under([drive], model.behind_m, 0.2, 1.0)
    crossing = Crossing(drive, grid, model.behind_m, model.contact_patch_m)
    waves = np.exp(2j * np.pi * 0.37 * grid.wave_number_cpm) / (1 + grid.wave_number_cpm)
    gains = model.responses(np.array([875.0]), crossing.f_hz)[0]
    white, readings = generator.standard_normal((2, grid.count)), generator.standard_normal((2, len(drive.distance_m)))
    there = crossing.readings(crossing.under_axles(white, waves), gains)
    assert (there * readings).sum(axis=1) == pytest.approx(
        (white * crossing.back(readings, waves, gains)).sum(axis=1), rel=1e-9)
    products = crossing.products(crossing.transform(readings), gains[None], crossing.under_axles(white, waves))
    assert products[:, 0] == pytest.approx((there * readings).sum(axis=1), rel=1e-9)


@pytest.mark.parametrize("car", [AWAY, FULL, QUARTER], ids=["half", "full", "quarter"])
def test_derivatives_of_the_response(car: Vehicle) -> None:
    names = [MASS, "front.unsprung_mass_kg", "front.suspension_damping_n_s_per_m", "front.tire_stiffness_n_per_m"]
    names += [INERTIA, "sensor.ahead_m"] * (car is not QUARTER)
    model, f_hz = response(car, *names), np.linspace(0.0, 45.0, 90)
    values = np.array([one.start for one in model.parameters])
    derivatives = model.responses(values, f_hz)[1]
    for index in range(len(names)):
        step = 1e-4 * max(abs(values[index]), 0.1) * (np.arange(len(values)) == index)
        low, high = (model.responses(values + sign * step, f_hz)[0] for sign in (-1, 1))
        difference = (high - low) / (2 * step.sum())
        assert np.abs(derivatives[index] - difference).max() < 1e-5 * max(np.abs(difference).max(), 1e-6)


@pytest.mark.slow
def test_slopes_and_information_are_those_of_the_dense_likelihood() -> None:
    """C built as a matrix from the same maps, its derivatives by differences, everything else from textbooks."""
    road = track(120.0, 2)
    drives = [driven(HALF, road, 12.0, 25.0, 1), driven(HALF, road, 20.0, 25.0, 2, 0.4)]
    options = Options(free_waviness=True, probes=40, scale_off=0.01)
    problem = RoadProblem(response(HALF, MASS, DAMPERS), [drives], options)
    x = problem.start()
    x[-2] = 0.3
    one = problem.roads.roads[0]

    def covariance(at: Array) -> Array:
        model = one.model(problem.roads.state(0, *problem.apart(at)))
        unit = np.eye(one.grid.count)
        maps = [crossing.readings(crossing.under_axles(unit, waves), gains).T for crossing, waves, gains in
                zip(one.crossings, model.waves, model.responses, strict=True)]
        whole = np.concatenate(maps)
        return np.asarray(whole @ whole.T + model.variance * np.eye(len(whole)))

    inverse = np.linalg.inv(covariance(x))
    y = np.concatenate(one.measured)
    u = inverse @ y
    steps = 1e-4 * np.eye(len(x))
    changes = [(covariance(x + step) - covariance(x - step)) / 2e-4 for step in steps]
    exact = np.array([0.5 * u @ change @ u - 0.5 * np.trace(inverse @ change) for change in changes])
    information = 0.5 * np.array([[np.trace(inverse @ a @ inverse @ b) for a in changes] for b in changes])
    looked = problem.score(x, information=True)
    deviations = np.sqrt(np.diag(information))
    assert looked.slopes / deviations == pytest.approx(exact / deviations, abs=4 / np.sqrt(options.probes))
    scale = np.outer(deviations, deviations)
    assert np.abs(looked.information / scale - information / scale).max() < 0.35


@pytest.mark.slow
def test_one_drive_over_a_road_of_which_only_the_kind_is_known() -> None:
    fitted = found(HALF, [[driven(HALF, track(280.0, 3), 14.0, 280.0, 3)]], MASS, DAMPERS)
    assert fitted.converged
    for name in (MASS, DAMPERS):
        truth = free(HALF, name).start
        assert fitted.parameters[name] == pytest.approx(truth, abs=3.5 * fitted.standard_errors[name])
        assert 0.02 * truth < fitted.standard_errors[name] < 0.2 * truth
    assert fitted.roads[f"road1.{GD_N0}"] == pytest.approx(GD, abs=3.5 * fitted.road_errors[f"road1.{GD_N0}"])
    assert fitted.roads[NOISE] == pytest.approx(NOISE_MPS2, rel=0.1)


@pytest.mark.slow
def test_what_probes_have_in_common_is_small_at_the_end() -> None:
    """Estimates that differ by nothing but the probes: their scatter is the standard error over the root of so many."""
    drives = [[driven(HALF, track(60.0, 3), 14.0, 50.0, 3)]]
    few, many = ([found(HALF, drives, MASS, seed=seed, probes=4, last_probes=count, refuse=False).parameters[MASS]
                  for seed in range(5)] for count in (4, 32))
    assert np.std(np.log(many)) < 0.5 * np.std(np.log(few))


@pytest.mark.slow
def test_two_drives_over_one_road_at_different_speeds() -> None:
    road = track(200.0, 4)
    drives = [driven(HALF, road, 10.0, 180.0, 1), driven(HALF, road, 18.0, 180.0, 2, off_m=-1.2)]
    fitted = found(HALF, [drives], MASS, DAMPERS, "both.unsprung_mass_kg", free_waviness=True)
    assert fitted.converged
    for name in fitted.parameters:
        truth = free(HALF, name).start
        assert fitted.parameters[name] == pytest.approx(truth, abs=3.5 * fitted.standard_errors[name])
        assert fitted.standard_errors[name] < 0.05 * truth
    assert fitted.roads["road1.drive2.place_offset_m"] == pytest.approx(1.2, abs=0.02)
    assert fitted.roads["road1.waviness"] == pytest.approx(2.0, abs=3.5 * fitted.road_errors["road1.waviness"])
    grid, elevation = fitted.grids[0], fitted.elevations[0]
    place = grid.start_m + grid.spacing_m * np.arange(grid.count)
    inside = (place > 40) & (place < 160)
    truth = np.interp(place, road.start_m + SPACING_M * np.arange(len(road.elevation_m)), road.elevation_m)
    slopes = np.diff(elevation[inside]), np.diff(truth[inside])
    assert np.corrcoef(*slopes)[0, 1] > 0.8


@pytest.mark.slow
def test_distances_that_disagree_a_little_are_found() -> None:
    road = track(150.0, 4)
    slow, fast = driven(HALF, road, 10.0, 95.0, 1), driven(HALF, road, 18.0, 95.0, 2)
    stretched = replace(fast, distance_m=fast.distance_m / 1.004 + 5.0)
    fitted = found(HALF, [[slow, stretched]], MASS, DAMPERS, place_off_m=10.0, scale_off=0.01)
    assert fitted.converged
    for name in fitted.parameters:
        assert fitted.parameters[name] == pytest.approx(free(HALF, name).start, abs=3.5 * fitted.standard_errors[name])
        assert fitted.standard_errors[name] < 0.04 * free(HALF, name).start
    scale, error = fitted.roads["road1.drive2.distance_scale"], fitted.road_errors["road1.drive2.distance_scale"]
    assert scale == pytest.approx(1.004, abs=max(3.5 * error, 1e-4))
    assert error < 2e-4
    with pytest.raises(NotIdentifiable, match="do not agree on one road"):
        found(HALF, [[slow, stretched]], MASS, probes=2)


@pytest.mark.release
def test_drives_over_two_roads_are_not_over_one() -> None:
    drives = [driven(HALF, track(120.0, seed), speed, 90.0, seed) for seed, speed in ((4, 10.0), (5, 18.0))]
    with pytest.raises(NotIdentifiable) as caught:
        found(HALF, [drives], MASS, probes=2, scale_off=0.01)
    assert [finding.kind for finding in caught.value.findings] == [APART]


@pytest.mark.slow
def test_roads_add_up() -> None:
    drives = [driven(HALF, track(150.0, seed), 14.0, 140.0, seed) for seed in range(2)]
    alone = found(HALF, [drives[:1]], MASS)
    both = found(HALF, [[one] for one in drives], MASS)
    assert both.standard_errors[MASS] == pytest.approx(alone.standard_errors[MASS] / np.sqrt(2), rel=0.35)
    assert {f"road1.{GD_N0}", f"road2.{GD_N0}", NOISE} == set(both.roads)


@pytest.mark.slow
def test_what_no_such_drive_can_tell() -> None:
    drive = driven(HALF, track(150.0, 5), 14.0, 120.0, 5)
    with pytest.raises(NotIdentifiable) as caught:
        found(HALF, [[drive]], MASS, INERTIA)
    assert [finding.kind for finding in caught.value.findings] == [SILENT]
    assert found(HALF, [[drive]], MASS, INERTIA, refuse=False).verdict[0].direction == {INERTIA: 1.0}
    everything = [MASS, INERTIA, *(f"both.{one}" for one in (
        "unsprung_mass_kg", "suspension_stiffness_n_per_m", "suspension_damping_n_s_per_m", "tire_stiffness_n_per_m"))]
    away = changed(HALF, {"sensor.ahead_m": 0.6})
    assert away.sensor == SensorPlace(0.6)
    road = track(200.0, 6)
    with pytest.raises(NotIdentifiable, match="share one scale") as caught:
        found(away, [[driven(away, road, speed, 80.0, 6) for speed in (10.0, 18.0)]], *everything, probes=2)
    assert caught.value.findings[0].kind == TOGETHER
    with pytest.raises(NotIdentifiable) as caught:
        found(HALF, [[driven(HALF, road, 14.0, 30.0, 1)]], MASS, DAMPERS, "both.suspension_stiffness_n_per_m")
    assert caught.value.findings[0].kind == WEAK


def test_what_is_not_asked_right() -> None:
    with pytest.raises(ValueError, match="cannot be found where the road is not known"):
        response(HALF, "contact_patch_m")
    with pytest.raises(ValueError, match="at least one free parameter"):
        fit_roads(response(HALF), [[driven(HALF, track(60.0, 1), 14.0, 40.0, 1)]])
    with pytest.raises(ValueError, match="a drive over every road"):
        fit_roads(response(HALF, MASS), [[]])
