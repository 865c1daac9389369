import numpy as np
import pytest

from logger.roads.obstacles import speed_bump


def test_a_bump_is_a_raised_cosine() -> None:
    at = np.array([9.9, 10.0, 10.9, 11.8, 12.7, 13.6, 13.7])
    assert speed_bump(at, 10.0, 0.08, 3.6) == pytest.approx([0, 0, 0.04, 0.08, 0.04, 0, 0])


def test_a_bump_needs_a_width() -> None:
    for width_m in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="width above 0"):
            speed_bump([0.0], 0.0, 0.1, width_m)
