"""What is removed from an error, against what was put in: by hand, on records of the very car that is compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from logger.api.lab.compare import comparison_json, conclusion, evidence, headline
from logger.lab.compare import LabComparison, compare
from logger.lab.likelihood.record_band import with_pass_bands
from logger.runs import Run
from logger.simulation.virtual_drive import SimulatedRuns

from ...support.lab.runs_with_residual import CAR, beside_with, measuring

NOISE_MPS2 = 0.03


def compared(change: Callable[[Run], Run]) -> LabComparison:
    made = beside_with(lambda run, _, rng: rng.normal(0, NOISE_MPS2, run.count), 2002, 30.0)
    return compare(SimulatedRuns([change(run) for run in made.runs]), CAR)


def drifting_sensors(run: Run) -> Run:
    return measuring(run, run.measured_mps2 + 0.28 * np.exp(-run.time_s / 9))


@pytest.mark.slow
def test_a_drift_is_named_with_its_share_and_nothing_else_is_missing() -> None:
    found, clean = compared(drifting_sensors), compared(lambda run: run)
    removed = found.removed
    assert [one.form for one in removed.drifts] == ["exponential"] * 3
    # By hand: the powers of the drift and of the noise over the samples that count.
    time_s = np.arange(200, 3000) / 100
    drift = float(np.mean((0.28 * np.exp(-time_s / 9)) ** 2))
    assert removed.drift_share == pytest.approx(drift / (drift + NOISE_MPS2**2), rel=0.03)
    assert removed.error == pytest.approx(clean.plain.error * clean_size(clean, found), rel=0.03)
    said = " ".join(headline(found))
    assert "The sensor drifts (an exponential of " in said and "The motion does not cause the drift" in said
    assert evidence(found) == ["No test finds more than noise in the residual."] and not found.missing
    assert conclusion(found).startswith("The model lacks nothing apart from")
    shown = comparison_json(found)
    assert shown["error"] == found.plain.error and shown["error_without_drift"] == removed.error
    assert shown["removed"]["drift"]["runs"][0]["time_s"] == pytest.approx(9.0, rel=0.1)


def clean_size(clean: LabComparison, found: LabComparison) -> float:
    """Errors are divided by what was measured, the drift in it."""
    sizes = [float(np.concatenate(one.plain.residuals.measured).std()) for one in (clean, found)]
    whole = float(np.sqrt(np.mean(np.concatenate(found.plain.residuals.measured) ** 2)))
    return sizes[0] / whole


@pytest.mark.slow
def test_nothing_is_named_where_nothing_is_removed() -> None:
    removed = compared(lambda run: run).removed
    assert not removed.drifting_sensors and removed.drift_share == 0 == removed.filter_share
    assert removed.distance_error_m == 0
    assert removed.distance_share < 0.02


@pytest.mark.slow
def test_a_wrong_place_is_named_with_its_share() -> None:
    found = compared(lambda run: replace(run, distance_m=run.distance_m + 1.0))
    assert found.removed.distance_error_m == pytest.approx(1.0, abs=0.05) and found.removed.distance_share > 0.95
    assert not found.missing and conclusion(found).startswith("The model lacks nothing apart from")


@pytest.mark.slow
def test_what_lies_outside_of_the_pass_band_has_its_share() -> None:
    made = beside_with(lambda run, _, rng: rng.normal(0, NOISE_MPS2, run.count), 2003, 30.0)
    runs = with_pass_bands(made.runs, made.predictions, low_pass_hz=25.0)
    found = compare(SimulatedRuns(runs), CAR)
    # The model is right: noise alone differs, white up to half the sample rate, half of it above 25 Hz.
    assert found.removed.filter_share == pytest.approx(0.5, abs=0.03)
    assert "power lies outside that band" in " ".join(headline(found))
