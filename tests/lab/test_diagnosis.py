"""A diagnosis names what is missing and nothing where nothing is; what it cannot explain or try, it says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from logger.lab.diagnosis import ALREADY_PRESENT, LAID_BY_THE_ROAD, LabDiagnosis, assess, diagnose, obstacles_of, refit
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.selection.evidence import FALSE_ALARM, probability_by_chance
from logger.lab.selection.stepwise import Search, SearchRound, Selection
from logger.runs import RecordFacts, Run
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.effect import Chosen, Misalignment, chosen
from logger.vehicle.named_parameters import changed, read

from ..support.lab.runs_with_residual import CAR, measuring
from ..support.lab.secret_runs import EFFECTS, NOISE_MPS2, car_off_by, hidden, posterior_of, secret_runs

FEW = ("sensor_gain", "sensor_offset", "time_offset", "tire_damping")
SPRINGS = ("front.suspension_stiffness_n_per_m", "rear.suspension_stiffness_n_per_m")


def diagnosed(runs: SimulatedRuns, names: Sequence[str] = FEW, present: Sequence[Chosen] = (),
              tolerance: Tolerance | None = None) -> LabDiagnosis:
    return diagnose(posterior_of(runs, tolerance=tolerance), {name: EFFECTS[name] for name in names}, present)


@pytest.fixture(scope="module")
def flawless() -> SimulatedRuns:
    return secret_runs(seed=2)


@pytest.fixture(scope="module")
def offset() -> LabDiagnosis:
    return diagnosed(secret_runs([hidden("sensor_offset", offset_m=0.4)]), (*FEW, "roll"))


def nothing_is_missing(found: LabDiagnosis) -> bool:
    return not found.verdict and not found.unexplained and found.shape is None


# --- what lacks no physics ---


def test_a_car_as_its_file_says_lacks_nothing(flawless: SimulatedRuns) -> None:
    found = diagnosed(flawless)
    assert nothing_is_missing(found) and not found.beyond and not found.missing
    assert found.final_error == pytest.approx(found.noise_floor_error, rel=0.05)
    assert found.noise.deviation_mps2 == pytest.approx(NOISE_MPS2, rel=0.05)
    assert all(one.p_value > FALSE_ALARM for one in found.candidates)


@pytest.mark.slow
def test_a_recorder_that_averages_and_is_a_little_weak_lacks_no_physics() -> None:
    rng = np.random.default_rng(3)

    def weak(run: Run) -> np.ndarray:
        f_hz = np.fft.rfftfreq(run.count, 1 / run.rate_hz)
        passed = np.fft.irfft(np.fft.rfft(run.measured_mps2) * 0.992 * np.sinc(f_hz / run.rate_hz), run.count)
        return np.asarray(passed + rng.normal(0, NOISE_MPS2, run.count))

    runs = [measuring(run, weak(run)) for run in secret_runs(noise_mps2=0.0).runs]
    assert nothing_is_missing(diagnosed(SimulatedRuns(runs, 500.0)))


@pytest.mark.slow
def test_a_clock_that_runs_a_little_fast_lacks_no_physics(flawless: SimulatedRuns) -> None:
    fast = SimulatedRuns([replace(one, distance_m=1.0008 * one.distance_m) for one in flawless.runs], 500.0)
    found = diagnosed(fast, (*FEW, "speed_scale"))
    assert set(found.verdict) <= {"speed_scale"} and not found.unexplained
    assert found.final_error < found.baseline_error


@pytest.mark.slow
def test_numbers_within_their_tolerance_lack_no_physics() -> None:
    rng = np.random.default_rng(5)
    numbers = (*SPRINGS, "sprung_mass_kg", "front.suspension_damping_n_s_per_m", "rear.tire_stiffness_n_per_m")
    car = changed(CAR, {name: read(CAR, name) * float(np.exp(0.025 * rng.normal())) for name in numbers})
    assert nothing_is_missing(diagnosed(secret_runs(car=car)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, pytest.param(5, marks=pytest.mark.release)])
def test_a_file_that_is_off_by_a_fifth_lacks_no_physics(seed: int) -> None:
    runs = secret_runs(car=car_off_by(0.18, seed), lasts_s=12.0, rougher=2.0)
    found = diagnosed(runs, (*FEW, "cg_shift", "occupant"), tolerance=Tolerance())
    assert nothing_is_missing(found) and found.tolerance == pytest.approx(0.2)


# --- what lacks some ---


def test_what_is_missing_is_named_with_its_numbers_and_errors(offset: LabDiagnosis) -> None:
    assert offset.verdict == ("sensor_offset",) and not offset.unexplained
    (one,) = offset.missing
    error = one.standard_errors["offset_m"]
    assert 0 < error < 0.03 and one.values["offset_m"] == pytest.approx(0.4, abs=4 * error)
    best = offset.candidate("sensor_offset")
    assert best is offset.candidates[0] and best.one.values == one.values
    assert best.p_value <= probability_by_chance(best.gain, 5) and best.p_value < 1e-9
    assert best.confused_with == ()


@pytest.mark.slow
def test_what_gains_is_named_however_large_its_standard_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a friction that grows over all rates there are: a damper does nearly the same."""
    monkeypatch.setattr("logger.lab.diagnosis.deviations_from_null", lambda *_: 0.5)
    assert diagnosed(secret_runs([hidden("sensor_offset", offset_m=0.4)])).verdict == ("sensor_offset",)


def test_errors_on_what_no_fit_saw_fall_on_the_way(offset: LabDiagnosis) -> None:
    words = [step.words for step in offset.steps]
    assert words == ["the vehicle's file unchanged", "its parameters refitted", "with sensor_offset"]
    before, refitted, after = (step.error for step in offset.steps)
    assert before == pytest.approx(offset.baseline_error, rel=1e-4)  # which is simulated finely
    assert before > refitted > 2 * after
    assert offset.final_error <= after == pytest.approx(offset.candidate("sensor_offset").error, rel=0.02)
    assert after == pytest.approx(offset.noise_floor_error, rel=0.06)


def test_others_are_candidates_where_they_are_better_than_the_refit_the_least_probable_by_chance_first(
        offset: LabDiagnosis) -> None:
    best, *others = offset.candidates
    assert {*(one.effect.name for one in others), *offset.no_better} == {*FEW} - {"sensor_offset"}
    assert [one.p_value for one in others] == sorted(one.p_value for one in others)
    refitted = offset.steps[1].error
    assert best.error < 0.5 * refitted
    assert all(best.error < one.error < refitted and one.held_out_gain < best.held_out_gain for one in others)


@pytest.mark.slow
def test_an_effect_that_is_there_is_refitted_and_not_tried() -> None:
    present = [hidden("sensor_offset", offset_m=0.3)]
    found = diagnosed(secret_runs([hidden("sensor_offset", offset_m=0.4)]), FEW, present)
    assert nothing_is_missing(found) and found.obstacles == {"sensor_offset": ALREADY_PRESENT} and found.not_tried == {}
    (one,) = found.effects
    assert one.values["offset_m"] == pytest.approx(0.4, abs=0.04) and one.standard_errors.keys() == {"offset_m"}
    assert found.baseline_error > 1.1 * found.final_error


@pytest.mark.slow
def test_one_effect_is_enough_to_ask_for() -> None:
    found = diagnosed(secret_runs([hidden("sensor_gain", gain=1.2)]), ["sensor_gain"])
    assert found.verdict == ("sensor_gain",) and not found.unexplained


@pytest.mark.slow
def test_none_can_be_asked_for_too(flawless: SimulatedRuns) -> None:
    found = diagnosed(flawless, [])
    assert nothing_is_missing(found) and found.candidates == () and found.undetectable == ()


# --- what is not explained ---


@pytest.mark.slow
def test_what_only_another_car_would_explain_is_unexplained() -> None:
    stiff = changed(CAR, {name: 1.35 * read(CAR, name) for name in SPRINGS})
    found = diagnosed(secret_runs(car=stiff), ("sensor_gain", "sensor_mount_resonance"), tolerance=Tolerance(0.05))
    assert found.verdict == () and found.unexplained
    assert {*SPRINGS} <= found.beyond.keys()
    assert all(abs(np.log1p(share)) > Tolerance.band * 0.02 for share in found.beyond.values())
    assert all(0.15 < found.beyond[name] < 0.40 for name in SPRINGS)
    assert not found.exceeds_noise and found.shape is None


@pytest.mark.slow
def test_what_no_candidate_explains_is_unexplained_and_imitations_are_not_named() -> None:
    found = diagnosed(secret_runs([hidden("dry_friction", friction_force_n=200.0)]), ("tire_damping", "sensor_gain"))
    assert found.verdict == () and found.exceeds_noise and found.unexplained
    assert found.excess > UNEXPLAINED and found.shape is not None
    assert min(one.p_value for one in found.candidates) < FALSE_ALARM  # more than noise, and yet nothing


@pytest.mark.slow
@pytest.mark.parametrize("there, verdict", [(("dry_friction", "sensor_bandwidth"), ()),
                                            (("sensor_bandwidth",), ("sensor_bandwidth",))])
def test_a_sensor_that_explains_little_beside_what_is_unknown_is_not_named(
        there: tuple[str, ...], verdict: tuple[str, ...]) -> None:
    values = {"dry_friction": {"friction_force_n": 200.0}, "sensor_bandwidth": {"cutoff_hz": 25.0}}
    posterior = posterior_of(secret_runs([hidden(name, **values[name]) for name in there]))
    low_pass = EFFECTS["sensor_bandwidth"]
    before, now = (refit(posterior, posterior.start(effects)) for effects in (
        [], [hidden("sensor_bandwidth", **values["sensor_bandwidth"])]))
    selection = Selection(before, now, {low_pass.name: before.score - now.score}, {}, SearchRound((), ()),
                          ((low_pass.name, now.hold_out),))
    found = assess(posterior, {low_pass.name: low_pass}, [], Search([low_pass], 0, Misalignment(1.0, 0.0)), selection)
    assert found.verdict == verdict and found.exceeds_noise is not bool(verdict)


def test_effects_that_cannot_be_tried_are_named_with_the_reason(flawless: SimulatedRuns, offset: LabDiagnosis) -> None:
    why = {name: EFFECTS[name].obstacle_on(CAR, False, False, False) for name in (
        "roll", "constant_force", "force_gain", "force_limit")}
    assert all(why.values())
    found = obstacles_of(posterior_of(flawless), EFFECTS, [chosen(EFFECTS["sensor_gain"], {"gain": 1.1})])
    assert found == {"sensor_gain": ALREADY_PRESENT, **why}
    assert offset.not_tried == {"roll": why["roll"]} and "roll" in offset.catalogue


def test_what_only_shifts_records_is_not_tried_on_runs_that_were_laid_where_the_road_was_felt() -> None:
    first, *others = secret_runs(seed=2).runs
    laid = [replace(run, facts=RecordFacts(places_by="road", vehicle="some")) for run in (first, *others)]
    tried = {name: EFFECTS[name] for name in ("time_offset", "speed_scale", "sensor_bandwidth")}
    found = obstacles_of(posterior_of(SimulatedRuns(laid)), tried, [])
    assert found == dict.fromkeys(("time_offset", "speed_scale"), LAID_BY_THE_ROAD)
    assert obstacles_of(posterior_of(SimulatedRuns([first, *laid[1:]])), tried, []) == {}


@pytest.mark.slow
def test_effects_that_the_runs_would_hide_are_reported(flawless: SimulatedRuns) -> None:
    found = diagnosed(flawless, (*FEW, "wheel_lift"))
    hidden_ones = {one.effect.name: one.deviations for one in found.undetectable}
    assert hidden_ones["wheel_lift"] < 0.1 and "sensor_offset" not in hidden_ones
    assert not {*hidden_ones} & {*found.verdict}


def test_progress_is_reported(flawless: SimulatedRuns) -> None:
    reported: list[str] = []
    diagnose(posterior_of(flawless), {"sensor_gain": EFFECTS["sensor_gain"]}, progress=reported.append)
    assert reported[0] == "refitting the model's parameters" and "round 1" in reported
    assert reported[-1] == "what these runs could not show"
