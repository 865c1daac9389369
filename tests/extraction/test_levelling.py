"""Which way is up: by gravity, at any angle, and where a recorder turns."""

from __future__ import annotations

import numpy as np
import pytest

from logger.extraction.recorded_columns import felt, steady_mean, turns, upwards
from logger.units import STANDARD_GRAVITY_MPS2 as G

from ..support.drives.phones import rotation

TIME_S = np.arange(0, 120, 0.01)


def forces(rng: np.random.Generator) -> np.ndarray:
    """Of a drive (n, 3): ahead, left, up, with braking, curves and a rough road."""
    ahead = 2.5 * ((TIME_S > 10) & (TIME_S < 16)) - 3.0 * ((TIME_S > 100) & (TIME_S < 105))
    left = 2.0 * np.sin(2 * np.pi * TIME_S / 17) * (TIME_S > 40)
    return np.stack([ahead, left, G + rng.standard_normal(len(TIME_S))], axis=1)


@pytest.mark.parametrize("seed", range(30))
def test_however_a_phone_lies_the_vertical_is_the_same(seed: int) -> None:
    rng = np.random.default_rng(seed)
    force = forces(rng)
    straight, _ = upwards(TIME_S, force)
    turned, _ = upwards(TIME_S, force @ rotation(rng).T)
    assert np.abs(turned - straight).max() < 1e-3
    mirrored, _ = upwards(TIME_S, -force @ rotation(rng).T)  # as Apple counts
    assert np.abs(mirrored - straight).max() < 1e-3


def test_the_vertical_is_right_beside_braking_and_curves() -> None:
    force = forces(np.random.default_rng(1))
    found, tilt_rad = upwards(TIME_S, force)
    assert np.std(found - (force[:, 2] - G)) < 0.05
    assert tilt_rad < np.radians(1.0)


def test_the_mean_is_that_of_most_blocks() -> None:
    means = np.tile([0.0, 3.0, 9.0], (20, 1))
    means[:9] += 40.0
    assert np.allclose(steady_mean(means), [0, 3, 9], atol=0.2)  # the others lie 70 away
    assert np.allclose(steady_mean(means[-1:]), [0, 3, 9])


@pytest.mark.parametrize(("unit", "scale"), [(1.0, 1.0), (G, 1 / G), (G / 1000, 1000 / G)])
def test_the_size_of_gravity_tells_the_unit(unit: float, scale: float) -> None:
    assert felt(TIME_S, scale * forces(np.random.default_rng(1))).unit_mps2 == pytest.approx(unit)


def test_without_gravity_there_is_no_unit() -> None:
    found = felt(TIME_S, forces(np.random.default_rng(1)) - [0, 0, G])
    assert found.unit_mps2 is None
    assert found.size < 0.5


def test_driving_is_no_turn() -> None:
    assert turns(TIME_S, forces(np.random.default_rng(1))) == []


@pytest.mark.parametrize(("at_s", "angle_deg"), [(60.0, 20.0), (25.0, 60.0), (101.3, 90.0), (60.0, 15.0)])
def test_a_turn_is_found_where_it_was(at_s: float, angle_deg: float) -> None:
    force = forces(np.random.default_rng(1))
    a = np.radians(angle_deg)
    about = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    late = at_s < TIME_S
    force[late] = force[late] @ about.T
    ((found_s, words),) = turns(TIME_S, force)
    assert abs(found_s - at_s) < 1.0
    assert "tilted by" in words
    assert abs(float(words.split()[-2]) - angle_deg) < 8  # braking and curves are in the means


def test_two_turns_are_both_found_and_short_records_say_nothing() -> None:
    force = forces(np.random.default_rng(1))
    force[(TIME_S > 30) & (TIME_S < 70)] = force[(TIME_S > 30) & (TIME_S < 70)][:, [2, 0, 1]]
    assert [round(at_s) for at_s, _ in turns(TIME_S, force)] == [30, 70]
    assert turns(TIME_S[:1500], force[:1500]) == []
