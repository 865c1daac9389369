"""Roads and routes without any length are refused before anything is laid on them."""

from __future__ import annotations

import numpy as np
import pytest

from logger.fleet.road_map import pieces_of
from logger.roads.road_matching import measures


def test_roads_without_a_length_are_refused() -> None:
    point = np.array([46.5, 46.5]), np.array([6.5, 6.5])
    with pytest.raises(ValueError, match="expected a line with a length"):
        pieces_of([point])
    street = np.array([46.5, 46.501]), np.array([6.5, 6.5])
    assert set(pieces_of([point, street]).road.tolist()) == {1}


def test_a_route_without_a_length_has_no_measures() -> None:
    with pytest.raises(ValueError, match="expected a line with a length"):
        measures(np.array([46.5, 46.5]), np.array([6.5, 6.5]), None, None)
