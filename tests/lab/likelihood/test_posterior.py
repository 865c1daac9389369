"""What a posterior predicts near a state, and when its readings are bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.arrays import Array
from logger.lab.likelihood.posterior import derivatives
from logger.runs import RecordFacts
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.effect import Chosen

from ...support.lab.secret_runs import FINE_HZ, hidden, posterior_of, secret_runs


def test_near_a_state_rough_simulations_are_corrected_by_what_they_lack_there() -> None:
    rubbing = [hidden("dry_friction", friction_force_n=60.0)]
    posterior = posterior_of(secret_runs(rubbing, lasts_s=6.0))
    state = posterior.start(rubbing)
    given = state.effects, state.logs, state.record
    rough = posterior.predict(*given, rough=True)
    for one, fine, roughly in zip(posterior.predictor(state)(*given), state.predictions, rough, strict=True):
        assert np.abs(fine - roughly).max() > 1e-3 * fine.std()  # there is something to correct
        np.testing.assert_allclose(one, fine, atol=1e-9)


def test_what_was_just_predicted_is_not_simulated_again_and_what_differs_is() -> None:
    posterior = posterior_of(secret_runs(lasts_s=6.0))
    state, runs = posterior.start([hidden("tire_damping", tire_damping_n_s_per_m=300.0)]), posterior.runs
    simulated = runs.work
    np.testing.assert_array_equal(posterior.predict(state.effects, state.logs, state.record), state.predictions)
    assert runs.work == simulated
    other = [hidden("tire_damping", tire_damping_n_s_per_m=400.0)], state.logs, state.record
    drawn = state.effects, state.logs + 0.1, state.record
    for one in (posterior.predict(*other), posterior.predict(*drawn),
                posterior.simulated(2 * FINE_HZ).predict(state.effects, state.logs, state.record)):
        assert not np.array_equal(one, state.predictions)


@pytest.mark.parametrize(("effect", "values"), [
    ("damper_asymmetry", {"rebound_to_bump_ratio": 2.0}), ("tire_damping", {"tire_damping_n_s_per_m": 300.0}),
    ("top_mount_compliance", {}), ("progressive_spring", {"cubic_stiffness_n_per_m3": 3e6}), ("payload", {})])
def test_what_an_effect_changes_is_nearly_right_in_half_as_many_steps(effect: str, values: dict[str, float]) -> None:
    posterior = posterior_of(secret_runs(lasts_s=6.0))
    state = posterior.start()

    def change(rough: bool) -> Array:
        there, here = (posterior.predict(some, state.logs, state.record, rough)[0]
                       for some in ([hidden(effect, **values)], []))
        return there - here

    right = change(rough=False)
    assert 0 < np.abs(change(rough=True) - right).max() < 0.02 * np.abs(right).max()


def test_readings_are_bounds_where_a_step_is_large_beside_the_noise_and_nowhere_else() -> None:
    runs = secret_runs(lasts_s=6.0).runs
    stepped = [replace(one, measured_mps2=np.round(one.measured_mps2 / 0.6) * 0.6, facts=RecordFacts(
        step_mps2=0.6, noise_mps2=0.05)) for one in runs]
    plain, coarse = posterior_of(SimulatedRuns(runs, FINE_HZ)), posterior_of(SimulatedRuns(stepped, FINE_HZ))
    assert plain.with_rounding_at(plain.start()) is plain
    assert coarse.with_rounding_at(coarse.start()) is not coarse


@pytest.mark.parametrize("effects", [
    [], [hidden("occupant")], [hidden("payload", mass_kg=90.0), hidden("sensor_bandwidth")],
    [hidden("time_offset", delay_s=0.03), hidden("sensor_offset")]])
def test_derivatives_by_the_cars_numbers_are_those_of_simulations(effects: list[Chosen]) -> None:
    posterior = posterior_of(secret_runs(lasts_s=6.0))
    state, steps = posterior.start(effects), np.full(len(posterior.prior.names), 1e-4)
    error_m = posterior.distance_error_m(state.record)

    def predict(logs: Array) -> list[Array]:
        return posterior.runs.predict(posterior.car(effects, logs), error_m, rough=True)

    here = predict(state.logs)
    above, below = (derivatives(predict, state.logs, way * steps, here) for way in (1, -1))
    for one, high, low in zip(posterior.number_slopes(state, steps), above, below, strict=True):
        assert np.abs(one - (high + low) / 2).max() < 2e-3 * np.abs(one).max()  # lengths by one-sided ones
