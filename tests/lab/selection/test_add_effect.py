"""An effect that is added comes with its numbers, what it changed, and how often noise would do as much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.bounds import SURE_SIGMA
from logger.lab.likelihood.map_fit import align, fit, fit_to_the_end
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.standard_errors import standard_errors
from logger.lab.selection.add_effect import AddedEffects, ShiftedNumber, add, moved_between
from logger.lab.selection.candidate_fit import chance_of
from logger.lab.selection.evidence import FALSE_ALARM
from logger.runs import normalised_rms_error
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen
from logger.vehicle.named_parameters import read

from ...support.lab.runs_with_residual import CAR, measuring
from ...support.lab.secret_runs import EFFECTS, NOISE_MPS2, car_off_by, hidden, posterior_of, secret_runs

OFFSET_M = 0.4


@pytest.fixture(scope="module")
def runs() -> SimulatedRuns:
    return secret_runs([hidden("sensor_offset", offset_m=OFFSET_M)])


@pytest.fixture(scope="module")
def added(runs: SimulatedRuns) -> AddedEffects:
    return add(posterior_of(runs), [], [hidden("sensor_offset", offset_m=0.2)])


@pytest.mark.slow
def test_the_number_that_was_hidden_is_found_within_its_error(added: AddedEffects) -> None:
    (one,) = added.effects
    assert added.names == ("sensor_offset",) and added.new == (one,)
    error = one.standard_errors["offset_m"]
    assert 0.002 < error < 0.03
    assert one.values["offset_m"] == pytest.approx(OFFSET_M, abs=4 * error)


@pytest.mark.slow
def test_where_a_search_ended_changes_nothing_of_where_the_fit_ends(runs: SimulatedRuns, added: AddedEffects) -> None:
    posterior, one = posterior_of(runs), hidden("sensor_offset", offset_m=0.2)
    near = fit(align(posterior, posterior.start([one]))).state
    again = add(posterior, [], [one], near=near)
    assert again.effects[0].values["offset_m"] == pytest.approx(added.effects[0].values["offset_m"], abs=0.005)
    assert again.error_after == pytest.approx(added.error_after, rel=1e-3)


def test_each_error_is_less_than_the_one_before_and_the_last_is_hardly_more_than_noise(added: AddedEffects) -> None:
    assert added.error_before > added.error_refitted > max(added.error_as_written, added.error_after)
    assert [one.error for one in added.steps] == [added.error_before, added.error_refitted, added.error_after]
    assert added.error_after == pytest.approx(added.noise_floor_error, rel=0.05)
    assert added.tolerance == pytest.approx(0.04)


def test_errors_are_those_that_simulations_of_the_vehicles_have(runs: SimulatedRuns, added: AddedEffects) -> None:
    before, written = (normalised_rms_error(runs.runs, runs.predict(car)) for car in (
        compose(CAR), compose(added.vehicle, added.effects)))
    assert (added.error_before, added.error_as_written) == pytest.approx((before, written), rel=1e-9)
    counted = np.concatenate([run.kept_mps2 for run in runs.runs])
    assert added.noise_floor_error == pytest.approx(NOISE_MPS2 / np.sqrt((counted**2).mean()), rel=0.05)


@pytest.mark.slow
def test_how_often_noise_would_gain_as_much_is_by_the_evidence_of_both_models(runs: SimulatedRuns) -> None:
    posterior, one = posterior_of(secret_runs(noise_mps2=0.3, lasts_s=12.0)), hidden("sensor_offset", offset_m=0.1)
    without, there = (fit(align(posterior, posterior.start(some))) for some in ([], [one]))
    gain = without.score - there.score
    found = add(posterior, [], [one], candidates=3)
    assert found.p_value == pytest.approx(chance_of([one], gain, posterior.freedom, 3), rel=0.1, abs=1e-6)
    assert found.helps == (found.p_value < FALSE_ALARM)


def test_numbers_that_the_missing_effect_had_biased_are_right_with_it(added: AddedEffects) -> None:
    assert added.helps
    biased = [one for one in added.moved if one.biased]
    assert len(biased) >= 4
    for one in biased:
        assert abs(one.found - one.nominal) < abs(one.without - one.nominal)
    assert all(abs(one.found - one.nominal) < 4 * one.standard_error for one in added.numbers)
    shifts = [abs(one.shift) for one in added.moved]
    assert shifts == sorted(shifts, reverse=True) and {*added.moved} == {*added.numbers}


def test_the_vehicle_that_is_written_has_the_numbers_that_were_found(added: AddedEffects) -> None:
    for one in added.numbers:
        assert one.nominal == read(CAR, one.name) and one.found == read(added.vehicle, one.name)
        assert abs(one.found / one.nominal - 1) < 0.08


@pytest.mark.slow
def test_an_effect_that_does_nothing_moves_no_number_of_a_car_that_bends(runs: SimulatedRuns) -> None:
    found = add(posterior_of(runs), [], [chosen(EFFECTS["wheel_lift"], {})])
    assert not found.helps and not any(one.biased for one in found.moved)
    assert found.error_after == pytest.approx(found.error_refitted, rel=0.03)


@pytest.mark.slow
def test_effects_that_are_there_stay_and_are_fitted_too(runs: SimulatedRuns) -> None:
    found = add(posterior_of(runs), [hidden("sensor_offset", offset_m=0.3)], [hidden("tire_damping")])
    offset, tires = found.effects
    assert (offset.effect.name, tires.effect.name) == ("sensor_offset", "tire_damping") and found.new == (tires,)
    assert offset.values["offset_m"] == pytest.approx(OFFSET_M, abs=0.03)
    assert {"offset_m"} == offset.standard_errors.keys()
    assert not found.helps


@pytest.mark.slow
def test_distances_are_reported_only_where_they_are_off_by_more_than_usual(runs: SimulatedRuns,
                                                                          added: AddedEffects) -> None:
    assert added.removed.distance_error_m == 0
    off = [replace(one, distance_m=one.distance_m + 0.3) for one in runs.runs]
    found = add(posterior_of(SimulatedRuns(off, 500.0)), [], [hidden("sensor_offset")])
    assert found.removed.distance_error_m == pytest.approx(0.3, abs=0.03)


def test_a_shift_counts_standard_errors() -> None:
    number = ShiftedNumber("sprung_mass_kg", 875.0, 900.0, 9.0, 880.0, 8.0)
    assert number.shift == -2.5 and number.biased
    assert not replace(number, without=880.0 + 8.0 * SURE_SIGMA).biased
    assert replace(number, standard_error=0.0).shift == 0


def test_between_first_and_last_numbers_move_from_without_any_to_with_all(added: AddedEffects) -> None:
    later = replace(added, numbers=tuple(replace(one, found=1.1 * one.found, without=0.0)
                                         for one in added.numbers))
    between = {one.name: one for one in moved_between(added, later)}
    for one, now in zip(added.numbers, later.numbers, strict=True):
        found = between[one.name]
        assert (found.without, found.found) == (one.without, now.found)


@pytest.mark.slow
def test_what_numbers_of_a_file_known_to_a_fifth_do_as_well_is_no_effect() -> None:
    """With this file, tires that damp do what its numbers do: an effect only for whom says that they are right."""
    runs, tires = secret_runs(car=car_off_by(0.06, seed=3), lasts_s=12.0, rougher=2.0), [hidden("tire_damping")]
    found = add(posterior_of(runs, tolerance=Tolerance()), [], tires)
    assert found.tolerance == pytest.approx(0.2) and not found.helps
    held = add(posterior_of(runs, tolerance=Tolerance(numbers=0.04 / Tolerance.band)), [], tires)
    assert held.tolerance == pytest.approx(0.04) and held.helps


@pytest.mark.slow
def test_two_effects_added_one_after_the_other_keep_to_the_car_that_was_given() -> None:
    friction, offset = hidden("dry_friction", friction_force_n=90.0), hidden("sensor_offset", offset_m=OFFSET_M)
    runs = secret_runs([friction, offset], lasts_s=20.0)
    first = add(posterior_of(runs), [], [friction])
    bent = max(abs(one.found / one.nominal - 1) for one in first.numbers)  # the missing offset pulls at the car
    second = add(posterior_of(runs, start_vehicle=first.vehicle), first.effects, [offset])
    assert second.error_before == pytest.approx(first.error_as_written, rel=1e-6)
    found = {one.effect.name: one for one in second.effects}
    assert found["sensor_offset"].values["offset_m"] == pytest.approx(OFFSET_M, rel=0.08)
    assert found["dry_friction"].values["friction_force_n"] == pytest.approx(90.0, rel=0.08)
    assert max(abs(one.found / one.nominal - 1) for one in second.numbers) < bent


@pytest.mark.slow
def test_standard_errors_are_as_large_as_numbers_are_off() -> None:
    there, off = hidden("sensor_offset", offset_m=0.2), []
    clean = secret_runs([there], lasts_s=10.0, noise_mps2=0.0).runs
    for seed in range(20):
        rng = np.random.default_rng(seed)
        posterior = posterior_of(SimulatedRuns([
            measuring(run, run.measured_mps2 + rng.normal(0, 0.2, run.count)) for run in clean], 500.0))
        (one,) = standard_errors(fit_to_the_end(align(posterior, posterior.start([there])))).effects
        if seed == 0:  # what ``add`` reports is just that
            (added,) = add(posterior, [], [there]).effects
            assert (added.values, added.standard_errors) == (pytest.approx(one.values, rel=0.02),
                                                             pytest.approx(one.standard_errors, rel=0.02))
        off.append((one.values["offset_m"] - 0.2) / one.standard_errors["offset_m"])
    assert 0.2 < np.mean(np.square(off)) < 2.0  # priors make the errors of cars that are just right too large
