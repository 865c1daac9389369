"""The parts of a diagnosis without a profile: responses against the stepping simulation, likelihoods against dense
algebra."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from logger.api.lab.diagnose import same_road_json
from logger.identification.unknown_road.marginal_likelihood import at_n0
from logger.identification.unknown_road.road_operator import Crossing, RoadDrive, grid_under
from logger.lab.diagnosis import CandidateEffect
from logger.lab.likelihood.priors import Tolerance
from logger.lab.selection.holdout import AS_FILED, REFITTED, ErrorStep
from logger.lab.unknown_road.diagnosis import UnknownRoadDiagnosis, diagnose_same_road
from logger.lab.unknown_road.same_road import (
    DriveConditions,
    NotOneRoad,
    RoadFitState,
    SameRoad,
    Tabulated,
    certain_two_roads,
    fit,
    possible_two_roads,
    response_of,
    responses_of,
    road_agreements,
    screen,
)
from logger.profiles.track import Track
from logger.roads.iso8608 import CM3_M3, generate
from logger.runs import Run
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import Car, compose, recorded
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.linearise import is_linear
from logger.vehicle.simulate import Passage

Array = npt.NDArray[np.float64]

CAR = read_vehicle(vehicle_file("rav4-2009"))
RATE_HZ, SPACING_M, NOISE_MPS2 = 100.0, 0.05, 0.05
LONG = Track(SPACING_M, generate(64.0, 220.0, SPACING_M, 3), -110.0)
OTHER = Track(SPACING_M, generate(64.0, 220.0, SPACING_M, 4), -110.0)
FLAT = Track(1.0, np.zeros(2))
STEPS = (ErrorStep(AS_FILED, 0.4), ErrorStep(REFITTED, 0.3))


def named(name: str, **values: float) -> Chosen:
    return chosen(shipped_effects()[name], values)


def run_of(effects: list[Chosen], speed_mps: float, length_m: float, seed: int, road: Track = LONG,
           noise_mps2: float = NOISE_MPS2) -> Run:
    """A drive over the road, the simulation having begun five seconds before the record."""
    time_s = np.arange(-500, round(RATE_HZ * length_m / speed_mps)) / RATE_HZ
    distance_m = speed_mps * time_s + 0.8 * (1 - np.cos(time_s / 2))
    car = compose(CAR, effects)
    clean = recorded(car, Passage(road, RATE_HZ, car.driven(distance_m)))[500:]
    noise = noise_mps2 * np.random.default_rng(seed).standard_normal(len(clean))
    return Run(f"run{seed}", RATE_HZ, clean + noise, distance_m[500:], np.full(len(clean), speed_mps), FLAT)


def crossed(run: Run) -> Callable[[Array], Array]:
    """Readings by gains, of the car on its way over the true road."""
    drive, structure = RoadDrive(RATE_HZ, run.measured_mps2, run.distance_m), compose(CAR).structure
    behind_m = np.unique(structure.behind_m)
    grid = grid_under([drive], behind_m, SPACING_M, 0.0)
    crossing = Crossing(drive, grid, behind_m, structure.contact_patch_m)
    place = grid.start_m + SPACING_M * np.arange(grid.count)
    elevation = np.interp(place, LONG.start_m + SPACING_M * np.arange(len(LONG.elevation_m)), LONG.elevation_m)
    under = crossing.under_axles(elevation[None], np.ones(len(grid.wave_number_cpm), complex))

    def predicted(gains: Array) -> Array:
        table = Tabulated(behind_m, structure.contact_patch_m, RATE_HZ, gains, np.empty((0, *gains.shape), complex))
        return crossing.readings(under, table.responses(np.zeros(0), crossing.f_hz)[0])[0]

    return predicted


@pytest.mark.parametrize("effect", [
    named("tire_damping", tire_damping_n_s_per_m=600.0), named("top_mount_compliance", mount_stiffness_n_per_m=5e4),
    named("occupant", mass_kg=90.0, frequency_hz=4.0, damping_ratio=0.25), named("time_offset", delay_s=0.05),
    named("sensor_mount_resonance", frequency_hz=18.0, damping_ratio=0.1), named("sensor_offset", offset_m=0.5),
], ids=lambda one: one.effect.name)
def test_responses_are_those_of_the_simulation(effect: Chosen) -> None:
    run = run_of([effect], 14.0, 80.0, 1)
    predicted = crossed(run)
    reported = predicted(response_of(compose(CAR, [effect]), RATE_HZ))
    read = run.measured_mps2 - run.measured_mps2.mean()
    assert np.mean((reported - read) ** 2) < 1.1 * NOISE_MPS2**2 + 0.02**2 * np.mean(read**2)


@pytest.mark.parametrize("effect", [
    named("dry_friction", friction_force_n=50.0), named("damper_asymmetry", rebound_to_bump_ratio=1.5),
    named("progressive_spring", cubic_stiffness_n_per_m3=1e6), named("wheel_lift"),
    named("bump_stop", clearance_m=0.03, stop_stiffness_n_per_m=1e5),
], ids=lambda one: one.effect.name)
def test_what_bends_its_laws_has_no_response(effect: Chosen) -> None:
    with pytest.raises(ValueError, match="expected a linear car"):
        response_of(compose(CAR, [effect]), RATE_HZ)


@pytest.mark.parametrize("effect", [
    named("dry_friction", friction_force_n=150.0),
    named("damper_blow_off", knee_velocity_m_per_s=0.03, slope_ratio=0.2),
    named("progressive_spring", cubic_stiffness_n_per_m3=3e7),
], ids=lambda one: one.effect.name)
def test_a_linear_car_stands_in_for_one_that_bends_its_laws(effect: Chosen) -> None:
    """Most of what such an effect does to a record of the stepping simulation is in proportion to the road, and not to
    one that moves the car less."""
    run = run_of([effect], 14.0, 200.0, 1)
    predicted = crossed(run)
    level = float(np.log(64.0 / at_n0(2.0)))  # as LONG was generated

    def left(car: Car, level: float) -> float:
        (gains,) = responses_of(car, RATE_HZ, [DriveConditions(14.0, level, 2.0)])
        off = run.measured_mps2 - run.measured_mps2.mean() - predicted(gains)
        return float(np.mean(off**2)) - NOISE_MPS2**2

    bent = compose(CAR, [effect])
    assert not is_linear(bent)
    assert left(bent, level) < 0.5 * left(compose(CAR), level)
    assert left(bent, level) < left(bent, level - np.log(100.0))


@pytest.mark.slow
def test_friction_is_not_taken_for_another_damping() -> None:
    """A linear damper comes near what friction does, if each drive is over one road of one roughness: not near enough
    if the friction itself is a candidate."""
    rubbing = named("dry_friction", friction_force_n=100.0, transition_velocity_m_per_s=0.0)
    runs = [run_of([rubbing], speed, 110.0, seed) for seed, speed in ((1, 9.0), (2, 15.0))]
    effects = {name: shipped_effects()[name] for name in ("dry_friction", "tire_damping", "sensor_gain")}
    found = diagnose_same_road(SameRoad(runs, CAR, Tolerance()), effects)
    assert "tire_damping" not in [one.effect.name for one in found.missing]
    assert [one.effect.name for one in found.missing] in ([], ["dry_friction"])
    assert found.missing or "dry_friction" in [one.effect.name for one in found.undecided]


def test_what_may_only_imitate_is_not_named() -> None:
    one = CandidateEffect(named("tire_damping", tire_damping_n_s_per_m=300.0), 0.28, 1e-12, 60.0)
    found = UnknownRoadDiagnosis((one,), (), STEPS, (), 0.1, {}, {}, {}, (), 0.1, 0.5, undecided=(one.one,))
    reported = same_road_json(found)
    assert reported["verdict"] == [] and reported["undecided"] == ["tire_damping"]
    assert any(words.startswith("Undecided: tire_damping. It explains more than") for words in reported["sentences"])


def deviance(problem: SameRoad, state: RoadFitState) -> float:
    """Minus twice the log-likelihood of all drives by their covariance, written out, and the priors."""
    total = problem.cost(state)
    for road, part, parts in zip(problem._roads.roads, problem._roads.parts, problem.stretches, strict=True):
        own, grid = state.roads[part], road.grid
        n = np.maximum(grid.wave_number_cpm, 0.01)
        psd = np.exp(own[0]) * CM3_M3 * (n / 0.2) ** -own[1]
        psd[0] = 0.0
        drives = iter(problem.tables(state.gains))
        rows = []
        for number, crossing in enumerate(road.crossings):
            off = 0.0 if number == 0 else own[1 + number]
            waves = np.sqrt(psd / (2 * grid.spacing_m)) * np.exp(2j * np.pi * grid.wave_number_cpm * off)
            response = next(drives).responses(np.zeros(0), crossing.f_hz)[0]
            rows.append(crossing.readings(crossing.under_axles(np.eye(grid.count), waves), response).T)
        matrix = np.concatenate(rows)
        covariance = matrix @ matrix.T + np.exp(2 * own[-1]) * np.eye(len(matrix))
        read = np.concatenate([drive.measured_mps2 - drive.measured_mps2.mean() for _, drive in parts])
        total += float(np.linalg.slogdet(covariance)[1] + read @ np.linalg.solve(covariance, read))
    return total


@pytest.mark.slow
def test_gains_are_those_of_dense_likelihoods() -> None:
    problem = SameRoad([run_of([], 9.0, 85.0, 1), run_of([], 15.0, 85.0, 2)], CAR, Tolerance())
    assert len(problem.stretches) == 1
    start = problem.start()
    before = replace(start, roads=start.roads + 0.02 * np.cos(np.arange(len(start.roads))))
    logs = 0.02 * np.cos(np.arange(len(start.logs)))
    after = RoadFitState((), logs, start.roads, problem.response((), logs))
    own = deviance(problem, before) - deviance(problem, after)
    found = problem.preconditioned(before).gain(before, after) * (1 + 1 / 8)
    assert found == pytest.approx(own, abs=max(4.0, 0.15 * abs(own)))


@pytest.mark.slow
def test_the_road_takes_a_gain_and_a_contact_patch() -> None:
    problem = SameRoad([run_of([], 9.0, 85.0, 1), run_of([], 15.0, 85.0, 2)], CAR, Tolerance())
    start = problem.start()
    base = fit(problem.preconditioned(start), start)
    gain, patch, damping = screen(base, [
        named("sensor_gain", gain=1.1), named("tire_enveloping", contact_patch_m=0.4),
        named("tire_damping", tire_damping_n_s_per_m=300.0)])
    assert gain.share_beyond_road < 0.02 and patch.share_beyond_road < 0.02 < 0.2 < damping.share_beyond_road
    assert 0.8 < base.state.noise_mps2 / NOISE_MPS2 < 1.2
    assert all(error < 0.5 for error in base.problem.errors(base.state))


def test_drives_over_other_roads_are_refused() -> None:
    here = run_of([], 14.0, 80.0, 1)
    far = replace(here, distance_m=here.distance_m + 500.0)
    with pytest.raises(NotOneRoad, match=r"run1 and run1: expected drives over the same road, found by the "
                                         "distances that no other drive shares 3 s with it"):
        SameRoad([here, far], CAR, Tolerance())
    with pytest.raises(NotOneRoad, match="elsewhere: expected drives over the same road"):
        SameRoad([here, run_of([], 9.0, 80.0, 2), replace(far, name="elsewhere")], CAR, Tolerance())


@pytest.mark.parametrize("effects", [[], [named("sensor_bandwidth", cutoff_hz=4.0)]], ids=["right", "lacking"])
def test_one_road_is_distinguished_from_two(effects: list[Chosen]) -> None:
    here = run_of(effects, 9.0, 85.0, 1)
    one = SameRoad([here, run_of(effects, 15.0, 85.0, 2)], CAR, Tolerance())
    assert all(found.is_significant for found in road_agreements(one, one.start()))
    two = SameRoad([here, run_of(effects, 15.0, 85.0, 2, OTHER)], CAR, Tolerance())
    assert not any(found.is_significant for found in road_agreements(two, two.start()))
    assert certain_two_roads(road_agreements(two, two.start())) == (0, 1)


@pytest.mark.slow
def test_the_one_drive_over_another_road_is_named() -> None:
    runs = [run_of([], 9.0, 85.0, 1), run_of([], 14.0, 85.0, 2, OTHER), run_of([], 15.0, 85.0, 3)]
    bandwidth = shipped_effects()["sensor_bandwidth"]
    with pytest.raises(NotOneRoad, match=r"run2: expected drives .* neither explains the other's record|run2 and "
                                         "run3: "):
        diagnose_same_road(SameRoad(runs, CAR, Tolerance()), {bandwidth.name: bandwidth})


def test_two_roads_with_a_bump_each_at_about_one_place() -> None:
    place_m = np.arange(len(LONG.elevation_m)) * SPACING_M + LONG.start_m
    roads = [Track(SPACING_M, road.elevation_m + high_m * np.exp(-0.5 * ((place_m - at_m) / wide_m) ** 2), road.start_m)
             for road, high_m, at_m, wide_m in ((LONG, 0.05, 40.0, 0.3), (OTHER, 0.03, 41.0, 0.6))]
    problem = SameRoad([run_of([], 9.0, 85.0, 1, roads[0]), run_of([], 15.0, 85.0, 2, roads[1])], CAR, Tolerance())
    assert not any(found.is_significant for found in road_agreements(problem, problem.start()))


def test_drives_that_drown_in_noise_are_not_refused() -> None:
    problem = SameRoad([run_of([], speed, 85.0, seed, noise_mps2=8.0) for seed, speed in ((1, 9.0), (2, 15.0))], CAR,
                       Tolerance())
    found = road_agreements(problem, problem.start())
    assert certain_two_roads(found) is None
    assert possible_two_roads(found) == [(0, 1)]


def test_a_car_that_hides_the_road_is_no_reason_to_refuse() -> None:
    soft = named("top_mount_compliance", mount_stiffness_n_per_m=1e4)
    problem = SameRoad([run_of([soft], speed, 85.0, seed, noise_mps2=0.01) for seed, speed in ((1, 9.0), (2, 15.0))],
                       CAR, Tolerance())
    trials_of_it = [chosen(soft.effect, values) for values in soft.effect.trials()]
    assert certain_two_roads(road_agreements(problem, problem.start())) == (0, 1)
    assert certain_two_roads(road_agreements(problem, problem.start(), trials_of_it)) is None


def test_errors_and_floor_are_over_the_same() -> None:
    runs = [run_of([], 9.0, 85.0, 1), run_of([], 15.0, 85.0, 2)]
    runs[1] = replace(runs[1], measured_mps2=runs[1].measured_mps2 + 1.5)
    problem = SameRoad(runs, CAR, Tolerance())
    read = np.concatenate([one for _, one, _ in problem.predicted_by_others(problem.start())])
    assert problem.size_mps2 == pytest.approx(np.sqrt(np.mean(read**2)))


def test_a_refitted_car_is_as_far_off_as_it_is_from_what_was_given() -> None:
    start_vehicle = replace(CAR, sprung_mass_kg=1.05 * CAR.sprung_mass_kg, contact_patch_m=0.15)
    problem = SameRoad([run_of([], 9.0, 85.0, 1), run_of([], 15.0, 85.0, 2)], CAR, Tolerance(), start_vehicle)
    start = problem.start()
    assert problem.prior.vehicle(problem.vehicle, start.logs) == start_vehicle
    assert problem.cost(start) == pytest.approx((np.log(1.05) / Tolerance().numbers) ** 2)


def test_what_was_not_fitted_says_so() -> None:
    one = CandidateEffect(named("tire_damping", tire_damping_n_s_per_m=300.0), 0.28, 0.5, 1.0, fitted=False)
    found = UnknownRoadDiagnosis((one,), (), STEPS, (), 0.1, {}, {}, {}, (), 0.1, 0.1,
                  (("slow", "brisk"),))
    reported = same_road_json(found)
    assert reported["candidates"][0]["error"] == 0.28 and reported["candidates"][0]["fitted"] is False
    assert reported["maybe_over_two_roads"] == [["slow", "brisk"]]
    assert any(words.startswith("Whether slow and brisk are over one road") for words in reported["sentences"])


@pytest.mark.slow
def test_no_noise_at_all_breaks_nothing() -> None:
    runs = [run_of([], speed, 85.0, seed, noise_mps2=0.0) for seed, speed in ((1, 9.0), (2, 15.0))]
    problem = SameRoad(runs, CAR, Tolerance())
    bandwidth = shipped_effects()["sensor_bandwidth"]
    found = diagnose_same_road(problem, {bandwidth.name: bandwidth})
    assert found.missing == () and not found.unexplained
    assert 0.002 <= found.noise_floor_error < 0.01
    assert problem.least_mps2 <= found.noise_mps2 < 0.01 * problem.size_mps2


@pytest.mark.slow
def test_noise_that_went_through_the_recorders_filter_is_noise_all_the_same() -> None:
    rng = np.random.default_rng(5)

    def filtered(run: Run) -> Run:
        f_hz = np.fft.rfftfreq(len(run.measured_mps2), 1 / RATE_HZ)
        spectrum = np.fft.rfft(rng.normal(0.0, NOISE_MPS2, len(run.measured_mps2))) / (1 + (f_hz / 44.0) ** 60)
        return replace(run, measured_mps2=run.measured_mps2 + np.fft.irfft(spectrum, len(run.measured_mps2)))

    runs = [filtered(run_of([], speed, 140.0, seed, noise_mps2=0.0)) for seed, speed in ((1, 9.0), (2, 14.0))]
    bandwidth = shipped_effects()["sensor_bandwidth"]
    found = diagnose_same_road(SameRoad(runs, CAR, Tolerance()), {bandwidth.name: bandwidth})
    assert found.missing == () and not found.unexplained
    assert found.noise_floor_error * SameRoad(runs, CAR, Tolerance()).size_mps2 == pytest.approx(NOISE_MPS2, rel=0.2)


@pytest.mark.parametrize("order", [(0, 1, 2), (0, 2, 1), (2, 0, 1)])
def test_drives_of_which_no_stretch_is_shared_by_all_are_placed_by_way_of_each_other(order: tuple[int, ...]) -> None:
    road = Track(SPACING_M, generate(64.0, 500.0, SPACING_M, 5), -110.0)

    def part(speed_mps: float, seed: int, low_m: float, high_m: float, off_m: float) -> Run:
        run = run_of([], speed_mps, 330.0, seed, road)
        own = slice(*np.searchsorted(run.distance_m, (low_m, high_m)))
        return replace(run, measured_mps2=run.measured_mps2[own], distance_m=run.distance_m[own] + off_m,
                       speed_mps=run.speed_mps[own])

    off_m = (0.0, 0.6, -1.2)
    parts = [part(12.0, 1, 0.0, 150.0, off_m[0]), part(15.0, 2, 0.0, 320.0, off_m[1]),
             part(13.0, 3, 170.0, 320.0, off_m[2])]
    problem = SameRoad([parts[one] for one in order], CAR, Tolerance())
    assert [len(shared) for shared in problem.stretches] == [2, 2]
    first = problem.start().roads
    for own, shared in zip(problem._roads.parts, problem.stretches, strict=True):
        there_m = np.array([off_m[order[run]] for run, _ in shared])
        assert first[own[2:-1]] == pytest.approx(there_m[0] - there_m[1:], abs=0.15)
    assert all(one.is_significant for one in road_agreements(problem, problem.start()))


@pytest.mark.slow
def test_what_fills_the_highest_frequencies_is_not_taken_for_noise() -> None:
    """Dry friction leaves power all over, more than a sensor of 0.01 m/s2 does anywhere; the road can be estimated."""
    rubbing = named("dry_friction", friction_force_n=80.0, transition_velocity_m_per_s=0.0)
    runs = [run_of([rubbing], speed, 110.0, seed, noise_mps2=0.01) for seed, speed in ((1, 9.0), (2, 15.0))]
    gain = shipped_effects()["sensor_gain"]
    problem = SameRoad(runs, CAR, Tolerance())
    found = diagnose_same_road(problem, {gain.name: gain})
    assert found.unexplained and found.excess > 2
    assert found.noise_floor_error * problem.size_mps2 == pytest.approx(0.01, rel=0.2)
