"""What an effect would gain is computed without a fit, and agrees with dense algebra over all unknowns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from logger.arrays import Array
from logger.lab.diagnosis import refit
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.selection import candidate_fit
from logger.lab.selection.candidate_fit import fit_roughly, refine
from logger.lab.selection.evidence import min_gain
from logger.lab.selection.screening import (
    Baseline,
    misalignment,
    scale_strength,
    screen,
    shared_parameters,
    without_distance_trend,
    without_effect,
)
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.effect import Chosen, Misalignment

from ...support.lab.runs_with_residual import CAR
from ...support.lab.secret_runs import EFFECTS, Dense, hidden, posterior_of, secret_runs
from ...support.slow import slow

STILL = Misalignment(1.0, 0.0)


def fitted(posterior: Posterior) -> Baseline:
    return refit(posterior, posterior.start())


@pytest.fixture(scope="module")
def slight() -> Baseline:
    """A plain car beside loud runs with a sensor that sits ahead."""
    return fitted(posterior_of(secret_runs([hidden("sensor_offset", offset_m=0.2)], noise_mps2=0.5)))


@pytest.mark.parametrize(("rate_hz", "first_hz"), [(0.0, None), (10.0, None), (100.0, 45.0)])
def test_no_slow_sensor_is_tried_that_ten_samples_a_second_cannot_show(rate_hz: float, first_hz: float | None) -> None:
    kinds = EFFECTS["sensor_bandwidth"].delaying_trials(replace(STILL, rate_hz=rate_hz))
    assert [*{kind[0]["cutoff_hz"] for kind in kinds}] == ([] if first_hz is None else [pytest.approx(first_hz)])


@pytest.mark.parametrize("name", ["sensor_offset", "tire_damping", "payload"])
def test_a_promise_is_what_dense_least_squares_gain_by_the_change(slight: Baseline, name: str) -> None:
    dense = Dense(slight.linear)
    found = screen(slight, EFFECTS[name], [STILL])
    trial = found.trials[0]
    before, _ = dense.least(dense.residual, dense.here)
    after, there = dense.least(dense.residual, dense.here, dense.white(trial.change()))
    assert trial.start is None and found.gain == trial.gain
    best = before - after
    strength, weakest = there[-1], -10 if EFFECTS[name].parameters[0].low < 0 else 0.03
    if weakest <= strength <= 10:
        assert trial.gain == pytest.approx(best, rel=1e-6, abs=1e-4)
        assert trial.logs == pytest.approx(there[: dense.count], abs=1e-6)
    else:  # not as strong, or as weak, as would be best
        assert trial.gain < best


def test_the_effect_that_is_there_promises_most_and_what_a_fit_then_gains(slight: Baseline) -> None:
    names = ("sensor_offset", "sensor_gain", "tire_damping", "sensor_bandwidth", "cg_shift")
    promises = {name: screen(slight, EFFECTS[name], [STILL]) for name in names}
    assert max(promises, key=lambda name: promises[name].gain) == "sensor_offset"
    rough = fit_roughly(slight.score, slight, promises["sensor_offset"])[0]
    fine = refine(slight.score, rough)
    assert fine.gain >= rough.gain - 1.0
    counted = np.log(slight.posterior.freedom)  # of the number that it has
    assert fine.gain == pytest.approx(promises["sensor_offset"].gain - counted, rel=0.3)
    assert fine.gain == pytest.approx(slight.score - fine.score)
    assert fine.chosen.effect is fine.effect is EFFECTS["sensor_offset"]
    assert fine.chosen.values["offset_m"] == pytest.approx(0.2, abs=0.1)


def test_a_trial_that_ends_at_a_car_that_cannot_be_simulated_is_left_out(
        slight: Baseline, monkeypatch: pytest.MonkeyPatch) -> None:
    found = screen(slight, EFFECTS["body_bending"], [STILL])
    relinearised = candidate_fit.relinearise
    left_out = found.trials[0].one.values["ends_move"]

    def not_simulated(posterior: Posterior, state: State, numbers: list[Array], least: float) -> LinearModel:
        if state.effects[-1].values["ends_move"] == left_out:
            raise np.linalg.LinAlgError("Matrix is not positive definite")
        return relinearised(posterior, state, numbers, least)

    monkeypatch.setattr(candidate_fit, "relinearise", not_simulated)
    fits = fit_roughly(slight.score, slight, found)
    assert fits and all(one.chosen.values["ends_move"] != left_out for one in fits)


@pytest.mark.slow
def test_a_car_that_was_bent_does_not_hide_what_bends_it() -> None:
    base = fitted(posterior_of(secret_runs([hidden("sensor_offset", offset_m=0.4)])))
    found = screen(base, EFFECTS["sensor_offset"], [STILL])
    assert found.gain > 500
    fine = refine(base.score, fit_roughly(base.score, base, found)[0])
    assert fine.chosen.values["offset_m"] == pytest.approx(0.4, abs=0.03)


def test_each_choice_has_its_best_trial_and_the_most_promising_is_first(slight: Baseline) -> None:
    found = screen(slight, EFFECTS["body_bending"], [STILL])
    assert {one.one.values["ends_move"] for one in found.trials} == {0.0, 1.0}
    frequencies = {one.one.values["frequency_hz"] for one in found.trials}
    assert len(frequencies) * 2 >= len(found.trials)  # of one choice no two trials are of one frequency
    assert found.gain == max(one.gain for one in found.trials)
    assert len(screen(slight, EFFECTS["tire_damping"], [STILL]).trials) == 1


def test_what_changes_nothing_promises_nothing(slight: Baseline) -> None:
    no_wheel_lifts_here = screen(slight, EFFECTS["wheel_lift"], [STILL])
    assert no_wheel_lifts_here.gain == pytest.approx(0, abs=1e-6)


@pytest.mark.slow
def test_a_patch_of_another_length_is_found_though_the_car_has_such_a_number_too() -> None:
    patch_m = 0.75 * CAR.contact_patch_m
    base = fitted(posterior_of(secret_runs([hidden("tire_enveloping", contact_patch_m=patch_m)])))
    place = base.posterior.prior.names.index("contact_patch_m")
    assert base.state.logs[place] < 0
    found = screen(base, EFFECTS["tire_enveloping"], [STILL])
    fine = refine(base.score, fit_roughly(base.score, base, found)[0])
    assert fine.gain > 30
    assert fine.chosen.values["contact_patch_m"] == pytest.approx(patch_m, rel=0.1)


@pytest.mark.slow
def test_as_recorded_is_the_nominal_car_on_distances_without_their_trend() -> None:
    runs = SimulatedRuns([replace(one, distance_m=1.004 * one.distance_m + 0.1) for one in secret_runs().runs], 500.0)
    base = fitted(posterior_of(runs))
    there = without_distance_trend(base)
    assert there.state.effects == base.state.effects and not there.state.logs.any()
    for run, distance_error_m, was_m in zip(runs.runs, base.posterior.distance_error_m(there.state.record),
                                   base.posterior.distance_error_m(base.state.record), strict=True):
        assert abs(was_m).max() > 0.2
        assert np.polyfit(run.distance_m, distance_error_m, 1) == pytest.approx(0, abs=0.02)
        assert abs(distance_error_m).max() < 0.1 * abs(was_m).max()


def test_a_wrong_speed_is_tried_where_the_runs_then_lie() -> None:
    posterior = posterior_of(secret_runs([hidden("speed_scale", scale=1.02)]))
    base = fitted(posterior)
    found = screen(base, EFFECTS["speed_scale"], [misalignment(posterior, posterior.start())])
    best = found.trials[0]
    assert best.start is not None and best.start.effects[-1] == best.one
    assert best.one.values["scale"] == pytest.approx(1.02, abs=2e-3)
    assert best.gain > 2 * min_gain(len(EFFECTS))


# --- how the runs lie ---


@pytest.mark.parametrize("scale", [0.95, 1.0, 1.03])
def test_one_factor_of_all_distances_is_seen(scale: float) -> None:
    runs = secret_runs().runs
    posterior = posterior_of(SimulatedRuns([replace(one, distance_m=scale * one.distance_m) for one in runs], 500.0))
    assert misalignment(posterior, posterior.start()).scale == pytest.approx(scale, abs=2e-3)


@pytest.mark.parametrize("late", [-90, 0, 40])
def test_one_delay_of_all_accelerations_is_seen(late: int) -> None:
    runs = secret_runs().runs
    posterior = posterior_of(SimulatedRuns([
        replace(one, measured_mps2=np.roll(one.measured_mps2, late)) for one in runs], 500.0))
    assert misalignment(posterior, posterior.start()).delay_s == pytest.approx(late / 100, abs=0.01)


# --- strengths ---


@pytest.mark.parametrize(("name", "parameter", "value", "half"), [
    ("sensor_gain", "gain", 1.21, 1.1), ("sensor_offset", "offset_m", 0.4, 0.2), ("speed_scale", "scale", 1.0404, 1.02),
    ("tire_damping", "tire_damping_n_s_per_m", 300.0, 150.0), ("sensor_bandwidth", "cutoff_hz", 20.0, 40.0),
    ("top_mount_compliance", "mount_stiffness_n_per_m", 2e5, 4e5),
])
def test_half_an_effect_is_half_way_to_where_it_does_nothing(
        name: str, parameter: str, value: float, half: float) -> None:
    one = hidden(name, **{parameter: value})
    found, same = scale_strength(one, 0.5), scale_strength(one, 1.0)
    assert found is not None and found.values[parameter] == pytest.approx(half)
    assert same is not None and same.values == pytest.approx(one.values)


def test_an_effect_that_is_there_or_not_has_no_half() -> None:
    assert scale_strength(hidden("wheel_lift"), 0.5) is None
    assert scale_strength(hidden("tire_enveloping", contact_patch_m=0.2), 0.5) is None


@pytest.mark.parametrize(("frequency_hz", "damping_ratio"), [(18.2, 0.03), *slow((14.2, 0.057), (29.0, 0.05))])
def test_a_sharp_resonance_promises_most_of_its_gain_wherever_it_is(frequency_hz: float, damping_ratio: float) -> None:
    """Between two of the frequencies at which it is tried, too."""
    sharp = hidden("sensor_mount_resonance", frequency_hz=frequency_hz, damping_ratio=damping_ratio)
    base = fitted(posterior_of(secret_runs([sharp], noise_mps2=0.2)))
    alone = screen(base, sharp.effect, [STILL])
    near = screen(base, sharp.effect, [STILL], Chosen(EFFECTS["occupant"], sharp.values))
    assert alone.gain > 0.5 * near.gain > 50
    assert near.trials[0].one.values == pytest.approx(dict(sharp.values), rel=0.05)


def test_the_fit_that_would_begin_at_the_effect_itself_is_not_tried_and_its_other_shapes_are() -> None:
    sharp = hidden("sensor_mount_resonance", frequency_hz=18.2, damping_ratio=0.03)
    base = fitted(posterior_of(secret_runs([sharp], noise_mps2=0.2)))
    alone = screen(base, sharp.effect, [STILL])
    again = screen(base, sharp.effect, [STILL], alone.trials[0].one)
    assert [one.one.values for one in alone.trials[1:]] == [one.one.values for one in again.trials]
    offset = hidden("sensor_offset", offset_m=0.2)
    assert not screen(base, offset.effect, [STILL], offset).trials  # of one shape


def test_numbers_that_are_shared_stay_inside_the_range_of_the_effect_that_takes_them() -> None:
    bending = EFFECTS["body_bending"]
    assert shared_parameters(bending, {"frequency_hz": 300.0, "mass_kg": 3.0}) == {"frequency_hz": 60.0}
    assert shared_parameters(EFFECTS["sensor_gain"], {"frequency_hz": 300.0}) == {}


def test_a_model_without_one_of_its_effects_has_all_else_as_it_was() -> None:
    there = [hidden("sensor_offset", offset_m=0.4), hidden("sensor_gain", gain=1.1)]
    posterior = posterior_of(secret_runs(there))
    now = refit(posterior, posterior.start(there))
    out = without_effect(now, "sensor_gain")
    assert out.state.names == ("sensor_offset",) and np.array_equal(out.state.logs, now.state.logs)
    assert out.state.effects[0].values == now.state.effects[0].values
    assert screen(out, EFFECTS["sensor_gain"], [STILL]).gain > min_gain(len(EFFECTS))


@pytest.mark.slow
@pytest.mark.parametrize(("order", "cutoff_hz"), [(4, 20.0), (6, 28.0), (8, 16.0)])
def test_a_delay_that_the_distances_absorbed_does_not_hide_the_order_of_a_filter(order: int, cutoff_hz: float) -> None:
    """A filter by scipy delays by up to half a wave; noise behind it hides from spectra what it took away."""
    rng, sections = np.random.default_rng(3), butter(order, cutoff_hz, fs=100.0, output="sos")
    runs = [replace(run, measured_mps2=sosfilt(sections, run.measured_mps2) + rng.normal(0, 0.05, run.count))
            for run in secret_runs([], noise_mps2=0.01).runs]
    posterior = posterior_of(SimulatedRuns(runs, 500.0))
    base = fitted(posterior)
    found = screen(base, EFFECTS["sensor_bandwidth"], [misalignment(posterior, posterior.start())])
    best = max(fit_roughly(base.score, base, found), key=lambda one: one.gain)
    assert best.chosen.values["order"] == pytest.approx(order, abs=1)
    assert best.chosen.values["cutoff_hz"] == pytest.approx(cutoff_hz, rel=0.15)
    others = [one for one in found.trials if abs(one.one.values["order"] - order) > 2]
    assert best.gain > 1.1 * max((one.gain for one in others), default=0.0)


def test_a_term_that_the_plain_form_has_not_promises_what_it_is_worth_and_its_size() -> None:
    """A cushion: the harder, the farther it is pressed, which a cubic term alone cannot be."""
    cushion = hidden("progressive_spring", cubic_stiffness_n_per_m3=1e4, quadratic_stiffness_n_per_m2=-3e5)
    base = fitted(posterior_of(secret_runs([cushion], rougher=2.0)))
    trials = screen(base, EFFECTS["progressive_spring"], [STILL]).trials
    plain, refined = (max(one.gain for one in trials if one.one.is_plain is form) for form in (True, False))
    assert not trials[0].one.is_plain and refined > 5 * plain
    assert trials[0].one.values["quadratic_stiffness_n_per_m2"] == pytest.approx(-3e5, rel=0.2)
