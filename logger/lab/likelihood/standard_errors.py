"""Standard errors of the numbers of a fitted model, from the information matrix.

On a rig squares are weighed by one level, and the noise of its measured input goes through the model: friction and
stops make more of it than of all other noise, and the fit follows it. There the covariance is that of the estimates
themselves (H. White, Econometrica 50, 1982): of the gradient under the noise as it is, between two inverses of the
information. The noise of the readings has the residual's power in each band; that of the input is drawn. What measured
the input has a gain as well: lengths and velocities of effects are known no better than the motion. Clock and gains of
the recorder, which a fit lets differ from run to run, are the same in all: more runs do not average them. What is
missing is no noise: some stretches call for one value of a number, others for another, and by what they contradict each
other the errors are larger (K.-Y. Liang and S. Zeger, Biometrika 73, 1986). Differences over steps do not show exactly
that a larger car under larger forces moves the same; the derivatives are made to.

The numbers of effects differ by many powers of ten (a cubic stiffness has 1e6, a ratio 1), so that the matrix is scaled
to a diagonal of ones before it is inverted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import own_slopes, range_of, with_dimensions
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.whittle import BLOCK_S
from logger.runs import are_on_rig
from logger.simulation.virtual_drive import begins_unknown
from logger.vehicle.effect import Chosen, Sought
from logger.vehicle.named_parameters import FreeParameter, coordinates_of, free_parameters_of, read, slope_of
from logger.vehicle.uncertain import NumberErrors, dimensions_of

_SCALE = "sprung_mass_kg"


@dataclass(frozen=True, eq=False)
class StandardErrors:
    """Standard errors of a fitted model.

    effects    its effects, with those of their numbers; larger than the whole range of a number: infinite
    logs       of the logarithms of the car's numbers (p,), and their covariance (p, p)
    numbers    of all numbers of car and effects, in their own units, with their correlations
    """

    effects: tuple[Chosen, ...]
    logs: Array
    covariance: Array
    numbers: NumberErrors


def standard_errors(found: LinearModel) -> StandardErrors:
    """Standard errors of a fitted model, with the priors: a number of the car that the runs say nothing of is as
    uncertain as before."""
    linear, state = found, found.state
    covariance = _covariance(linear)
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    own, free_parameters = deviations[linear.count:], free_parameters_of(state.effects)
    ranges = [range_of(state.effects[free.effect].effect.parameters[free.parameter]) for free in free_parameters]
    effects = with_standard_errors(state.effects, free_parameters, np.where(own < ranges, own, np.inf))
    p = linear.count
    return StandardErrors(effects, deviations[:p], covariance[:p, :p], _number_errors(linear, covariance))


def deviations_from_null(one: Chosen, errors: NumberErrors | None = None) -> float:
    """By how many standard errors an effect is from doing nothing (A. Wald's test), by the strength of which that is
    most; infinite where none has a standard error. The sprung mass is taken as it is: a factor that all masses and
    forces share says nothing of whether there is a force.

    errors    of all numbers, with their correlations; None: the effect is judged alone
    """
    found = []
    errors = errors or NumberErrors({})
    names, matrix = list(errors.standard_errors), errors.matrix()
    mass = names.index(_SCALE) if _SCALE in names else None
    for parameter in one.effect.parameters:
        value, error = one.values[parameter.name], one.standard_errors.get(parameter.name, np.inf)
        name = f"{one.effect.name}.{parameter.name}"
        if mass is not None and name in names:
            error *= float(np.sqrt(max(1 - matrix[names.index(name), mass]**2, 0.0)))
        none = parameter.low if parameter.name in one.effect.also_by else parameter.null
        if none is not None and 0 < error < np.inf:
            null = 0.0 if np.isinf(none) else parameter.coordinate(none)
            found.append(abs((parameter.coordinate(value) - null) / (error * slope_of(parameter, value))))
    return max(found, default=float("inf"))


def _number_errors(linear: LinearModel, covariance: Array) -> NumberErrors:
    """Standard errors and correlations in the numbers' own units, by their covariance on the scales of the fit."""
    prior, state = linear.posterior.prior, linear.state
    vehicle = prior.vehicle(linear.posterior.vehicle, state.logs)
    names, units = list(prior.names), [read(vehicle, name) for name in prior.names]
    for free in free_parameters_of(state.effects):
        one = state.effects[free.effect]
        parameter = one.effect.parameters[free.parameter]
        names.append(f"{one.effect.name}.{parameter.name}")
        units.append(1 / slope_of(parameter, one.values[parameter.name]))
    return NumberErrors.of_covariance(names, covariance * np.outer(units, units))


def _covariance(linear: LinearModel) -> Array:
    """Covariance of the logarithms of the car's numbers, then of the effects' numbers on their scales; infinite where
    nothing is known."""
    free = linear.posterior.with_free_gains()
    if free is not linear.posterior:  # what a sensor may be off by, all that it scales is
        linear = LinearModel(free, linear.state, linear.numbers, linear.whiteners)
    posterior, state, on_rig = linear.posterior, linear.state, are_on_rig(linear.posterior.runs.runs)
    slopes, gained = own_slopes(posterior, state, linear.whiteners), posterior.carried_gain(state) if on_rig else []
    if not posterior.measures_forces:  # which no motion is, as what follows has it
        wanted = posterior.size_slopes(state, gained if _frees_all_lengths(posterior, state) else ())
        linear, slopes = with_dimensions(linear, state.effects, free_parameters_of(state.effects), slopes, wanted)
    information = linear.information(None if slopes is None else linear.whitened(slopes))
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    known = size > 0
    scale = np.where(known, size, 1.0)
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-10, hermitian=True) / np.outer(scale, scale)
    if on_rig:
        scatter, pulls = _scatter(linear, slopes, gained)
        inverse = inverse @ with_contradictions(information + scatter, pulls) @ inverse
    return np.asarray(np.where(np.outer(known, known), inverse, np.diag(np.where(known, 0.0, np.inf))))


def _frees_all_lengths(posterior: Posterior, state: State) -> bool:
    """Whether nothing that stays as it is has a length: on a rig without places, which begins at rest and of which no
    tire lifts off, as gravity stays; laws that were learned have curves, whose lengths stay."""
    fixed = [(name, value) for one in state.effects for name, value in one.values.items()
             if name not in {free.name for free in one.freed}]
    car, runs = posterior.car(state.effects, state.logs), posterior.runs.runs
    return (are_on_rig(runs) and not any(begins_unknown(car, run) for run in runs)
            and not car.structure.behind_m.any() and all(one.tire_pulls for one in car.laws)
            and not any(one.effect.sought is Sought.NEVER for one in state.effects)
            and not any(value and dimensions_of(name)[1] for name, value in fixed if np.isfinite(value)))


def with_contradictions(covariance: Array, pulls: Array) -> Array:
    """The covariance (m, m) of a gradient, larger where the gradients (stretches, m) of stretches contradict each other
    by more than it and chance make: by more than the largest eigenvalue of as many draws of it (I. Johnstone, Annals of
    Statistics 29, 2001)."""
    size = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(size > 0, size, 1.0)
    values, ways = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = values > 1e-10 * values[-1]
    count, free = int(kept.sum()), len(pulls) - 1
    if free < 2 or not count:
        return covariance
    root, inverse = (scale**way * (ways[:, kept].T * np.sqrt(values[kept])[:, None]**way) for way in (1, -1))
    drawn = (pulls - pulls.mean(axis=0)) @ inverse.T
    values, ways = np.linalg.eigh(drawn.T @ drawn * (len(pulls) / free))
    sides = np.sqrt([free - 1, count])  # 2.02: the 99th percentile of C. Tracy and H. Widom's distribution
    chance = sides.sum() * (sides.sum() + 2.02 * (1 / sides).sum() ** (1 / 3)) / free
    more = root.T @ ways * np.sqrt(np.where(values > chance, values - 1, 0.0))
    return np.asarray(covariance + more @ more.T)


def _scatter(linear: LinearModel, slopes: list[Array] | None, gained: Sequence[Array]) -> tuple[Array, Array]:
    """Covariance of the gradient of a rig's fit by the numbers of the car, and by those whose derivatives (m, n) per
    run these are, less the information: (p + m, p + m); and the gradients of stretches (stretches, p + m). ``gained``
    is what the input's gain carries (n,) per run."""
    posterior, state = linear.posterior, linear.state
    parts = [one for one in (linear.numbers, slopes) if one is not None]
    columns = linear.without_record_errors([np.vstack(one) for one in zip(*parts, strict=True)])
    # The standard error of a standard deviation by so many draws is 1 / sqrt(2 n) of it, a sixth.
    drawn = [posterior.carried_noise(state, draw) for draw in range(18)]
    found = np.zeros((len(columns[0]), len(columns[0])))
    pulls, gain_pull, stretches = np.zeros((len(drawn), len(found))), np.zeros(len(found)), []
    for run, (bands, residual) in enumerate(zip(posterior.bands, posterior.residuals(state), strict=True)):
        carried = np.mean([bands.power(one[run]) for one in drawn], axis=0)
        own, white = bands.scatter_whitener(residual, carried)(columns[run]), linear.whiteners[run](columns[run])
        pulls += np.stack([linear.whiteners[run](one[run]) for one in drawn]) @ white.T
        gain_pull += white @ linear.whiteners[run](gained[run])
        found += own @ own.T - white @ white.T
        each = linear.whiteners[run].in_time(columns[run]) * linear.whiteners[run].in_time(residual)
        by_time = each.reshape(len(found), len(bands.each), -1).sum(axis=1)
        # Longer than a rig remembers what moved it, some seconds.
        count = max(1, round(by_time.shape[1] / (2 * BLOCK_S * posterior.runs.runs[run].rate_hz)))
        stretches += [one.sum(axis=1) for one in np.array_split(by_time, count, axis=1)]
    for pull in (by_run := linear.pulls_of_instruments(columns)):
        found -= sum(np.outer(one, one) for one in pull.values())
    for instrument in {one: None for pull in by_run for one in pull}:
        both = sum(pull[instrument] for pull in by_run if instrument in pull)
        found += np.outer(both, both)
    return found + pulls.T @ pulls / len(drawn) + np.outer(gain_pull, gain_pull), np.array(stretches)


def with_standard_errors(effects: Sequence[Chosen], free_parameters: Sequence[FreeParameter], deviations: Array
                         ) -> tuple[Chosen, ...]:
    """The effects with standard errors of their numbers, given those of the free ones on their scales (m,); scales are
    linear over a ten-thousandth of a number."""
    errors: list[Mapping[str, float]] = [{} for _ in effects]
    coordinates = coordinates_of(effects, free_parameters)
    for free, here, deviation in zip(free_parameters, coordinates, deviations, strict=True):
        parameter = effects[free.effect].effect.parameters[free.parameter]
        step = 1e-4 * max(abs(here), 1e-4)
        # At a bound a value goes one way only: it rises by so much over the way that it went.
        high, low = parameter.value(here + step), parameter.value(here - step)
        way = abs(parameter.coordinate(high) - parameter.coordinate(low))
        rise = abs(high - low) / way if way > 0 else 0.0
        errors[free.effect] = {**errors[free.effect], parameter.name: float(rise * deviation)}
    return tuple(replace(one, standard_errors=found) for one, found in zip(effects, errors, strict=True))
