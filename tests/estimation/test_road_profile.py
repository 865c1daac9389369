"""Pieces with known waves in them, joined, and what is left of each wave."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from logger.estimation.batch import RESOLVED_SHARE, band_passed, road_profile
from logger.estimation.streaming import RoadPiece

SPACING_M = 0.15
POINTS = 50
PIECE_M = SPACING_M * POINTS


def cut(
    road: Callable[[np.ndarray], np.ndarray], numbers: range, reported: tuple[float, float] = (1.0, 50.0)
) -> list[RoadPiece]:
    """Pieces of a road, each at a height of its own."""
    rng = np.random.default_rng(4)
    return [
        RoadPiece(number * PIECE_M, SPACING_M,
                  road(number * PIECE_M + SPACING_M * np.arange(POINTS + 1)) + rng.uniform(-9, 9), *reported)
        for number in numbers
    ]


def wave(length_m: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda x: np.sin(2 * np.pi * x / length_m + 1.0)


def test_pieces_at_any_height_join_to_the_road() -> None:
    pieces = cut(lambda x: wave(10.0)(x) + 0.5 * wave(3.0)(x) + 0.02 * x, range(-3, 60))
    profile = road_profile(pieces)
    assert profile is not None
    assert (profile.shortest_m, profile.longest_m, profile.left_out_m) == (1.0, 50.0, 0.0)
    part, = profile.parts
    assert (part.start_m, part.length_m) == (pytest.approx(-3 * PIECE_M), pytest.approx(63 * PIECE_M))
    x = part.start_m + part.spacing_m * np.arange(len(part.elevation_m))
    inside = slice(700, -700)
    expected = wave(10.0)(x) + 0.5 * wave(3.0)(x)
    assert part.elevation_m[inside] == pytest.approx(expected[inside], abs=0.01)


@pytest.mark.parametrize(("length_m", "left"), [
    (10.0, 1.0), (100.0, 1 / (1 + 2**8)), (50.0, 0.5), (1.0, 0.5), (2 / 3, 0.0376), (33.3, 0.96), (1.5, 0.96),
])
def test_what_is_left_of_a_wave(length_m: float, left: float) -> None:
    x = SPACING_M * np.arange(8000)
    passed = band_passed(wave(length_m)(x), SPACING_M, 1.0, 50.0)
    inside = slice(1000, -1000)
    assert passed[inside] == pytest.approx(left * wave(length_m)(x)[inside], abs=0.01)


def test_a_hill_leaves_nothing_at_the_ends() -> None:
    x = SPACING_M * np.arange(3000)
    assert np.abs(band_passed(500 + 0.07 * x, SPACING_M, 1.0, 50.0)).max() < 1e-9


def test_a_missing_piece_begins_another_part_and_short_parts_are_left_out() -> None:
    road = wave(10.0)
    pieces = cut(road, range(20)) + cut(road, range(22, 25)) + cut(road, range(30, 45))
    unknown = RoadPiece(20 * PIECE_M, SPACING_M, np.zeros(POINTS + 1), float("nan"), float("nan"))
    pieces.insert(20, unknown)
    profile = road_profile(pieces)
    assert profile is not None
    assert [part.start_m for part in profile.parts] == pytest.approx([0.0, 30 * PIECE_M])
    assert [part.length_m for part in profile.parts] == pytest.approx([20 * PIECE_M, 15 * PIECE_M])
    assert profile.left_out_m == pytest.approx(3 * PIECE_M)


def test_the_range_is_reported_over_most_of_the_way() -> None:
    road = wave(10.0)
    pieces = cut(road, range(70), (0.5, 30.0)) + cut(road, range(70, 100), (0.8, 20.0))
    profile = road_profile(pieces)
    assert profile is not None
    assert np.mean([piece.shortest_m <= profile.shortest_m for piece in pieces]) >= RESOLVED_SHARE
    assert np.mean([piece.longest_m >= profile.longest_m for piece in pieces]) >= RESOLVED_SHARE
    assert (profile.shortest_m, profile.longest_m) == (0.8, 20.0)


def test_very_long_waves_are_no_road() -> None:
    profile = road_profile(cut(wave(10.0), range(40), (0.5, 400.0)))
    assert profile is not None
    assert profile.longest_m == pytest.approx(100.0)


def test_no_profile_where_too_little_is_reported() -> None:
    nothing = cut(wave(10.0), range(40), (float("nan"), float("nan")))
    assert road_profile([]) is None
    assert road_profile(nothing) is None
    mixed = nothing[:15] + cut(wave(10.0), range(15, 40))
    assert road_profile(mixed) is None
    crossed = cut(wave(10.0), range(20), (1.0, 3.0)) + cut(wave(10.0), range(20, 40), (5.0, 50.0))
    assert road_profile(crossed) is None
