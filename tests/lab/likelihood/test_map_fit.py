"""Fits of a car, its effects and its distance errors: they end at the noise, where nothing near is likelier, from
wherever they begin; and what they are asked to explain they do not bend the car for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import CONVERGED, align, effect_slopes, fit, fit_to_the_end, without_common_scale
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.priors import Tolerance
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.named_parameters import changed, coordinates_of, free_parameters_of, read, with_coordinates
from logger.vehicle.uncertain import grows_with_mass

from ...support.lab.noisy_runs import drawn, noisy_runs, posterior_of, tire_damping
from ...support.lab.runs_with_residual import CAR
from ...support.lab.secret_runs import EFFECTS, FINE_HZ, NOISE_MPS2, hidden
from ...support.slow import slow

Array = npt.NDArray[np.float64]


def from_start(posterior: Posterior, *effects: Chosen) -> LinearModel:
    return fit(align(posterior, posterior.start(effects)))


@cache
def plain() -> LinearModel:
    """A car as its file says, in every respect."""
    return from_start(posterior_of(noisy_runs()))


@cache
def damped() -> LinearModel:
    """A car with damped tires, and a model with them."""
    return from_start(posterior_of(noisy_runs([tire_damping(300.0)])), tire_damping(150.0))


def noise_share(posterior: Posterior) -> float:
    return NOISE_MPS2 / posterior.size_mps2


def test_a_car_that_lacks_nothing_ends_at_the_noise_with_the_numbers_that_it_has() -> None:
    found, posterior = plain(), plain().posterior
    assert posterior.error(found.state) == pytest.approx(noise_share(posterior), rel=0.03)
    assert np.abs(found.state.logs / posterior.prior.deviations).max() < 1.0


@pytest.mark.slow
def test_a_car_that_is_off_within_its_tolerance_ends_at_the_noise_too() -> None:
    posterior = drawn([], 4, plain().state.size).posterior
    found = from_start(posterior)
    assert posterior.error(posterior.start()) > 1.2 * posterior.error(found.state)
    assert posterior.error(found.state) == pytest.approx(noise_share(posterior), rel=0.04)


def test_an_effect_is_found_with_its_number() -> None:
    found, posterior = damped(), damped().posterior
    without = from_start(posterior)
    assert without.score - found.score > 50
    assert posterior.error(found.state) == pytest.approx(noise_share(posterior), rel=0.03)
    assert np.abs(without.state.logs / posterior.prior.deviations).max() > 2.0  # the car bends to make up for it
    assert np.abs(found.state.logs / posterior.prior.deviations).max() < 1.5
    assert found.state.effects[0].p.tire_damping_n_s_per_m == pytest.approx(300.0, abs=80.0)


@pytest.mark.parametrize("start", [30.0, *slow(800.0)])
def test_a_fit_ends_in_the_same_place_wherever_it_begins(start: float) -> None:
    other = from_start(damped().posterior, tire_damping(start))
    assert other.score == pytest.approx(damped().score, abs=2 * CONVERGED)
    assert other.state.effects[0].p.tire_damping_n_s_per_m == pytest.approx(
        damped().state.effects[0].p.tire_damping_n_s_per_m, abs=20.0)


def test_where_numbers_are_not_known_the_prior_of_one_holds_the_scale_of_all() -> None:
    """A car in which all masses and forces are larger by one factor moves alike, so that a fit from there goes back to
    the mass that was weighed."""
    harder, factor = chosen(EFFECTS["progressive_spring"], {"cubic_stiffness_n_per_m3": 2e6}), 1.1
    runs = noisy_runs([harder], noise_mps2=0.002)
    weighed = Tolerance(numbers=1.0, by_name={"sprung_mass_kg": 0.02})
    posterior = Posterior(SimulatedRuns(runs, FINE_HZ), CAR, weighed)
    logs = np.log(factor) * np.array([grows_with_mass(name) for name in posterior.prior.names])
    state = posterior.state_at([replace(harder, values={"cubic_stiffness_n_per_m3": 2e6 * factor})], logs)
    found = fit_to_the_end(LinearModel(posterior, state)).state
    assert dict(zip(posterior.prior.names, found.logs, strict=True))["sprung_mass_kg"] == pytest.approx(0, abs=0.003)


def test_a_fit_takes_a_tire_that_nobody_measured_no_nearer_to_rigid_than_is_unusual() -> None:
    """From there its derivative leads on and on (without that end, to 3,000 times the tire)."""
    tire = "front.tire_stiffness_n_per_m"
    posterior = Posterior(SimulatedRuns(noisy_runs(noise_mps2=0.002), FINE_HZ), CAR, Tolerance(by_name={tire: 1.0}))
    off = np.array([name == tire for name in posterior.prior.names])
    found = fit_to_the_end(LinearModel(posterior, posterior.state_at((), 6.0 * off))).state
    assert np.log(2) < found.logs @ off <= 1.001 * posterior.prior.reach[off][0]


def test_a_car_that_cannot_be_simulated_is_no_step(monkeypatch: pytest.MonkeyPatch) -> None:
    predict, tried = Posterior.predict, list[float]()

    def within(self: Posterior, effects: Sequence[Chosen], logs: Array, *more: Any, **said: Any) -> list[Array]:
        tried.append(float(np.abs(logs).max()))
        if tried[-1] > 0.02:
            raise np.linalg.LinAlgError
        return predict(self, effects, logs, *more, **said)

    posterior = drawn([], 4, plain().state.size).posterior
    start = align(posterior, posterior.start())
    monkeypatch.setattr(Posterior, "predict", within)
    found = fit(start)
    assert max(tried) > 0.02 >= np.abs(found.state.logs).max() > 0
    assert found.score <= start.score


@pytest.mark.slow
def test_a_fit_to_the_end_goes_on_where_rounds_are_over_and_no_farther_than_it_gains() -> None:
    posterior = damped().posterior
    start = align(posterior, posterior.start([tire_damping(3000.0)]))
    cut, ended = fit(start, rounds=1), fit(start, rounds=1, at_most=12)
    assert cut.score > damped().score + 2 * CONVERGED
    for one in (ended, fit_to_the_end(start)):
        assert one.score == pytest.approx(damped().score, abs=2 * CONVERGED)
        assert one.state.effects[0].p.tire_damping_n_s_per_m == pytest.approx(
            damped().state.effects[0].p.tire_damping_n_s_per_m, abs=20.0)


def test_nothing_near_a_fit_is_likelier() -> None:
    """Numbers of the car and of the effect moved by half of what they are known to, truly predicted, the distance
    errors made up for."""
    linear, posterior, state = damped(), damped().posterior, damped().state
    here = linear.objective(state.predictions, state.logs)
    known = 1 / np.sqrt(np.diag(linear.information()))
    free_parameters = free_parameters_of(state.effects)
    coordinates = coordinates_of(state.effects, free_parameters)
    beside = [(state.effects, state.logs + way * row) for row in np.diag(0.5 * known) for way in (1, -1)]
    beside += [(with_coordinates(state.effects, free_parameters, coordinates + way * 15.0), state.logs)
               for way in (1, -1)]
    for effects, logs in beside:
        there = posterior.predict(effects, logs, state.record)
        assert linear.objective(there, logs) > here - 0.5 * CONVERGED


def test_an_effect_that_does_nothing_explains_nothing_and_costs_its_numbers() -> None:
    posterior, state = plain().posterior, plain().state
    gain = chosen(EFFECTS["sensor_gain"], {"gain": 1.0})
    same = posterior.state_at([gain], state.logs, state.record, state.size)
    assert posterior.deviance(same) == pytest.approx(posterior.deviance(state), abs=1e-6)
    rise = LinearModel(posterior, same).score - LinearModel(posterior, state).score
    assert rise == pytest.approx(np.log(posterior.freedom), abs=1e-6)


@pytest.mark.slow
def test_what_is_not_there_gains_nothing_when_it_is_fitted() -> None:
    one = chosen(EFFECTS["sensor_bandwidth"], EFFECTS["sensor_bandwidth"].usual)
    for found in (from_start(plain().posterior, tire_damping(100.0)), from_start(plain().posterior, one)):
        assert found.score > plain().score - 3.0


def test_a_fit_begins_where_the_car_stands_and_its_prior_stays_where_it_was() -> None:
    start_vehicle = changed(CAR, {"sprung_mass_kg": 1.02 * CAR.sprung_mass_kg})
    posterior = Posterior(plain().posterior.runs, CAR, Tolerance(), start_vehicle)
    start = posterior.start()
    assert read(posterior.prior.vehicle(CAR, start.logs), "sprung_mass_kg") == pytest.approx(1.02 * CAR.sprung_mass_kg)
    found = from_start(posterior)
    assert found.score == pytest.approx(plain().score, abs=2 * CONVERGED)


def test_aligning_moves_no_number_of_the_car_and_makes_nothing_worse() -> None:
    posterior = drawn([], 4, plain().state.size).posterior
    start = posterior.start()
    found = align(posterior, start)
    assert found.state.logs.tolist() == start.logs.tolist()
    assert found.score <= LinearModel(posterior, start).score


def test_a_round_that_is_not_worth_it_is_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    posterior = drawn([tire_damping(300.0)], 4, plain().state.size).posterior
    start = align(posterior, posterior.start())
    predict, asked = Posterior.predict, []
    monkeypatch.setattr(Posterior, "predict", lambda *given, **named: (asked.append(1), predict(*given, **named))[1])
    whole = fit(start)
    thoroughly = len(asked)
    asked.clear()
    early = fit(start, rounds=1)
    assert len(asked) < thoroughly
    assert whole.score <= early.score <= start.score


def test_slopes_by_the_cars_numbers_are_differences_of_predictions() -> None:
    posterior, state = plain().posterior, plain().state
    step = 0.002
    found = posterior.number_slopes(state, np.full(len(posterior.prior.names), step))
    logs = state.logs.copy()
    logs[0] += step
    there = posterior.predict((), logs, [0 * one for one in state.record])
    here = posterior.predict((), state.logs, [0 * one for one in state.record])
    off = np.concatenate([(high - low) / step for high, low in zip(there, here, strict=True)])
    assert np.concatenate([one[0] for one in found]) == pytest.approx(off, abs=0.05 * np.abs(off).max())


def test_a_rough_simulation_of_friction_tells_what_a_change_does() -> None:
    posterior = plain().posterior
    cars = [posterior.car([chosen(EFFECTS["dry_friction"], {"friction_force_n": force_n})], posterior.start().logs)
            for force_n in (60.0, 90.0)]
    fine, rough = (np.concatenate([there - here for here, there in zip(
        *(posterior.runs.predict(car, rough=how) for car in cars), strict=True)]) for how in (False, True))
    assert 0 < np.sqrt(np.mean((rough - fine) ** 2)) < 0.2 * np.sqrt(np.mean(fine**2))


def test_a_refinement_that_comes_back_to_its_default_stays_a_number_of_the_fit() -> None:
    """A stop in extension that a step moved out of reach, to where none is."""
    model = plain()
    near, gone = (hidden("bump_stop", extension_clearance_m=place_m) for place_m in (0.05, 1.0))
    free = free_parameters_of([near])
    own = effect_slopes(model.posterior, [gone], model.state.logs, free, model.state.record, None)
    assert len(free_parameters_of([gone])) < len(free)
    freed = without_common_scale(model, [gone], free, own)[1]
    assert freed and [one.shape for one in freed] == [one.shape for one in own]
