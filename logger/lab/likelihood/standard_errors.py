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
from logger.vehicle.effect_parameters import Move, coordinates_of, moves_of, slope_of
from logger.vehicle.named_parameters import read
from logger.vehicle.uncertain import NumberErrors

Array = npt.NDArray[np.float64]


def standard_errors(found: LinearModel) -> tuple[tuple[Chosen, ...], Array]:
    """The effects of a fitted model with standard errors, and those of the logarithms of the car's numbers (p,).

    Both hold the priors: a number that the runs say nothing of is as uncertain as it was.
    """
    linear, state = found.without_wall(), found.state
    covariance = _covariance(linear)
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return (with_errors(state.effects, moves_of(state.effects), deviations[linear.count:]),
            deviations[: linear.count])


def number_errors(found: LinearModel) -> NumberErrors:
    """How far the numbers of the car and of its effects may be off together, in their own units; as
    ``standard_errors``."""
    linear, state = found.without_wall(), found.state
    prior, moves = linear.posterior.prior, moves_of(state.effects)
    vehicle = prior.vehicle(linear.posterior.vehicle, state.logs)
    names, units = list(prior.names), [read(vehicle, name) for name in prior.names]
    for move in moves:
        one = state.effects[move.effect]
        parameter = one.effect.parameters[move.parameter]
        names.append(f"{one.effect.name}.{parameter.name}")
        units.append(1 / slope_of(parameter, one.values[parameter.name]))
    return NumberErrors.of_covariance(names, _covariance(linear) * np.outer(units, units))


def _covariance(linear: LinearModel) -> Array:
    """Of the logarithms of the car's numbers, then of those of the effects on their scales; infinite where nothing is
    known."""
    slopes, state = own_slopes(linear), linear.state
    information = linear.information(state.logs, None if slopes is None else linear.whitened(slopes))
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    seen = size > 0
    scale = np.where(seen, size, 1.0)
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-10, hermitian=True)
    return np.asarray(np.where(np.outer(seen, seen), inverse / np.outer(scale, scale),
                               np.diag(np.where(seen, 0.0, np.inf))))


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
