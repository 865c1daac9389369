"""What is said of a diagnosis: what is missing, how sure that is, what else it could be; and the contract's object."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from logger.api.lab.diagnose import diagnosis_blocks, diagnosis_json, diagnosis_summary, looks_like, table, untested
from logger.api.lab.question import DiagnoseQuestion
from logger.api.lab.words import force_words
from logger.lab.diagnosis import ALREADY_PRESENT, CandidateEffect, LabDiagnosis
from logger.lab.likelihood.noise_floor import NoiseLevel, SignalErrors
from logger.lab.residual_tests import run_residual_tests
from logger.lab.residual_tests.tests import ResidualEvidence
from logger.lab.residuals.breakdown import breakdown
from logger.lab.residuals.unexplained import Removed, Shape, spatial_line_of
from logger.lab.selection.detectability import Undetectable
from logger.lab.selection.holdout import AS_FILED, JUDGED_ON, REFITTED, ErrorStep
from logger.report.blocks import text
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.effect import Chosen, chosen

from ..support.lab.runs_with_residual import beside_with

EFFECTS = shipped_effects()


def candidate(name: str, p_value: float, gain: float, **values: float) -> CandidateEffect:
    return CandidateEffect(Chosen(EFFECTS[name], EFFECTS[name].usual | values), 0.2, p_value, gain, gain - 4.0, ())


OTHERS = (candidate("tire_damping", 0.3, 8.0), candidate("sensor_gain", 1.0, -2.0))
AS_USUAL = Removed((), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.151)
NOTHING = LabDiagnosis(
    runs=("runs/a",), catalogue=EFFECTS, baseline_error=0.31, final_error=0.151, noise=NoiseLevel(0.05, 0.001),
    noise_floor_error=0.15, candidates=OTHERS, obstacles={}, verdict=(), excess=0.02, beyond={}, in_conflict=False,
    steps=(ErrorStep(AS_FILED, 0.31), ErrorStep(REFITTED, 0.152)), effects=(),
    undetectable=(), shape=None, removed=AS_USUAL)
FRICTION = candidate("dry_friction", 1e-12, 500.0, friction_force_n=84.7)
FOUND = replace(
    NOTHING, candidates=(FRICTION, *OTHERS), verdict=("dry_friction",),
    effects=(chosen(EFFECTS["dry_friction"], FRICTION.one.values, standard_errors={
        "friction_force_n": 3.9, "transition_velocity_m_per_s": float("inf")}),),
    steps=(NOTHING.steps[0], ErrorStep(REFITTED, 0.25), ErrorStep("with dry_friction", 0.153)))


@pytest.fixture(scope="module")
def shape() -> Shape:
    """Of a residual that turns with a wheel."""
    def turns(run: object, _model: object, rng: np.random.Generator) -> np.ndarray:
        return 0.05 * np.sin(run.distance_m / 0.31) + rng.normal(0, 0.03, run.count)  # type: ignore[attr-defined]

    residuals = beside_with(turns)
    where = breakdown(residuals)
    return Shape(residuals, where, run_residual_tests(ResidualEvidence(residuals, where, residuals)),
                 spatial_line_of(residuals))


# --- sentences ---


def test_few_samples_leave_more_than_noise_of_what_no_fit_saw() -> None:
    error = 1.12 * FOUND.noise_floor_error
    short = replace(FOUND, steps=(*FOUND.steps[:-1], FOUND.steps[-1]._replace(error=error)), overfit=5 / 55)
    assert short.reaches_floor and not replace(short, overfit=5 / 1000).reaches_floor


def test_nothing_is_missing_where_there_is_no_more_than_noise() -> None:
    nothing, errors = diagnosis_summary(NOTHING)
    assert nothing.startswith("Nothing is missing: ")
    assert errors == ("NRMSE on held-out stretches: 0.310 (fit 69.0 %) with the vehicle's file unchanged, 0.152 "
                      "(fit 84.8 %) with its parameters refitted. Noise floor: about 0.150 (fit 85.0 %). Share of "
                      "the measured power explained: 98% with the parameters refitted.")
    assert looks_like(NOTHING) == untested(NOTHING) == []


def test_what_is_missing_is_said_with_its_numbers_and_how_probable_noise_is() -> None:
    missing, errors = diagnosis_summary(FOUND)
    assert missing == (f"dry_friction is missing ({EFFECTS['dry_friction'].title}): friction_force_n 85 ± 4 N, "
                       "transition_velocity_m_per_s 0 m/s. p-value (probability that noise alone looks like any known "
                       "effect): below 1e-9.")
    assert "0.153 (fit 84.7 %) with dry_friction. Noise floor: about 0.150 (fit 85.0 %). " in errors
    assert errors.endswith("explained: 94% with the parameters refitted, 98% finally.")
    reach = diagnosis_summary(replace(FOUND, best_linear=0.962))[1]
    assert reach.endswith("No linear model can explain more than 96%.")
    assert diagnosis_json(FOUND)["explained_power"] == {
        "refitted": pytest.approx(1 - 0.25**2), "final": pytest.approx(1 - 0.153**2), "best_linear": None}


def test_a_signal_that_contradicts_the_others_is_named() -> None:
    sure = replace(FOUND, signals_off={"travel_m": 0.052})
    (off,) = (one for one in diagnosis_summary(sure) if "travel_m" in one)
    assert off.startswith("travel_m is +5.2% off against all other signals")
    hedged = replace(FOUND, excess=3.0, signals_off={"travel_m": 0.052},
                     signals={"travel_m": SignalErrors(0.7, 0.139, 0.003)})
    assert any(one.startswith("travel_m may be +5.2% off") and "leaves 13.9% of the signal" in one
               for one in diagnosis_summary(hedged))
    for found, *shares in ((sure, {"travel_m": 0.052}, {}), (hedged, {}, {"travel_m": 0.052})):
        said = diagnosis_json(found)
        assert [said["signals_in_conflict"], said["signals_perhaps_in_conflict"]] == shares
    left = replace(FOUND, excess=3.0, excess_of={"": 0.0, "travel_m": 3.0})
    assert any(one.startswith("It appears only in travel_m") for one in diagnosis_summary(left))
    everywhere = replace(left, excess_of={"": 0.5, "travel_m": 3.0})
    assert not any("travel_m" in one for one in diagnosis_summary(everywhere))


def test_beside_something_unexplained_it_is_only_part_or_an_imitation() -> None:
    missing, *_ = diagnosis_summary(replace(FOUND, excess=0.5, final_error=0.18))
    assert "dry_friction explains part of the residual, or imitates something else" in missing
    missing, left, *_ = diagnosis_summary(replace(FOUND, excess=0.5))
    assert missing.startswith("dry_friction is missing")  # a hundred times what is left
    assert left == ("Something more is missing that no known effect explains: in the worst run the residual is 1.5 "
                    "times the sensor's noise. Beyond that noise it is less than 0.1% of the measured power.")


def test_an_effect_that_leaves_another_signal_as_it_was_may_only_imitate() -> None:
    """A table that gives way moved a wheel otherwise, and a bending body fitted the sensor on the body alone."""
    steps = (NOTHING.steps[0], ErrorStep(REFITTED, 0.65, 0.96**2), ErrorStep("with dry_friction", 0.16, 0.90**2))
    found = replace(FOUND, excess=240.0, excess_of={"": 0.01, "wheel": 240.0}, steps=steps,
                    signals={"wheel": SignalErrors(0.96, 0.90, 0.003)})
    missing, left, where, *_ = diagnosis_summary(found)
    assert missing.startswith("dry_friction explains part of the residual, or imitates something else")
    assert where.endswith("sign and filter: if they are right, dry_friction may be an imitation.")
    assert left.endswith("is 241 times the sensor's noise. Beyond that noise it is 81% of the power of wheel.")


def test_how_much_larger_forces_should_be_is_said_in_plain_numbers() -> None:
    said = [force_words(gain)[0].split(" would")[0] for gain in (-0.9, 3.2, 934.0)]
    assert said == ["Forces of the opposite sign", "Forces several times as large", "Forces about 900 times as large"]
    assert diagnosis_json(replace(FOUND, force_gain=-0.9))["force_gain"] == -0.9


def test_what_was_removed_comes_first_where_it_is_most_of_the_residual() -> None:
    def said(share: float) -> list[str]:
        return [one.split()[0] for one in diagnosis_summary(replace(NOTHING, removed=replace(
            AS_USUAL, distance_share=share, clock_ppm=80.0)))]

    assert said(0.6) == ["The", "Nothing", "NRMSE"] and said(0.01) == ["Nothing", "NRMSE", "The"]


@pytest.mark.parametrize(("clock_ppm", "lag_s", "words"), [
    (-80.0, 0.0, "runs 80 ppm slower than that"), (0.2, 0.00096, "is 0.96 ms behind that"),
    (4.0, -0.002, "runs 4 ppm faster than and is 2 ms ahead of that")])
def test_how_a_recorders_clock_is_off_is_said(clock_ppm: float, lag_s: float, words: str) -> None:
    said = " ".join(diagnosis_summary(replace(NOTHING, removed=replace(
        AS_USUAL, distance_share=0.6, clock_ppm=clock_ppm, lag_s=lag_s))))
    assert f"The recorder's clock {words} of the excitation." in said


def test_what_is_left_is_the_share_that_is_not_explained_on_stretches_that_no_fit_saw() -> None:
    """Two figures for one thing contradicted each other."""
    steps = (*FOUND.steps[:-1], ErrorStep("with dry_friction", 0.457))
    found = replace(FOUND, excess=3.0, final_error=0.145, steps=steps)
    said = " ".join(diagnosis_summary(found))
    assert f"it is {100 * (0.457**2 - found.noise_floor_error**2):.0f}% of the measured power" in said
    assert "79% finally" in said


def test_times_the_noise_are_times_the_noise_alone() -> None:
    """Also where the residual exceeds what calibrated sensors leave."""
    _, left, *_ = diagnosis_summary(replace(FOUND, excess=2.9, over_noise=37.0))
    assert "the residual is 38 times the sensor's noise" in left


def test_the_next_command_is_asked_as_this_one_was() -> None:
    asked = DiagnoseQuestion("rig.yaml", ["run"], tolerance="unknown", low_pass_hz=20.0, anyway=True)
    assert asked.command("learn {} --out law.py") == (
        "ridelog learn --vehicle rig.yaml --tolerance unknown --low-pass 20.0 --anyway --out law.py run")
    assert asked.command("identify {}", in_lab=False) == "ridelog identify --vehicle rig.yaml run"


def test_what_calibrated_sensors_may_leave_above_their_noise_is_said_too() -> None:
    missing, left, *_ = diagnosis_summary(replace(FOUND, over_noise=0.5))
    assert missing.startswith("dry_friction is missing")
    assert left == ("In the worst run the residual is 1.5 times the sensor's noise. Beyond that noise it is less than "
                    "0.1% of the measured power: calibration errors of the sensors may leave as much.")
    _, other, *_ = diagnosis_summary(replace(FOUND, over_noise=9.0, proportional=0.1))
    assert other.endswith("may leave as much. But those grow in proportion to the motion, and most of this residual "
                          "does not: something small may be missing.")
    nothing, as_much, *_ = diagnosis_summary(replace(NOTHING, over_noise=0.5))
    assert nothing.endswith("the residual is hardly more than calibration errors of the sensors.")
    assert as_much == left


def test_what_no_candidate_explains_is_said_and_so_are_imitations_that_are_not_named() -> None:
    found = replace(NOTHING, excess=2.0)
    left, _ = diagnosis_summary(found)
    assert left == ("Something is missing that no known effect explains: in the worst run the residual is 3 times the "
                    "sensor's noise. Beyond that noise it is less than 0.1% of the measured power.")
    imitating = replace(found, candidates=(candidate("tire_damping", 1e-5, 40.0), *OTHERS[1:]))
    _, imitation, _ = diagnosis_summary(imitating)
    assert imitation.startswith("ridelog does not name an effect that gains less than 10% of what a full ")
    lowering = replace(imitating, candidates=(replace(imitating.candidates[0], error=0.05), *OTHERS[1:]))
    _, refused, _ = diagnosis_summary(lowering)
    assert refused == ("ridelog does not name tire_damping, though it lowers the NRMSE: its parameters are beyond what "
                       "the runs show.")


def test_a_force_of_another_gain_may_be_in_the_place_of_a_mass() -> None:
    one = CandidateEffect(chosen(EFFECTS["force_gain"], {"gain": 1.25}), 0.153, 1e-12, 500.0)
    found = replace(NOTHING, beyond={"sprung_mass_kg": -0.2}, candidates=(one, *OTHERS))
    assert "forces that count 1.25 times what they say would explain as much" in " ".join(diagnosis_summary(found))
    for other in (replace(found, beyond={}), replace(found, candidates=(
            replace(found.candidates[0], error=0.2), *OTHERS))):
        assert "forces that count" not in " ".join(diagnosis_summary(other))


def test_numbers_outside_their_tolerance_are_named_with_how_far_they_are_off() -> None:
    found = replace(NOTHING, beyond={"front.suspension_stiffness_n_per_m": 0.242, "sprung_mass_kg": -0.13},
                    in_conflict=True)
    nothing, conflict, _ = diagnosis_summary(found)
    assert found.unexplained and not found.exceeds_noise
    assert nothing == ("No effect is needed: with the model's parameters refitted, the residual is hardly more than "
                       "the sensor's noise.")
    assert conflict.startswith("Parameters beyond their tolerance: "
                               "front.suspension_stiffness_n_per_m by +24% (1.24 times the file's), sprung_mass_kg by "
                               "-13% (0.87 times the file's). Measure them: either")
    missing, beyond, *_ = diagnosis_summary(replace(FOUND, beyond=found.beyond, in_conflict=True))
    assert missing.startswith("dry_friction is missing") and beyond.endswith("them: the vehicle's file is wrong there.")
    doubtful, _, beyond, *_ = diagnosis_summary(
        replace(FOUND, beyond=found.beyond, in_conflict=True, over_noise=3.3))
    assert doubtful.startswith("dry_friction explains part of the residual, or imitates something else")
    assert beyond.endswith("the vehicle's file is wrong there, or an unknown effect is missing.")


def test_numbers_off_by_less_than_a_conflict_are_named_too() -> None:
    found = replace(NOTHING, beyond={"front.cg_distance_m": 0.054, "rear.cg_distance_m": 0.046})
    nothing, beyond, _ = diagnosis_summary(found)
    assert not found.unexplained
    assert nothing.startswith("No effect is missing") and "within their tolerance" not in nothing
    assert "front.cg_distance_m by +5% (1.05 times the file's), rear.cg_distance_m by +5% (" in beyond


def test_what_the_tolerance_absorbed_is_said_with_its_error_and_what_does_the_same() -> None:
    found = replace(NOTHING, moved={"sprung_mass_kg": (0.104, 0.014)}, as_moved=chosen(
        EFFECTS["payload"], {"mass_kg": 108.05}))
    _, moved, same, _ = diagnosis_summary(found)
    assert "sprung_mass_kg by +10.4% ± 1.4%" in moved and "Measure one of them" in moved
    assert same.startswith("payload (") and "mass_kg 108 kg) would bias all of them in this way" in same
    assert diagnosis_json(found)["parameter_shifts"] == {"sprung_mass_kg": {"share": 0.104, "standard_error": 0.014}}
    assert diagnosis_json(found)["shift_explained_by"] == {"effect": "payload", "parameters": {"mass_kg": 108.05}}


def test_parameters_that_the_file_leaves_open_are_said_as_they_were_fitted() -> None:
    found = replace(NOTHING, left_open={"stiffness_n_per_m": (2100.4, 1.4), "mass_kg": (2.45, 0.02)})
    fitted = diagnosis_summary(found)[1]
    assert fitted == ("Fitted parameters that the vehicle's file leaves open: stiffness_n_per_m 2100.4 ± 1.4 N/m "
                      "and mass_kg 2.45 ± 0.02 kg.")
    assert diagnosis_json(found)["fitted_parameters"]["mass_kg"] == {"value": 2.45, "standard_error": 0.02}


def test_distances_that_are_off_are_reported() -> None:
    off = replace(NOTHING, removed=replace(AS_USUAL, distance_error_m=0.34, distance_share=0.4))
    assert any("by up to 0.34 m, more than usual. This causes 40% of" in one for one in diagnosis_summary(off))


def test_what_explains_as_well_is_named_with_the_drives_that_would_separate_them() -> None:
    alike = replace(FRICTION, confused_with=("damper_blow_off", "sensor_gain"))
    found = replace(FOUND, candidates=(alike, *OTHERS))
    verdict, drives, *_ = diagnosis_summary(found)
    assert verdict.startswith("One of dry_friction, damper_blow_off and sensor_gain is missing; these runs cannot "
                              "distinguish them. If it is dry_friction (")
    two = replace(FOUND, candidates=(replace(FRICTION, confused_with=("sensor_gain",)), *OTHERS))
    assert diagnosis_summary(two)[0].startswith("Either dry_friction or sensor_gain is missing; these runs cannot ")
    assert drives.startswith("dry_friction, damper_blow_off and sensor_gain explain the residual about equally well. ")
    for name in ("dry_friction", "damper_blow_off", "sensor_gain"):
        assert f"{name}: {EFFECTS[name].shown_by}" in drives
    bench = replace(found, catalogue=dict.fromkeys(found.catalogue, found.catalogue["dry_friction"]))
    assert f"distinguish them: {EFFECTS['dry_friction'].shown_by}. " in diagnosis_summary(bench)[1]
    assert diagnosis_json(found)["groups"] == [["dry_friction", "damper_blow_off", "sensor_gain"]]
    assert diagnosis_json(FOUND)["groups"] == [["dry_friction"]] and diagnosis_json(NOTHING)["groups"] == []


def test_what_is_nearly_named_is_said_with_the_drive_that_would_show_it() -> None:
    near = candidate("sensor_gain", 0.008, 15.6)
    *_, said = diagnosis_summary(replace(NOTHING, candidates=(near, OTHERS[0])))
    assert said == ("sensor_gain just misses the threshold: in 0.8% of such searches noise alone looks like it; "
                    f"ridelog allows 0.1%. To find out: {EFFECTS['sensor_gain'].shown_by}.")
    assert not any("misses the threshold" in one for one in (*diagnosis_summary(NOTHING), *diagnosis_summary(FOUND)))


def test_what_was_added_and_dropped_again_is_named() -> None:
    steps = (*FOUND.steps[:2], ErrorStep("with tire_damping", 0.2), *FOUND.steps[2:],
             ErrorStep("with the final model", 0.1))
    assert diagnosis_summary(replace(FOUND, steps=steps))[-1] == (
        "Tried and dropped: tire_damping (the effects above explain the same, or it explains little of what is left).")
    assert not any("dropped" in one for one in diagnosis_summary(FOUND))


def test_what_the_runs_cannot_tell_of_comes_with_the_drive_that_would() -> None:
    hidden = tuple(Undetectable(EFFECTS[name], 0.5 * place) for place, name in enumerate(
        ["wheel_lift", "bump_stop", "payload", "occupant", "sensor_gain", "roll", "body_bending", "time_offset",
         "cg_shift", "tire_damping"]))
    found = replace(NOTHING, undetectable=hidden, obstacles={
        "roll": "one track is known", "dry_friction": ALREADY_PRESENT})
    obstacle, first, *more = untested(found)
    assert obstacle == "roll: not tried; one track is known."
    assert first == f"wheel_lift: detectability 0.0 (6 needed). To see it: {EFFECTS['wheel_lift'].shown_by}."
    assert len(more) == 9 and more[-2] == "Detectability too low as well: cg_shift, tire_damping."
    assert more[-1].startswith("Detectability: standard deviations by which")


def test_what_it_looks_like_is_said_where_something_is_left(shape: Shape) -> None:
    said = looks_like(replace(NOTHING, excess=0.5, shape=shape))
    assert any("A wheel of 0.31 m radius" in one for one in said)


def test_the_table_has_the_candidates_in_order_with_errors_where_they_are_known() -> None:
    rows = list(table(FOUND))
    assert [row[0] for row in rows] == ["dry_friction", "tire_damping", "sensor_gain"]
    assert rows[0][1:3] == ("0.200", "below 1e-9") and rows[0][3].startswith("friction_force_n 85 ± 4 N")
    assert rows[1][2] == "0.30" and "±" not in rows[1][3]
    printed = text(diagnosis_blocks(FOUND, 1))
    assert "dry_friction" in printed and "tire_damping" not in printed and "and 2 more (--json lists all)" in printed


# --- for a program ---


def test_the_object_has_what_the_contract_promises() -> None:
    reported = json.loads(json.dumps(diagnosis_json(FOUND), allow_nan=False))
    assert {"baseline_error", "noise_floor_error", "candidates", "verdict", "unexplained"} <= reported.keys()
    assert (reported["baseline_error"], reported["noise_floor_error"]) == (0.31, 0.15)
    assert reported["verdict"] == ["dry_friction"] and reported["unexplained"] is False
    best, *others = reported["candidates"]
    assert {"effect", "parameters", "error", "p_value", "confused_with"} <= best.keys() == others[0].keys()
    assert best["effect"] == "dry_friction" and best["parameters"] == dict(FRICTION.one.values)
    assert (best["error"], best["p_value"], best["confused_with"]) == (0.2, 1e-12, [])
    assert best["standard_errors"] == {"friction_force_n": 3.9}  # none that is not known
    assert others[0]["standard_errors"] == {}
    assert (best["log_likelihood_gain"], best["held_out_log_likelihood_gain"]) == (250.0, 248.0)


def test_the_object_says_what_is_left_and_what_was_not_seen(shape: Shape) -> None:
    found = replace(FOUND, excess=0.5, shape=shape, beyond={"sprung_mass_kg": -0.13}, obstacles={
        "roll": "one track is known", "sensor_offset": ALREADY_PRESENT}, undetectable=(
            Undetectable(EFFECTS["wheel_lift"], 0.1),))
    reported = json.loads(json.dumps(diagnosis_json(found), allow_nan=False))
    assert reported["unexplained"] is True and reported["residual_over_noise"] == 1.5
    assert reported["beyond_tolerance"] == {"sprung_mass_kg": -0.13}
    assert reported["not_tried"] == {"roll": "one track is known"} and reported["undetectable"] == {"wheel_lift": 0.1}
    assert reported["judged_on"] == JUDGED_ON
    assert (reported["errors"][-2]["model"], reported["errors"][-2]["error"]) == ("with dry_friction", 0.153)
    assert reported["sentences"] == [*diagnosis_summary(found), *looks_like(found)]
    seen = reported["unexplained_shape"]
    assert seen["repeats_every_m"] == pytest.approx(2 * np.pi * 0.31, rel=0.02)
    assert sum(part["error_power_share"] for part in seen["frequency"]) == pytest.approx(1.0, abs=0.05)
    for force, at in (("force_by_rate", "rate_mps"), ("force_by_travel", "travel_m")):
        assert len(seen[force][at]) == len(seen[force]["force_n"]) == len(seen[force]["standard_error_n"]) > 2


def test_a_diagnosis_that_lacks_nothing_has_an_empty_verdict() -> None:
    reported = diagnosis_json(NOTHING)
    assert reported["verdict"] == [] and reported["unexplained"] is False and reported["unexplained_shape"] is None


def test_what_a_search_did_not_try_is_said() -> None:
    cut = replace(FOUND, not_searched=("one more effect", "hysteresis"))
    assert "It did not try one more effect or hysteresis." in " ".join(diagnosis_summary(cut))
    assert "cut short" not in " ".join(diagnosis_summary(FOUND))
    assert diagnosis_json(cut)["not_searched"] == ["one more effect", "hysteresis"]
