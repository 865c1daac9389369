"""What lay on the road, found together with the car: on drives that the stepping simulation made."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from logger.identification.drive_model import DriveModel
from logger.identification.identifiability import WEAK, NotIdentifiable
from logger.identification.noise_models import White
from logger.identification.prediction_error_fit import Fit, FitOptions, fit
from logger.identification.session import located
from logger.identification.unknown_inputs import (
    Bump,
    RoadInput,
    RoadStep,
    changed_input,
    expanded,
    free_input,
    input_names,
    is_input,
    read_input,
    run_and_name,
)
from logger.profiles.track import Track
from logger.roads.iso8608 import generate
from logger.runs import Run
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.studies.drives import recorded
from logger.vehicle.named_parameters import free
from logger.vehicle.vehicle import Vehicle

from ..support.drives.bumps import bump_record
from ..support.slow import slow

Array = npt.NDArray[np.float64]

HALF, QUARTER = (read_vehicle(vehicle_file(name)) for name in ("rav4-2009", "golden-car"))
FLAT = Track(1.0, np.zeros(2))
MASS, HEIGHT, WIDTH, START, SPEED = ("sprung_mass_kg", "bump.height_m", "bump.width_m", "bump.start_m", "speed_scale")
TRUTH = {MASS: 875.0, HEIGHT: 0.15, WIDTH: 2.6, START: 2.0, SPEED: 1.0}
GUESS = RoadInput(bump=Bump(2.2, 0.12, 3.0))


def on_flat_road(car: Vehicle, seed: int = 0) -> Run:
    return replace(bump_record(car, seed=seed), track=FLAT)


def step_record(car: Vehicle, height_m: float, speed_mps: float = 13.4, track: Track | None = None) -> Run:
    time_s = np.arange(600) / 100
    way = speed_mps * time_s
    place = np.arange(-20.0, way[-1] + 20, 0.01)
    road = height_m * (place >= 10.0)
    if track is not None:
        road = road + track.averaged(place, 0.0)
    measured = recorded(car, Track(0.01, road, place[0]), way, 0.05, 3)
    return Run("run", 100.0, measured, way, np.full(600, speed_mps), track or FLAT, 0.0)


def model(car: Vehicle, records: list[Run], road: RoadInput, *names: str, **start: float) -> DriveModel:
    numbers = [free_input(road, name, start.get(name)) if is_input(name) else free(car, name, start.get(name))
               for name in names]
    return DriveModel(car, numbers, records, road)


def found(car: Vehicle, records: list[Run], road: RoadInput, *names: str, **start: float) -> Fit:
    one = model(car, records, road, *names, **start)
    return fit(one, one.measured)


def test_derivatives_at_the_bounds_of_an_obstacle_stay_within_them() -> None:
    road = RoadInput(bump=Bump(2.0, 1.0, 50.0))
    one = model(HALF, [on_flat_road(HALF)], road, HEIGHT, WIDTH)
    values = np.array([1.0, 50.0])
    predicted, slopes = one.predict(values), one.slopes(values)
    np.testing.assert_allclose(slopes[0][:, 0], predicted[0], rtol=1e-5, atol=1e-5 * np.abs(predicted[0]).max())


def test_predictions_are_those_of_the_simulation() -> None:
    record = on_flat_road(HALF)
    clean = bump_record(HALF, noise_mps2=0.0).measured_mps2
    reported = model(HALF, [record], RoadInput(bump=Bump(2.0, 0.15, 2.6))).predict(np.empty(0))[0]
    assert np.sqrt(np.mean((reported - clean) ** 2)) < 2e-3 * np.sqrt(np.mean(clean**2))
    late = model(HALF, [replace(record, distance_m=1.05 * record.distance_m)],
                 RoadInput(bump=Bump(2.0, 0.15, 2.6), speed_scale=1.05)).predict(np.empty(0))[0]
    assert late == pytest.approx(reported, abs=1e-9)


@pytest.mark.parametrize("car", [HALF, QUARTER], ids=["half", "quarter"])
def test_derivatives_are_those_of_the_prediction(car: Vehicle) -> None:
    place = np.arange(-10.0, 100.0, 0.1)
    rough = Track(0.1, generate(64.0, 120.0, 0.1, 1)[: len(place)], place[0])
    record = replace(on_flat_road(car), track=rough)
    road = RoadInput(Bump(3.0, 0.1, 2.0), RoadStep(8.0, -0.03), 1.03)
    one = model(car, [record, replace(record, distance_m=record.distance_m + 1)], road,
                *(name for name in input_names(road) if name != START), "run2.bump.start_m")
    values = np.array([each.start for each in one.parameters])
    slopes = one.slopes(values)
    for index, number in enumerate(one.parameters):
        step = 1e-4 * (np.arange(len(values)) == index)
        for run, (low, high) in enumerate(zip(one.predict(values - step), one.predict(values + step), strict=True)):
            difference = (high - low) / 2e-4
            size = np.abs(difference).max()
            assert (size > 0) == (run == 1 or number.name != "run2.bump.start_m")
            assert slopes[run][:, index] == pytest.approx(difference, abs=1e-4 * max(size, 1e-9)), number.name


@pytest.mark.parametrize("names", [(MASS, HEIGHT, START), *slow(((MASS, HEIGHT, WIDTH, START),)),
                                   (MASS, HEIGHT, WIDTH, START, SPEED)])
def test_bump_and_mass_together(names: tuple[str, ...]) -> None:
    road = GUESS if WIDTH in names else RoadInput(bump=Bump(2.2, 0.12, 2.6))
    for seed in range(3):
        fitted = found(HALF, [on_flat_road(HALF, seed)], road, *names, **{MASS: 700.0})
        assert fitted.converged
        for name in names:
            assert fitted.parameters[name] == pytest.approx(TRUTH[name], abs=4 * fitted.standard_errors[name]), name
            assert fitted.standard_errors[name] < 0.004 * TRUTH[name]


def test_one_wheel_does_not_tell_speed_from_width() -> None:
    with pytest.raises(NotIdentifiable) as caught:
        found(QUARTER, [on_flat_road(QUARTER)], GUESS, HEIGHT, WIDTH, START, SPEED)
    finding, = caught.value.findings
    assert finding.kind == WEAK
    assert finding.direction[WIDTH] == pytest.approx(-finding.direction[SPEED], abs=0.1)
    assert found(QUARTER, [on_flat_road(QUARTER)], GUESS, HEIGHT, WIDTH, START).converged


def test_an_axle_distance_that_is_not_known_hides_the_speed() -> None:
    axles = ("front.cg_distance_m", "rear.cg_distance_m")
    one = model(HALF, [on_flat_road(HALF)], RoadInput(bump=Bump(2.0, 0.15, 2.6)), WIDTH, START, SPEED, *axles)
    with pytest.raises(NotIdentifiable, match="speed_scale"):
        fit(one, one.measured, FitOptions(noise=[White()]))


def test_a_drive_that_never_met_the_bump_says_nothing_of_it() -> None:
    with pytest.raises(NotIdentifiable, match=r"does not depend on bump\.height_m"):
        found(HALF, [replace(on_flat_road(HALF), distance_m=on_flat_road(HALF).distance_m - 200.0)], GUESS, HEIGHT)


@pytest.mark.parametrize("height_m", [0.0381, -0.0381])
def test_a_bridge_joint_from_a_known_mass(height_m: float) -> None:
    record = step_record(HALF, height_m)
    road = RoadInput(step=RoadStep(10.3, height_m / 2))
    fitted = found(HALF, [record], road, "step.height_m", "step.start_m")
    error_m = fitted.standard_errors["step.height_m"]
    assert fitted.parameters["step.height_m"] == pytest.approx(height_m, abs=4 * error_m)
    assert error_m < 0.01 * abs(height_m)
    assert fitted.parameters["step.start_m"] == pytest.approx(10.0, abs=0.02)


def test_a_step_on_a_road_whose_profile_is_known() -> None:
    place = np.arange(-20.0, 120.0, 0.1)
    rough = Track(0.1, generate(64.0, 150.0, 0.1, 4)[: len(place)], place[0])
    fitted = found(HALF, [step_record(HALF, 0.03, track=rough)], RoadInput(step=RoadStep(10.1, 0.02)),
                   "step.height_m", "step.start_m", MASS)
    for name, truth in (("step.height_m", 0.03), (MASS, 875.0)):
        assert fitted.parameters[name] == pytest.approx(truth, abs=max(4 * fitted.standard_errors[name], 2e-3 * truth))


def test_a_mass_in_proportion_to_the_height_that_was_assumed() -> None:
    """Fig 4.31: what a wrong height does, and that with the height free it does nothing."""
    record = step_record(HALF, 0.0381)
    masses = [found(HALF, [record], RoadInput(step=RoadStep(10.0, height_m)), MASS).parameters[MASS]
              for height_m in (0.0254, 0.0381, 0.0508)]
    assert masses[0] < 0.8 * masses[1] < 0.7 * masses[2]
    free_height = found(HALF, [record], RoadInput(step=RoadStep(10.0, 0.0254)), MASS, "step.height_m", "step.start_m")
    assert free_height.parameters[MASS] == pytest.approx(875, abs=4 * free_height.standard_errors[MASS])


def test_where_an_obstacle_lies() -> None:
    assert located(HALF, on_flat_road(HALF), RoadInput(bump=Bump(0.0, 0.1, 3.2)), "bump") == pytest.approx(2.0, abs=0.5)
    assert located(HALF, step_record(HALF, -0.03), RoadInput(step=RoadStep(0.0, -0.02)), "step") == pytest.approx(
        10.0, abs=0.3)
    long = replace(on_flat_road(HALF), distance_m=on_flat_road(HALF).distance_m * 1.0 + 1e5 * (np.arange(600) > 300))
    with pytest.raises(ValueError, match="expected a start_m"):
        located(HALF, long, RoadInput(bump=Bump(0.0, 0.1, 0.1)), "bump")


def test_three_runs_each_with_its_own_start() -> None:
    records = [replace(bump_record(HALF, seed=seed, start_m=2.0 + 0.3 * seed), track=FLAT) for seed in range(3)]
    names = expanded("each.bump.start_m", 3)
    assert names == ["run1.bump.start_m", "run2.bump.start_m", "run3.bump.start_m"]
    fitted = found(HALF, records, GUESS, MASS, HEIGHT, WIDTH, *names)
    assert [fitted.parameters[name] for name in names] == pytest.approx([2.0, 2.3, 2.6], abs=0.02)
    assert fitted.parameters[MASS] == pytest.approx(875, abs=4 * fitted.standard_errors[MASS])


def test_names_and_bounds() -> None:
    road = RoadInput(Bump(3.0, 0.1, 2.0), RoadStep(8.0, -0.03), 1.0)
    assert input_names(road) == [START, HEIGHT, WIDTH, "step.start_m", "step.height_m", SPEED]
    assert run_and_name("run2.bump.start_m") == (1, START)
    assert expanded(f"each.{START}", 1) == [START]
    assert (is_input("run3.speed_scale"), is_input("each.step.height_m"), is_input(MASS)) == (True, True, False)
    assert changed_input(road, {"run2.speed_scale": 1.1, HEIGHT: 0.2, "step.start_m": 7.0}, 1) == RoadInput(
        Bump(3.0, 0.2, 2.0), RoadStep(7.0, -0.03), 1.1)
    assert changed_input(road, {"run2.speed_scale": 1.1}, 0) == road
    down = free_input(road, "step.height_m")
    assert (down.start, down.by_factors) == (-0.03, True)
    assert (down.low, down.high) == pytest.approx((-0.6, -0.0015))
    assert not free_input(road, START).by_factors
    assert free_input(road, HEIGHT).high == 1.0
    with pytest.raises(ValueError, match="give it a bump or a step first"):
        read_input(RoadInput(), HEIGHT)


@pytest.mark.parametrize(("names", "message"), [
    (("run2.bump.start_m",), "there is 1 run"), (("run1.bump.start_m", START), "is free for all runs"),
    ((SPEED, SPEED), "found speed_scale twice"),
])
def test_names_that_do_not_fit(names: tuple[str, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        model(HALF, [on_flat_road(HALF)], GUESS, *names)
