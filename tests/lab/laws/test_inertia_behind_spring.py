"""Inertia in the suspensions: beside the matrices of a car that has it, and beside a pendulum that turbulence stops."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from logger.lab.laws.draft import Draft, LawContext
from logger.lab.laws.families.inertia_behind_spring import FAMILY
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import BodyEffect, Chosen, ForceEffect, Parameter, Scale, chosen
from logger.vehicle.laws import Seen, linear
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


def draft_of(variant: str) -> Draft:
    posterior = posterior_of(secret_runs())
    return next(one for one in FAMILY.drafts(LawContext(posterior, posterior.start())) if one.variant == variant)


def check_alike(law: Chosen, other: Chosen) -> None:
    """Two cars move alike, beside what either differs by from the plain one."""
    runs = SimulatedRuns(secret_runs().runs)
    cars = [compose(CAR, effects) for effects in ([law], [other], [])]
    for found, expected, before in zip(*map(runs.predict, cars), strict=True):
        kept = slice(300, None)  # both begin at rest on the road there, which a slope is not
        assert np.std((found - expected)[kept]) < 0.01 * np.std((before - expected)[kept])


@pytest.mark.slow
def test_it_is_a_car_with_one_more_coordinate_in_each_suspension() -> None:
    check_alike(chosen(draft_of("sprung").effect, {
        "stiffness_n_per_m": STIFFNESS_N_PER_M, "frequency_hz": HZ, "damping_ratio": RATIO, "square_per_m": 0.0}),
        chosen(InMatrices(), {"size": 1.0}))


def test_geared_rigidly_it_has_the_kinetic_energy_of_the_travel() -> None:
    found = compose(CAR, [chosen(draft_of("rigid").effect, {"inertance_kg": 8.0})]).structure
    plain, ahead_m = compose(CAR).structure, CAR.front.cg_distance_m
    # Heave 0.3, pitch 0.1, front wheel -0.2, rear wheel 0.4: the travels' rates by hand.
    rates = np.array([0.3, 0.1, -0.2, 0.4])
    assert CAR.rear is not None
    travels_mps = np.array([0.3 + 0.1 * ahead_m + 0.2, 0.3 - 0.1 * CAR.rear.cg_distance_m - 0.4])
    more_j = 0.5 * rates @ (found.mass - plain.mass) @ rates
    assert more_j == pytest.approx(0.5 * 8.0 * travels_mps @ travels_mps)
    np.testing.assert_array_equal(found.stiffness, plain.stiffness)


@pytest.mark.parametrize("by_rate", [0.0, 0.1])
def test_turbulence_takes_energy_by_the_cube_of_the_speed(by_rate: float) -> None:
    """Held still, the column swings on its spring: d(b y'^2 / 2 + k y^2 / 2)/dt = -b (e |y'|^3 + 2 z w y'^2)."""
    draft = draft_of("sprung")
    assert isinstance(draft.effect, ForceEffect)
    reach_m = float(draft.functions.partition("REACH_M = ")[2].split()[0])
    p = SimpleNamespace(stiffness_n_per_m=STIFFNESS_N_PER_M, frequency_hz=HZ, square_per_m=200.0, damping_ratio=by_rate)
    motion, = draft.effect.laws(p, linear(1000.0)).motions
    assert motion.rates is not None
    omega = 2 * np.pi * HZ
    inertance_kg = STIFFNESS_N_PER_M / omega**2
    for y_m, y_mps in ((0.01, 0.3), (-0.02, -0.1), (0.0, 0.5)):
        seen = Seen(*[0.0] * 10, memory=(y_m / reach_m, y_mps / (reach_m * omega)))
        speed_mps, accel_mps2 = (reach_m * one for one in motion.rates(motion.p, seen))
        accel_mps2 *= omega
        power_w = inertance_kg * y_mps * accel_mps2 + STIFFNESS_N_PER_M * y_m * speed_mps
        lost_w = inertance_kg * (200.0 * abs(y_mps)**3 + 2 * by_rate * omega * y_mps**2)
        assert power_w == pytest.approx(-lost_w)
        assert motion.force(motion.p, seen) == pytest.approx(-STIFFNESS_N_PER_M * y_m)
