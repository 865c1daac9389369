"""A stop in extension: nothing short of it, beyond it a spring and a damper that let go where they would pull."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.extension_stop import FAMILY
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import ForceEffect, chosen
from logger.vehicle.laws import Seen, linear

from ...support.lab.secret_runs import CAR, EFFECTS, posterior_of, secret_runs

P = {"stiffness_n_per_m": 1e5, "clearance_m": 0.01, "damping_time_s": 0.005}


def test_its_force_by_hand() -> None:
    posterior = posterior_of(secret_runs())
    draft, = FAMILY.drafts(LawContext(posterior, posterior.start()))
    assert isinstance(draft.effect, ForceEffect)
    motion, = draft.effect.laws(SimpleNamespace(**P), linear(1000.0)).motions
    by_hand = [(0.009, 1.0, 0.0), (-0.05, -1.0, 0.0), (0.012, 0.0, 200.0), (0.012, 0.1, 250.0), (0.012, -0.2, 100.0),
               (0.012, -0.5, 0.0)]
    for travel_m, rate_mps, force_n in by_hand:
        seen = Seen(travel_m, rate_mps, *[0.0] * 8, memory=())
        assert motion.force(motion.p, seen) == pytest.approx(force_n)


def test_without_damping_it_is_the_bump_stop_of_the_mirrored_road() -> None:
    """Upside down, an extension is a compression: ``bump_stop`` of the list on the road turned over."""
    posterior = posterior_of(secret_runs())
    draft, = FAMILY.drafts(LawContext(posterior, posterior.start()))
    runs = [replace(run, track=replace(run.track, elevation_m=4 * run.track.elevation_m)) for run in secret_runs().runs]
    turned = [replace(run, track=replace(run.track, elevation_m=-run.track.elevation_m)) for run in runs]
    stop = chosen(draft.effect, P | {"damping_time_s": 0.0})
    listed = chosen(EFFECTS["bump_stop"], {"clearance_m": P["clearance_m"], "stop_stiffness_n_per_m": 1e5})
    found = SimulatedRuns(runs).predict(compose(CAR, [stop]))
    expected = SimulatedRuns(turned).predict(compose(CAR, [listed]))
    plain = SimulatedRuns(runs).predict(compose(CAR))
    for here, there, before in zip(found, expected, plain, strict=True):
        assert np.std(here - before) > 0.1 * np.std(before)
        assert np.std(here + there) < 0.02 * np.std(here - before)
