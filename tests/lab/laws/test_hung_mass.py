"""A mass on a spring at each wheel: beside a mass that is bolted to it, and beside Den Hartog's amplification."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.hung_mass import FAMILY
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.vehicle import Axle

from ...support.lab.secret_runs import CAR, posterior_of, secret_runs

MASS_KG, RATIO = 6.0, 0.12


def at_wheels(frequency_hz: float) -> Chosen:
    posterior = posterior_of(secret_runs())
    (draft,) = FAMILY.drafts(LawContext(posterior, posterior.start()))
    return chosen(draft.effect, {"mass_kg": MASS_KG, "frequency_hz": frequency_hz, "damping_ratio": RATIO})


def test_on_a_stiff_spring_it_is_a_heavier_wheel() -> None:
    def heavier(axle: Axle | None) -> Axle | None:
        return axle and replace(axle, unsprung_mass_kg=axle.unsprung_mass_kg + MASS_KG)

    front = heavier(CAR.front)
    assert front is not None
    runs = SimulatedRuns(secret_runs().runs)
    cars = (compose(CAR, [at_wheels(30.0)]), compose(replace(CAR, front=front, rear=heavier(CAR.rear))), compose(CAR))
    for hung, bolted, plain in zip(*map(runs.predict, cars), strict=True):
        # A spring of 30 Hz gives by (f / 30)^2: a fifth at a hop of 13 Hz, and less below.
        assert np.std((hung - bolted)[300:]) < 0.4 * np.std((plain - bolted)[300:])


def test_a_wheel_feels_the_amplified_mass() -> None:
    """Eliminated at a frequency, it weighs m (k + i w c) / (k - w2 m + i w c) (Den Hartog, section 3.2)."""
    hz = 11.0
    found, plain = compose(CAR, [at_wheels(hz)]).structure, compose(CAR).structure
    n = len(plain.mass)
    for at_hz in (3.0, 9.0, 14.0):
        w = 2 * np.pi * at_hz
        dynamic = found.stiffness + 1j * w * found.damping - w**2 * found.mass
        seen = dynamic[:n, :n] - dynamic[:n, n:] @ np.linalg.solve(dynamic[n:, n:], dynamic[n:, :n])
        own = 2 * np.pi * hz
        spring = MASS_KG * (own**2 + 2j * RATIO * own * w)
        felt_kg = MASS_KG * spring / (spring - MASS_KG * w**2)
        expected = plain.stiffness + 1j * w * plain.damping - w**2 * (
            plain.mass + felt_kg * plain.wheels.T @ plain.wheels)
        np.testing.assert_allclose(seen, expected, rtol=1e-9, atol=1e-6)
