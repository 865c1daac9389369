"""What repeats in noise is found at the very frequency that was put in; in noise alone nothing is."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from logger.lab.laws import repeating
from logger.lab.laws.families.clipping import FAMILY as CLIPPING
from logger.lab.laws.families.hum import FAMILY as HUM
from logger.lab.laws.families.wheel_turns import FAMILY as WHEEL_TURNS
from logger.lab.laws.repeating import spatial_frequency, tone_in_time
from logger.vehicle.effect import RecordEffect, Recording

from ...support.lab.secret_runs import posterior_of, secret_runs

FIRST, COUNT = 200, 5000
TIME_S = np.arange(COUNT) / 100
SPEEDS_MPS = (9.0, 15.0)
Array = np.ndarray


def look_at(monkeypatch: pytest.MonkeyPatch, signals: list[Array]) -> Any:
    """Runs whose residuals, white already, are these (n,) and noise."""
    rng = np.random.default_rng(2004)
    noisy = [one[FIRST:] + rng.normal(size=COUNT - FIRST) for one in signals]
    monkeypatch.setattr(repeating, "white_residuals", lambda context: noisy)
    runs = [SimpleNamespace(rate_hz=100.0, first=FIRST, distance_m=way(speed), speed_mps=np.full(COUNT, speed))
            for speed in SPEEDS_MPS]
    still = SimpleNamespace(distance_error_m=lambda record: [np.zeros(COUNT)] * len(runs))
    return SimpleNamespace(runs=runs, posterior=still, state=SimpleNamespace(record=None))


def way(speed_mps: float) -> Array:
    return 3.0 + speed_mps * (TIME_S + 0.4 * np.sin(TIME_S / 3))


def test_a_tone_that_wanders_is_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    late = 0.7 * np.sin(2 * np.pi * TIME_S / 18.3) + 0.2 * np.cos(2 * np.pi * TIME_S / 18.3)
    tone = np.sin(2 * np.pi * 21.7 * (TIME_S + late) + 1.0)
    context = look_at(monkeypatch, [tone, tone])
    found = tone_in_time(context, (5.0, 37.0), wanders=True)
    assert found is not None and found.wanders
    assert found.frequency_hz == pytest.approx(21.7, abs=0.01) and found.period_s == pytest.approx(18.3, abs=0.05)
    assert (found.wander_sin_s, found.wander_cos_s) == pytest.approx((0.7, 0.2), abs=0.01)


def test_a_steady_tone_and_one_by_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    context = look_at(monkeypatch, [0.5 * np.cos(2 * np.pi * 13.37 * TIME_S)] * 2)
    found = tone_in_time(context, (5.0, 37.0), wanders=False)
    assert found is not None and not found.wanders and found.frequency_hz == pytest.approx(13.37, abs=0.003)
    turning = look_at(monkeypatch, [0.5 * np.cos(2 * np.pi * 0.531 * way(speed)) for speed in SPEEDS_MPS])
    assert spatial_frequency(turning, (0.3, 1.6)) == pytest.approx(0.531, abs=2e-4)


@pytest.mark.slow
def test_noise_does_not_repeat(monkeypatch: pytest.MonkeyPatch) -> None:
    context = look_at(monkeypatch, [np.zeros(COUNT)] * 2)
    assert tone_in_time(context, (5.0, 37.0), False) is None and spatial_frequency(context, (0.3, 1.6)) is None
    assert tone_in_time(context, (5.0, 37.0), True) is None


def test_nothing_is_drafted_where_nothing_repeats() -> None:
    from logger.lab.laws.draft import LawContext

    posterior = posterior_of(secret_runs())
    context = LawContext(posterior, posterior.start())
    assert HUM.drafts(context) == [] == WHEEL_TURNS.drafts(context)


@pytest.mark.parametrize(("limits", "values"), [
    (lambda motion: np.clip(motion, -2.5, 2.5), {"limit_mps2": 2.5}),
    (lambda motion: motion / np.hypot(1.0, motion / 2.5), {"limit_mps2": 2.5, "sharpness_ratio": 2.0}),
    (lambda motion: 2.5 * np.tanh(motion / 2.5), {"limit_mps2": 2.694, "sharpness_ratio": 2.231}),
])
def test_a_limited_record_is_that_of_a_limited_motion(limits: Callable[[Array], Array],
                                                      values: dict[str, float]) -> None:
    """Limited in fine steps and filtered by another program: SciPy's resampling. Of amplifiers that saturate as tanh
    does, one bends much alike."""
    from scipy.signal import firwin, resample_poly

    from logger.lab.laws.draft import LawContext

    posterior = posterior_of(secret_runs())
    effect, = (one.effect for one in CLIPPING.drafts(LawContext(posterior, posterior.start()))
               if [number.name for number in one.parameters] == [*values])
    assert isinstance(effect, RecordEffect)
    time_s = np.arange(16000) / 1600
    fine = 3 * np.sin(2 * np.pi * 1.3 * time_s) + 1.5 * np.sin(2 * np.pi * 9.1 * time_s)
    low_pass = firwin(16 * 40 + 1, 44.0, width=12.0, fs=1600)
    limited = resample_poly(limits(fine), 1, 16, window=low_pass)
    accel = fine[::16]
    some = Recording(time_s[::16], np.zeros(1000), np.zeros(1000), accel)
    off = (effect.record(SimpleNamespace(**values), some) - limited)[100:-100]
    assert np.sqrt(np.mean(off**2)) < 0.02 * np.std(accel - limited)
    for far in (1e9, np.inf):
        beyond = SimpleNamespace(**{**values, "limit_mps2": far})
        np.testing.assert_allclose(effect.record(beyond, some), accel, atol=1e-9)
