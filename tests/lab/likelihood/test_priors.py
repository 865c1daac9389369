"""Priors of a vehicle's numbers: costs and their derivatives against plain calculus, a wall beyond two deviations, and
logarithms that bring one car to another."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import approx_fprime
from scipy.stats import norm

from logger.lab.likelihood.priors import Tolerance, VehiclePrior, is_length
from logger.vehicle.named_parameters import read

from ...support.lab.runs_with_residual import CAR

PRIOR = VehiclePrior.of(CAR, Tolerance())
FAR = np.linspace(-3.5, 3.5, len(PRIOR.names)) * PRIOR.deviations


def test_lengths_and_other_numbers_have_the_tolerance_that_was_given() -> None:
    prior = VehiclePrior.of(CAR, Tolerance(numbers=0.05, lengths=0.01))
    deviations = dict(zip(prior.names, prior.deviations, strict=True))
    assert deviations["sprung_mass_kg"] == deviations["front.tire_stiffness_n_per_m"] == 0.05
    assert deviations["front.cg_distance_m"] == deviations["contact_patch_m"] == 0.01


def test_without_the_wall_the_cost_is_that_of_a_normal_density() -> None:
    loose = PRIOR.without_soft_bounds()
    density = norm(scale=PRIOR.deviations)
    assert loose.cost(FAR) == pytest.approx(2 * (density.logpdf(0.0) - density.logpdf(FAR)).sum())


def test_the_wall_stands_beyond_two_deviations_and_rises() -> None:
    loose = PRIOR.without_soft_bounds()
    near = np.clip(FAR, -1.99 * PRIOR.deviations, 1.99 * PRIOR.deviations)
    assert PRIOR.cost(near) == loose.cost(near)
    assert PRIOR.cost(FAR) > loose.cost(FAR) + 100
    assert not PRIOR.at_soft_bounds(near)
    assert PRIOR.at_soft_bounds(FAR) and not loose.at_soft_bounds(FAR)


@pytest.mark.parametrize("prior", [PRIOR, PRIOR.without_soft_bounds()], ids=["wall", "no wall"])
def test_gradient_and_curvature_are_half_the_costs_derivatives(prior: VehiclePrior) -> None:
    steps = 1e-6 * PRIOR.deviations
    slope = np.array([(prior.cost(FAR + row) - prior.cost(FAR - row)) / (2 * row.sum()) for row in np.diag(steps)])
    assert prior.gradient(FAR) == pytest.approx(slope / 2, rel=1e-4, abs=1e-2)
    assert prior.gradient(FAR) == pytest.approx(approx_fprime(FAR, prior.cost, 1e-9) / 2, rel=1e-2, abs=1.0)
    rise = (prior.gradient(FAR + steps) - prior.gradient(FAR - steps)) / (2 * steps)
    assert prior.curvature(FAR) == pytest.approx(rise, rel=1e-4)


def test_the_nearest_numbers_within_the_wall_cost_no_more_than_a_normal_prior_asks() -> None:
    within = PRIOR.clip_to_soft_bounds(FAR)
    assert not PRIOR.at_soft_bounds(within)
    inside = np.abs(FAR) < 2 * PRIOR.deviations
    assert within[inside].tolist() == FAR[inside].tolist()
    assert np.abs(within / PRIOR.deviations)[~inside] == pytest.approx(2.0)
    assert PRIOR.without_soft_bounds().clip_to_soft_bounds(FAR).tolist() == FAR.tolist()


def test_logarithms_bring_one_car_to_another_and_back() -> None:
    other = PRIOR.vehicle(CAR, FAR)
    assert PRIOR.logs(CAR, other) == pytest.approx(FAR)
    for name, log in zip(PRIOR.names, FAR, strict=True):
        assert read(other, name) == pytest.approx(read(CAR, name) * np.exp(log))


def test_a_file_is_rough_where_most_of_what_was_measured_is_off() -> None:
    errors = 0.2 * PRIOR.deviations
    lengths = is_length(PRIOR.names)
    off = np.where(np.arange(len(PRIOR.names)) % 2, 2.5, -2.5) * PRIOR.deviations
    assert PRIOR.off_on_the_whole(off, errors)
    assert not PRIOR.off_on_the_whole(np.where(lengths, off, 0.0), errors)
    assert not PRIOR.off_on_the_whole(off, 0.8 * PRIOR.deviations)  # nothing was measured
    few = np.zeros(len(off))
    few[np.flatnonzero(~lengths)[:3]] = 20 * PRIOR.deviations[0]  # what a missing effect pulls away
    assert not PRIOR.off_on_the_whole(few, errors)


def test_numbers_within_their_band_are_never_a_rough_file() -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        logs = rng.uniform(-Tolerance.band, Tolerance.band, len(PRIOR.names)) * PRIOR.deviations
        assert not PRIOR.off_on_the_whole(logs, 0.2 * PRIOR.deviations)
