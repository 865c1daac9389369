"""Cars with effects: against the car without where they do nothing, and against Newton's laws where it rubs."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
import pytest

from logger.identification.drive_model import DriveModel
from logger.identification.identifiability import TOGETHER, NotIdentifiable
from logger.identification.noise_models import White
from logger.identification.prediction_error_fit import Fit, FitOptions, fit
from logger.identification.unknown_inputs import Bump, RoadInput, free_input, is_input
from logger.profiles.track import Track
from logger.runs import Run
from logger.simulation.virtual_drive import SimulatedRuns
from logger.store.formats.effect_file import shipped_effects
from logger.studies.drives import rav4
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, Parameter, RoadEffect, Scale, chosen
from logger.vehicle.named_parameters import free, free_number, free_parameter_named

from ..support.drives.bumps import bump_record, road_record
from ..support.drives.rubbing import FRICTION_N, rubbing_run

Array = npt.NDArray[np.float64]

CAR, EFFECTS = rav4(), shipped_effects()
MASS, FRICTION = "sprung_mass_kg", "dry_friction.friction_force_n"
FLAT = Track(1.0, np.zeros(2))


def effect(name: str, **values: float) -> Chosen:
    return chosen(EFFECTS[name], values)


def rubbing(friction_n: float) -> Chosen:
    return effect("dry_friction", friction_force_n=friction_n)


def model(records: list[Run], effects: list[Chosen], starts: dict[str, float], road: RoadInput | None = None
          ) -> DriveModel:
    road = road or RoadInput()
    numbers = []
    for name, start in starts.items():
        move = free_parameter_named(effects, name)
        if is_input(name):
            numbers.append(free_input(road, name, start))
        else:
            numbers.append(free(CAR, name, start) if move is None else free_number(effects, move, start))
    return DriveModel(CAR, numbers, records, road, effects)


def found(*asked: object) -> Fit:
    made = model(*asked)  # type: ignore[arg-type]
    return fit(made, made.measured, FitOptions(noise=[White()], starts=made.trials()))


def off(result: Fit, truth: dict[str, float]) -> Array:
    """Errors in standard errors."""
    return np.array([(result.parameters[name] - value) / result.standard_errors[name]
                     for name, value in truth.items()])


def recorded(run: Run, effects: list[Chosen], noise_mps2: float = 0.05, seed: int = 0) -> Run:
    """The run as this car with effects would have recorded it."""
    clean = SimulatedRuns([run]).predict(compose(CAR, effects))[0]
    return replace(run, measured_mps2=clean + noise_mps2 * np.random.default_rng(seed).standard_normal(run.count))


def test_a_load_of_nothing_changes_nothing() -> None:
    record = road_record(CAR, 12.0, 14.0, 3)
    starts = {name: free(CAR, name).start for name in
              (MASS, "front.suspension_damping_n_s_per_m", "rear.tire_stiffness_n_per_m", "contact_patch_m")}
    simulated = model([record], [effect("payload", mass_kg=0.0)], starts)
    exact = DriveModel(CAR, simulated.parameters, [record])
    values = np.array(list(starts.values()))
    (here, slopes), (expected, expected_slopes) = (
        (one.predict(values), one.slopes(values)) for one in (simulated, exact))
    assert np.std(here[0] - expected[0]) < 1e-5 * np.std(expected[0])
    assert (np.std(slopes[0] - expected_slopes[0], axis=0) < 0.01 * np.std(expected_slopes[0], axis=0)).all()


@pytest.mark.slow
def test_mass_and_friction_are_found_on_drives_by_newtons_laws_with_honest_errors() -> None:
    """Over draws of the sensor's noise."""
    truth = {MASS: CAR.sprung_mass_kg, FRICTION: FRICTION_N}
    there, starts = [rubbing(60.0)], {MASS: 800.0, FRICTION: 60.0}
    models = [model([rubbing_run(seed, road_seed=seed % 4)], there, starts) for seed in range(10)]
    errors = np.array([off(fit(one, one.measured, FitOptions(noise=[White()])), truth) for one in models])
    print(f"errors in standard errors: {errors.round(2).tolist()}, r.m.s. {np.sqrt((errors**2).mean()):.2f}")
    assert np.abs(errors).max() < 3.0
    assert 0.7 < np.sqrt((errors**2).mean()) < 1.4


def test_friction_from_none_at_all() -> None:
    run = recorded(road_record(CAR, 15.0, 12.0, 1, gd_n0_cm3=16.0), [rubbing(80.0)])
    assert np.abs(off(found([run], [rubbing(0.0)], {FRICTION: 0.0}), {FRICTION: 80.0})).max() < 3.0


class Written(RoadEffect):
    name = title = source = signature = shown_by = "written_low"
    parameters = (Parameter("times", 2.0, 1.0, 10.0, 1.0, Scale.LINEAR, (2.0,), "how much higher the road is"),)

    def road(self, p: SimpleNamespace, spacing_m: float, elevation_m: Array) -> Array:
        return np.asarray(p.times * elevation_m)


def test_a_road_that_differs_from_its_profile_does_so_under_a_bump_too() -> None:
    record = road_record(CAR, 4.0, 14.0, 3)
    low = replace(record, track=replace(record.track, elevation_m=record.track.elevation_m / 2))
    bump = RoadInput(bump=Bump(20.0, 0.1, 2.6))
    expected, = model([record], [effect("payload", mass_kg=0.0)], {MASS: 900.0}, bump).predict(np.array([900.0]))
    found, = model([low], [chosen(Written(), {"times": 2.0})], {MASS: 900.0}, bump).predict(np.array([900.0]))
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.slow
def test_a_bump_of_which_only_the_kind_is_known_beside_friction() -> None:
    truth = {MASS: 875.0, FRICTION: 100.0, "bump.height_m": 0.08, "bump.start_m": 12.0}
    run = recorded(bump_record(CAR, 8.0, height_m=0.08, start_m=12.0), [rubbing(100.0)])
    run = replace(run, track=FLAT, skip_s=2.0)
    road = RoadInput(bump=Bump(12.3, 0.07, 2.6))
    starts = {MASS: 800.0, FRICTION: 60.0, "bump.height_m": 0.07, "bump.start_m": 12.3}
    assert np.abs(off(found([run], [rubbing(60.0)], starts, road), truth)).max() < 3.0


@pytest.mark.slow
def test_a_speed_that_is_recorded_too_large() -> None:
    run = recorded(road_record(CAR, 12.0, 14.0, 5), [effect("sensor_gain", gain=1.1)])
    run = replace(run, distance_m=1.004 * run.distance_m, speed_mps=1.004 * run.speed_mps)
    starts = {"sensor_gain.gain": 1.0, "speed_scale": 1.0}
    result = found([run], [effect("sensor_gain", gain=1.0)], starts)
    assert np.abs(off(result, {"sensor_gain.gain": 1.1, "speed_scale": 1.004})).max() < 3.5


@pytest.mark.slow
def test_several_effects_at_once() -> None:
    there = [effect("sensor_bandwidth", cutoff_hz=20.0), effect("time_offset", delay_s=0.012), rubbing(70.0)]
    run = recorded(road_record(CAR, 15.0, 12.0, 2, gd_n0_cm3=16.0), there)
    starts = {"sensor_bandwidth.cutoff_hz": 30.0, "time_offset.delay_s": 0.0, FRICTION: 60.0}
    truth = {"sensor_bandwidth.cutoff_hz": 20.0, "time_offset.delay_s": 0.012, FRICTION: 70.0}
    assert np.abs(off(found([run], there, starts), truth)).max() < 3.0


def test_a_load_and_the_mass_can_be_estimated_only_together() -> None:
    load = effect("payload", mass_kg=50.0)
    run = recorded(road_record(CAR, 12.0, 14.0, 3), [load])
    with pytest.raises(NotIdentifiable) as refused:
        found([run], [load], {MASS: 875.0, "payload.mass_kg": 50.0})
    (finding,) = refused.value.findings
    assert finding.kind == TOGETHER
    assert {MASS, "payload.mass_kg"} == set(finding.direction)


def test_friction_that_the_noise_hides_is_refused() -> None:
    run = recorded(road_record(CAR, 12.0, 14.0, 3, gd_n0_cm3=256.0), [rubbing(20.0)], noise_mps2=2.0)
    with pytest.raises(NotIdentifiable, match=FRICTION):
        found([run], [rubbing(20.0)], {FRICTION: 20.0})


def test_noise_that_roads_make_is_that_of_the_car_with_its_effects() -> None:
    run, f_hz = road_record(CAR, 12.0, 14.0, 3), np.linspace(0.5, 30.0, 60)
    models = [model([run], [effect("sensor_gain", gain=gain)], {MASS: 875.0}) for gain in (1.0, 0.5)]
    plain, half = (one.road_spectra(np.array([875.0]), f_hz)[0] for one in models)
    assert half == pytest.approx(0.25 * plain)


@pytest.mark.parametrize(("name", "message"), [
    ("dry_friction.force", "expected dry_friction.friction_force_n, dry_friction.transition_velocity_m_per_s"),
    ("sensor_bandwidth.order", "expected sensor_bandwidth.cutoff_hz"),
    ("wheel_lift.height_m", "expected none of it"),
])
def test_numbers_that_effects_do_not_have(name: str, message: str) -> None:
    there = [rubbing(60.0), effect("sensor_bandwidth", cutoff_hz=30.0), effect("wheel_lift")]
    with pytest.raises(ValueError, match=message):
        free_parameter_named(there, name)


def test_a_number_stays_within_what_it_may_be() -> None:
    there = [rubbing(60.0)]
    move = free_parameter_named(there, FRICTION)
    assert move is not None
    number = free_number(there, move)
    assert (number.start, number.low, number.high, number.by_factors) == (60.0, 0.0, 2000.0, False)
    with pytest.raises(ValueError, match="expected a start between its bounds"):
        free_number(there, move, 2500.0)
