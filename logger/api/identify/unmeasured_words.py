"""A fit without a measured road, in plain words and for a program."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from logger.api.identify.words import NORMAL_95
from logger.identification.unknown_road.marginal_likelihood import GD_N0, NOISE, OFFSET
from logger.identification.unknown_road.road_fit import RoadFit
from logger.vehicle.named_parameters import Free

_UNITS = {GD_N0: "cm3", NOISE: "m/s2", OFFSET: "m"}
_MENTIONED = 0.7
_DOUBTFUL = 0.1


def as_json(fit: RoadFit, free: Sequence[Free]) -> dict[str, Any]:
    """All of it for a program."""
    return {
        "parameters": fit.parameters, "standard_errors": fit.standard_errors,
        "error_before": _finite(fit.error_before), "error_after": _finite(fit.error_after), "converged": fit.converged,
        "start": {one.name: one.start for one in free}, "bounds": {one.name: [one.low, one.high] for one in free},
        "road": fit.roads, "road_standard_errors": fit.road_errors,
        "correlation": {first: {second: float(value) for second, value in zip(fit.names, row, strict=True)}
                        for first, row in zip(fit.names, _correlation(fit), strict=True)},
        "at_bound": fit.at_bound, "iterations": fit.iterations,
        "cannot_tell": [finding.words for finding in fit.verdict],
    }


def lines(fit: RoadFit, free: Sequence[Free]) -> Iterator[str]:
    """What a person reads."""
    yield (f"Converged in {fit.iterations} steps." if fit.converged else
           f"NOT CONVERGED in {fit.iterations} steps: do not use these values; start nearer (--start) or free less.")
    yield (f"Residual over the most probable road, rms over that of the readings: {fit.error_before:.4f} before, "
           f"{fit.error_after:.4f} after.")
    yield ""
    width = max(map(len, [*fit.parameters, *fit.roads]))
    yield f"{'parameter':{width}} {'start':>10} {'estimate':>10} {'std. error':>11}   {'95 % interval':^21}"
    for one in free:
        value, error = fit.parameters[one.name], fit.standard_errors[one.name]
        mark = "  AT ITS BOUND" if one.name in fit.at_bound else ""
        yield f"{one.name:{width}} {one.start:10.5g} {value:10.6g} {error:11.3g}   {_between(value, error)}{mark}"
    for name, value in fit.roads.items():
        error = fit.road_errors[name]
        unit = _UNITS.get(name.rpartition(".")[2], "")
        yield f"{name:{width}} {'':10} {value:10.4g} {error:11.3g}   {_between(value, error)}  {unit}"
    yield ""
    yield from _limits(fit, free)


def _between(value: float, error: float) -> str:
    return f"{value - NORMAL_95 * error:9.5g} to {value + NORMAL_95 * error:9.5g}"


def _limits(fit: RoadFit, free: Sequence[Free]) -> Iterator[str]:
    correlation = _correlation(fit)
    pairs = sorted(((abs(correlation[i, j]), correlation[i, j], fit.names[i], fit.names[j])
                    for j in range(len(fit.names)) for i in range(j)), reverse=True)
    if large := [f"{first} and {second} {value:+.2f}" for size, value, first, second in pairs if size > _MENTIONED]:
        yield f"Estimates that err together (correlation beyond {_MENTIONED:g}): {'; '.join(large)}."
    for finding in fit.verdict:
        yield f"Cannot tell: {finding.words}"
    sizes = [one.name for one in free if one.by_factors]
    vague = {name: fit.standard_errors[name] / abs(fit.parameters[name]) for name in sizes}
    if rough := [f"{name} ({share:.0%})" for name, share in vague.items() if share > _DOUBTFUL]:
        yield (f"Poorly determined without the road's profile: {', '.join(rough)}. Several drives over one road at "
               "different speeds (--same-road) determine them better.")
    yield ("The road is assumed to be one of ISO 8608 with this waviness; bumps, holes or a spectrum of another shape "
           "bias the estimates. Masses, springs and dampers are known only relative to those that were held fixed.")


def _correlation(fit: RoadFit) -> np.ndarray:
    deviations = np.sqrt(np.maximum(np.diag(fit.covariance), 1e-300))
    return np.asarray(fit.covariance / np.outer(deviations, deviations))


def _finite(error: float) -> float | None:
    return error if np.isfinite(error) else None
