"""Dampers that fade by the heat that they make: beside the heat's own equation, stepped with small steps."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import lambertw

from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.damper_heat import FAMILY
from logger.vehicle.effect import ForceEffect
from logger.vehicle.laws import Seen, linear

from ...support.lab.secret_runs import posterior_of, secret_runs

DAMPING_N_S_PER_M, PER_J, COOLS_S = 1500.0, 2e-3, 20.0


@pytest.mark.parametrize("variant", ["alike", "by_axle"])
def test_a_steady_rate_brings_it_to_where_loss_and_cooling_are_equal(variant: str) -> None:
    """At a steady rate h = a T c v^2 exp(-h) in the end: Lambert's W of a T c v^2."""
    posterior = posterior_of(secret_runs())
    draft = next(one for one in FAMILY.drafts(LawContext(posterior, posterior.start())) if one.variant == variant)
    assert isinstance(draft.effect, ForceEffect)
    p = SimpleNamespace(lost_per_j=PER_J, rear_lost_per_j=PER_J, front_lost_per_j=0.0, cooling_time_s=COOLS_S)
    law, = draft.effect.laws(p, linear(DAMPING_N_S_PER_M, rear=True)).motions
    assert law.rates is not None
    rate_mps, h, step_s = 0.3, 0.0, 0.05
    for _ in range(int(400 / step_s)):
        h += step_s * law.rates(law.p, Seen(0.0, rate_mps, *[0.0] * 8, memory=(h,)))[0]
    expected = float(np.real(lambertw(PER_J * COOLS_S * DAMPING_N_S_PER_M * rate_mps**2)))
    assert h == pytest.approx(expected, rel=1e-6)
    whole = law.force(law.p, Seen(0.0, rate_mps, *[0.0] * 8, memory=(h,))) + DAMPING_N_S_PER_M * rate_mps
    assert whole == pytest.approx(DAMPING_N_S_PER_M * rate_mps * np.exp(-h))
