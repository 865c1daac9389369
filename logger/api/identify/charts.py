"""A fit as pictures: its residuals, and which numbers can be estimated only together."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import numpy.typing as npt

from logger.api.identify.words import NORMAL_95
from logger.chart_data import Bars, Chart, Curves, Line
from logger.identification.prediction_error_fit import Fit
from logger.identification.unknown_road.road_fit import RoadFit

Array = npt.NDArray[np.float64]

_LAGS, _MOST_PAIRS = 50, 12


def charts(fit: Fit | RoadFit) -> list[Chart]:
    """Of a fit on measured roads the residuals' autocorrelation, with the band that chance stays in; of every fit with
    two numbers or more how they hang together."""
    pairs = _correlations(fit)
    return [*([_left(fit.white)] if isinstance(fit, Fit) else []), *([pairs] if pairs.bars else [])]


def _left(white: list[Array]) -> Curves:
    """G. M. Ljung and G. E. P. Box 1978: of white residuals each is nearly normal, of variance 1 / n."""
    count, power = sum(map(len, white)), max(sum(float(one @ one) for one in white), 1e-300)
    lags = np.arange(1, min(_LAGS, min(map(len, white)) - 1) + 1)
    found = np.array([sum(float(one[lag:] @ one[:-lag]) for one in white) for lag in lags]) / power
    bound = np.full(len(lags), NORMAL_95 / np.sqrt(count))
    return Curves("Autocorrelation of the residuals", "lag [samples]", "correlation", (
        Line("residuals", lags.astype(np.float64), found),
        Line("95 % of chance", lags.astype(np.float64), bound, faint=True),
        Line("", lags.astype(np.float64), -bound, faint=True)), (0.0, ""))


def _correlations(fit: Fit | RoadFit) -> Bars:
    names = fit.names if isinstance(fit, RoadFit) else list(fit.parameters)
    errors = np.sqrt(np.maximum(np.diag(fit.covariance), 1e-300))
    correlation = fit.covariance / np.outer(errors, errors)
    pairs = [(f"{names[i]}, {names[j]}", float(correlation[i, j])) for i, j in combinations(range(len(names)), 2)]
    pairs.sort(key=lambda pair: -abs(pair[1]))
    return Bars("Numbers that err together", "correlation of their errors", tuple(pairs[:_MOST_PAIRS]))
