"""Where the residual is: shares that add up, and bands around the car's own vibrations."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

from logger.api.lab.words import paired
from logger.lab.residuals.breakdown import Part, breakdown
from logger.report.quantities import fixed
from logger.runs import Run, short_names

from ...support.lab.runs_with_residual import CAR, RATE_HZ, a_run, beside_with

Array = npt.NDArray[np.float64]


def sine_and_noise(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
    """A sine at 11 Hz with three times the power of noise."""
    time_s = np.arange(len(prediction)) / RATE_HZ
    return np.sqrt(6) * 0.1 * np.sin(2 * np.pi * 11.0 * time_s) + rng.normal(0, 0.1, len(prediction))


def test_shares_add_up_and_the_sine_is_where_it_is() -> None:
    residuals = beside_with(sine_and_noise)
    where = breakdown(residuals)
    for parts in (where.frequency, where.speed, where.amplitude, where.place):
        assert sum(part.share for part in parts) == pytest.approx(1.0)
    shares = {part.name: part for part in where.frequency}
    hop = shares["wheel hop"]
    # Three quarters, and the band's part of the white quarter.
    assert hop.share == pytest.approx(0.75 + 0.25 * (hop.high - hop.low) / 50, abs=0.01)


def test_bands_surround_the_vibrations_of_the_car() -> None:
    """The half car's heave and hop by hand: both springs under the body's mass, all springs on a wheel's."""
    bands = {band.name: band for band in beside_with(sine_and_noise).bands}
    front = CAR.front
    wheel_hz = np.sqrt((front.suspension_stiffness_n_per_m + front.tire_stiffness_n_per_m)
                       / front.unsprung_mass_kg) / (2 * np.pi)
    in_series = 1 / (1 / front.suspension_stiffness_n_per_m + 1 / front.tire_stiffness_n_per_m)
    body_hz = np.sqrt(2 * in_series / CAR.sprung_mass_kg) / (2 * np.pi)
    assert bands["wheel hop"].from_hz < wheel_hz < bands["wheel hop"].to_hz
    assert bands["body bounce"].from_hz < body_hz < bands["body bounce"].to_hz
    ends = [(band.from_hz, band.to_hz) for band in beside_with(sine_and_noise).bands]
    assert ends[0][0] == 0 and ends[-1] == (38.0, 50.0)
    assert [high for _, high in ends[:-1]] == [low for low, _ in ends[1:]]


def test_errors_of_parts_are_ratios_of_rms() -> None:
    residuals = beside_with(lambda run, prediction, rng: -0.2 * prediction)
    for part in (*breakdown(residuals).speed, *breakdown(residuals).place):
        assert part.error == pytest.approx(0.25)  # 0.2 of the model is 0.25 of what is left to be measured


def test_where_nothing_was_measured_there_is_no_error() -> None:
    dead = slice(600, 900)  # three seconds of zeros

    def silent(run: Run, prediction: Array, rng: np.random.Generator) -> Array:
        return np.where((np.arange(len(prediction)) >= dead.start) & (np.arange(len(prediction)) < dead.stop),
                        -prediction, 0.05)

    where = breakdown(beside_with(silent))
    unknown = [part for part in where.place if not np.isfinite(part.error)]
    assert unknown and all(part.residual_mps2 > 0 and fixed(part.error, 3, "-") == "-" for part in unknown)
    assert all(part.error > 0 for part in where.place if part not in unknown)


def test_runs_are_called_by_their_folders_while_those_differ() -> None:
    one, other, third = a_run("a/run1", 8.0, 5.0, 1), a_run("a/run2", 8.0, 5.0, 1), a_run("b/run2", 8.0, 5.0, 1)
    assert short_names([one, other]) == {"a/run1": "run1", "a/run2": "run2"}
    assert short_names([other, third]) == {"a/run2": "a/run2", "b/run2": "b/run2"}


def test_parts_are_paired_by_band_or_by_ends_whatever_else_there_is() -> None:
    def part(low: float, high: float, name: str = "") -> Part:
        return Part(low, high, 0.1, 0.2, 0.3, 4, name)

    before = [part(0, 1, "below body bounce"), part(1, 2, "body bounce"), part(2, 8, "between bounce and hop")]
    after = [part(0, 1.1, "below body bounce"), part(1.1, 2.1, "body bounce"), part(8, 12, "wheel hop")]
    assert paired(before, after) == [(before[0], after[0]), (before[1], after[1]), (None, after[2])]
    assert paired([part(0, 2), part(2, 4)], [part(2, 4), part(4, 6)]) == [(part(2, 4), part(2, 4)), (None, part(4, 6))]
