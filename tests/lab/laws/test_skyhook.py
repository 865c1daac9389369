"""Dampers hooked to the sky: their forces by hand, and a body that they hold still."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.skyhook import ACTIVE, FAMILY, SEMI_ACTIVE
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import ForceEffect, chosen
from logger.vehicle.laws import Seen, linear

from ...support.lab.secret_runs import CAR, posterior_of, secret_runs

P = {"sky_n_s_per_m": 2000.0, "firmest_n_s_per_m": 3000.0}
BY_HAND = {
    # speed of the body's end, rate of the suspension (positive in extension), force
    ACTIVE: [(0.1, 0.5, 200.0), (0.1, -0.5, 200.0), (-0.2, 0.0, -400.0)],
    SEMI_ACTIVE: [(0.1, 0.5, 200.0), (-0.1, -0.5, -200.0), (0.1, 0.01, 30.0), (-0.1, -0.01, -30.0), (0.1, -0.5, 0.0),
                  (-0.1, 0.5, 0.0), (0.0, 0.5, 0.0)],
}


@pytest.mark.parametrize("variant", BY_HAND)
def test_its_force_by_hand(variant: str) -> None:
    posterior = posterior_of(secret_runs())
    draft, = (one for one in FAMILY.drafts(LawContext(posterior, posterior.start())) if one.variant == variant)
    assert isinstance(draft.effect, ForceEffect)
    motion, = draft.effect.laws(SimpleNamespace(**P), linear(1000.0)).motions
    still = Seen(*[0.0] * 10, memory=())
    for body_mps, rate_mps, force_n in BY_HAND[variant]:
        assert motion.force(motion.p, still._replace(body_mps=body_mps, rate_mps=rate_mps)) == pytest.approx(force_n)


@pytest.mark.slow
def test_an_active_one_holds_the_body_still() -> None:
    """The speed of the body, which is what they resist."""
    posterior = posterior_of(secret_runs())
    draft, _ = FAMILY.drafts(LawContext(posterior, posterior.start()))
    runs = SimulatedRuns(secret_runs().runs)
    hooked = runs.predict(compose(CAR, [chosen(draft.effect, {"sky_n_s_per_m": 15000.0})]))
    for with_it, without in zip(hooked, runs.predict(compose(CAR)), strict=True):
        quiet, loud = (float(np.std(np.cumsum(one - one.mean())[100:])) for one in (with_it, without))
        assert quiet < 0.6 * loud  # the other sign would drive it
