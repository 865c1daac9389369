"""Standard errors: they hold over cars, noises and distance errors drawn by chance, and are given on the scales of the
numbers themselves."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
import pytest

from logger.arrays import Complex
from logger.lab.likelihood.distance_error import USUAL, ErrorSize
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import align, fit
from logger.lab.likelihood.standard_errors import (
    deviations_from_null,
    standard_errors,
    with_contradictions,
    with_standard_errors,
)
from logger.vehicle.effect import Chosen, Parameter, Scale, SensorEffect, chosen
from logger.vehicle.named_parameters import free_parameters_of
from logger.vehicle.uncertain import grows_with_mass

from ...support.lab.noisy_runs import drawn, noisy_runs, posterior_of, tire_damping
from ...support.lab.secret_runs import EFFECTS, hidden

Array = npt.NDArray[np.float64]
NAME = "tire_damping_n_s_per_m"
SEEDS = 24


@cache
def found() -> LinearModel:
    posterior = posterior_of(noisy_runs([tire_damping(300.0)]))
    return fit(align(posterior, posterior.start([tire_damping(200.0)])))


def errors_of(model: LinearModel) -> tuple[tuple[Chosen, ...], Array]:
    """The effects with their errors, and those of the logarithms of the car's numbers (p,)."""
    errors = standard_errors(model)
    return errors.effects, errors.logs


@pytest.mark.parametrize(("name", "values", "errors", "far"), [
    ("sensor_offset", {"offset_m": -0.06}, {"offset_m": 0.02}, 3.0),
    ("damper_asymmetry", {"rebound_to_bump_ratio": 2.0}, {"rebound_to_bump_ratio": 0.1}, 20 * np.log(2.0)),
    ("top_mount_compliance", {"mount_stiffness_n_per_m": 2e5}, {"mount_stiffness_n_per_m": 4e4}, 5.0),
    ("occupant", {"mass_kg": 30.0}, {"mass_kg": 10.0, "frequency_hz": 0.1, "damping_ratio": 0.01}, 3.0),
    ("frame_friction", {"friction_force_n": 0.0, "body_friction_force_n": 1.6},
     {"friction_force_n": 0.01, "body_friction_force_n": 0.04}, 40.0),
    ("wheel_lift", {}, {}, np.inf),
    ("sensor_offset", {"offset_m": 0.1}, {"offset_m": np.inf}, np.inf),
])
def test_how_far_an_effect_is_from_doing_nothing_is_measured_on_the_scale_of_its_strength(
        name: str, values: dict[str, float], errors: dict[str, float], far: float) -> None:
    assert deviations_from_null(replace(hidden(name, **values), standard_errors=errors)) == pytest.approx(far)


@pytest.mark.slow
@pytest.mark.parametrize("size", [
    pytest.param(USUAL, id="a good recorder"),
    pytest.param(ErrorSize(0.004, 0.03, 0.0003), id="one that wanders", marks=pytest.mark.release)])
def test_numbers_are_off_by_as_much_as_their_errors_say(size: ErrorSize) -> None:
    cars, effects = [], []
    for seed in range(SEEDS):
        case = drawn([tire_damping(300.0)], seed, size)
        one = fit(align(case.posterior, case.posterior.start([tire_damping(200.0)])))
        (tires,), deviations = errors_of(one)
        cars.append((one.state.logs - case.logs) / deviations)
        effects.append((tires.values[NAME] - 300.0) / tires.standard_errors[NAME])
    # Of 312 numbers of cars the r.m.s. scatters by 0.06, as those of one car err together; of 24 effects by 0.15.
    assert np.sqrt(np.mean(np.square(cars))) == pytest.approx(1.0, abs=0.15)
    assert np.sqrt(np.mean(np.square(effects))) == pytest.approx(1.0, abs=0.5)
    assert abs(np.mean(effects)) < 3 / np.sqrt(SEEDS)


def test_no_number_is_less_certain_than_its_prior_and_what_the_runs_do_not_show_as_uncertain() -> None:
    _, deviations = errors_of(found())
    prior = found().posterior.prior
    share = dict(zip(prior.names, deviations / prior.deviations, strict=True))
    assert max(share.values()) <= 1.0 + 1e-9
    assert share["pitch_inertia_kg_m2"] > 0.95 and share["sprung_mass_kg"] < 0.6


def test_twice_the_noise_makes_an_effect_half_as_certain() -> None:
    loud = posterior_of(noisy_runs([tire_damping(300.0)], noise_mps2=0.2))
    there = fit(align(loud, loud.start([tire_damping(200.0)])))
    quiet, noisy = (standard_errors(one).effects[0].standard_errors[NAME] for one in (found(), there))
    assert 1.5 < noisy / quiet < 4.5  # of four times the noise: the priors of the car's numbers hold part of it


@pytest.mark.parametrize(("numbers", "stretches"), [(3, 14), (9, 40), (4, 8)])
def test_stretches_contradict_each_other_where_they_do_so_more_than_by_chance(numbers: int, stretches: int) -> None:
    """Of gradients that noise makes one covariance in a hundred is larger, whatever the units; of three times as large
    ones all."""
    rng = np.random.default_rng(1)
    root = rng.normal(size=(numbers, numbers)) * np.logspace(0, 5, numbers)[:, None]
    noise = root @ root.T
    larger = []
    for _ in range(300):
        pulls = rng.normal(size=(stretches, numbers)) @ root.T / np.sqrt(stretches)
        larger.append([np.sqrt(np.linalg.det(with_contradictions(noise, size * pulls)) / np.linalg.det(noise))
                       for size in (1.0, 3.0)])
    chance, contradicted = np.array(larger).T
    assert (chance > 1 + 1e-6).mean() < 0.03 and (contradicted > 2).mean() > 0.99
    assert with_contradictions(noise, pulls[:2]) is noise  # two say nothing


def test_errors_are_the_roots_of_the_inverse_information_whatever_the_units() -> None:
    """A cubic stiffness of 1e6 beside a ratio of 1: the plain inverse is right too, where it is well enough scaled."""
    (tires,), deviations = errors_of(found())
    linear = found()
    information = linear.information()
    alone = np.sqrt(np.diag(np.linalg.inv(information)))
    assert (deviations >= alone * (1 - 1e-9)).all()
    assert (deviations < 1.5 * alone).all()
    assert tires.standard_errors[NAME] > 0


def test_a_number_that_changes_nothing_is_wholly_uncertain_and_leaves_the_others_as_they_were() -> None:
    class Nothing(SensorEffect):
        name = "nothing"
        parameters = (Parameter("gain", 1.0, 0.5, 2.0, 1.0, Scale.LINEAR, (1.5,), "of nothing"),)

        def factor(self, p: SimpleNamespace, s: Complex) -> Complex:
            return np.ones_like(s)

    posterior, state = found().posterior, found().state
    more = posterior.state_at([*state.effects, chosen(Nothing(), {"gain": 1.0})], state.logs, state.record, state.size)
    one = fit(LinearModel(posterior, more), found().numbers, rounds=1)
    (tires, nothing), deviations = errors_of(one)
    (before,), alone = errors_of(found())
    assert nothing.standard_errors["gain"] == np.inf
    assert tires.standard_errors[NAME] == pytest.approx(before.standard_errors[NAME], rel=0.1)
    assert deviations == pytest.approx(alone, rel=0.1)


def test_a_stop_out_of_reach_is_wholly_uncertain_though_a_car_of_larger_forces_moves_alike() -> None:
    stop = hidden("bump_stop", clearance_m=0.29, stop_stiffness_n_per_m=1e5)
    posterior, state = found().posterior, found().state
    more = posterior.state_at([*state.effects, stop], state.logs, state.record, state.size)
    (_, unmet), _ = errors_of(LinearModel(posterior, more, found().numbers))
    assert {*unmet.standard_errors.values()} == {np.inf}


@pytest.mark.parametrize("name, key, value, error", [
    ("tire_damping", NAME, 150.0, 50.0),
    ("tire_damping", NAME, 0.0, 50.0),
    ("damper_asymmetry", "rebound_to_bump_ratio", 2.0, 100.0),
    ("damper_asymmetry", "rebound_to_bump_ratio", None, None),
])
def test_an_error_at_a_bound_is_not_halved(name: str, key: str, value: float | None, error: float | None) -> None:
    effect = EFFECTS[name]
    parameter = next(one for one in effect.parameters if one.name == key)
    value = parameter.high if value is None else value
    error = 50.0 * parameter.high if error is None else error
    one = chosen(effect, {**effect.usual, key: value})
    free = free_parameters_of((one,))
    (with_error,) = with_standard_errors((one,), free, np.full(len(free), 50.0))
    assert with_error.standard_errors[key] == pytest.approx(error, rel=1e-3)


def test_how_heavy_a_car_that_rubs_is_only_its_prior_tells() -> None:
    """Masses, springs, dampers and forces that are larger by one factor move alike, so that the deviation of that
    factor is the prior's: that of the mean of so many numbers."""
    friction = hidden("dry_friction", friction_force_n=60.0, transition_velocity_m_per_s=0.02)
    posterior = posterior_of(noisy_runs([friction]))
    state = posterior.start([friction])
    found = LinearModel(posterior, state, posterior.number_slopes(state, posterior.prior.steps))
    effects, deviations = errors_of(found)
    masses = [grows_with_mass(name) for name in posterior.prior.names]
    least = posterior.prior.deviations[masses][0] / np.sqrt(np.count_nonzero(masses))
    assert (deviations[masses] > 0.99 * least).all()
    assert effects[0].standard_errors["friction_force_n"] > 0.99 * 60.0 * least
