"""The fit against truth, against SciPy on another simulation, and against draws of its own noise."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import least_squares
from scipy.signal import lfilter

from logger.fitting.fisher_scoring import correlation_of
from logger.identification.drive_model import DriveModel
from logger.identification.identifiability import UNEXPLAINED, NotIdentifiable
from logger.identification.noise_models import Autoregressive, RoadNoise, White
from logger.identification.prediction_error_fit import Fit, FitOptions, fit, spread_starts
from logger.runs import normalised_rms
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.studies.drives import recorded
from logger.vehicle.named_parameters import Free, changed, free

from ..support.drives.bumps import bump_record, road_record

Array = npt.NDArray[np.float64]

CAR = read_vehicle(vehicle_file("rav4-2009"))
MASS, RATE = "sprung_mass_kg", "both.suspension_stiffness_n_per_m"
BUMP = bump_record(CAR)
WHITE = [White()]


def mass_fit(start: float = 700.0, options: FitOptions | None = None) -> Fit:
    model = DriveModel(CAR, [free(CAR, MASS, start)], [BUMP])
    return fit(model, model.measured, options)


class Line:
    """a + b t."""

    exact = True

    def __init__(self, time: Array) -> None:
        self.time = time
        self.parameters = [Free("a", 0.0, -10.0, 10.0), Free("b", 1.0, 0.01, 100.0)]

    def predict(self, values: Array) -> list[Array]:
        return [values[0] + values[1] * self.time]

    def slopes(self, values: Array) -> list[Array]:
        return [np.stack([np.ones_like(self.time), self.time], axis=1)]


def test_without_noise_it_is_the_truth() -> None:
    names = [MASS, "front.suspension_stiffness_n_per_m", "rear.suspension_damping_n_s_per_m", "contact_patch_m"]
    model = DriveModel(CAR, [free(CAR, name, 1.3 * free(CAR, name).start) for name in names],
                         [bump_record(CAR, noise_mps2=0.0), road_record(CAR, 20.0, 12.0, 1, noise_mps2=0.0)])
    found = fit(model, model.measured)
    assert found.converged
    assert [found.parameters[name] / free(CAR, name).start for name in names] == pytest.approx([1] * 4, abs=2e-5)
    assert found.error_after < 2e-5 < 0.1 < found.error_before


def test_scipy_on_the_stepping_simulation_says_the_same() -> None:
    def residuals(x: Array) -> Array:
        car = changed(CAR, {MASS: 875 * x[0], RATE: 23_088 * x[1]})
        return np.asarray(recorded(car, BUMP.track, BUMP.distance_m, 0.0, 0) - BUMP.measured_mps2)

    theirs = least_squares(residuals, [0.9, 1.1], diff_step=1e-4)
    deviation = np.sqrt(2 * theirs.cost / (BUMP.count - 2))
    errors = deviation * np.sqrt(np.diag(np.linalg.inv(theirs.jac.T @ theirs.jac)))
    model = DriveModel(CAR, [free(CAR, MASS, 790), free(CAR, RATE, 25_000)], [BUMP])
    ours = fit(model, model.measured, FitOptions(noise=WHITE))
    unit = np.array([875, 23_088])
    assert np.array(list(ours.parameters.values())) / unit == pytest.approx(theirs.x, abs=2e-3 * errors.min())
    assert np.array(list(ours.standard_errors.values())) / unit == pytest.approx(errors, rel=2e-3)
    covariance = np.linalg.inv(theirs.jac.T @ theirs.jac) * deviation**2
    assert correlation_of(ours.covariance)[0, 1] == pytest.approx(covariance[0, 1] / errors.prod(), abs=1e-3)


def test_every_start_ends_at_the_same_mass() -> None:
    ends = [mass_fit(start).parameters[MASS] for start in (300, 600, 1500, 3000)]
    assert np.ptp(ends) < 1e-4
    assert ends[0] == pytest.approx(875, rel=0.003)


def test_errors_are_those_of_the_formats() -> None:
    found = mass_fit()
    assert found.error_after == pytest.approx(
        np.sqrt(np.mean(found.residuals[0] ** 2) / np.mean(BUMP.measured_mps2**2)))
    assert normalised_rms([np.ones(4), np.zeros(2)], [np.ones(4), np.ones(2)]) == pytest.approx(np.sqrt(2 / 3))


def test_bounds_hold_and_are_reported() -> None:
    model = DriveModel(CAR, [free(CAR, MASS, 600, (500, 700)), free(CAR, RATE)], [BUMP])
    found = fit(model, model.measured)
    assert found.parameters[MASS] == pytest.approx(700)
    assert found.at_bound == [MASS]
    assert not mass_fit().at_bound


def test_several_starts_and_the_best_of_them() -> None:
    found = mass_fit(options=FitOptions(starts=[{MASS: 400.0}, {MASS: 2000.0}]))
    assert found.ends[:, 0] == pytest.approx(found.parameters[MASS], rel=1e-4)
    with pytest.raises(ValueError, match="every start between its bounds"):
        mass_fit(options=FitOptions(starts=[{MASS: 4.0}]))
    numbers = [free(CAR, MASS), free(CAR, "sensor.ahead_m")]
    starts = spread_starts(numbers, 40)
    masses = np.array([start[MASS] for start in starts])
    assert (masses.min() < 340, masses.max() > 2300, ((masses > 291) & (masses < 2626)).all()) == (True, True, True)
    assert np.abs(np.mean([start["sensor.ahead_m"] for start in starts])) < 0.3


def test_a_line_is_a_regression() -> None:
    time = np.linspace(0, 3, 200)
    measured = 0.5 + 2 * time + 0.1 * np.random.default_rng(1).standard_normal(200)
    found = fit(Line(time), [measured], FitOptions(noise=WHITE))
    columns = np.stack([np.ones(200), time], axis=1)
    solution, left, *_ = np.linalg.lstsq(columns, measured, rcond=None)
    assert list(found.parameters.values()) == pytest.approx(solution.tolist(), abs=1e-6)
    assert found.covariance == pytest.approx(np.linalg.inv(columns.T @ columns) * left[0] / 198, rel=1e-4)


def test_a_low_pass_leaves_out_what_is_only_noise() -> None:
    hum = 2.0 * np.sin(2 * np.pi * 33.0 * BUMP.time_s)
    model = DriveModel(CAR, [free(CAR, MASS, 700)], [BUMP])
    plain, low = (fit(model, [model.measured[0] + hum], FitOptions(noise=WHITE, low_pass_hz=one))
                  for one in (None, 20.0))
    assert low.standard_errors[MASS] < 0.1 * plain.standard_errors[MASS]
    assert low.parameters[MASS] == pytest.approx(875, rel=0.003)


def test_innovations_bring_the_errors_right_that_output_error_has_wrong() -> None:
    time, generator = np.linspace(0, 2, 400), np.random.default_rng(4)
    outcome: dict[str, list[float]] = {"white": [], "ar": []}
    for _ in range(40):
        noise = lfilter([0.05], [1.0, -0.95], generator.standard_normal(400))
        for name, kind in (("white", White()), ("ar", Autoregressive())):
            found = fit(Line(time), [2 * time + noise], FitOptions(noise=[kind]))
            outcome[name].append((found.parameters["b"] - 2) / found.standard_errors["b"])
    assert np.std(outcome["white"]) > 3
    assert np.std(outcome["ar"]) < 1.6


def test_a_rough_road_outside_the_model() -> None:
    scores, levels = [], []
    for seed in range(6):
        record = bump_record(CAR, 12.0, seed=seed, iri_outside=5.0, start_m=8.0)
        model = DriveModel(CAR, [free(CAR, MASS, 1000), free(CAR, RATE, 20_000)], [record])
        found = fit(model, model.measured, FitOptions(noise=[White(), Autoregressive(), RoadNoise(model.road_spectra)]))
        assert (found.noise.name, found.converged) == ("road", True)
        scores += [(found.parameters[MASS] - 875) / found.standard_errors[MASS]]
        levels += [found.noise.levels["gd_n0_cm3"]]
    assert np.sqrt(np.mean(np.square(scores))) < 1.7
    assert np.mean(levels) == pytest.approx((5 / 0.5386) ** 2, rel=0.2)


def test_what_is_not_asked_right() -> None:
    model = DriveModel(CAR, [free(CAR, MASS)], [BUMP])
    with pytest.raises(ValueError, match="as long as the predictions"):
        fit(model, [model.measured[0][1:]])
    with pytest.raises(ValueError, match="at least one free parameter"):
        fit(DriveModel(CAR, [], [BUMP]), model.measured)


def test_records_of_nothing_but_zeros() -> None:
    model = DriveModel(CAR, [free(CAR, MASS)], [BUMP])
    with pytest.raises(ValueError, match="expected measurements that vary, found nothing but 0"):
        fit(model, [np.zeros_like(model.measured[0])])


def test_another_record_than_this_one_is_not_explained() -> None:
    model = DriveModel(CAR, [free(CAR, MASS)], [road_record(CAR, 10.0, 14.0, 1)])
    other = road_record(CAR, 10.0, 14.0, 2).kept_mps2
    with pytest.raises(NotIdentifiable, match="explains nothing of what was measured") as refused:
        fit(model, [other])
    assert refused.value.findings[0].kind == UNEXPLAINED
    fit(model, model.measured)


@pytest.mark.slow
def test_all_starts_have_one_end() -> None:
    records = [bump_record(CAR, 8.0, seed=seed, height_m=height_m, start_m=12.0)
               for seed, height_m in enumerate((0.15, 0.10))]
    wanted = [free(CAR, MASS), free(CAR, "both.suspension_damping_n_s_per_m")]
    model = DriveModel(CAR, wanted, records)
    found = fit(model, model.measured, FitOptions(low_pass_hz=20.0, starts=spread_starts(wanted, 4)))
    assert np.abs(found.ends / [875, 1776] - 1).max() < 0.01
