"""Priors of a vehicle's numbers: costs and their derivatives against plain calculus, logarithms that bring one car to
another, and numbers beyond their tolerance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import approx_fprime
from scipy.stats import norm

from logger.lab.likelihood.priors import Tolerance, VehiclePrior
from logger.vehicle.named_parameters import read
from logger.vehicle.uncertain import Known

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


def covariance_of(information: np.ndarray) -> np.ndarray:
    """Posterior covariance by the information of the runs (p, p), in units of the prior."""
    return np.linalg.inv(information + np.eye(len(PRIOR.names))) * np.outer(PRIOR.deviations, PRIOR.deviations)


def test_numbers_are_in_conflict_where_the_runs_move_them_farther_than_chance() -> None:
    """Drawn from the prior and measured with an error, a number is rarely so."""
    rng, deviations = np.random.default_rng(2), PRIOR.deviations
    known = 0.3 * deviations
    errors = (deviations**-2 + known**-2) ** -0.5
    drawn = [errors**2 / known**2 * (rng.normal(0, deviations) + rng.normal(0, known)) for _ in range(400)]
    assert sum(PRIOR.is_in_conflict(one, errors) for one in drawn) / 400 < 0.06  # 13 numbers, three deviations: 0.035
    assert not PRIOR.is_in_conflict(np.full(len(deviations), 1.5) * deviations, 0.999 * deviations)  # within the band


def test_a_number_is_beyond_its_tolerance_where_no_car_within_it_explains_the_runs() -> None:
    lengths = np.isin(PRIOR.names, ["front.cg_distance_m", "rear.cg_distance_m"])
    well = covariance_of(np.diag(np.where(lengths, 400.0, 1.0)))  # known to a twentieth of the prior
    assert {*PRIOR.beyond_tolerance(2.2 * lengths * PRIOR.deviations, well)} == {
        "front.cg_distance_m", "rear.cg_distance_m"}
    badly = covariance_of(np.diag(np.where(lengths, 4.0, 1.0)))
    assert not PRIOR.beyond_tolerance(2.2 * lengths * PRIOR.deviations, badly)
    assert not PRIOR.beyond_tolerance(1.5 * lengths * PRIOR.deviations, well)


def test_a_wheelbase_of_which_the_runs_know_the_sum_alone_is_beyond_at_both_ends() -> None:
    lengths = np.isin(PRIOR.names, ["front.cg_distance_m", "rear.cg_distance_m"]).astype(float)
    sum_alone = covariance_of(400.0 * np.outer(lengths, lengths))
    assert {*PRIOR.beyond_tolerance(2.2 * lengths * PRIOR.deviations, sum_alone)} == {
        "front.cg_distance_m", "rear.cg_distance_m"}
    apart = covariance_of(np.diag(1e-9 * lengths))
    assert not PRIOR.beyond_tolerance(2.2 * lengths * PRIOR.deviations, apart)


@pytest.mark.parametrize("wrong", [{"sprung_mass_kg": 0.1}, {"front.suspension_stiffness_n_per_m": 0.38},
                                   {"front.suspension_stiffness_n_per_m": 0.38, "sprung_mass_kg": -0.14}])
def test_where_no_run_shows_the_common_factor_of_masses_and_forces_the_wrong_ones_move(wrong: dict[str, float]) -> None:
    scaling = np.array([not name.endswith("_m") or "_per_m" in name for name in PRIOR.names], float)
    no_common_factor = np.eye(len(scaling)) - np.outer(scaling, scaling) / scaling.sum()
    moved = np.array([np.log1p(wrong.get(name, 0.0)) for name in PRIOR.names])
    posterior = covariance_of(1e4 * no_common_factor)
    found = PRIOR.moved(no_common_factor @ moved, posterior)
    assert {name: share for name, (share, _) in found.items()} == pytest.approx(wrong, abs=0.003)
    assert all(error < 0.004 for _, error in found.values())
    assert not PRIOR.moved(no_common_factor @ moved, covariance_of(1e-3 * no_common_factor))


def test_what_is_weighed_well_is_what_other_masses_and_forces_are_counted_against() -> None:
    """All springs, dampers and tires are a seventh softer than the file says; the sprung mass was weighed to 2 %."""
    prior = VehiclePrior.of(CAR, Tolerance(by_name={"sprung_mass_kg": 0.02}))
    moved = np.where(["_n_" in name for name in prior.names], np.log(6 / 7), 0.0)
    found = prior.moved(moved, 1e-8 * np.eye(len(moved)))
    assert {*found} == {name for name in prior.names if "_n_" in name}


def test_a_fifth_less_is_no_more_beyond_a_tolerance_of_a_fifth_than_a_fifth_more() -> None:
    well = covariance_of(1e4 * np.eye(len(PRIOR.names)))
    damping = np.array([name == "front.suspension_damping_n_s_per_m" for name in PRIOR.names], float)
    assert not PRIOR.beyond_tolerance(np.log(0.805) * damping, well)
    assert {*PRIOR.beyond_tolerance(np.log(0.75) * damping, well)} == {"front.suspension_damping_n_s_per_m"}
    assert {*PRIOR.beyond_tolerance(np.log(1.25) * damping, well)} == {"front.suspension_damping_n_s_per_m"}


def test_a_number_that_nobody_measured_contradicts_nothing() -> None:
    """A gas spring that is not there, of a damper whose file says ``unknown``."""
    name = "front.suspension_stiffness_n_per_m"
    unknown = VehiclePrior.of(CAR, Tolerance(by_name={name: Known.unknown(name, 1.0).deviation}))
    gone = np.where(np.array(unknown.names) == name, -20.0, 0.0)
    errors = 0.01 * unknown.deviations
    assert not unknown.is_in_conflict(gone, errors) and PRIOR.is_in_conflict(gone, errors)
    well = np.diag(errors**2)
    assert name not in unknown.beyond_tolerance(gone, well) and name in PRIOR.beyond_tolerance(gone, well)


def test_a_fit_takes_a_number_that_nobody_measured_no_farther_than_is_unusual() -> None:
    tire, mass = "front.tire_stiffness_n_per_m", "front.unsprung_mass_kg"
    prior = VehiclePrior.of(CAR, Tolerance(by_name={tire: 1.0, mass: Known.unknown(mass, 40.0).deviation}))
    reach = dict(zip(prior.names, prior.reach, strict=True))
    assert reach[tire] == pytest.approx(3.0, abs=0.005)  # by a factor of 20
    assert reach[mass] == pytest.approx(3 * np.log(20) / np.sqrt(3))
    assert np.isinf([one for name, one in reach.items() if name not in (tire, mass)]).all()


def test_a_number_known_to_a_fifth_that_comes_out_a_thousandth_of_the_file_is_beyond_its_tolerance() -> None:
    """Forces of a bench in kN."""
    name = "front.suspension_damping_n_s_per_m"
    roughly = VehiclePrior.of(CAR, Tolerance(by_name={name: 0.2}))
    off = np.where(np.array(roughly.names) == name, np.log(1e-3), 0.0)
    assert roughly.is_vague
    assert {*roughly.beyond_tolerance(off, np.diag((0.01 * roughly.deviations) ** 2))} == {name}
