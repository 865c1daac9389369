"""Obstacles in closed form: against quadrature, against densely sampled profiles, and by their differences."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from logger.identification.unknown_inputs import Bump, Obstacle, ObstaclePath, RoadStep
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
    path = one.path(patch_m)
    edges = [one.start_m, one.start_m + one.length_m]

    def averaged(x: float) -> float:
        inside = [edge for edge in edges if abs(edge - x) < patch_m / 2]
        return quad(lambda u: height(one, u), x - patch_m / 2, x + patch_m / 2, points=inside or None)[0] / patch_m

    places = np.array([one.start_m - 1, one.start_m - 0.1, one.start_m + 0.02, one.start_m + 0.11, 5.0, 5.2, 7.0])
    elevation, mean = path.step_means(places)
    assert elevation == pytest.approx([averaged(x) for x in places], abs=1e-9)
    for low, high, reported in zip(places[:-1], places[1:], mean, strict=True):
        x = np.linspace(low, high, 2001)
        assert reported == pytest.approx(np.trapezoid([averaged(one) for one in x[::20]], x[::20]) / (high - low),
        abs=4e-4)


@pytest.mark.parametrize("one", OBSTACLES)
def test_against_a_dense_profile(one: Obstacle) -> None:
    place = np.arange(-5.0, 12.0, 0.0005)
    dense = Track(0.0005, np.array([height(one, x) for x in place]), place[0]).tire_paths(0.25)[0]
    for reported, expected in zip(one.path(0.25).step_means(WAY), dense.step_means(WAY), strict=True):
        assert reported == pytest.approx(expected, abs=3e-4 * abs(one.height_m) / 0.25)


@given(st.floats(-3, 6), st.floats(0.01, 0.3), st.floats(0.3, 5), st.floats(0.01, 0.4))
@settings(max_examples=30)
def test_slopes_are_those_of_the_path(start_m: float, height_m: float, width_m: float, patch_m: float) -> None:
    for kind, numbers in ((Bump, [start_m, height_m, width_m]), (RoadStep, [start_m, height_m])):
        slopes = kind(*numbers).slopes(patch_m)
        for index, name in enumerate(["start_m", "height_m", "width_m"][: len(numbers)]):
            step = 1e-5 * (np.arange(len(numbers)) == index)
            ends: list[ObstaclePath] = [kind(*(numbers + sign * step)).path(patch_m) for sign in (-1, 1)]
            pairs = zip(slopes[name].step_means(WAY), ends[1].step_means(WAY), ends[0].step_means(WAY), strict=True)
            for reported, high, low in pairs:
                difference = (high - low) / 2e-5
                edge = np.abs(reported - difference) > 1e-3 * max(1.0, np.abs(difference).max())
                assert edge.mean() < 0.01


@pytest.mark.parametrize("wrong", [
    (Bump, 0.0, 0.1, 0.0), (Bump, 0.0, 0.0, 1.0), (RoadStep, 0.0, 0.0), (RoadStep, 0.0, 2.0),
])
def test_what_is_none(wrong: tuple[type[Bump] | type[RoadStep], float]) -> None:
    with pytest.raises(ValueError, match="expected"):
        wrong[0](*wrong[1:])
