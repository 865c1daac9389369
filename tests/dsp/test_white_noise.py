"""White noise of a sensor, told from what moves."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from logger.dsp.white_noise import answered, without_white_noise
from logger.profiles.excitation import Excitation
from logger.profiles.track import Way

RATE_HZ = 500.0


def _sweep(count: int = 10_000) -> tuple[np.ndarray, np.ndarray]:
    """A sweep from 0.5 to 12 Hz of 20 mm, and its velocity."""
    time_s = np.arange(count) / RATE_HZ
    rise = np.log(24.0) / time_s[-1]
    phase = 2 * np.pi * 0.5 * np.expm1(rise * time_s) / rise
    return 0.02 * np.sin(phase), 0.02 * np.cos(phase) * 2 * np.pi * 0.5 * np.exp(rise * time_s)


def test_noise_of_a_sensor_is_found_and_taken_out() -> None:
    place_m, _ = _sweep()
    noise = 2e-5 * np.random.default_rng(1).standard_normal(len(place_m))
    found = without_white_noise(place_m + noise)
    assert found.deviation == pytest.approx(2e-5, rel=0.03)
    assert np.std(found.left(0)) == pytest.approx(np.std(found.samples - place_m), rel=0.3)
    assert np.std(found.samples - place_m) < 0.5 * 2e-5  # the motion's 12 of 250 Hz keep 5 % of its power


def test_a_velocity_by_a_noisy_place_is_the_motion_s() -> None:
    place_m, velocity_mps = _sweep()
    noise = 2e-5 * np.random.default_rng(2).standard_normal(len(place_m))
    excitation = Excitation(RATE_HZ, place_m + noise, moves_part=True)
    stance = SimpleNamespace(behind_m=np.zeros(1), left_m=np.zeros(1), contact_patch_m=0.0, on_base=True)
    time_s = np.arange(1000, 9000) / RATE_HZ
    curves, _ = excitation.under_wheels(Way(np.zeros_like(time_s), time_s), stance)
    # A curve through the samples is off by 12 mm/s.
    assert np.std(curves[:, 1] - velocity_mps[1000:9000]) < 2e-3


@pytest.mark.parametrize("samples", [
    pytest.param(np.cumsum(np.random.default_rng(3).standard_normal(10_000)), id="a road, which has no plateau"),
    pytest.param(np.random.default_rng(4).standard_normal(10_000), id="a force that is white"),
    pytest.param(_sweep()[0][:200] + 1e-5 * np.random.default_rng(5).standard_normal(200), id="too short to say"),
    pytest.param(np.zeros(10_000), id="at rest"),
])
def test_what_moves_is_left_as_it_is(samples: np.ndarray) -> None:
    found = without_white_noise(samples)
    assert found.deviation == 0.0
    assert found.samples is samples


def _digressive(velocity_mps: np.ndarray, rate_hz: float, oil_n_per_m: float = 1.2e5) -> np.ndarray:
    """Force of a damper whose slope halves above 50 mm/s, through the spring of its oil, by steps of a hundredth."""
    fine_s = np.arange(100 * len(velocity_mps)) / (100 * rate_hz)
    force_n = np.zeros(len(fine_s))
    for at, v in enumerate(np.interp(fine_s, np.arange(len(velocity_mps)) / rate_hz, velocity_mps)[:-1]):
        size = abs(force_n[at])
        flow = np.sign(force_n[at]) * (min(size, 75.0) / 1500 + max(size - 75.0, 0.0) / 750)
        force_n[at + 1] = force_n[at] + (v - flow) * oil_n_per_m / (100 * rate_hz)
    return force_n[::100]


@pytest.mark.parametrize(("hum_m", "shakes_m", "noise_m"), [
    pytest.param(6e-5, 0.0, 1.5e-5, id="hum and noise go"),
    pytest.param(0.0, 6e-5, 0.0, id="a vibration stays, though an oil spring leaves a third of it"),
    pytest.param(0.0, 0.0, 0.0, id="nothing to take out"),
])
def test_what_a_damper_does_not_answer_is_noise(hum_m: float, shakes_m: float, noise_m: float) -> None:
    rate_hz, count = 150.0, 180  # 1.2 s: of white noise alone nothing is seen in so short a record
    time_s = np.arange(count) / rate_hz
    hum, stroke = 2 * np.pi * 51.0 * time_s, 2 * np.pi * 1.1 * time_s
    moves_m = 0.018 * np.cos(stroke) + shakes_m * np.sin(hum)
    moves_mps = -0.018 * 2 * np.pi * 1.1 * np.sin(stroke) + shakes_m * 2 * np.pi * 51.0 * np.cos(hum)
    read_m = moves_m + hum_m * np.sin(hum) + noise_m * np.random.default_rng(6).standard_normal(count)
    force_n = _digressive(moves_mps, rate_hz) + 0.3 * np.random.default_rng(7).standard_normal(count)
    excitation = Excitation(rate_hz, read_m, moves_part=True)
    stance = SimpleNamespace(behind_m=np.zeros(1), left_m=np.zeros(1), contact_patch_m=0.0, on_base=True)

    def velocity_mps(one: Excitation) -> np.ndarray:
        return one.under_wheels(Way(np.zeros_like(time_s), time_s), stance)[0][15:-15, 1]

    as_read, answered = velocity_mps(excitation), velocity_mps(excitation.answered_by(force_n, rate_hz))
    off_mps, left_mps = (float(np.std(one - moves_mps[15:-15])) for one in (as_read, answered))
    if hum_m:
        assert off_mps > 0.011 > 0.004 > left_mps
    else:
        assert np.abs(answered - as_read).max() < 1e-5


@pytest.mark.parametrize("seed", range(6))
def test_the_trace_of_a_loud_stroke_at_other_frequencies_is_no_noise(seed: int) -> None:
    """Three seconds of a stroke that grows and falls, and a linear damper's force with noise of half a per cent."""
    time_s = np.arange(1500) / 500.0
    grows, turn = 1 + 0.5 * np.sin(2 * np.pi * 0.37 * time_s), 2 * np.pi * 1.5
    travel_m = 0.02 * np.sin(turn * time_s) * grows
    force_n = 5000 * travel_m + 1500 * np.gradient(travel_m, time_s) + np.random.default_rng(seed).normal(0, 1, 1500)
    assert answered(travel_m, force_n, 500.0, 200.0).tolist() == [1.0] * 1500


def test_nothing_of_what_stands_still_is_noise() -> None:
    force_n = np.random.default_rng(1).standard_normal(500)
    assert answered(np.zeros(500), force_n, 500.0, 100.0).tolist() == [1.0] * 500
