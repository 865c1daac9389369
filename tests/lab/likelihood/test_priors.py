"""Priors of a vehicle's numbers: costs and their derivatives against plain calculus, logarithms that bring one car to
another, and numbers beyond their tolerance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import approx_fprime
from scipy.stats import norm

from logger.lab.likelihood.priors import Tolerance, VehiclePrior
from logger.vehicle.named_parameters import read

from ...support.lab.runs_with_residual import CAR

PRIOR = VehiclePrior.of(CAR, Tolerance())
FAR = np.linspace(-3.5, 3.5, len(PRIOR.names)) * PRIOR.deviations


def test_lengths_and_other_numbers_have_the_tolerance_that_was_given() -> None:
    prior = VehiclePrior.of(CAR, Tolerance(numbers=0.05, lengths=0.01))
    deviations = dict(zip(prior.names, prior.deviations, strict=True))
    assert deviations["sprung_mass_kg"] == deviations["front.tire_stiffness_n_per_m"] == 0.05
    assert deviations["front.cg_distance_m"] == deviations["contact_patch_m"] == 0.01


def test_the_cost_is_that_of_a_normal_density() -> None:
    density = norm(scale=PRIOR.deviations)
    assert PRIOR.cost(FAR) == pytest.approx(2 * (density.logpdf(0.0) - density.logpdf(FAR)).sum())


def test_gradient_and_precision_are_half_the_costs_derivatives() -> None:
    assert PRIOR.gradient(FAR) == pytest.approx(approx_fprime(FAR, PRIOR.cost, 1e-9) / 2, rel=1e-2, abs=1.0)
    steps = 1e-6 * PRIOR.deviations
    rise = (PRIOR.gradient(FAR + steps) - PRIOR.gradient(FAR - steps)) / (2 * steps)
    assert PRIOR.precision == pytest.approx(rise, rel=1e-4)


def test_logarithms_bring_one_car_to_another_and_back() -> None:
    other = PRIOR.vehicle(CAR, FAR)
    assert PRIOR.logs(CAR, other) == pytest.approx(FAR)
    for name, log in zip(PRIOR.names, FAR, strict=True):
        assert read(other, name) == pytest.approx(read(CAR, name) * np.exp(log))


def test_a_number_is_beyond_its_tolerance_where_the_runs_move_it_farther_than_chance() -> None:
    """Drawn from the prior and measured with an error, a number is rarely beyond; a wheelbase of which the runs know
    the sum alone, half of it at either end, is beyond at two of its prior's deviations each."""
    rng, deviations = np.random.default_rng(2), PRIOR.deviations
    known = 0.3 * deviations
    errors = (deviations**-2 + known**-2) ** -0.5
    drawn = [errors**2 / known**2 * (rng.normal(0, deviations) + rng.normal(0, known)) for _ in range(400)]
    assert sum(bool(PRIOR.beyond(one, errors)) for one in drawn) / 400 < 0.06  # 13 numbers, three deviations: 0.035
    lengths = np.isin(PRIOR.names, ["front.cg_distance_m", "rear.cg_distance_m"])
    half = np.where(lengths, deviations / np.sqrt(2), deviations)
    moved = np.where(lengths, 2.2 * deviations, 0.0)
    assert {*PRIOR.beyond(moved, half)} == {"front.cg_distance_m", "rear.cg_distance_m"}
    assert not PRIOR.beyond(moved, np.where(lengths, known, deviations))  # known well, they may be so far off
    assert not PRIOR.beyond(np.full(len(deviations), 1.5) * deviations, 0.999 * deviations)  # within the band
