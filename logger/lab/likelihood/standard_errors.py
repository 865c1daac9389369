"""How certain the numbers of a fitted model are: standard errors from the information matrix.

The numbers of effects differ by many powers of ten (a cubic stiffness has 1e6, a ratio 1), so that the matrix is scaled
to a diagonal of ones before it is inverted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import own_slopes
from logger.vehicle.effect import Chosen
from logger.vehicle.effect_parameters import Move, coordinates_of, moves_of

Array = npt.NDArray[np.float64]


def standard_errors(found: LinearModel) -> tuple[tuple[Chosen, ...], Array]:
    """The effects of a fitted model with standard errors, and those of the logarithms of the car's numbers (p,).

    Both hold the priors: a number that the runs say nothing of is as uncertain as it was.
    """
    linear, state = found.without_wall(), found.state
    moves, slopes = moves_of(state.effects), own_slopes(linear)
    information = linear.information(state.logs, None if slopes is None else linear.whitened(slopes))
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    seen = size > 0
    scale = np.where(seen, size, 1.0)
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-10, hermitian=True)
    deviations = np.where(seen, np.sqrt(np.maximum(np.diag(inverse), 0.0)) / scale, np.inf)
    return with_errors(state.effects, moves, deviations[linear.count:]), deviations[: linear.count]


def with_errors(effects: Sequence[Chosen], moves: Sequence[Move], deviations: Array,
                share: float = 1e-4) -> tuple[Chosen, ...]:
    """The effects with standard errors, of which those of the numbers that moved are given on their scales (m,);
    scales are straight over such a share of a number."""
    errors: list[Mapping[str, float]] = [{} for _ in effects]
    for move, here, deviation in zip(moves, coordinates_of(effects, moves), deviations, strict=True):
        parameter = effects[move.effect].effect.parameters[move.parameter]
        step = share * max(abs(here), share)
        # At a bound a value goes one way only: it rises by so much over the way that it went.
        high, low = parameter.value(here + step), parameter.value(here - step)
        way = abs(parameter.coordinate(high) - parameter.coordinate(low))
        rise = abs(high - low) / way if way > 0 else 0.0
        errors[move.effect] = {**errors[move.effect], parameter.name: float(rise * deviation)}
    return tuple(replace(one, standard_errors=found) for one, found in zip(effects, errors, strict=True))
