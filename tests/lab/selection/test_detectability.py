"""Which effects some runs could not show: by how many deviations each stands out beside all that is unknown."""

from __future__ import annotations

import numpy as np
import pytest

from logger.lab.diagnosis import refit
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.priors import Tolerance
from logger.lab.selection.detectability import DETECTABLE_SIGMA, effect_as_moved, undetectable_effects
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen

from ...support.lab.runs_with_residual import CAR, a_run, measuring
from ...support.lab.secret_runs import EFFECTS, Dense, hidden, posterior_of, secret_runs
from ...support.slow import slow


@pytest.fixture(scope="module")
def loud() -> LinearModel:
    """The right model beside runs so loud that much is hidden."""
    posterior = posterior_of(secret_runs(noise_mps2=1.0, lasts_s=12.0))
    return refit(posterior, posterior.start()).linear


@pytest.mark.parametrize("name", ["sensor_offset", "sensor_gain", "tire_damping", "damper_asymmetry"])
def test_deviations_are_those_that_dense_least_squares_cannot_absorb(loud: LinearModel, name: str) -> None:
    (hidden,) = undetectable_effects(loud, [EFFECTS[name]])
    posterior, state = loud.posterior, loud.state
    one = chosen(EFFECTS[name], EFFECTS[name].usual)
    there, here = (posterior.predict(effects, state.logs, state.record, rough=True) for effects in ((one,), ()))
    dense = Dense(loud)
    change = dense.white([new - old for new, old in zip(there, here, strict=True)])
    left, _ = dense.least(change, np.zeros(len(dense.here)))
    assert hidden.effect is EFFECTS[name]
    assert hidden.deviations == pytest.approx(np.sqrt(left), rel=1e-5)


@pytest.mark.slow
def test_the_most_hidden_come_first_and_none_that_stands_out(loud: LinearModel) -> None:
    found = undetectable_effects(loud, list(EFFECTS.values()))
    deviations = [one.deviations for one in found]
    assert deviations == sorted(deviations) and max(deviations) < DETECTABLE_SIGMA
    assert {"wheel_lift", "bump_stop", "progressive_spring"} <= {one.effect.name for one in found}


def test_quieter_runs_hide_less(loud: LinearModel) -> None:
    quiet_runs = posterior_of(secret_runs(noise_mps2=0.02, lasts_s=12.0))
    quiet = refit(quiet_runs, quiet_runs.start()).linear
    effects = [EFFECTS[name] for name in ("sensor_offset", "damper_asymmetry", "tire_damping", "wheel_lift")]
    before, after = ({one.effect.name: one.deviations for one in undetectable_effects(found, effects)}
                     for found in (loud, quiet))
    assert before.keys() >= {"sensor_offset", "damper_asymmetry"} and after.keys() <= {"tire_damping", "wheel_lift"}
    assert all(after[name] >= before[name] for name in after)


def test_what_a_number_of_the_car_does_as_well_is_said_to_be_hidden_by_it() -> None:
    quiet_runs = posterior_of(secret_runs(noise_mps2=0.05, lasts_s=12.0))
    quiet = refit(quiet_runs, quiet_runs.start()).linear
    (load,) = undetectable_effects(quiet, [EFFECTS["payload"]])
    assert load.alike == "sprung_mass_kg" and load.deviations < DETECTABLE_SIGMA
    loud_runs = posterior_of(secret_runs(noise_mps2=5.0, lasts_s=12.0))
    deaf = refit(loud_runs, loud_runs.start()).linear
    assert all(one.alike is None for one in undetectable_effects(deaf, [EFFECTS["payload"]]))


NAMES = ("tire_enveloping", "sensor_gain", "speed_scale")


def slow_run(noise_mps2: float, of_motion: float = 0.0) -> SimulatedRuns:
    run = a_run("slow", 5.0, 20.0, 3)
    model = SimulatedRuns([run]).predict(compose(CAR))[0]
    size = noise_mps2 + of_motion * float(np.abs(model).max())
    return SimulatedRuns([measuring(run, model + np.random.default_rng(1).normal(0, size, run.count))])


def beside(runs: SimulatedRuns, patch: float = 0.0) -> LinearModel:
    """A car with a patch that is longer by a share, not fitted."""
    posterior = posterior_of(runs)
    logs = np.where(np.array(posterior.prior.names) == "contact_patch_m", patch, 0.0)
    state = posterior.state_at((), logs)
    numbers = posterior.number_slopes(state, posterior.prior.steps)
    return LinearModel(posterior, state, numbers)


def test_another_contact_length_than_the_cars_own_shows_on_a_rough_road_driven_slowly() -> None:
    """Though the usual length is the car's own, or as good as its own after a refit."""
    found = beside(slow_run(0.02), patch=0.003)
    assert undetectable_effects(found, [EFFECTS[name] for name in NAMES]) == ()


def test_a_road_that_hardly_moves_the_car_hides_them_all() -> None:
    found = undetectable_effects(beside(slow_run(0.0, of_motion=40.0)), [EFFECTS[name] for name in NAMES])
    assert {one.effect.name for one in found} == set(NAMES)
    assert all(one.deviations < 1 for one in found)


@pytest.mark.parametrize(("name", "values"), [
    ("payload", {"mass_kg": 90.0}), *slow(("cg_shift", {"shift_m": -0.1})), (None, {})])
def test_an_effect_that_the_numbers_absorb_is_told_by_their_move(name: str | None, values: dict[str, float]) -> None:
    """A load, or another centre of gravity, within the tolerance of 20 %; with nothing hidden there is no word."""
    runs = posterior_of(secret_runs([hidden(name, **values)] if name else []), tolerance=Tolerance())
    found = effect_as_moved(refit(runs, runs.start()).linear, [EFFECTS[one] for one in (
        "payload", "cg_shift", "sensor_offset", "tire_enveloping", "tire_damping")])
    assert (found and found.effect.name) == name
    for number, value in values.items():
        assert found is not None and found.values[number] == pytest.approx(value, rel=0.12)
