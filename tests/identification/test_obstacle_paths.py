"""Obstacles as tires meet them: against quadrature and against densely sampled profiles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import quad

from logger.identification.unknown_inputs import Bump, Obstacle, RoadStep
from logger.profiles.track import Track

Array = npt.NDArray[np.float64]

WAY = np.concatenate([np.linspace(-2, 9, 700), np.full(3, 9.0), np.linspace(9, 4, 90)])
OBSTACLES = [Bump(3.0, 0.15, 2.6), Bump(2.2, -0.05, 0.4), RoadStep(4.1, 0.038), RoadStep(1.0, -0.02)]


def height(one: Obstacle, x: float) -> float:
    if isinstance(one, RoadStep):
        return one.height_m if x >= one.start_m else 0.0
    inside = 0 <= x - one.start_m <= one.width_m
    return one.height_m / 2 * (1 - np.cos(2 * np.pi * (x - one.start_m) / one.width_m)) if inside else 0.0


@pytest.mark.parametrize("one", OBSTACLES)
@pytest.mark.parametrize("patch_m", [0.05, 0.25])
def test_against_quadrature(one: Obstacle, patch_m: float) -> None:
    path, = one.track.tire_paths(patch_m)
    edges = [one.start_m, one.start_m + one.length_m]

    def averaged(x: float) -> float:
        inside = [edge for edge in edges if abs(edge - x) < patch_m / 2]
        return quad(lambda u: height(one, u), x - patch_m / 2, x + patch_m / 2, points=inside or None)[0] / patch_m

    places = np.array([one.start_m - 1, one.start_m - 0.1, one.start_m + 0.02, one.start_m + 0.11, 5.0, 5.2, 7.0])
    elevation, mean = path.step_means(places)
    assert elevation == pytest.approx([averaged(x) for x in places], abs=1e-6 * abs(one.height_m))
    for low, high, reported in zip(places[:-1], places[1:], mean, strict=True):
        x = np.linspace(low, high, 2001)
        assert reported == pytest.approx(np.trapezoid([averaged(one) for one in x[::20]], x[::20]) / (high - low),
        abs=4e-4)


@pytest.mark.parametrize("one", OBSTACLES)
def test_against_a_dense_profile(one: Obstacle) -> None:
    place = np.arange(-5.0, 12.0, 0.0005)
    dense = Track(0.0005, np.array([height(one, x) for x in place]), place[0]).tire_paths(0.25)[0]
    for reported, expected in zip(one.track.tire_paths(0.25)[0].step_means(WAY), dense.step_means(WAY), strict=True):
        assert reported == pytest.approx(expected, abs=3e-4 * abs(one.height_m) / 0.25)


@pytest.mark.parametrize("wrong", [
    (Bump, 0.0, 0.1, 0.0), (Bump, 0.0, 0.0, 1.0), (RoadStep, 0.0, 0.0), (RoadStep, 0.0, 2.0),
])
def test_what_is_none(wrong: tuple[type[Bump] | type[RoadStep], float]) -> None:
    with pytest.raises(ValueError, match="expected"):
        wrong[0](*wrong[1:])
