"""Channels of a rig that were at their end or out, and forces of the wrong sign."""

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from logger.dsp.channel_faults import at_ends, goes_against, longest_still, released_at

RATE_HZ = 200.0
TIME_S = np.arange(4000) / RATE_HZ
SWING = np.sin(9 * TIME_S) + 0.3 * np.sin(31 * TIME_S + 1)


@pytest.mark.parametrize("step", [0.0, 0.02, 0.2])
def test_an_amplifier_at_its_end_is_found_and_steps_are_none(step: float) -> None:
    noisy = SWING + np.random.default_rng(1).normal(0, 1e-4, len(SWING))
    read = step * np.round(noisy / step) if step else noisy
    assert not at_ends(read).any()
    if step < 0.1:
        np.testing.assert_array_equal(at_ends(np.clip(read, -0.8, 0.4)), (read <= -0.8) | (read >= 0.4))


def test_a_cable_that_is_out_is_found_and_what_rests_is_not() -> None:
    noisy = SWING + np.random.default_rng(1).normal(0, 1e-3, len(SWING))
    assert longest_still(noisy, RATE_HZ) is None
    out = noisy.copy()
    out[1000:1100] = out[1000]
    assert longest_still(out, RATE_HZ) == (1000, 1100)
    assert longest_still(0.2 * np.round(np.exp(-TIME_S) * SWING / 0.2), RATE_HZ) is None
    play = 0.1 * np.round(30.0 * np.sign(SWING) * np.maximum(np.abs(SWING) - 0.4, 0.0))  # read in steps
    assert longest_still(play, RATE_HZ) is None
    often = noisy.copy()
    for first in range(500, 3500, 300):
        often[first : first + 15] = 0.0  # less than a tenth of a second, and once more
    often[2000:2022] = 0.0
    assert longest_still(often, RATE_HZ) is None


@pytest.mark.parametrize("measured", [0, 1, 2])
def test_a_force_of_the_wrong_sign_is_found_whatever_is_measured(measured: int) -> None:
    push = np.random.default_rng(2).normal(0, 1.0, len(TIME_S)).cumsum() * 0.1
    mass = StateSpace([[0.0, 1.0], [-400.0, -2.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    _, place, states = lsim(mass, push, TIME_S)
    motion = [place, states[:, 1], push - 400 * place - 2 * states[:, 1]][measured]
    assert not goes_against(push, motion, measured, range(3), RATE_HZ)
    assert goes_against(-push, motion, measured, range(3), RATE_HZ)


@pytest.mark.parametrize("noise", [0.0, 0.003, 0.02])
@pytest.mark.parametrize("order", range(3))
def test_what_is_held_is_found_and_what_swings_is_not_held(order: int, noise: float) -> None:
    """A mass at 3 Hz with a damping ratio of 5 %, let go at rest or recorded from any moment on; its derivatives."""
    root = 6 * np.pi * (-0.05 + 1j)
    time_s, rng = np.arange(600) / RATE_HZ, np.random.default_rng(order)

    def swings(turn: float) -> np.ndarray:
        return np.asarray((np.exp(1j * turn) * (root / abs(root)) ** order * np.exp(root * time_s)).real)

    let_go = swings(np.arctan2(-0.05, 1.0))
    held = np.concatenate([np.full(300, let_go[0] if order == 0 else 0.0), let_go])
    assert released_at(held + noise * rng.standard_normal(900)) == pytest.approx(300, abs=6)
    for turn in np.linspace(0, 2 * np.pi, 20):
        assert released_at(swings(turn) + noise * rng.standard_normal(600)) < 15
