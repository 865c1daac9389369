"""Maximum a posteriori fits: the car's numbers, the effects' numbers and the distance errors together.

Problem: twenty candidates are to be fitted in full, each together with a dozen numbers of the car and some hundred of
the distance errors, in seconds. Solution: the derivatives by the numbers of the car and of the distance errors hardly
depend on the candidate, so that they are computed once for a model and kept while candidates are tried
(``LinearModel``). Only the effect's own derivatives are computed again in each Levenberg-Marquardt step, and every step
is judged by a full prediction. Then the model is linearised again at the distances that were found, with new weights.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from logger.arrays import Array
from logger.bounds import CONFLICT_SIGMA
from logger.fitting.levenberg_marquardt import Damping, minimise
from logger.lab.likelihood.lag import RESOLVED_M, offset_by_correlation_m, offset_by_lag_m
from logger.lab.likelihood.linear_model import LinearModel, RecordErrorFit, whitened
from logger.lab.likelihood.posterior import NotSimulated, Posterior, State, derivatives
from logger.lab.likelihood.signals import JointWhitener
from logger.profiles.track import Track
from logger.vehicle.effect import Chosen, Parameter
from logger.vehicle.named_parameters import (
    FreeParameter,
    coordinates_of,
    free_parameters_of,
    slope_of,
    steps_of,
    with_coordinates,
)
from logger.vehicle.uncertain import dimensions_of

CONVERGED = 2.0
"""A round of a fit that gains less than this in minus twice a log-likelihood is its last: a fifth of what distinguishes
two models (``selection.evidence``)."""
_STEPS = 5
"""Levenberg-Marquardt steps between two linearisations. A judgement: a fit goes on at the next one."""
_ALIGNING_SHARE = 0.02
"""Alignment in the course of a fit ends with a round that gains a smaller share of the whole gain: the fit aligns again
in its next round."""
_NEAR_M = 0.02
"""A smaller distance error is within the reach of first-order alignment: a quarter of the shortest wave at walking
pace."""


def fit(start: LinearModel, numbers: Sequence[Array] | None = None, rounds: int = 6, min_gain: float = 0.0,
        at_most: int = 0) -> LinearModel:
    """A model fitted in full, linearised at its maximum.

    numbers     derivatives by the car's numbers taken near the start; None: they are taken now
    at_most     rounds, if more: after ``rounds`` that gained each takes derivatives of its own
    min_gain    a round that gains less is the last, if that is more than ``CONVERGED``
    """
    posterior, fresh = start.posterior, numbers is None
    numbers = posterior.number_slopes(start.state, posterior.prior.steps) if numbers is None else numbers
    free_parameters = free_parameters_of(start.state.effects)
    best = now = start.with_number_slopes(numbers)
    least = best.score
    enough = max(CONVERGED, min_gain)
    last = max(rounds, at_most)
    for done in range(1, last + 1):
        now = relinearise(posterior, optimise_numbers(now, now.state, free_parameters), numbers, least)
        gained = least - now.score
        if gained > 0:
            best, least = now, now.score
        if done == last or (gained < enough and fresh):
            break
        if gained < enough or done == 1 or done >= rounds:
            fresh, numbers = True, posterior.number_slopes(best.state, _fine_steps(best))
            now = best = best.with_number_slopes(numbers)
    return best


def fit_to_the_end(start: LinearModel, numbers: Sequence[Array] | None = None) -> LinearModel:
    """A model fitted until nothing is gained any more. A search has no time for it: where a law bends all that the car
    does, as play in its dampers does, the derivatives of one round say little of the next, and the rounds of ``fit``
    end on the way. It begins again where it ended, with derivatives over the prior's steps: those over fine steps may
    stop in a ripple of the score."""
    found = fit(start, numbers, at_most=40)
    while (again := fit(found, at_most=40)).score < found.score - CONVERGED:
        found = again
    return found


def fit_rounded_readings(found: LinearModel) -> LinearModel:
    """A fitted model fitted again with its rounded readings taken for bounds; itself where rounding is noise."""
    posterior = found.posterior.with_rounding_at(found.state)
    return found if posterior is found.posterior else fit(LinearModel(posterior, found.state), found.numbers)


def fit_model(posterior: Posterior, start: State, numbers: Sequence[Array] | None = None) -> LinearModel:
    """A model aligned, fitted to the end, and fitted again with its rounded readings taken for bounds; ``numbers`` as
    of ``fit``. What is left to gain of the car's own numbers would be credited to whatever is tried on top."""
    return fit_rounded_readings(fit_to_the_end(align(posterior, start), numbers))


def relinearise(posterior: Posterior, state: State, numbers: Sequence[Array] | None, least: float) -> LinearModel:
    """The model linearised at a state that was fitted to first order; aligned again where its score is above the least
    so far, because its distances moved too far for first order."""
    found = LinearModel(posterior, posterior.state_at(state.effects, state.logs, state.record, state.size), numbers)
    if found.score < least:
        return found
    return _align_from(found.with_number_slopes(None), _ALIGNING_SHARE).with_number_slopes(numbers)


def align(posterior: Posterior, state: State, min_share: float = 0.0) -> LinearModel:
    """Fit the distance errors of a state alone, and linearise there: from the state's own, from those that the lags
    amount to, and for runs with uncertain places from those at which all of a run correlates most; the likeliest of
    these.

    min_share    a round that gains a smaller share of the whole gain is the last
    """
    best = _align_from(LinearModel(posterior, state), min_share)
    begins = [one for one in (_align_by_lag(posterior, state, min_share),
                              _align_by_correlation(posterior, state, min_share)) if one is not None]
    if not begins:
        return best
    best = min(best, *begins, key=lambda one: one.score)
    for _ in range(2):
        found = _align_by_lag(posterior, best.state, min_share)
        if found is None or found.score > best.score - CONVERGED:
            break
        best = found
    return best


def _align_by_correlation(posterior: Posterior, state: State, min_share: float) -> LinearModel | None:
    """Alignment from constant distance errors at which each run with uncertain places correlates most with the model;
    None where these are 0."""
    record, moves = [], False
    for run, error, k, prediction in zip(posterior.runs.runs, posterior.record_errors, state.record, state.predictions,
                                         strict=True):
        off_m = run.facts.place_std_m or 0.0
        if off_m > RESOLVED_M and isinstance(run.track, Track):
            distance_error_m = error.distance_error_m(k)
            farther_m = offset_by_correlation_m(
                run.distance_m + distance_error_m, run.measured_mps2, run.main(prediction),
                (run.track.start_m, run.track.end_m), CONFLICT_SIGMA * off_m)
            if farther_m:
                k, moves = error.coefficients_of(distance_error_m + farther_m), True
        record.append(k)
    if not moves:
        return None
    there = posterior.state_at(state.effects, state.logs, record, state.size)
    return _align_by_lag(posterior, there, min_share) or _align_from(LinearModel(posterior, there), min_share)


def _align_by_lag(posterior: Posterior, state: State, min_share: float) -> LinearModel | None:
    """Alignment from ``record_by_lag``; None where that is."""
    record = record_by_lag(posterior, state)
    if record is None:
        return None
    followed = posterior.state_at(state.effects, state.logs, record, state.size)
    return _align_from(LinearModel(posterior, followed), min_share)


def record_by_lag(posterior: Posterior, state: State) -> list[Array] | None:
    """Record errors with the distance errors that a state's lags amount to; None where these are small enough to be
    found from the state itself."""
    farther_m = [offset_by_lag_m(run, one) for run, one in zip(posterior.runs.runs, state.predictions, strict=True)]
    if max(float(np.abs(one).max()) for one in farther_m) < _NEAR_M:
        return None
    return [error.coefficients_of(error.distance_error_m(k) + more) for error, k, more in zip(
        posterior.record_errors, state.record, farther_m, strict=True)]


def _align_from(start: LinearModel, min_share: float) -> LinearModel:
    """Gauss-Newton steps of the distance errors, each with their most likely size, as long as they gain or promise
    enough."""
    best = now = start
    first = least = start.score
    for _ in range(40):
        state, found = now.state, now.fit_record_errors(now.state.predictions)
        if found.gain < CONVERGED:
            break
        now = LinearModel(now.posterior, now.posterior.state_at(state.effects, state.logs, found.record, now.size))
        gained = least - now.score
        if gained > 0:
            best, least = now, now.score
        if gained < max(CONVERGED, min_share * (first - least)):
            break
    return best


@dataclass(frozen=True, eq=False)
class _Point:
    """A point of a fit: its predictions, made with these record errors, the most likely record errors near them, and
    half of the objective."""

    effects: tuple[Chosen, ...]
    logs: Array
    record: list[Array]
    predictions: list[Array]
    fit: RecordErrorFit
    cost: float


def optimise_numbers(linear: LinearModel, state: State, free_parameters: Sequence[FreeParameter],
                     small_gain: float = 0.15) -> State:
    """Levenberg-Marquardt steps on the car's numbers and the free ones of the effects, with the most likely distance
    errors to first order at each. A car that cannot be simulated, as its numbers are too far off, is no step."""
    own: list[Array] | None = None
    p = linear.count
    known: tuple[Array, _Point, list[Array]] | None = None
    here, evaluated = linear, list[_Point]()
    realigns = any(state.effects[free.effect].effect.realigns for free in free_parameters)
    predict = linear.posterior.predictor(state)

    def evaluate(x: Array) -> _Point:
        effects, logs = with_coordinates(state.effects, free_parameters, x[p:]), x[:p] if p else state.logs
        record = linear.state.record
        if realigns and known is not None:
            # The distance error compensates an effect that shifts a run: predicted without it, no step would gain.
            there, at, slopes = known
            predictions = [one + (x - there)[p:] @ columns for one, columns in zip(at.predictions, slopes, strict=True)]
            record = linear.fit_record_errors(predictions, at.record).record
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                predictions = predict(effects, logs, record)
                found = linear.fit_record_errors(predictions, record)
        except NotSimulated:
            if not evaluated:  # where a fit begins is a car
                raise
            return replace(evaluated[0], cost=np.inf)
        evaluated[:] = [_Point(effects, logs, record, predictions, found,
                               0.5 * (found.squares + linear.prior.cost(logs)))]
        return evaluated[0]

    def normal_equations(x: Array, at: _Point, fresh: bool) -> tuple[Array, Array]:
        nonlocal own, known, here
        if free_parameters and fresh:
            slopes = effect_slopes(linear.posterior, at.effects, at.logs, free_parameters, at.record, own)
            known = x.copy(), at, slopes
            if linear.prior.is_vague:
                here, freed = without_common_scale(linear, at.effects, free_parameters, slopes)
                slopes = freed or slopes
            own = linear.whitened(slopes)
        information = here.information(own)
        information[p:, p:] += unseen
        return here.gradient(at.fit.residuals, at.logs, own), information

    # A number that the runs say nothing of would be moved by roundings: its step is damped by what its range says.
    unseen = np.diag([range_of(state.effects[free.effect].effect.parameters[free.parameter])**-2.0
                      for free in free_parameters])
    start = np.concatenate([state.logs[:p], coordinates_of(state.effects, free_parameters)])
    # Where numbers are not known, the scale of all masses and forces is held by the prior of one of them alone, and
    # where a force was measured by that of its sensor's gain: a step that is damped by what the runs say of each moves
    # it by next to nothing, and looks like the last.
    by_priors = linear.prior.is_vague or linear.posterior.shows_forces
    damping = Damping(first=Damping.least) if by_priors else Damping()
    ends = np.array([*linear.posterior.ends.T[:p], *(ends_of(
        state.effects[free.effect].effect.parameters[free.parameter]) for free in free_parameters)]).reshape(-1, 2)
    best = minimise(start, evaluate, normal_equations, small_gain=lambda _at: small_gain, most_rounds=_STEPS,
                    low=ends[:, 0], high=ends[:, 1], damping=damping).at
    return State(best.effects, best.logs, best.fit.record, linear.size, best.predictions)


def ends_of(parameter: Parameter) -> tuple[float, float]:
    """Ends of a parameter's range on the scale that fits move on, the lower one first."""
    first, last = sorted(map(parameter.coordinate, (parameter.low, parameter.high)))
    return first, last


def range_of(parameter: Parameter) -> float:
    """Width of a parameter's range on the scale that fits move on; infinite where it has no end."""
    low, high = ends_of(parameter)
    return high - low


def effect_slopes(posterior: Posterior, effects: Sequence[Chosen], logs: Array,
                  free_parameters: Sequence[FreeParameter], record: Sequence[Array], white: Sequence[Array] | None
                  ) -> list[Array]:
    """Derivatives of predictions by the effects' numbers, on the scales of the parameters: (m, n) per run, with these
    record errors, by differences of rough simulations, which are near enough.

    white    such derivatives taken nearby, whitened (m, kept) per run, by which steps are ``_fine``: a stop of which
             the place is a hundredth of a millimetre off changes all that comes after a blow, and not in proportion.
             None: they are not known
    """
    near = posterior.beginnings(effects, logs, record)
    predict = partial(posterior.predict, logs=logs, record=record, rough=True, near=near)
    steps = steps_of(effects, free_parameters)
    if white is not None:
        steps = _fine(steps, sum((one**2).sum(axis=1) for one in white))
    return derivatives(lambda there: predict(with_coordinates(effects, free_parameters, there)),
                       coordinates_of(effects, free_parameters), steps, predict(effects))


def own_slopes(posterior: Posterior, state: State, whiteners: Sequence[JointWhitener]) -> list[Array] | None:
    """Derivatives of a state's predictions by the numbers of its effects: (m, n) per run; None where none is free."""
    free_parameters = free_parameters_of(state.effects)
    if not free_parameters:
        return None
    slopes, given = None, (state.effects, state.logs, free_parameters, state.record)
    for _ in range(2):
        slopes = effect_slopes(posterior, *given, None if slopes is None else whitened(
            posterior, whiteners, slopes, state.predictions))
    return slopes


def without_common_scale(linear: LinearModel, effects: Sequence[Chosen], free_parameters: Sequence[FreeParameter],
                         own: list[Array] | None) -> tuple[LinearModel, list[Array] | None]:
    """The model and the derivatives by the numbers of its effects (m, n), per run, without a common scale of all
    masses and forces but that of the forces that drive a rig: a car in which they are larger by one factor moves the
    same. Differences over steps do not show that exactly, least of all of a mode that little damps, or of dry friction,
    which sticks and slips: they would seem to measure a size that only the prior knows, or the force. A force among the
    signals shows the size."""
    if linear.numbers is None or linear.posterior.measures_forces:
        return linear, own
    return with_dimensions(linear, effects, free_parameters, own, linear.posterior.size_slopes(linear.state))


def with_dimensions(linear: LinearModel, effects: Sequence[Chosen], free_parameters: Sequence[FreeParameter],
                    own: list[Array] | None, wanted: Sequence[Array]) -> tuple[LinearModel, list[Array] | None]:
    """The model and the derivatives by the effects' free numbers (m, n), per run, as dimensional analysis has them (E.
    Buckingham, Physical Review 4, 1914). A user's own effects may have units that nobody knows: there they stay.

    wanted    (1, n) per run, the derivative by the logarithm of all masses and forces together; (2, n): then that by
              all lengths and forces
    """
    if linear.numbers is None or any(one.file for one in effects):
        return linear, own
    names, per_log = [*linear.prior.names], [1.0] * len(linear.prior.names)
    for free in free_parameters:
        parameter = effects[free.effect].effect.parameters[free.parameter]
        value = effects[free.effect].values[parameter.name]
        names.append(parameter.name)
        per_log.append(value * slope_of(parameter, value))
    slopes = linear.numbers if own is None else list(map(np.vstack, zip(linear.numbers, own, strict=True)))
    # What moves nothing, such as a stop out of reach, bears no part of what the differences are off by.
    by_log = (np.array(per_log) * np.any([one.any(axis=1) for one in slopes], axis=0))[:, None]
    powers = np.array([dimensions_of(name)[: len(wanted[0])] for name in names], float) * (by_log != 0)
    share = np.linalg.pinv(powers).T / np.where(by_log == 0, 1.0, by_log)
    freed = [one - share @ (powers.T @ (by_log * one) - right) for one, right in zip(slopes, wanted, strict=True)]
    p = linear.count
    return linear.with_number_slopes([one[:p] for one in freed]), None if own is None else [one[p:] for one in freed]


def _fine_steps(linear: LinearModel) -> Array:
    """Difference steps of the logarithms of the car's numbers (p,)."""
    return _fine(linear.posterior.prior.steps, np.diag(linear.information()))


def _fine(steps: Array, information: Array) -> Array:
    """Difference steps (m,) that are at most five standard deviations of each number alone, by its information (m,)."""
    return np.asarray(steps / np.maximum(np.abs(steps) * np.sqrt(information) / 5.0, 1.0))
