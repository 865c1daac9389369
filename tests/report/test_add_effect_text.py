"""What is said of an effect that was added: its numbers, whether it is to be kept, and what it had biased."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

from logger.api.lab.compare import addition_json, bias, errors, judgement, moved_blocks
from logger.lab.residuals.unexplained import OFFSET, Drift, Removed
from logger.lab.selection.add_effect import AddedEffects, ShiftedNumber
from logger.report.blocks import Hint, Table
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.effect import chosen
from logger.vehicle.uncertain import NumberErrors

from ..support.lab.runs_with_residual import CAR

EFFECTS = shipped_effects()
AS_USUAL = Removed((), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.153)
MASS = ShiftedNumber("sprung_mass_kg", nominal=875.0, without=846.0, without_standard_error=9.8, found=876.0,
                     standard_error=7.5)
TIRE = ShiftedNumber("rear.tire_stiffness_n_per_m", nominal=238180.0, without=300000.0, without_standard_error=3000.0,
                     found=240000.0, standard_error=3000.0)
STILL = ShiftedNumber("contact_patch_m", nominal=0.25, without=0.2501, without_standard_error=0.003, found=0.25,
                      standard_error=0.003)
FOUND = AddedEffects(
    CAR, (chosen(EFFECTS["sensor_gain"], {"gain": 1.02}, standard_errors={"gain": 0.01}),
          chosen(EFFECTS["dry_friction"], EFFECTS["dry_friction"].usual | {"friction_force_n": 84.7}, standard_errors={
              "friction_force_n": 3.9, "transition_velocity_m_per_s": float("inf")})),
    ("dry_friction",), (STILL, MASS, TIRE), error_before=0.47, error_refitted=0.43, error_after=0.153,
    error_as_written=0.154, noise_floor_error=0.15, p_value=1e-12, removed=AS_USUAL,
    errors=NumberErrors({"sprung_mass_kg": 7.5}), excess=0.0)


def test_the_errors_are_distinguished_from_the_file_as_it_was_to_the_noise() -> None:
    reported = errors(FOUND).rows
    assert [error for _, error, _, _ in reported] == ["0.4700", "0.4300", "0.1530", "0.1540", "0.1500"]
    assert [fit for _, _, fit, _ in reported] == ["53.0 %", "57.0 %", "84.7 %", "84.6 %", "85.0 %"]
    assert [which for which, *_ in reported] == ["Before", "", "After", "", "Noise floor"]
    assert "refitted with dry_friction, on held-out stretches" in reported[2][3]
    both = errors(replace(FOUND, names=("dry_friction", "sensor_gain")))
    assert "with dry_friction and sensor_gain" in both.rows[2][3]


def test_an_effect_that_helps_is_said_to_with_its_numbers() -> None:
    assert judgement(FOUND) == [
        "dry_friction: friction_force_n 85 ± 4 N, transition_velocity_m_per_s 0 m/s.",
        "It helps: the probability that noise alone improves the fit as much is below 1e-9."]


def test_what_is_removed_is_said_before_the_effect() -> None:
    drift = Drift("drive", OFFSET, 0.3, None, np.zeros(100), 100.0)
    found = replace(FOUND, removed=replace(AS_USUAL, drifts=(drift,), drift_share=0.4))
    assert judgement(found)[0].startswith("The sensor drifts (a constant offset of 0.3 m/s2). The motion does ")
    assert addition_json(found)["removed"]["drift"]["error_power_share"] == 0.4


def test_an_effect_that_does_not_help_is_warned_of() -> None:
    assert judgement(replace(FOUND, p_value=0.02))[-1] == (
        "WARNING: it does not help. The probability that noise alone improves the fit as much is 0.02; these runs are "
        "no reason to keep it.")


def test_an_effect_without_numbers_is_reported_in_words() -> None:
    lift = replace(FOUND, effects=(chosen(EFFECTS["wheel_lift"], {}),), names=("wheel_lift",))
    assert judgement(lift)[0] == f"wheel_lift: {EFFECTS['wheel_lift'].title}."


def test_a_number_at_its_bound_was_not_measured() -> None:
    asymmetry = EFFECTS["damper_asymmetry"]
    ratio = asymmetry.parameters[0]
    bound = replace(FOUND, effects=(chosen(asymmetry, {ratio.name: ratio.high}),), names=("damper_asymmetry",))
    assert judgement(bound)[1] == (f"At its bound: {ratio.name}. The bound stopped the fit there; it is not a "
                                   "measured value.")
    assert not any("bound" in one for one in judgement(FOUND))


def test_distances_that_are_off_are_reported() -> None:
    assert any("up to 0.34 m" in one for one in judgement(
        replace(FOUND, removed=replace(AS_USUAL, distance_error_m=0.34))))


def test_the_number_that_was_biased_most_is_reported_with_how_wrong_it_was() -> None:
    said = bias(FOUND.names, FOUND.moved)
    assert said == ("Without dry_friction the refit biased rear.tire_stiffness_n_per_m and sprung_mass_kg. "
                    "rear.tire_stiffness_n_per_m came out 25.0% too high, 20.0 standard errors from its value with it.")
    low = bias(("dry_friction", "sensor_gain"), [MASS])
    assert "Without dry_friction and sensor_gain" in low and "3.4% too low" in low and low.endswith("with them.")
    none = replace(MASS, name="stiffness_n_per_m", without=1086.0, found=6.7, standard_error=0.6)
    assert "stiffness_n_per_m came out 1079 N/m too high" in bias(FOUND.names, [none])
    many = [replace(MASS, name=f"number{i}") for i in range(6)]
    assert "number0, number1, number2, number3 and 2 more." in bias(FOUND.names, many)


def test_where_nothing_was_biased_that_is_said() -> None:
    assert bias(FOUND.names, [STILL]) == (
        "dry_friction moved no parameter of the model by more than 2 standard errors.")


def test_the_rows_fit_their_heads_and_mark_what_was_biased() -> None:
    table, _ = moved_blocks(FOUND.moved)
    assert isinstance(table, Table)
    rows = table.rows
    assert all(len(row) == len(table.heads) for row in rows)
    assert rows[1] == ("sprung_mass_kg", "876", "-3.3%", "+0.1% ± 0.9%", "+4.0", "was biased")
    assert rows[2][-1] == ""


def test_of_a_rig_no_distances_are_spoken_of_and_no_change_is_relative_to_a_guess() -> None:
    table, hint = moved_blocks([replace(MASS, left_open=True)])
    assert isinstance(table, Table) and isinstance(hint, Hint)
    assert table.rows == [("sprung_mass_kg", "876", "-3.4%", "± 0.9%", "+4.0", "was biased")]
    assert "or to Now where that is a guess" in str(hint)
    words = [row[-1] for row in errors(replace(FOUND, on_rig=True)).rows]
    assert words[0] == "vehicle's file as it is" and not any("distances" in one for one in words)


def test_the_object_has_what_the_contract_promises_and_is_of_the_effect_that_was_added() -> None:
    reported = json.loads(json.dumps(addition_json(FOUND), allow_nan=False))
    assert {"effect", "parameters", "standard_errors", "error_before", "error_after"} <= reported.keys()
    assert reported["added"] == ["dry_friction"]
    assert reported["effect"] == "dry_friction" and reported["parameters"]["friction_force_n"] == 84.7
    assert reported["standard_errors"] == {"friction_force_n": 3.9}  # none that is not known
    assert (reported["error_before"], reported["error_after"]) == (0.47, 0.153)
    errors = [reported[key] for key in ("error_refitted", "error_as_written", "noise_floor_error")]
    assert errors == [0.43, 0.154, 0.15]
    assert reported["helps"] is True and reported["p_value"] == 1e-12
    assert reported["biased"] == ["rear.tire_stiffness_n_per_m", "sprung_mass_kg"]
    assert reported["vehicle_parameters"][1] == {
        "name": "sprung_mass_kg", "nominal": 875.0, "without": 846.0, "without_standard_error": 9.8, "with": 876.0,
        "with_standard_error": 7.5, "shift_standard_errors": 4.0}


def test_several_effects_are_each_in_the_object_with_their_own_numbers() -> None:
    reported = json.loads(json.dumps(addition_json(replace(FOUND, names=("dry_friction", "sensor_gain"))),
                                     allow_nan=False))
    assert reported["effect"] == "sensor_gain+dry_friction"
    assert reported["parameters"]["sensor_gain.gain"] == 1.02
    assert reported["parameters"]["dry_friction.friction_force_n"] == 84.7
    assert reported["standard_errors"] == {"sensor_gain.gain": 0.01, "dry_friction.friction_force_n": 3.9}
    gain, friction = reported["added"]
    assert gain == {"name": "sensor_gain", "parameters": {"gain": 1.02}, "standard_errors": {"gain": 0.01}}
    assert friction["name"] == "dry_friction" and friction["parameters"]["friction_force_n"] == 84.7
    assert friction["standard_errors"] == {"friction_force_n": 3.9}
