"""A sensor that lies loose, beside a mass that is followed in its own coordinates, step by step."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import decimate, firwin, lfilter

from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.loose_sensor import FAMILY
from logger.vehicle.effect import RecordEffect, Recording, chosen

from ...support.lab.secret_runs import posterior_of, secret_runs

RATE_HZ, FINE = 100.0, 80
HELD_MPS2 = 3.0


def thrown(body_m: np.ndarray, step_s: float, held_mps2: float) -> np.ndarray:
    """Acceleration of a mass that is pressed down onto a body (n,) and never below it, by its place alone."""
    place, rate = body_m[0], 0.0
    places = np.empty_like(body_m)
    for k, floor in enumerate(body_m):
        rate -= held_mps2 * step_s
        place += rate * step_s
        if place < floor:  # it is carried, and leaves with the speed of the body
            rate, place = (floor - body_m[k - 1]) / step_s if k else 0.0, floor
        places[k] = place
    return np.gradient(np.gradient(places, step_s), step_s)


def effect() -> RecordEffect:
    found = FAMILY._draft(HELD_MPS2, 10.0).effect
    assert isinstance(found, RecordEffect)
    return found


def test_nothing_is_tried_where_the_residual_is_noise() -> None:
    posterior = posterior_of(secret_runs())
    assert not FAMILY.drafts(LawContext(posterior, posterior.start()))


@pytest.mark.slow
@pytest.mark.parametrize(("share", "upwards"), [(0.95, True), (0.995, False)])
def test_what_holds_it_is_found_closely_whether_blows_or_flights_are_most_of_it(share: float, upwards: bool) -> None:
    """In a long flight the record stays behind, downwards, and the residual is skewed the other way."""
    held_mps2 = max(float(np.quantile(-run.measured_mps2, share)) for run in secret_runs().runs)
    posterior = posterior_of(secret_runs([chosen(effect(), {"held_mps2": held_mps2})]))
    context = LawContext(posterior, posterior.start())
    assert (np.mean(np.concatenate(context.residuals) ** 3) > 0) == upwards
    draft, = FAMILY.drafts(context)
    assert draft.parameters[0].start == pytest.approx(held_mps2, rel=0.02)


def test_it_flies_and_lands_as_a_mass_does() -> None:
    time_s = np.arange(round(6 * RATE_HZ * FINE)) / (RATE_HZ * FINE)
    accel = 4.0 * np.sin(2 * np.pi * 2.0 * time_s) + 2.5 * np.sin(2 * np.pi * 5.3 * time_s + 1.0)
    step_s = time_s[1]
    rate = np.cumsum(accel) * step_s
    body_m = np.cumsum(rate - rate.mean()) * step_s
    fine = thrown(body_m, step_s, HELD_MPS2)
    taps = firwin(16 * FINE + 1, 40.0, fs=RATE_HZ * FINE)
    late = 8 * FINE

    def kept(signal: np.ndarray) -> np.ndarray:
        return np.asarray(lfilter(taps, 1.0, np.append(signal, np.zeros(late)))[late::FINE][: round(6 * RATE_HZ)])

    plain, expected = kept(accel), kept(fine)
    at_s = np.arange(len(plain)) / RATE_HZ
    found = effect().record(SimpleNamespace(held_mps2=HELD_MPS2), Recording(at_s, at_s, at_s, plain))
    inside = slice(50, -50)
    assert np.std((expected - plain)[inside]) > 1.0
    # Both are without what lies above 38 Hz, where their filters differ.
    low = [decimate(one, 4) for one in (found - expected, expected - plain)]
    assert np.std(low[0][10:-10]) < 0.1 * np.std(low[1][10:-10])


@pytest.mark.parametrize("held_mps2", [np.inf, 50.0])
def test_what_is_held_fast_stays(held_mps2: float) -> None:
    at_s = np.arange(600) / RATE_HZ
    accel = 5.0 * np.sin(7.0 * at_s)
    recording = Recording(at_s, at_s, at_s, accel)
    np.testing.assert_allclose(effect().record(SimpleNamespace(held_mps2=held_mps2), recording), accel, atol=1e-9)
