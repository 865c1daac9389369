"""Distance errors: their numbers against plain calculus, how large they are found to be, and distances that wander
laid where they were truly driven."""

from __future__ import annotations

from dataclasses import astuple, replace

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.signal import savgol_filter

from logger.lab.likelihood.distance_error import (
    USUAL,
    ErrorSize,
    RecordError,
    derivative,
    unusual_distance_error_m,
    usual_size,
)
from logger.lab.likelihood.map_fit import align, fit
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.priors import Tolerance
from logger.runs import RecordFacts, Run
from logger.vehicle.effect import Chosen, chosen

from ...support.lab.noisy_runs import drawn, noisy_runs, off_m, posterior_of, tire_damping, with_wrong_speed, worst_rms
from ...support.lab.runs_with_residual import a_run
from ...support.lab.secret_runs import EFFECTS
from ...support.slow import release

RATE_HZ = 100.0
INNER = slice(50, -50)
RUN = a_run("run", 10.0, 20.0, 1)
ERROR = RecordError.of(RUN, Tolerance())
SPEED_SCALE, TIME_OFFSET = EFFECTS["speed_scale"], EFFECTS["time_offset"]


def laid(runs: list[Run], effects: tuple[Chosen, ...] = ()) -> tuple[Posterior, State]:
    """Runs with their distance errors fitted."""
    posterior = posterior_of(runs)
    return posterior, align(posterior, posterior.start(effects)).state


def gain_of(runs: list[Run], one: Chosen) -> tuple[float, Chosen]:
    """By how much an effect makes a model more evident whose numbers and distance errors are all fitted; and it."""
    posterior = posterior_of(runs)
    without, found = (fit(align(posterior, posterior.start(effects))) for effects in ([], [one]))
    return without.score - found.score, found.state.effects[0]


# --- the numbers of a record's error ---


@pytest.mark.parametrize(("at_hz", "within"), [(1.0, 1e-9), (10.0, 1e-9), (25.0, 1e-6), (33.0, 3e-4)])
def test_the_rate_of_change_of_a_wave_is_its_derivative(at_hz: float, within: float) -> None:
    time_s = np.arange(1000) / RATE_HZ
    turn = 2 * np.pi * at_hz
    found = derivative(np.sin(turn * time_s + 0.4), RATE_HZ)
    assert np.abs(found - turn * np.cos(turn * time_s + 0.4))[INNER].max() < within * turn


def test_a_recorder_that_averages_over_its_samples_is_allowed_its_droop() -> None:
    wave = np.sin(2 * np.pi * 20.0 * RUN.time_s)
    k = np.zeros(ERROR.count)
    k[-2:] = 0.01, np.pi**2 / 6  # sin(x) / x is 1 - x^2 / 6 with x = pi f / rate
    expected = (1.01 - (np.pi * 20.0 / RUN.rate_hz) ** 2 / 6) * wave
    assert ERROR.with_recorder_error(wave, k)[INNER] == pytest.approx(expected[INNER], abs=1e-3)
    assert ERROR.distance_error_m(k) == pytest.approx(0.0)


def test_slopes_say_what_small_numbers_do_to_a_prediction() -> None:
    """A prediction at a place farther by d is that of d / speed later; waves here are slow enough for that."""
    time_s = RUN.time_s
    k = 1e-3 * np.sin(np.arange(ERROR.count))
    k[-4] *= 0.01  # the factor, by which a whole run is multiplied

    def wave(at_s: np.ndarray) -> np.ndarray:
        return np.sin(2 * np.pi * 1.3 * at_s) + 0.5 * np.sin(2 * np.pi * 4.1 * at_s)

    later = wave(time_s + ERROR.distance_error_m(k) / RUN.speed_mps)
    found = k @ ERROR.slopes(wave(time_s))
    expected = ERROR.with_recorder_error(later, k) - wave(time_s)
    assert np.abs(found - expected)[INNER].max() < 0.01 * np.abs(expected).max()


def test_the_curve_goes_through_a_straight_line() -> None:
    line_m = 0.3 - 0.002 * np.arange(RUN.count)
    assert ERROR.distance_error_m(ERROR.coefficients_of(line_m)) == pytest.approx(line_m, abs=1e-12)


def test_the_basis_is_that_of_splines_and_of_what_a_smoothing_filter_leaves() -> None:
    count = ERROR.spline_count
    splines = BSpline.design_matrix(np.linspace(0, count - 3, RUN.count), np.arange(-3, count + 1.0), 3).toarray().T
    assert ERROR.basis[:count].toarray() == pytest.approx(splines, abs=1e-12)
    rough = replace(RUN, distance_m=np.round(RUN.distance_m, 2))
    left = rough.distance_m - savgol_filter(rough.distance_m, 101, 3)
    assert RecordError.of(rough, Tolerance()).basis[[-1]].toarray()[0] == pytest.approx(-left, abs=1e-9)


@pytest.mark.parametrize(("lasts_s", "coefficients"), [(20.0, 63), (100.0, 303), (150.0, 363), (400.0, 363)])
def test_longer_runs_have_more_coefficients_up_to_a_limit(lasts_s: float, coefficients: int) -> None:
    assert RecordError.of(a_run("run", 5.0, lasts_s, 1), Tolerance()).spline_count == coefficients


# --- the prior ---


def test_the_prior_has_the_deviations_that_it_was_given() -> None:
    size = ErrorSize(start_m=0.01, walk_m=0.02, scale=0.001)
    covariance = np.linalg.inv(ERROR.precision(size))

    def deviation_m(sample: int) -> float:
        rows = np.array([ERROR.distance_error_m(one)[sample] for one in np.eye(ERROR.count)])
        rows[-3] = 0.0  # what of the distance is rougher than any car drives is not of this size
        return float(np.sqrt(rows @ covariance @ rows))

    driven_m = np.ptp(RUN.distance_m)
    assert deviation_m(0) == pytest.approx(0.01, rel=1e-6)
    expected_m = np.sqrt(0.01**2 + 0.02**2 * RUN.time_s[-1] + (0.001 * driven_m) ** 2)
    assert deviation_m(-1) == pytest.approx(expected_m, rel=0.01)  # a curve is smoother than a walk, by half a knot


@pytest.mark.parametrize("size", [USUAL, ErrorSize(0.05, 0.001, 0.01)])
def test_the_determinant_is_that_of_the_precision(size: ErrorSize) -> None:
    sign, expected = np.linalg.slogdet(ERROR.precision(size))
    assert sign == 1
    assert ERROR.log_determinant(size) == pytest.approx(expected)


def test_sizes_are_kept_as_logarithms_and_the_usual_ones_cost_nothing() -> None:
    size = ErrorSize(0.05, 0.001, 0.01)
    assert astuple(ErrorSize.of(size.logs)) == pytest.approx(astuple(size))
    assert USUAL.cost == 0.0 < ErrorSize(walk_m=0.01).cost < ErrorSize(start_m=0.01).cost


def test_more_than_a_good_recorder_is_off_by_is_reported_and_no_less() -> None:
    usual_m = np.sqrt(USUAL.start_m**2 + USUAL.walk_m**2 * 20.0 + (USUAL.scale * np.ptp(RUN.distance_m)) ** 2)
    for factor, expected in ((2.5, 0.0), (4.0, 4.0 * usual_m)):
        k = ERROR.coefficients_of(np.full(RUN.count, -factor * usual_m))
        assert unusual_distance_error_m([ERROR, ERROR], [np.zeros(ERROR.count), k]) == pytest.approx(expected)


# --- sizes that are found ---


@pytest.mark.slow
@pytest.mark.parametrize("size", [ErrorSize(0.004, 0.004, 0.0003), ErrorSize(0.004, 0.03, 0.0003),
                                  ErrorSize(0.02, 0.015, 0.0003)])
def test_the_size_of_a_walk_is_found(size: ErrorSize) -> None:
    found = []
    for seed in range(6):
        case = drawn([], seed, size)
        start = case.posterior.state_at((), case.logs)
        found.append(np.log(align(case.posterior, start).size.walk_m / size.walk_m))
    assert np.mean(found) == pytest.approx(0.0, abs=0.35)
    assert np.std(found) < 0.6


def test_a_start_that_is_far_off_is_no_walk() -> None:
    true = noisy_runs()
    late = [replace(run, distance_m=run.distance_m + off) for run, off in zip(true, (0.06, -0.09), strict=True)]
    posterior, state = laid(late)
    found_m = posterior.distance_error_m(state.record)
    assert worst_rms([one + off for one, off in zip(found_m, (0.06, -0.09), strict=True)],
                     true) < 0.005
    assert state.size.start_m > 3 * USUAL.start_m and state.size.walk_m < USUAL.walk_m


# --- distances that wander ---


# As far as a real signal is off (0.08 m/s), from one reading to the next or for seconds.
@pytest.fixture(scope="module", params=[
    pytest.param((0.08, 0.02, 3), id="rough"), pytest.param((0.08, 5.0, 33), id="5 s, far"),
    *(pytest.param((0.08, over_s, 3), id=f"{over_s:g} s", marks=pytest.mark.release) for over_s in (1.0, 5.0))])
def wrong(request: pytest.FixtureRequest) -> tuple[float, float, int]:
    return request.param  # type: ignore[no-any-return]


def wrong_speed(run: Run, wrong: tuple[float, float, int], number: int) -> Run:
    *wander, seed = wrong
    return with_wrong_speed(run, *wander, seed + number)


@pytest.mark.slow
def test_runs_are_laid_where_they_were_driven(wrong: tuple[float, float, int]) -> None:
    true = noisy_runs()
    runs = [wrong_speed(run, wrong, i) for i, run in enumerate(true)]
    posterior, state = laid(runs)
    truth_m = off_m(runs, true)
    left_m = [found - one for found, one in zip(posterior.distance_error_m(state.record), truth_m, strict=True)]
    before_m = worst_rms(truth_m, true)
    assert before_m > 0.02 and worst_rms(left_m, true) < min(0.01, 0.5 * before_m)
    undisturbed = posterior_of(true)
    assert posterior.error(state) < 1.05 * undisturbed.error(undisturbed.start())


@pytest.mark.slow
@pytest.mark.parametrize("true", [0.0, 300.0])
def test_a_distance_that_wanders_hides_no_physics_and_makes_none(wrong: tuple[float, float, int], true: float) -> None:
    runs = [wrong_speed(run, wrong, i) for i, run in enumerate(noisy_runs([tire_damping(true)]))]
    gain, tires = gain_of(runs, tire_damping(150.0))
    assert gain > 50 if true else gain < 2
    assert tires.p.tire_damping_n_s_per_m == pytest.approx(true, abs=80.0)


def test_runs_that_do_not_wander_stay_where_they_were_recorded() -> None:
    true = noisy_runs()
    posterior, state = laid(true)
    assert worst_rms(posterior.distance_error_m(state.record), true) < 0.003
    assert unusual_distance_error_m(posterior.record_errors, state.record) == 0.0
    assert state.size.walk_m < USUAL.walk_m


WHEEL = chosen(SPEED_SCALE, {"scale": 1.01})


@pytest.mark.slow
@pytest.mark.parametrize(("one", "start"), [
    (WHEEL, chosen(SPEED_SCALE, {"scale": 1.0098})),
    (chosen(SPEED_SCALE, {"scale": 1.04}), chosen(SPEED_SCALE, {"scale": 1.0398})),
    (chosen(TIME_OFFSET, {"delay_s": 0.06}), chosen(TIME_OFFSET, {"delay_s": 0.05})),
], ids=["a wheel 1 % off", "a wheel 4 % off", "a late clock"])
def test_a_wrong_wheel_and_a_late_clock_are_no_distance_errors(one: Chosen, start: Chosen) -> None:
    gain, found = gain_of(noisy_runs([one]), start)
    assert gain > 10
    (name,) = one.values
    assert found.values[name] == pytest.approx(one.values[name], abs=0.002 if name == "delay_s" else 3e-4)


@pytest.mark.slow
def test_a_wrong_wheel_is_found_from_a_start_that_is_a_little_off() -> None:
    _, found = gain_of(noisy_runs([WHEEL]), chosen(SPEED_SCALE, {"scale": 1.008}))
    assert found.values["scale"] == pytest.approx(1.01, abs=5e-4)


@pytest.mark.slow
@pytest.mark.parametrize("apart", [0.001, 0.004])
def test_runs_may_each_have_their_own_factor_and_start(apart: float) -> None:
    true = noisy_runs([tire_damping(300.0)], speeds_mps=(8.0, 14.0, 11.0))
    runs = [replace(run, distance_m=(1 + share * apart) * run.distance_m + start)
            for run, share, start in zip(true, (1.0, -0.8, 0.3), (0.06, -0.04, 0.0), strict=True)]
    gain, tires = gain_of(runs, tire_damping(150.0))
    assert gain > 50
    assert tires.p.tire_damping_n_s_per_m == pytest.approx(300.0, abs=80.0)


def test_distances_that_are_coarse_from_sample_to_sample_are_smoothed() -> None:
    true, rng = noisy_runs(), np.random.default_rng(7)
    coarse = [replace(run, distance_m=run.distance_m + rng.normal(0, 0.05, run.count)) for run in true]
    (posterior, state), (undisturbed, still) = laid(coarse), laid(true)
    assert posterior.error(posterior.start()) > 1.3 * posterior.error(state)
    assert posterior.error(state) < 1.1 * undisturbed.error(still)


# --- runs that say how far off their places may be ---


RECEIVER = RecordFacts(place_std_m=1.2, places_by="receiver", delay_std_s=0.1)
_FORGETS_S = 60.0


def by_receiver(run: Run, seed: int, late_s: float = 0.0) -> Run:
    """The run with a receiver's places: wrong by 1.2 m, slowly now by more and now by less, and late."""
    rng = np.random.default_rng(seed)
    seconds = np.arange(int(run.count / run.rate_hz) + 3)
    apart = np.abs(seconds[:, None] - seconds)
    covariance = 1.2**2 * np.exp(-apart / _FORGETS_S) + 1e-9 * np.eye(len(seconds))
    wrong_m = np.linalg.cholesky(covariance) @ rng.normal(0, 1, len(seconds))
    smooth_m = np.convolve(np.pad(wrong_m, 3, mode="edge"), np.hanning(9)[1:-1] / 4, "valid")
    off_m = np.interp(run.time_s, seconds, smooth_m) + late_s * run.speed_mps
    return replace(run, distance_m=np.maximum.accumulate(run.distance_m + off_m), facts=RECEIVER)


@pytest.mark.parametrize("facts", [RecordFacts(), RecordFacts(place_std_m=0.0), RecordFacts(place_std_m=0.003)])
def test_a_run_that_says_nothing_or_little_has_a_good_recorder(facts: RecordFacts) -> None:
    assert usual_size(replace(RUN, facts=facts)) == USUAL


def test_a_receiver_is_off_by_what_it_says_at_the_start_and_by_as_much_a_minute_later() -> None:
    error = RecordError.of(replace(RUN, facts=RECEIVER), Tolerance())
    k = np.linalg.solve(np.linalg.cholesky(error.precision(USUAL)).T, np.random.default_rng(1).normal(
        0, 1, (error.count, 4000)))
    moved = error.basis.T @ k[:-2]
    late_m = 0.1 * RUN.speed_mps
    assert moved[0].std() == pytest.approx(np.hypot(1.2, late_m[0]), rel=0.05)
    walked = moved[-1] - moved[0] - (late_m[-1] - late_m[0]) / 0.1 * k[error.spline_count]
    # A process that forgets itself in a minute: its structure function begins as 2 t / 60 of its variance.
    assert walked.std() == pytest.approx(1.2 * np.sqrt(2 * 20.0 / _FORGETS_S), rel=0.08)


@pytest.mark.parametrize("size", [USUAL, ErrorSize(0.05, 0.001, 0.01)])
def test_the_determinant_of_a_receiver_is_that_of_its_precision(size: ErrorSize) -> None:
    error = RecordError.of(replace(RUN, facts=RECEIVER), Tolerance())
    assert np.linalg.slogdet(error.precision(size))[1] == pytest.approx(error.log_determinant(size), abs=1e-6)


def test_what_a_receiver_may_be_off_by_is_not_unusual() -> None:
    error = RecordError.of(replace(RUN, facts=RECEIVER), Tolerance())
    k = error.coefficients_of(np.full(RUN.count, 2.0))
    farther = ERROR.coefficients_of(np.full(RUN.count, 2.0))
    assert unusual_distance_error_m([error], [k]) == 0.0 < unusual_distance_error_m([ERROR], [farther])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, *release(2, 3)])
def test_runs_are_found_metres_off_and_nothing_is_made_of_it(seed: int) -> None:
    truth = noisy_runs(lasts_s=20.0)
    runs = [by_receiver(run, 10 * seed + number, 0.06) for number, run in enumerate(truth)]
    posterior, state = laid(runs)
    found_m = posterior.distance_error_m(state.record)
    left = [one - moved for one, moved in zip(off_m(runs, truth), found_m, strict=True)]
    assert worst_rms(left, truth) < 0.05
    for one in (chosen(TIME_OFFSET, TIME_OFFSET.usual), chosen(SPEED_SCALE, SPEED_SCALE.usual)):
        assert gain_of(runs, one)[0] < 10.0


# --- runs that were laid where the road was felt ---


BY_THE_ROAD = RecordFacts(place_std_m=0.07, places_by="road", vehicle="some")


@pytest.mark.parametrize("size", [USUAL, ErrorSize(0.05, 0.001, 0.01)])
def test_places_by_the_road_may_all_be_late_by_as_much_as_is_looked_for(size: ErrorSize) -> None:
    error = RecordError.of(replace(RUN, facts=BY_THE_ROAD), Tolerance())
    late = np.linalg.inv(error.precision(size))[error.spline_count, error.spline_count]
    assert late == pytest.approx((0.6 / np.sqrt(12)) ** 2)  # evenly within 0.3 s
    assert error.basis[[error.spline_count]].toarray()[0] == pytest.approx(RUN.speed_mps)
    assert np.linalg.slogdet(error.precision(size))[1] == pytest.approx(error.log_determinant(size), abs=1e-6)


@pytest.mark.slow
def test_what_a_model_of_another_phase_felt_late_is_no_late_clock() -> None:
    """The same 20 ms in all runs, as of a body's bounce by a damper that is off by a third."""
    late = [replace(run, distance_m=run.distance_m + 0.02 * run.speed_mps) for run in noisy_runs(lasts_s=20.0)]
    one = chosen(TIME_OFFSET, {"delay_s": -0.02})
    assert gain_of(late, one)[0] > 10.0 > gain_of([replace(run, facts=BY_THE_ROAD) for run in late], one)[0]
