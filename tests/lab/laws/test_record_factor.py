"""What lies between body and record, beside SciPy's rational functions of the same poles and zeros."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import freqs

from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.record_factor import FAMILY
from logger.vehicle.effect import SensorEffect

from ...support.lab.secret_runs import posterior_of, secret_runs

HZ = np.array([0.0, 0.3, 2.0, 9.0, 20.0, 45.0])
OMEGA, RATIO, ADDED, BY_RATE = 2 * np.pi * 9.0, 0.3, 0.7, -0.4
CASES = {
    "pole": ([1.0, (1 + ADDED) * OMEGA], [1.0, OMEGA]),
    "rising": ([1 + ADDED, OMEGA], [1.0, OMEGA]),
    "pair_10": ([1.0, (2 * RATIO + BY_RATE) * OMEGA, (1 + ADDED) * OMEGA**2], [1.0, 2 * RATIO * OMEGA, OMEGA**2]),
}


@pytest.mark.parametrize("variant", CASES)
def test_its_poles_and_zeros(variant: str) -> None:
    posterior = posterior_of(secret_runs())
    effect, = (one.effect for one in FAMILY.drafts(LawContext(posterior, posterior.start()))
               if one.variant == variant)
    assert isinstance(effect, SensorEffect)
    p = SimpleNamespace(added_ratio=ADDED, rate_ratio=BY_RATE, frequency_hz=9.0, damping_ratio=RATIO)
    _, expected = freqs(*CASES[variant], worN=2 * np.pi * HZ)
    np.testing.assert_allclose(effect.factor(p, 2j * np.pi * HZ), expected, rtol=1e-12)
