"""Inertia behind a spring: beside the matrices of a car that has a wheel's inertia more, and a spring to it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from logger.lab.laws.families.family import LawContext
from logger.lab.laws.families.inertia_behind_spring import FAMILY
from logger.simulation.simulated_runs import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import BodyEffect, Parameter, Scale, chosen
from logger.vehicle.structure import Structure

from ...support.lab.secret_runs import CAR, posterior_of, secret_runs

STIFFNESS_N_PER_M, HZ, RATIO = 30000.0, 6.0, 0.25


class InMatrices(BodyEffect):
    """One more coordinate y for each suspension, of the kinetic energy b y'^2 / 2, the potential k (x - y)^2 / 2 and
    the dissipation c y'^2 / 2."""

    name = "in_matrices"
    title = source = signature = shown_by = "words"
    parameters = (Parameter("size", 1.0, 0.0, 2.0, 0.0, Scale.LINEAR, (1.0,), "how much"),)
    stage = 9

    def structure(self, p: SimpleNamespace, structure: Structure) -> Structure:
        n, w = len(structure.mass), len(structure.wheels)
        omega = 2 * np.pi * HZ
        inertia = STIFFNESS_N_PER_M / omega**2
        apart = np.hstack([structure.travel, -np.eye(w)])
        own = np.diag(np.append(np.zeros(n), np.ones(w)))
        wide = ((0, w), (0, w))
        return replace(
            structure, mass=np.pad(structure.mass, wide) + inertia * own,
            damping=np.pad(structure.damping, wide) + 2 * RATIO * omega * inertia * own,
            stiffness=np.pad(structure.stiffness, wide) + STIFFNESS_N_PER_M * apart.T @ apart,
            road=np.pad(structure.road, ((0, w), (0, 0))), body=np.pad(structure.body, ((0, w), (0, 0))),
            wheels=np.pad(structure.wheels, ((0, 0), (0, w))), travel=np.pad(structure.travel, ((0, 0), (0, w))))


def test_it_is_a_car_with_one_more_coordinate_in_each_suspension() -> None:
    runs = SimulatedRuns(secret_runs().runs)
    posterior = posterior_of(secret_runs())
    draft, = FAMILY.drafts(LawContext(posterior, posterior.start()))
    law = chosen(draft.effect, {"stiffness_n_per_m": STIFFNESS_N_PER_M, "frequency_hz": HZ, "damping_ratio": RATIO})
    cars = [compose(CAR, effects) for effects in ([law], [chosen(InMatrices(), {"size": 1.0})], [])]
    for found, expected, before in zip(*map(runs.predict, cars), strict=True):
        kept = slice(300, None)  # both begin at rest on the road there, which a slope is not
        assert np.std((found - expected)[kept]) < 0.01 * np.std((before - expected)[kept])
