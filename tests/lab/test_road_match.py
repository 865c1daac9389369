"""Whether a run is of its road: answers are known, as the runs are made of a signal that is known."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfilt

from logger.lab.road_match import RoadMatch, better_placement, bounce_band_hz, pool, road_match
from logger.profiles.track import Track
from logger.runs import Run

Array = npt.NDArray[np.float64]
RATE_HZ, COUNT, SPEED_MPS = 100.0, 6000, 10.0
BAND_HZ = (0.5, 5.0)


def ride(seed: int, count: int = COUNT) -> Array:
    """What a body on springs makes of a random road: noise around 1.3 Hz (scipy's filters, not the lab's car)."""
    noise = np.random.default_rng(seed).normal(0, 1, count)
    return np.asarray(sosfilt(butter(1, (0.8, 2.0), "band", fs=RATE_HZ, output="sos"), noise))


def run_of(measured: Array) -> Run:
    speed = np.full(len(measured), SPEED_MPS)
    return Run("run", RATE_HZ, measured, np.arange(len(measured)) * SPEED_MPS / RATE_HZ, speed,
               Track(1.0, np.zeros(100)))


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000), gain=st.floats(0.3, 3.0), noise=st.floats(0.0, 0.5), late=st.integers(-60, 60))
def test_the_right_road_is_clear(seed: int, gain: float, noise: float, late: int) -> None:
    model = ride(seed)
    measured = gain * np.roll(model, late) + np.random.default_rng(seed + 1).normal(0, noise * model.std(), COUNT)
    found = road_match(run_of(measured), model, BAND_HZ)
    assert found.is_clear and not found.is_refuted and not found.is_upside_down
    assert found.gain == pytest.approx(gain, rel=0.1)
    turned = road_match(run_of(-measured), model, BAND_HZ)
    assert turned.is_upside_down and not turned.is_refuted


@pytest.mark.slow
def test_by_chance_one_road_in_a_thousand_is_taken_for_another() -> None:
    """Of unrelated pairs hardly any is above what chance gives, and nearly all are refuted."""
    found = [road_match(run_of(ride(2 * k)), ride(2 * k + 1), BAND_HZ) for k in range(300)]
    assert np.mean([one.is_refuted for one in found]) > 0.9
    assert np.mean([max(one.correlation, one.turned) > one.chance for one in found]) < 0.02
    assert not any(one.is_clear for one in found)
    assert all(pool(found[k:k + 3]).is_refuted for k in range(0, 300, 3))


def test_a_short_run_is_refused_by_itself_and_its_own_road_never() -> None:
    """Five seconds: the largest of chance may be above what the right road gives, and yet the two differ."""
    wrong, right = ([road_match(run_of(ride(2 * k, 500)), ride(2 * k + more, 500), BAND_HZ) for k in range(50)]
                    for more in (1, 0))
    assert not any(one.is_refuted for one in right)
    assert any(one.is_refuted and one.chance > one.expected for one in wrong)


def test_a_run_that_is_upside_down_half_a_bounce_later_is_told_from_one_that_is_not() -> None:
    turned = RoadMatch(correlation=0.84, turned=0.999, gain=1.0, chance=0.5, mean_chance=0.27, expected=0.5)
    assert turned.is_upside_down and not replace(turned, correlation=0.999, turned=0.84).is_upside_down
    assert not replace(turned, correlation=0.70, turned=0.75).is_upside_down


def test_where_the_sensor_is_all_noise_nothing_is_refuted() -> None:
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(0, 5.0, COUNT)
        assert not road_match(run_of(noise), ride(seed), BAND_HZ).is_refuted


@pytest.mark.slow
def test_where_it_fits_better_is_found() -> None:
    """A recording of one long road, 137 m farther along, forwards and backwards."""
    road = ride(5, 3 * COUNT)
    at = round(137.0 / SPEED_MPS * RATE_HZ)

    def predict(source: Array, farther_m: Array) -> Array:
        place = np.arange(COUNT) + farther_m / SPEED_MPS * RATE_HZ
        return np.interp(place, np.arange(len(source)), source, left=0.0, right=0.0)

    run = run_of(road[at:at + COUNT])
    length_m = 3 * COUNT * SPEED_MPS / RATE_HZ
    found = better_placement(run, lambda farther_m, backwards: predict(road[::-1] if backwards else road, farther_m),
                             BAND_HZ, (0.0, length_m))
    assert found is not None and not found.backwards
    assert found.farther_m == pytest.approx(137.0, abs=SPEED_MPS)
    other = ride(6, 3 * COUNT)
    assert better_placement(run, lambda farther_m, backwards: predict(other[::-1] if backwards else other, farther_m),
                            BAND_HZ, (0.0, length_m)) is None


def test_the_band_holds_bounce_and_pitch() -> None:
    low_hz, high_hz = bounce_band_hz(np.array([1.1, 1.5]))
    assert low_hz < 1.1 / 2 and 2 * 1.5 < high_hz < 8.0
