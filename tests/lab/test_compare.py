"""The comparison as a whole: the error by hand, small mistakes taken by the refit, missing physics not."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from logger.api.lab.compare import comparison_json, conclusion, evidence, headline, next_step
from logger.lab.compare import LabComparison, compare
from logger.simulation.virtual_drive import SimulatedRuns
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.effect import chosen
from logger.vehicle.vehicle import Vehicle

from ..support.lab.runs_with_residual import CAR, beside_with, recorded_by, runs_of

NOISE_MPS2 = 0.015
FRICTION = ("dry_friction", {"friction_force_n": 80.0})


def compared(nominal: Vehicle, effects: list[tuple[str, dict[str, float]]], seed: int = 5) -> LabComparison:
    return compare(runs_of(beside_with(recorded_by(effects, NOISE_MPS2), seed, lasts_s=24.0)), nominal)


def off_by(share: float) -> Vehicle:
    """The car with its mass and springs a little off."""
    softer = replace(CAR.front, suspension_stiffness_n_per_m=CAR.front.suspension_stiffness_n_per_m * (1 - share))
    return replace(CAR, sprung_mass_kg=CAR.sprung_mass_kg * (1 + share), front=softer)


@pytest.fixture(scope="module")
def mistaken() -> LabComparison:
    return compared(off_by(0.04), [])


@pytest.fixture(scope="module")
def lacking() -> LabComparison:
    return compared(CAR, [FRICTION])


@pytest.mark.slow
def test_small_mistakes_are_not_physics(mistaken: LabComparison) -> None:
    """Everything that is left after the refit is the noise, and nothing is said to be missing."""
    measured = np.concatenate(mistaken.plain.residuals.measured)
    floor = NOISE_MPS2 / float(np.sqrt(np.mean(measured**2)))
    assert mistaken.plain.error > 1.2 * floor
    assert mistaken.refitted.error == pytest.approx(floor, rel=0.03)
    assert not mistaken.missing
    assert not mistaken.far
    assert mistaken.moves["sprung_mass_kg"] == pytest.approx(1 / 1.04 - 1, abs=0.03)
    assert evidence(mistaken) == ["No test finds more than noise in the residual."]
    assert "The model lacks nothing" in conclusion(mistaken) and next_step(mistaken).startswith("Next: nothing.")


def test_missing_friction_is_physics(lacking: LabComparison) -> None:
    assert lacking.missing
    names = [test.name for test in lacking.tests.found]
    assert "force by rate" in names and "direction" not in names
    assert "ridelog diagnose" in next_step(lacking)
    assert headline(lacking)[0].startswith(f"NRMSE {lacking.plain.error:.3f} (residual ")


@pytest.mark.slow
def test_the_effect_in_the_model_leaves_noise() -> None:
    residuals = beside_with(recorded_by([FRICTION], NOISE_MPS2), 5, lasts_s=12.0)
    name, values = FRICTION
    found = compare(runs_of(residuals), CAR, [chosen(shipped_effects()[name], values)])
    assert not found.missing
    assert found.moves["dry_friction.friction_force_n"] == pytest.approx(0.0, abs=0.1)


def test_error_is_the_ratio_of_rms_without_the_first_two_seconds(lacking: LabComparison) -> None:
    residuals = lacking.plain.residuals
    residual = np.concatenate([(run.measured_mps2 - one)[200:] for run, one in
                           zip(residuals.runs, residuals.predictions, strict=True)])
    measured = np.concatenate([run.measured_mps2[200:] for run in residuals.runs])
    reported = comparison_json(lacking)
    assert reported["error"] == pytest.approx(np.sqrt(np.mean(residual**2) / np.mean(measured**2)))
    assert sum(run["samples"] for run in reported["runs"]) == len(residual)


def test_json_has_what_the_format_names(lacking: LabComparison) -> None:
    reported = json.loads(json.dumps(comparison_json(lacking), allow_nan=False))
    assert {"error", "runs", "where", "evidence", "refitted", "residual_tests"} <= reported.keys()
    assert {"run", "error", "samples"} <= reported["runs"][0].keys()
    where = reported["where"]
    assert {"from_hz", "to_hz", "error_power_share"} <= where["frequency"][0].keys()
    assert {"from_m", "to_m", "error", "run"} <= where["place"][0].keys()
    for parts in where.values():
        assert sum(part["error_power_share"] for part in parts) == pytest.approx(1.0)
    shares = [part["error_power_share"] for part in where["place"]]
    assert shares == sorted(shares, reverse=True)
    assert all(isinstance(sentence, str) and sentence.endswith(".") for sentence in reported["evidence"])
    assert reported["refitted"]["error"] == lacking.steps[-1].error == reported["errors"][1]["error"]
    assert reported["refitted"]["shifts"].keys() >= {"sprung_mass_kg"}


def test_one_short_run() -> None:
    run = beside_with(recorded_by([], NOISE_MPS2), lasts_s=14.0).runs[0]
    short = replace(run, measured_mps2=run.measured_mps2[:500], distance_m=run.distance_m[:500],
                    speed_mps=run.speed_mps[:500])
    found = compare(SimulatedRuns([short]), CAR)
    assert np.isfinite(found.refitted.error)
    json.dumps(comparison_json(found), allow_nan=False)

