"""Effects on the road, against what they say done by hand to its profile; and a law of a smoothed one against SciPy."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d, uniform_filter1d

from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.smoothed_profile import FAMILY
from logger.profiles.excitation import Excitation
from logger.profiles.track import Track
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose, recorded
from logger.vehicle.effect import Parameter, RoadEffect, Scale, chosen
from logger.vehicle.simulate import Passage

from ..support.lab.runs_with_residual import rough_track
from ..support.lab.secret_runs import posterior_of, secret_runs

CAR = read_vehicle(vehicle_file("rav4-2009"))
DISTANCE_M = 2.0 + 10.0 * np.arange(400) / 100
STEP_M = 0.05


class Raises(RoadEffect):
    name = "raises"
    title = source = signature = shown_by = "words"
    parameters = (Parameter("size", 1.0, 0.0, 10.0, 0.0, Scale.LINEAR, (1.0,), "how much"),)

    def __init__(self, stage: int = 0) -> None:
        self.stage, self.name = stage, f"raises_{stage}"

    def road(self, p: SimpleNamespace, spacing_m: float, elevation_m: np.ndarray) -> np.ndarray:
        return (1.0 + p.size * spacing_m) * elevation_m + 0.01 * self.stage * np.roll(elevation_m, 3) ** 2


@pytest.mark.parametrize("tracks", [1, 2])
def test_the_wheels_meet_the_road_and_not_its_profile(tracks: int) -> None:
    profile = rough_track(80.0, 1)
    height = profile.elevation_m.reshape(len(profile.elevation_m), -1)[:, 0]
    written = height if tracks == 1 else np.stack([height, 0.5 * height], axis=1)
    by_hand = (1.0 + 2.0 * profile.spacing_m) * written
    by_hand = (1.0 + 3.0 * profile.spacing_m) * by_hand + 0.01 * np.roll(by_hand, 3, axis=0) ** 2
    effects = [chosen(Raises(1), {"size": 3.0}), chosen(Raises(), {"size": 2.0})]
    passages = [Passage(Track(profile.spacing_m, one), 100.0, DISTANCE_M) for one in (written, by_hand)]
    plain = recorded(compose(CAR), passages[0])
    found, expected = recorded(compose(CAR, effects), passages[0]), recorded(compose(CAR), passages[1])
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)
    assert np.abs(found - plain).max() > 0.01
    np.testing.assert_array_equal(recorded(compose(CAR), passages[0]), plain)  # nothing of it stays


def test_a_rig_does_what_it_was_commanded() -> None:
    rig = Passage(Excitation(100.0, 0.01 * np.sin(np.arange(400) / 7)), 100.0, np.zeros(400))
    np.testing.assert_array_equal(recorded(compose(CAR, [chosen(Raises(), {"size": 2.0})]), rig),
                                  recorded(compose(CAR), rig))


@pytest.mark.parametrize(("name", "size_m", "share"), [("spread_m", 0.1, 0.05), ("base_m", 0.35, 0.15)])
def test_a_smoothed_profile_is_undone(name: str, size_m: float, share: float) -> None:
    """SciPy smooths a road between its flat ends, and the law gives it back; but for waves near one of which a mean
    leaves nothing, and the rounding of a file."""
    rng = np.random.default_rng(3)
    road = 0.01 * gaussian_filter1d(rng.standard_normal(4000), 0.15 / STEP_M) + 0.2 * np.linspace(0, 1, 4000) ** 2
    smoothed = np.round(gaussian_filter1d(road, size_m / STEP_M, mode="nearest") if name == "spread_m" else
                        uniform_filter1d(road, round(size_m / STEP_M), mode="nearest"), 6)
    posterior = posterior_of(secret_runs())
    effect, = (one.effect for one in FAMILY.drafts(LawContext(posterior, posterior.start()))
               if one.parameters[0].name == name)
    assert isinstance(effect, RoadEffect)
    found = effect.road(SimpleNamespace(**{name: size_m}), STEP_M, smoothed)
    kept = slice(100, -100)
    assert np.std((found - road)[kept]) < share * np.std((smoothed - road)[kept])
    np.testing.assert_allclose(effect.road(SimpleNamespace(**{name: 0.0}), STEP_M, smoothed), smoothed, atol=1e-9)
