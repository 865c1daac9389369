"""Errors on unseen stretches are those of models that were really refitted without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import least_squares

from logger.lab.diagnosis import refit
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import align, fit
from logger.lab.likelihood.signals import deviance
from logger.lab.selection.holdout import HoldOut, cross_validate, folds
from logger.runs import Run, normalised_rms
from logger.vehicle.effect import Chosen
from logger.vehicle.named_parameters import coordinates_of, free_parameters_of, with_coordinates

from ...support.lab.secret_runs import hidden, posterior_of, secret_runs

Array = npt.NDArray[np.float64]

SETS = 3


@pytest.fixture(scope="module")
def plain() -> LinearModel:
    """The right model, fitted."""
    posterior = posterior_of(secret_runs(lasts_s=15.0))
    return refit(posterior, posterior.start()).linear


def test_each_sample_that_counts_is_held_out_once_in_stretches_of_seconds(plain: LinearModel) -> None:
    for run in plain.posterior.runs.runs:
        which = folds(run)
        assert which.shape == run.kept_mps2.shape and set(which) == set(range(SETS))
        changes = np.flatnonzero(np.diff(which))
        assert np.diff(changes).min(initial=run.count) >= 4 * run.rate_hz
        assert np.bincount(which).min() >= 0.25 * len(which)


def test_a_long_run_is_held_out_in_many_stretches_and_a_short_one_in_three(plain: LinearModel) -> None:
    run = plain.posterior.runs.runs[0]

    def lasting(seconds: float) -> Run:
        zeros = np.zeros(round(seconds * run.rate_hz))
        return replace(run, measured_mps2=zeros, distance_m=zeros, speed_mps=zeros)

    assert np.count_nonzero(np.diff(folds(lasting(182.0)))) == 29
    assert np.count_nonzero(np.diff(folds(lasting(2.5)))) == SETS - 1


def test_most_is_explained_of_all_signals_each_by_what_is_left_of_it_beyond_its_noise() -> None:
    def errors(body: float, wheel: float, noise: float) -> HoldOut:
        return HoldOut(body, 0.0, {"": (body, 0.01), "wheel": (wheel, noise)})

    assert HoldOut(0.02, 0.0).explains_most_beyond(HoldOut(0.65, 0.0))
    assert not errors(0.02, 0.90, 0.003).explains_most_beyond(errors(0.65, 0.96, 0.003))  # the wheel moves otherwise
    assert errors(0.02, 0.40, 0.399).explains_most_beyond(errors(0.65, 0.41, 0.399))  # what it left of it was noise
    assert errors(0.10, 0.20, 0.003).is_worse_than(errors(0.11, 0.10, 0.003))
    assert errors(0.34, 0.02, 0.003).is_worse_than(errors(0.28, 0.50, 0.003))  # that of the first signal rises
    assert errors(0.06, 0.50, 0.3).largest == pytest.approx(0.4) and errors(0.06, 0.3, 0.3).largest == 0.06


# --- against fits ---


def unseen_when_refitted(found: LinearModel) -> tuple[float, float]:
    """Error and deviance of models whose numbers were fitted to convergence, by true predictions, without each set of
    stretches in turn; distances stay as they are."""
    posterior, state = found.posterior, found.state
    runs, free_parameters, p = posterior.runs.runs, free_parameters_of(state.effects), len(state.logs)
    here = np.concatenate([state.logs, coordinates_of(state.effects, free_parameters)])
    scale = np.concatenate([posterior.prior.deviations, np.maximum(0.1 * np.abs(here[p:]), 1e-3)])

    def residuals(x: Array) -> list[Array]:
        there: tuple[Chosen, ...] = with_coordinates(state.effects, free_parameters, x[p:])
        predicted = posterior.predict(there, x[:p], state.record)
        return posterior.residuals_of(predicted)

    unseen = residuals(here)
    for held in range(SETS):
        def seen(z: Array, held: int = held) -> Array:
            x = here + z * scale
            parts = [whitener.in_time(one)[folds(run) != held] for run, whitener, one in zip(
                runs, found.whiteners, residuals(x), strict=True)]
            beyond = np.maximum(np.abs(x[:p] / posterior.prior.deviations) - 2.0, 0.0)  # the wall of the prior
            return np.concatenate([*parts, x[:p] / posterior.prior.deviations, 10.0 * beyond**2])

        x = here + scale * least_squares(seen, np.zeros(len(here)), x_scale="jac", diff_step=1e-4).x
        for run, one, kept in zip(runs, residuals(x), unseen, strict=True):
            kept[run.first:][folds(run) == held] = one[run.first:][folds(run) == held]
    counted = [one[run.first:] for run, one in zip(runs, unseen, strict=True)]
    return normalised_rms(counted, [run.kept_mps2 for run in runs]), deviance(posterior.bands, unseen)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["right", "with one that is there", "with one that is not there"])
def test_held_out_is_what_refits_without_the_stretches_leave(model: str) -> None:
    there = [hidden("sensor_offset", offset_m=0.3)] if model == "with one that is there" else []
    tried = [] if model == "right" else [hidden("sensor_offset", offset_m=0.2)]
    posterior = posterior_of(secret_runs(there, lasts_s=12.0))
    linear = fit(align(posterior, posterior.start(tried)))
    state = linear.state
    quick = cross_validate(linear)
    error, lack = unseen_when_refitted(linear)
    seen_error, seen_lack = posterior.error(state), posterior.deviance(state)
    assert quick.error > seen_error and quick.deviance > seen_lack
    assert quick.error - seen_error == pytest.approx(error - seen_error, rel=0.1)
    assert quick.deviance - seen_lack == pytest.approx(lack - seen_lack, rel=0.1)


# --- what it is for ---


def test_numbers_that_fit_noise_make_the_error_larger(plain: LinearModel) -> None:
    rng = np.random.default_rng(1)
    own = [rng.normal(size=(40, run.count)) for run in plain.posterior.runs.runs]
    honest, vain = cross_validate(plain), cross_validate(plain, own)
    assert vain.error > 1.005 * honest.error and vain.deviance > honest.deviance + 10


def test_columns_that_do_nothing_change_nothing(plain: LinearModel) -> None:
    nothing = [np.zeros((2, run.count)) for run in plain.posterior.runs.runs]
    there, here = cross_validate(plain, nothing), cross_validate(plain)
    assert (there.error, there.deviance) == pytest.approx((here.error, here.deviance), rel=1e-9)


def test_a_number_that_acts_once_stays_as_fitted_where_its_event_is_held_out(plain: LinearModel) -> None:
    """A quarter of a second in one stretch of one run, and next to nothing elsewhere that could tell its number."""
    rng = np.random.default_rng(4)
    once = [1e-6 * rng.normal(size=(1, run.count)) for run in plain.posterior.runs.runs]
    once[0][0, 420:445] = 1.0
    there, here = cross_validate(plain, once), cross_validate(plain)
    assert there.error == pytest.approx(here.error, rel=0.01)


def test_a_model_without_numbers_is_judged_as_it_is(plain: LinearModel) -> None:
    posterior, state = plain.posterior, plain.state
    found = cross_validate(LinearModel(posterior, state))
    assert found.error == pytest.approx(posterior.error(state))
    assert found.deviance == pytest.approx(posterior.deviance(state))
