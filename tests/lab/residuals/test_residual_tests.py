"""Tests of residuals that are made to bear them: each with a number that is known beforehand, none on noise."""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from logger.lab.likelihood.lag import lag_drift, lags
from logger.lab.residual_tests import residual_tests, run_residual_tests
from logger.lab.residual_tests.tests import ResidualEvidence, ResidualTestResult, ResidualTestResults
from logger.lab.residuals.breakdown import ModelResiduals, breakdown
from logger.lab.residuals.force_state_map import Curve, force_map
from logger.lab.residuals.road_coherence import coherence_with_road, share_proportional
from logger.runs import Run
from logger.simulation.virtual_drive import SimulatedRuns

from ...support.lab.runs_with_residual import CAR, RATE_HZ, Residual, a_run, beside_with, measuring, recorded_by
from ...support.slow import slow

Array = npt.NDArray[np.float64]
NOISE_MPS2 = 0.05


def white(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
    return rng.normal(0, NOISE_MPS2, len(prediction))


def marks(residuals: ModelResiduals) -> ResidualTestResults:
    return run_residual_tests(ResidualEvidence(residuals, breakdown(residuals), residuals))


def mark(found: ResidualTestResults, name: str) -> ResidualTestResult:
    return next(one for one in found.tests if one.name == name)


def plus_noise(residual: Residual) -> Residual:
    return lambda run, prediction, rng: residual(run, prediction, rng) + white(run, prediction, rng)


@pytest.mark.slow
def test_noise_bears_no_marks() -> None:
    """2 % of false alarms for each mark at most: of 25 residuals none is wrong more than 3 times (p < 0.002 at 2 %)."""
    count: Counter[str] = Counter()
    for seed in range(25):
        count.update(one.name for one in marks(beside_with(white, seed, lasts_s=12.0)).found)
    assert all(times <= 3 for times in count.values()), count
    assert count.total() <= 5


def test_noise_of_another_colour_is_not_tied_to_the_road() -> None:
    def reddish(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
        noise = rng.normal(0, NOISE_MPS2, len(prediction) + 30)
        return np.convolve(noise, 0.85 ** np.arange(30), mode="valid")[: len(prediction)]

    found = marks(beside_with(reddish))
    assert mark(found, "whiteness").found
    assert mark(found, "whiteness").value == pytest.approx(0.85, abs=0.03)
    assert not [one.name for one in found.found if one.road]


def test_a_gain_is_reported() -> None:
    found = mark(marks(beside_with(plus_noise(lambda run, prediction, rng: 0.1 * prediction))), "gain")
    assert found.found
    assert found.value == pytest.approx(1.1, abs=4 * (found.standard_error or 0.0) + 1e-6)
    assert found.standard_error is not None and found.standard_error < 0.01


def test_what_follows_the_road_is_distinguished_from_noise() -> None:
    """Half of the power is the road's slope under the front wheel, filtered: the coherence says half."""
    def half(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
        slope = np.gradient(run.track.averaged(run.distance_m, CAR.contact_patch_m)) * RATE_HZ
        filtered = np.convolve(slope, [0.5, 1.0, 0.2], mode="same")
        # As strong as the noise, at every frequency that there is noise at up to 38 Hz.
        return filtered / filtered.std() * NOISE_MPS2 + white(run, prediction, rng)

    residuals = beside_with(half)
    share, p_value = coherence_with_road(residuals).explained(0.0, 50.0)
    assert share == pytest.approx(0.5, abs=0.05)
    assert p_value < 1e-12


def test_what_a_gain_leaves_is_proportional_and_what_a_law_leaves_is_not() -> None:
    late = beside_with(lambda run, prediction, rng: 0.03 * np.roll(prediction, 1))
    bent = beside_with(lambda run, prediction, rng: 0.03 * prediction * np.abs(np.roll(prediction, 3)))
    assert share_proportional(late) > 0.95
    assert share_proportional(bent) < 0.8
    assert share_proportional(beside_with(white)) < 0.05


def test_a_late_clock_is_distinguished_from_a_wrong_place() -> None:
    def shifted(seconds: float, metres: float) -> Residual:
        def residual(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
            time_s = np.arange(len(prediction)) / RATE_HZ
            late = np.interp(time_s - seconds - metres / run.speed_mps, time_s, prediction)
            return late - prediction

        return plus_noise(residual)

    for seconds, metres, unit, value in ((0.03, 0.0, "s", 0.03), (0.0, 0.25, "m", 0.25)):
        found = mark(marks(beside_with(shifted(seconds, metres))), "shift")
        assert found.found
        assert found.unit == unit
        assert found.value == pytest.approx(value, rel=0.05)
        assert "lags the model" in found.sentence


def test_a_speed_that_is_off_lets_the_model_run_ahead() -> None:
    """The model is driven over 1 % more road than the car was."""
    residuals = beside_with(white)
    truth = [Run(run.name, run.rate_hz, run.measured_mps2, 0.99 * run.distance_m, run.speed_mps, run.track)
             for run in residuals.runs]
    driven = SimulatedRuns(truth).predict(residuals.car)
    measured = [measuring(run, one) for run, one in zip(residuals.runs, driven, strict=True)]
    wrong = ModelResiduals(measured, residuals.car, residuals.predictions, residuals.responses)
    assert lag_drift(lags(measured, residuals.predictions)).value == pytest.approx(0.01, rel=0.03)
    found = marks(wrong)
    assert "runs ahead by 1 m in each 100 m" in mark(found, "drift").sentence
    assert found.found[0].name == "drift"
    assert not mark(found, "shift").found


@pytest.mark.parametrize(("ratio", "words"), [(1.5, "rebound more than bump"),
                                              *slow((0.7, "bump more than rebound"))])
def test_the_direction_of_asymmetric_dampers(ratio: float, words: str) -> None:
    """Rebound 2 r c / (1 + r), bump 2 c / (1 + r): their half difference is c (r - 1) / (r + 1)."""
    residuals = beside_with(recorded_by([("damper_asymmetry", {"rebound_to_bump_ratio": ratio})], NOISE_MPS2))
    forces = force_map(residuals)
    truth = CAR.front.suspension_damping_n_s_per_m * (ratio - 1) / (ratio + 1)
    assert forces.asymmetry.value == pytest.approx(truth, rel=0.1)
    found = mark(marks(residuals), "direction")
    assert found.found
    assert words in found.sentence


def test_the_curve_of_a_cubic_spring() -> None:
    k3 = 3.0e7
    found = force_map(beside_with(recorded_by([("progressive_spring", {"cubic_stiffness_n_per_m3": k3})], NOISE_MPS2)))
    at, force, error = found.by_travel.at, found.by_travel.force_n, found.by_travel.error_n
    # A straight spring takes a part of it: what bends is reported.
    cubic = np.linalg.lstsq(np.stack([at, at**3], axis=1), force, rcond=None)[0][1]
    assert cubic == pytest.approx(k3, rel=0.3)
    assert found.hardening.value == pytest.approx(k3, rel=0.25)
    assert force[-1] > 5 * error[-1] and force[0] < -5 * error[0]


def test_dampers_that_yield_and_friction_bend_the_curve_by_rate() -> None:
    residuals = beside_with(recorded_by([("dry_friction", {"friction_force_n": 60.0})], NOISE_MPS2))
    found = mark(marks(residuals), "force by rate")
    assert found.found
    assert "digressive" in found.sentence


def test_an_answer_out_of_proportion() -> None:
    """Stretches of 10 s take turns: 1.2 of the model where it is strong, 0.9 where it is weak."""
    plain = beside_with(white)
    strong = [np.mod(np.arange(run.count) / RATE_HZ, 20.0) < 10.0 for run in plain.runs]
    model = [one * np.where(of, 2.0, 0.5) for one, of in zip(plain.predictions, strong, strict=True)]
    measured = [measuring(run, one * np.where(of, 1.2, 0.9) + run.measured_mps2 - before)
                for run, one, of, before in zip(plain.runs, model, strong, plain.predictions, strict=True)]
    found = mark(marks(ModelResiduals(measured, plain.car, model, plain.responses)), "proportion")
    assert found.found
    assert found.value == pytest.approx(0.3, abs=0.08)


def test_excitation_and_speed_are_distinguished() -> None:
    def by_level(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
        level = np.sqrt(np.convolve(prediction**2, np.full(100, 1 / 100), mode="same"))
        return rng.normal(0, 0.2, len(prediction)) * level

    def by_speed(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
        return rng.normal(0, 0.01, len(prediction)) * run.speed_mps

    found = marks(beside_with(by_level))
    assert mark(found, "excitation").found and not mark(found, "speed").found
    found = marks(beside_with(by_speed))
    assert mark(found, "speed").found
    assert "times as large at 22 m/s as at 7 m/s" in mark(found, "speed").sentence
    assert mark(found, "speed").value == pytest.approx(22 / 7.3, rel=0.25)


def test_the_worst_place_is_named() -> None:
    def pothole(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
        hit = (run.distance_m >= 200.0) & (run.distance_m < 205.0) & run.name.endswith("run2")
        return np.where(hit, 0.8, 0.0)

    residuals = beside_with(plus_noise(pothole))
    worst = breakdown(residuals).worst_places(1)[0]
    assert (worst.name, worst.low) == ("runs/run2", 200.0)
    found = mark(marks(residuals), "place")
    assert found.found
    said = found.sentence
    assert "run2, 200 to " in said and "runs/run2" not in said


def test_a_tone_is_heard() -> None:
    def hum(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
        return 0.03 * np.sin(2 * np.pi * 27.3 * np.arange(len(prediction)) / RATE_HZ)

    found = mark(marks(beside_with(plus_noise(hum))), "tone")
    assert found.found
    assert found.value == pytest.approx(27.3, abs=0.05)


def test_blows_lean_to_one_side() -> None:
    def blows(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
        return np.where(prediction > 2.2 * prediction.std(), 0.4, 0.0)

    found = mark(marks(beside_with(plus_noise(blows))), "skewness")
    assert found.found
    assert "peaks point up (" in found.sentence


def test_a_run_of_five_seconds_can_be_read() -> None:
    run = a_run("short", 10.0, 5.0, 3)
    runs = SimulatedRuns([run])
    nothing = beside_with(white)
    prediction = runs.predict(nothing.car)
    rng = np.random.default_rng(1)
    short = ModelResiduals([measuring(run, prediction[0] + white(run, prediction[0], rng))], nothing.car, prediction,
                   runs.respond(nothing.car))
    found = marks(short)
    assert not found.found
    assert all(np.isnan(mark(found, name).value) for name in ("drift", "shift"))  # too few windows to tell



def test_a_model_that_leaves_nothing() -> None:
    """No division by nothing where measurements are the model's to the last bit."""
    residuals = beside_with(lambda run, prediction, rng: np.zeros(len(prediction)), lasts_s=14.0)
    assert not marks(residuals).found


@pytest.mark.slow
def test_a_tone_that_is_none_has_a_frequency_and_no_chance() -> None:
    for seed in range(6):
        residuals = beside_with(lambda run, _, rng: rng.normal(0, 0.03, run.count), seed)
        tone = mark(marks(residuals), "tone")
        assert tone.value > 0 and tone.p_value <= 1


def test_every_test_has_a_sentence_with_all_of_its_figures() -> None:
    for one in marks(beside_with(white)).tests:
        assert one.sentence.endswith("."), one.name


def test_a_force_that_is_not_known_at_its_ends_is_said_where_it_is() -> None:
    at_m, force_n = np.array([-0.04, -0.02, 0.0, 0.02, 0.04]), np.array([4.0, 4.0, 0.0, -20.0, 4.0])
    curve = Curve(at_m, force_n, np.array([5.0, 5.0, 0.0, 5.0, 5.0]), 1e-9, 0.2)
    test = next(one for one in residual_tests() if one.name == "force by travel")
    said = test.sentence(test.result(curve=curve, bend=1.0, acts="in the suspensions"))
    assert "travel, mostly between its ends, would explain 20% of" in said
    assert said.endswith("linear spring: -20 ± 5 N at 20 mm of extension (positive pulls both ends together).")


@pytest.mark.slow
def test_a_package_adds_a_test_with_one_file(tmp_path: Path) -> None:
    """Named in the comparison's JSON, and with its sentence in the evidence."""
    (tmp_path / "their_tests.py").write_text("""
from logger.lab.residual_tests.tests import ResidualTest, ResidualTests

class Peak(ResidualTest):
    name, unit = "peak", "m/s2"

    def run(self, tested):
        return self.result(max(abs(one).max() for one in tested.residuals.residual), None, 1e-9, True)

    def sentence(self, found):
        return f"The largest residual is {found.value:.3g} m/s2."

TESTS = ResidualTests("theirs", (Peak(),))
""")
    about = tmp_path / "theirs-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[ridelog.residual_tests]\ntheirs = their_tests:TESTS\n")
    code = ("import ridelog; road = ridelog.random_road(iso_class='C', length_m=200.0, seed=1)\n"
            "car = ridelog.read_vehicle('rav4-2009')\n"
            "run = ridelog.simulate(car.with_effect('sensor_gain', gain=1.2), road, 12.0, noise_mps2=0.03)\n"
            "print('The largest residual is' in str(ridelog.compare(car, [run])))")
    done = subprocess.run([sys.executable, "-c", code], text=True, capture_output=True,
                          env=os.environ | {"PYTHONPATH": str(tmp_path)})
    assert (done.stdout, done.stderr) == ("True\n", "")
