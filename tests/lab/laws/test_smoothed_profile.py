"""What a law makes of a car on a smoothed profile, beside the same car on the road itself."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d, uniform_filter1d

from logger.lab.laws.families.family import LawContext
from logger.lab.laws.families.smoothed_profile import FAMILY
from logger.vehicle.effect import RecordEffect, Recording

from ...support.lab.secret_runs import posterior_of, secret_runs

STEP_M, RATE_HZ = 0.01, 100.0


def shaken_along(road: np.ndarray, way_m: np.ndarray) -> np.ndarray:
    """What a sensor reads (n,) that is shaken by the road's height under it."""
    return np.interp(way_m, STEP_M * np.arange(len(road)), road)


@pytest.mark.parametrize("name", ["spread_m", "base_m"])
@pytest.mark.parametrize("to_mps", [8.0, 11.0])
def test_short_waves_come_back_at_any_speed(name: str, to_mps: float) -> None:
    """SciPy smooths the road, and the law undoes it; but for waves near one that a mean takes out whole."""
    rng = np.random.default_rng(3)
    road = gaussian_filter1d(rng.standard_normal(40000), 0.15 / STEP_M)  # no wave is so short that nothing is left
    smoothed = (gaussian_filter1d(road, 0.1 / STEP_M) if name == "spread_m" else
                uniform_filter1d(road, round(0.31 / STEP_M)))
    time_s = np.arange(2000) / RATE_HZ
    speed_mps = np.linspace(8.0, to_mps, len(time_s))
    way_m = 100.0 + np.cumsum(speed_mps) / RATE_HZ
    posterior = posterior_of(secret_runs())
    effect, = (one.effect for one in FAMILY.drafts(LawContext(posterior, posterior.start()))
               if one.parameters[0].name == name)
    assert isinstance(effect, RecordEffect)
    before = shaken_along(smoothed, way_m)
    recording = Recording(time_s, way_m, speed_mps, before)
    kept, truth = slice(100, -100), shaken_along(road, way_m)
    found = effect.record(SimpleNamespace(**{name: {"spread_m": 0.1, "base_m": 0.31}[name]}), recording)
    assert np.std((found - truth)[kept]) < (0.05 if name == "spread_m" else 0.1) * np.std((before - truth)[kept])
    np.testing.assert_allclose(effect.record(SimpleNamespace(**{name: 0.0}), recording), before, atol=1e-9)
