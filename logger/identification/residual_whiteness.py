"""Is there anything left in the residuals that a better model would have explained?

Two questions, two tests (Ljung 1999, 16.6). Residuals that are like their neighbours mean that the noise model misses
something, and that standard errors cannot be trusted. Residuals that follow the road mean that the car's model misses
something, and that the estimates themselves are biased.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

LAGS = 25
DOUBT = 0.01
"""A probability below this is taken as a no."""
_RANK = 1e-6


@dataclass(frozen=True)
class Test:
    """A sum of squares that has so many degrees of freedom when all is well, and how probable one so large then is.

    ``p_value`` is NaN where nothing could be tested.
    """

    statistic: float
    degrees: int
    p_value: float

    @property
    def passed(self) -> bool:
        """Whether nothing speaks against it."""
        return not self.p_value < DOUBT


UNTESTED = Test(0.0, 0, float("nan"))


def autocorrelation(white: Sequence[Array], fitted: int, lags: int = LAGS) -> Test:
    """Whether residuals [(n,), ...] are uncorrelated over 1 to ``lags`` samples (G. M. Ljung and G. E. P. Box 1978).

    fitted    numbers of the noise model beyond its power, which take so many degrees of freedom; lags grow by them
    """
    count, power = sum(map(len, white)), sum(float(one @ one) for one in white)
    reach = min(lags + fitted, min(map(len, white)) - 1)
    if power <= 0 or reach <= fitted:
        return UNTESTED
    at = np.arange(1, reach + 1)
    correlations = np.array([sum(float(one[lag:] @ one[:-lag]) for one in white) for lag in at]) / power
    return _test(count * (count + 2) * float((correlations**2 / (count - at)).sum()), reach - fitted)


def cross_correlation(
    white: Sequence[Array], inputs: Sequence[Array], sensitivities: Array, lags: int = LAGS
) -> Test:
    """Whether residuals [(n,), ...] owe anything to the inputs [(n, w), ...] of 0 to ``lags`` samples before.

    inputs           behind the same low-pass and noise model as the residuals
    sensitivities    (N, p): what the fit could explain by its numbers has been explained and is left out
    """
    columns = np.concatenate([_lagged(one, lags) for one in inputs])
    columns = columns - sensitivities @ np.linalg.lstsq(sensitivities, columns, rcond=None)[0]
    joined = np.concatenate(white)
    lengths = np.sqrt((columns**2).sum(axis=0))
    if not (joined.any() and lengths.any()):
        return UNTESTED
    basis, values, _ = np.linalg.svd(columns / lengths.max(), full_matrices=False)
    basis = basis[:, values > _RANK * values[0]]
    variance = float(joined @ joined) / len(joined)
    return _test(float(((basis.T @ joined) ** 2).sum()) / variance, basis.shape[1])


def _lagged(inputs: Array, lags: int) -> Array:
    """Inputs (n, w) of 0 to ``lags`` samples before (n, w (lags + 1)); 0 before the first one."""
    padded = np.concatenate([np.zeros((lags, inputs.shape[1])), inputs])
    return np.concatenate([padded[lags - lag : lags - lag + len(inputs)] for lag in range(lags + 1)], axis=1)


def _test(statistic: float, degrees: int) -> Test:
    from scipy.stats import chi2

    return Test(statistic, degrees, float(chi2.sf(statistic, degrees)))
