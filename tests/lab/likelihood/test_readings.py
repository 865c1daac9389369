"""Readings that were rounded, clipped or are missing: rounded ones hold as much as Fisher's information says, clipped
ones are bounds, and what was not read is nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from logger.comfort.uncertain_ride import BLURRED_FROM_STEPS
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.noise_floor import sensor_noise_of, sensor_noise_with_rounding
from logger.lab.likelihood.signals import Readings
from logger.lab.likelihood.whittle import Bands
from logger.runs import CLIPPED, NO_READING, READING, RecordFacts, Run

from ...support.lab.noisy_runs import noisy_runs, posterior_of
from ...support.lab.runs_with_residual import a_run, measuring

Array = npt.NDArray[np.float64]
STEP = 0.6
OFFSET = 0.17


def motion(size: float = 1.0, samples: int = 20_000) -> Array:
    """Gaussian, so large against the step that it stands anywhere within it."""
    return np.random.default_rng(3).normal(0, size, samples)


def rounded(prediction: Array, noise: float, step: float = STEP, seed: int = 4) -> Run:
    """A run of it with noise and an offset, rounded."""
    rng = np.random.default_rng(seed)
    noisy = prediction + OFFSET + rng.normal(0, noise, len(prediction))
    run = measuring(a_run("run", 12.0, len(prediction) / 100.0, 3), step * np.round(noisy / step))
    return replace(run, facts=RecordFacts(step_mps2=step))


def information(noise: float, step: float = STEP) -> float:
    """Fisher's, of one reading on the acceleration, averaged over its places within a step [(m/s2)^-2]."""
    def at(place: float) -> float:
        bounds = (np.arange(-15, 16) + 0.5) * step
        inside = np.diff(norm.cdf((bounds - place) / noise))
        slopes = np.diff(norm.pdf((bounds - place) / noise)) / noise
        return float(np.sum(slopes[inside > 1e-14] ** 2 / inside[inside > 1e-14]))

    return quad(at, 0, step, limit=200)[0] / step


# --- rounding ---


@pytest.mark.parametrize("noise", [0.03, 0.1, 0.2])
def test_what_bounds_leave_is_as_certain_as_their_information(noise: float) -> None:
    prediction = motion()
    run = rounded(prediction, noise)
    read = Readings.of(run).given(prediction)
    left = read.residual(prediction)[run.first:]
    assert left.mean() == pytest.approx(0.0, abs=4 * left.std() / np.sqrt(len(left)))  # the offset is gone
    assert left.std() == pytest.approx(information(noise) ** -0.5, rel=0.03)
    assert read.share == pytest.approx(noise**2 * information(noise), rel=0.05)
    assert left.std() * np.sqrt(read.share) == pytest.approx(noise, rel=0.05)


@pytest.mark.parametrize("noise", [0.03, 0.1, 0.2])
def test_what_bounds_leave_follows_a_prediction_that_is_a_little_off(noise: float) -> None:
    prediction = motion()
    run = rounded(prediction, noise)
    off = 0.3 * noise * np.sin(np.arange(run.count) * 0.37)
    left = Readings.of(run).given(prediction - off).residual(prediction - off)[run.first:]
    way = off[run.first:]
    error = (information(noise) * float(way @ way)) ** -0.5
    assert float(left @ way / (way @ way)) == pytest.approx(1.0, abs=4 * error + 0.1)


def test_a_model_that_is_far_off_leaves_what_was_read() -> None:
    run = rounded(motion(), 0.05)
    assert Readings.of(run).given(np.zeros(run.count)).rounding_is_noise


@pytest.mark.parametrize(("facts", "noise"), [
    (RecordFacts(), 0.05), (RecordFacts(step_mps2=STEP), 1.2 * BLURRED_FROM_STEPS * STEP),
    (RecordFacts(step_mps2=STEP, noise_mps2=STEP), 0.05),
], ids=["no step is known", "noise blurs the steps", "the sensor is known to be noisy"])
def test_what_has_no_bounds_worth_it_stays_as_it_was_read(facts: RecordFacts, noise: float) -> None:
    prediction = motion()
    run = replace(rounded(prediction, noise), facts=facts)
    assert Readings.of(run).given(prediction).mps2 is run.measured_mps2


def test_rounded_readings_that_were_filtered_stay_what_they_are() -> None:
    prediction = motion()
    run = rounded(prediction, 0.05)
    blended = measuring(run, 0.7 * run.measured_mps2 + 0.3 * np.roll(run.measured_mps2, 1))
    assert Readings.of(replace(blended, facts=run.facts)).given(prediction).rounding_is_noise


def test_readings_that_never_change_say_nothing() -> None:
    run = rounded(motion(0.001, 2000), 0.001)
    assert np.ptp(run.measured_mps2) == 0
    assert Readings.of(run).given(np.zeros(run.count)).rounding_is_noise


def test_noise_is_reported_without_rounding_and_as_it_was_read() -> None:
    runs = noisy_runs(lasts_s=30.0, noise_mps2=0.1)
    coarse = [replace(measuring(one, STEP * np.round(one.measured_mps2 / STEP)), facts=RecordFacts(step_mps2=STEP))
              for one in runs]
    posterior = posterior_of(coarse)
    state = posterior.start()
    rounded = posterior.with_rounding_at(state)
    assert sensor_noise_of(rounded, state).deviation_mps2 == pytest.approx(0.1, rel=0.05)
    with_rounding = sensor_noise_with_rounding(rounded, state)
    assert with_rounding.deviation_mps2 == pytest.approx(np.hypot(0.1, STEP / np.sqrt(12)), rel=0.05)
    assert rounded.error(state) == posterior.error(state)


def test_what_is_not_rounded_is_the_same_posterior() -> None:
    posterior = posterior_of(noisy_runs(lasts_s=8.0))
    assert posterior.with_rounding_at(posterior.start()) is posterior is posterior.without_rounding()


# --- clipped ones, and none ---


def marked(marks: dict[int, float], step: float | None = None) -> Run:
    """A run of 3 m/s2, turned over at every second sample."""
    run = a_run("run", 12.0, 8.0, 3)
    usable = np.full(run.count, READING)
    for at, mark in marks.items():
        usable[at] = mark
    measured = np.where(np.arange(run.count) % 2, -3.0, 3.0)
    return replace(measuring(run, measured), usable=usable, facts=RecordFacts(step_mps2=step))


@pytest.mark.parametrize(("at", "prediction", "left"), [
    (300, 1.0, 2.0), (300, 5.0, 0.0), (301, -1.0, -2.0), (301, -5.0, 0.0), (301, 2.0, -5.0)])
def test_a_clipped_reading_counts_as_far_as_a_prediction_falls_short(at: int, prediction: float, left: float) -> None:
    run = marked({at: CLIPPED})
    flat = np.full(run.count, prediction)
    assert run.residual(flat)[at] == left
    slopes = Readings.of(run).without_insensitive_samples(np.ones((2, run.count)), flat)
    assert (slopes[:, at] == (left != 0)).all() and slopes.sum() == slopes.size - 2 * (left == 0)


def test_a_rounded_bound_lies_half_a_step_lower() -> None:
    assert marked({300: CLIPPED}, step=0.5).residual(np.zeros(800))[300] == pytest.approx(2.75)


def garbled(runs: list[Run], seed: int) -> list[Run]:
    """With gaps of 10 to 200 ms, in which anything stands."""
    rng = np.random.default_rng(1)
    found = []
    for run in runs:
        usable = np.full(run.count, READING)
        for start in rng.integers(run.first, run.count - 20, 25):
            usable[start : start + rng.integers(1, 20)] = NO_READING
        lost = usable == NO_READING
        measured = run.measured_mps2.copy()
        measured[lost] = np.random.default_rng(seed).normal(0, 5, lost.sum())
        found.append(replace(measuring(run, measured), usable=usable))
    return found


def test_what_stands_in_gaps_is_nothing() -> None:
    found = []
    for seed in (1, 2):
        posterior = posterior_of(garbled(noisy_runs(lasts_s=12.0), seed))
        state = posterior.start()
        linear = LinearModel(posterior, state, posterior.number_slopes(state, posterior.prior.steps))
        found.append((posterior.deviance(state), posterior.error(state), linear.score, linear.objective(
            state.predictions, state.logs), linear.information()))
    for one, other in zip(*found, strict=True):
        assert np.asarray(one) == pytest.approx(np.asarray(other), rel=1e-9)


def test_gaps_leave_the_level_and_take_their_share_of_the_freedom() -> None:
    (run,) = garbled([a_run("run", 12.0, 120.0, 3)], 1)
    noise = np.random.default_rng(7).normal(0, 0.2, run.count)
    whole, holed = (Bands(replace(measuring(run, noise), usable=usable)) for usable in (None, run.usable))
    share = run.read[run.first:].mean()
    assert holed.freedom == pytest.approx(whole.freedom * share)
    left = run.residual(np.zeros(run.count), noise)
    assert float(holed.freedom @ holed.levels(left) / holed.freedom.sum()) == pytest.approx(0.04, rel=0.03)
