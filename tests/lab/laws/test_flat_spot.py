"""A flat spot of a tire: beside a road that dips once in each turn, and found where it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.lab.laws.draft import Draft, LawContext
from logger.lab.laws.families.flat_spot import FAMILY, _draft
from logger.lab.likelihood.map_fit import align
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen

from ...support.lab.secret_runs import CAR, posterior_of, secret_runs

RADIUS_M, DEPTH_M, LENGTH_M, PLACE_M = 0.31, 0.004, 0.25, 0.7
VALUES = {"force_n": DEPTH_M * CAR.front.tire_stiffness_n_per_m, "length_m": LENGTH_M, "turn_radius_m": RADIUS_M,
          "place_m": PLACE_M}


def dented() -> Draft:
    """The law at the front, as it is drafted for a car that has it."""
    posterior = posterior_of(secret_runs([chosen(anywhere().effect, VALUES)]))
    return drafted(LawContext(posterior, align(posterior, posterior.start()).state), "front")


def anywhere() -> Draft:
    """The law at the front."""
    posterior = posterior_of(secret_runs())
    return _draft(LawContext(posterior, posterior.start()), "front", ("",), RADIUS_M, [0.0])


def drafted(context: LawContext, axle: str) -> Draft:
    return next(one for one in FAMILY.drafts(context) if one.variant == f"spot_{axle}")


@pytest.mark.slow
def test_on_one_wheel_it_is_a_road_that_dips_once_in_each_turn() -> None:
    """A tire is a spring: what it is shorter by, the road might be lower by."""
    car = replace(CAR, model="quarter_car", rear=None, contact_patch_m=0.001)
    runs, lower = [], []
    for run in secret_runs().runs:
        spacing_m = 0.01
        at = spacing_m * np.arange(int(len(run.track.elevation_m) * run.track.spacing_m / spacing_m))
        smooth = replace(run.track, spacing_m=spacing_m, elevation_m=0.001 * np.sin(at / 3))
        away = (at - PLACE_M + np.pi * RADIUS_M) % (2 * np.pi * RADIUS_M) - np.pi * RADIUS_M
        dip = np.where(np.abs(away) < LENGTH_M / 2, DEPTH_M * np.cos(np.pi * away / LENGTH_M) ** 2, 0.0)
        runs.append(replace(run, track=smooth))
        lower.append(replace(run, track=replace(smooth, elevation_m=smooth.elevation_m - dip)))
    law = chosen(anywhere().effect, VALUES)
    found, plain = (SimulatedRuns(runs).predict(compose(car, some)) for some in ([law], []))
    expected = SimulatedRuns(lower).predict(compose(car))
    for here, there, before in zip(found, expected, plain, strict=True):
        assert np.std((here - there)[300:]) < 0.05 * np.std((there - before)[300:])


@pytest.mark.slow
def test_it_is_drafted_where_it_is() -> None:
    by_name = {one.name: one.start for one in dented().parameters}
    assert by_name["turn_radius_m"] == pytest.approx(RADIUS_M, rel=0.002)
    assert by_name["place_m"] % (2 * np.pi * RADIUS_M) == pytest.approx(PLACE_M, abs=0.15)


def test_where_nothing_repeats_it_is_not_drafted() -> None:
    posterior = posterior_of(secret_runs())
    assert not FAMILY.drafts(LawContext(posterior, align(posterior, posterior.start()).state))
