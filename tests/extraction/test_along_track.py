"""Motion by noisy fixes, against the motion that they were made of and against a dense solution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.extraction.along_track import Observations, TrackMotion, motion_of, place_std_m, speed_scale

NOISE_MPS = 0.08


def driven(rate_hz: float, seconds: float = 300.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, distances and speeds of a car that speeds up, slows down and stands, exactly."""
    fine_s = np.arange(0, seconds, 0.001)
    wanted = (12 + 4 * np.sin(2 * np.pi * fine_s / 70)) * (np.sin(2 * np.pi * fine_s / 180) > -0.8)
    hat = np.hanning(10_001)  # it takes 10 s to stop, at 3 m/s2 at most
    speed = np.convolve(np.pad(wanted, 5000, "edge"), hat / hat.sum(), "valid")
    distance = np.concatenate([[0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * 0.001)])
    at = np.arange(0, seconds - 1, 1 / rate_hz)
    return at, np.interp(at, fine_s, distance), np.interp(at, fine_s, speed)


def fixes(rate_hz: float, seed: int) -> tuple[Observations, np.ndarray, np.ndarray]:
    at, distance, speed = driven(rate_hz)
    rng = np.random.default_rng(100 + seed)
    return Observations(at, speed + NOISE_MPS * rng.standard_normal(len(at)), np.ones(len(at))), distance, speed


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [1.0, 5.0, 10.0])
def test_motion_is_nearer_to_the_truth_than_the_fixes_and_knows_their_noise(rate_hz: float) -> None:
    speeds, _, speed = fixes(rate_hz, 1)
    motion = motion_of(speeds)
    assert motion.noise_mps == pytest.approx(NOISE_MPS, rel=0.35)
    assert np.std(motion.state[:, 1] - speed) < 0.95 * NOISE_MPS


@pytest.mark.slow
def test_errors_of_the_distance_are_as_large_as_they_are_said_to_be() -> None:
    off = []
    for seed in range(12):
        speeds, distance, _ = fixes(1.0, seed)
        motion = motion_of(speeds)
        start = Observations(speeds.time_s[:1], np.zeros(1), np.full(1, 0.001))
        std_m = place_std_m(motion, speeds, start)
        off.append((motion.state[-1, 0] - distance[-1]) / std_m[-1])
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.5


@pytest.mark.slow
def test_a_wild_fix_hardly_counts() -> None:
    speeds, _, _ = fixes(1.0, 3)
    wild = speeds.value.copy()
    wild[100] += 30.0
    motion = motion_of(Observations(speeds.time_s, wild, speeds.deviation))
    assert abs(motion.state[-1, 0] - motion_of(speeds).state[-1, 0]) < 1.0


def test_places_pin_the_distance_down() -> None:
    speeds, distance, _ = fixes(1.0, 4)
    every = slice(None, None, 20)
    places = Observations(speeds.time_s[every] + 0.3, np.interp(speeds.time_s[every] + 0.3, speeds.time_s, distance),
                          np.full(len(distance[every]), 0.02))
    found = motion_of(speeds, places, motion_of(speeds))
    # Straight lines between the fixes are up to an eighth of the acceleration off, 0.3 m at 2.5 m/s2.
    near = found.time_s <= places.time_s[-1]
    assert np.abs(found.state[near, 0] - distance[near]).max() < 0.5
    assert place_std_m(found, speeds, places)[near].max() < 0.25


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1.0, 1.01])
def test_known_places_say_by_what_factor_the_speeds_are_off(scale: float) -> None:
    off = []
    for seed in range(6):
        speeds, distance, _ = fixes(5.0, seed)
        speeds = replace(speeds, value=scale * speeds.value)
        places = Observations(speeds.time_s[::15], distance[::15], np.full(len(distance[::15]), 0.02))
        found, error = speed_scale(motion_of(speeds, places, motion_of(speeds)), speeds, places)
        off.append((found - scale) / error)
        assert error < 0.001
    assert np.sqrt(np.mean(np.square(off))) < 2.0


def test_the_banded_solution_is_the_dense_one() -> None:
    """The same posterior by a dense system written out."""
    time_s = np.array([0.0, 1.0, 1.5, 3.0, 4.2])
    speeds = Observations(time_s, np.array([1.0, 2.0, 2.2, 3.0, 2.5]), np.ones(5))
    places = Observations(np.array([0.0, 3.0]), np.array([0.0, 6.0]), np.array([0.01, 0.5]))
    like = TrackMotion(time_s, np.zeros((5, 3)), 0.3, 0.2)
    rows, values, weights = [], [], []

    def add(row: np.ndarray, value: float, deviation: float) -> None:
        rows.append(row)
        values.append(value)
        weights.append(deviation**-2)

    for index, deviation in enumerate((1e4, 100.0, 5.0)):
        add(np.eye(15)[index], 0.0, deviation)
    steps = np.diff(time_s)
    precision = np.zeros((15, 15))
    for k, step in enumerate(steps):
        move = np.array([[1, step, step**2 / 2], [0, 1, step], [0, 0, 1]])
        spread = 0.3 * np.array([[step**5 / 20, step**4 / 8, step**3 / 6], [step**4 / 8, step**3 / 3, step**2 / 2],
                                 [step**3 / 6, step**2 / 2, step]]) + np.diag([(0.05 * 0.2) ** 2 * step, 0, 0])
        pick = np.zeros((3, 15))
        pick[:, 3 * k : 3 * k + 3], pick[:, 3 * k + 3 : 3 * k + 6] = -move, np.eye(3)
        precision += pick.T @ np.linalg.inv(spread) @ pick
    for k in range(5):
        add(np.eye(15)[3 * k + 1], speeds.value[k], 0.2)
    for at, value, deviation in zip((0, 3), places.value, places.deviation, strict=True):
        add(np.eye(15)[3 * at], value, deviation)
    stacked, w = np.array(rows), np.array(weights)
    found = motion_of(speeds, places, like).state.ravel()
    # Student's weights change what is far off: nothing is here, beyond a deviation or so.
    dense = np.linalg.solve(precision + stacked.T * w @ stacked, stacked.T * w @ np.array(values))
    assert np.abs(found - dense).max() < 0.15


def test_one_fix_is_no_motion() -> None:
    with pytest.raises(ValueError, match="two fixes or more"):
        motion_of(Observations(np.zeros(1), np.ones(1), np.ones(1)))
