"""Statistics beside those of scipy."""

import numpy as np
import pytest
from scipy import stats

from logger.lab.residuals.statistics import rank_correlation


@pytest.mark.parametrize("count", [8, 9, 300])
@pytest.mark.parametrize("decimals", [0, 9])  # with equals among them, and without
@pytest.mark.parametrize("slope", [-0.5, 0.0, 0.3])
def test_rank_correlations_are_spearmans(count: int, decimals: int, slope: float) -> None:
    one, noise = np.random.default_rng(count).normal(size=(2, count))
    one, other = np.round([one, slope * one + noise], decimals)
    expected = stats.spearmanr(one, other)
    assert rank_correlation(one, other) == pytest.approx((expected.statistic, expected.pvalue), rel=1e-9)


def test_ranks_that_all_rise_or_fall_leave_nothing_to_chance() -> None:
    rising = np.arange(20.0)
    assert rank_correlation(rising, np.exp(rising)) == pytest.approx((1.0, 0.0))
    assert rank_correlation(rising, -(rising**3)) == pytest.approx((-1.0, 0.0))
    assert np.isnan(rank_correlation(rising, 0 * rising)).all()
