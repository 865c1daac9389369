"""Maximum a posteriori fits: the car's numbers, the effects' numbers and the distance errors together.

Problem: twenty candidates are to be fitted in full, each together with a dozen numbers of the car and some hundred of
the distance errors, in seconds. Solution: what the numbers of the car and the distance errors do to a prediction hardly
depends on the candidate, so it is computed once for a model and kept while candidates are tried (``LinearModel``). Only
the effect's own slopes are taken anew in each of Levenberg and Marquardt's steps, and every step is judged by a true
prediction. Then the road is laid out anew where the distances are now, and weights and slopes follow the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from logger.fitting.levenberg_marquardt import minimise
from logger.lab.likelihood.lag import followed_m, shift_m
from logger.lab.likelihood.linear_model import Eliminated, LinearModel
from logger.lab.likelihood.posterior import Posterior, State
from logger.profiles.track import Track
from logger.vehicle.effect import Chosen
from logger.vehicle.effect_parameters import Move, coordinates_of, moved, moves_of, steps_of

Array = npt.NDArray[np.float64]

CONVERGED = 2.0
"""A round of a fit that gains less than this in minus twice a log-likelihood is its last."""
_STEPS = 5
"""Of Levenberg and Marquardt's, before slopes are taken anew."""
_WORTH_ALIGNING = 0.02
"""Of an alignment in the course of a fit, a round that gains a smaller share of what is gained is the last."""
_FAR_M, _REACH_SIGMA = 0.1, 4.0
"""Places that may be farther off than a fifth of the shortest wave that is felt are looked for within so many standard
deviations."""
_NEAR_M = 0.02
"""A model that lies no farther off than this, a quarter of the shortest wave at walking pace, is aligned to the same
places."""


@dataclass(frozen=True, eq=False)
class MapFit:
    """What is kept of a fitted model; the linear model beside it takes much memory.

    state      laid out
    numbers    slopes by the car's numbers (p, n) per run, taken near it
    score      minus twice the log of its evidence
    """

    posterior: Posterior
    state: State
    numbers: list[Array]
    score: float

    @staticmethod
    def of(linear: LinearModel) -> MapFit:
        """The state that a model is linear beside."""
        return MapFit(linear.posterior, linear.state, list(linear.numbers or ()), linear.score)

    def linear(self, as_sized: bool = False) -> LinearModel:
        """The model beside its state, made anew; ``as_sized``: with distance errors of the size that they have."""
        residuals = self.posterior.residuals(self.state)
        whiteners = [one.whitener(residual) for one, residual in zip(self.posterior.bands, residuals, strict=True)]
        return LinearModel(self.posterior, self.state, self.numbers, whiteners if as_sized else None)


def fit(start: LinearModel, numbers: Sequence[Array] | None = None, rounds: int = 6,
        worth: float = 0.0) -> LinearModel:
    """A model fitted in full, beside its state.

    numbers    slopes by the car's numbers taken near the start; None: they are taken now
    worth      what a round has to gain to be worth another one, if that is more than ``CONVERGED``
    """
    posterior, fresh = start.posterior, numbers is None
    numbers = posterior.number_slopes(start.state, posterior.prior.steps) if numbers is None else numbers
    moves = moves_of(start.state.effects)
    best = now = start.by(numbers)
    least = best.score
    enough = max(CONVERGED, worth)
    for done in range(1, rounds + 1):
        now = laid_out(posterior, minimised(now, now.state, moves), numbers, least)
        gained = least - now.score
        if gained > 0:
            best, least = now, now.score
        if done == rounds or (gained < enough and fresh):
            break
        if gained < enough or done == 1:
            fresh, numbers = True, posterior.number_slopes(best.state, _fine_steps(best))
            now = best = best.by(numbers)
    return best


def read_beside(found: LinearModel) -> LinearModel:
    """A fitted model with rounded readings that say what they do beside it, fitted to these; itself where none do."""
    posterior = found.posterior.beside(found.state)
    return found if posterior is found.posterior else fit(LinearModel(posterior, found.state), found.numbers)


def laid_out(posterior: Posterior, state: State, numbers: Sequence[Array] | None, least: float) -> LinearModel:
    """A state that was fitted to first order, laid out where its distances are; aligned anew where that is not as good
    as the least score so far, because they are far from where they were."""
    found = LinearModel(posterior, posterior.at(state.effects, state.logs, state.record, state.size), numbers)
    return found if found.score < least else _aligned_from(found.by(None), _WORTH_ALIGNING).by(numbers)


def aligned(posterior: Posterior, state: State, worth: float = 0.0) -> LinearModel:
    """A state with the distance errors alone fitted: from where it has them, or where the runs are followed along the
    road, from there or from where they lie after that, whichever is likeliest. Runs whose places may be far off are
    tried where all of each is most like the model as well."""
    best = _aligned_from(LinearModel(posterior, state), worth)
    begins = [one for one in (_followed(posterior, state, worth), _shifted(posterior, state, worth)) if one is not None]
    if not begins:
        return best
    best = min(best, *begins, key=lambda one: one.score)
    for _ in range(2):
        found = _followed(posterior, best.state, worth)
        if found is None or found.score > best.score - CONVERGED:
            break
        best = found
    return best


def _shifted(posterior: Posterior, state: State, worth: float) -> LinearModel | None:
    """A state with the runs that say that they may be far off laid where they are most like the model, followed along
    the road from there, and aligned; None where they lie there already."""
    record, moves = [], False
    for run, error, k, prediction in zip(posterior.runs.runs, posterior.record_errors, state.record, state.predictions,
                                         strict=True):
        off_m = run.facts.place_std_m or 0.0
        if off_m > _FAR_M and isinstance(run.track, Track):
            moved_m = error.moved_m(k)
            farther_m = shift_m(run.distance_m + moved_m, run.measured_mps2, run.main(prediction),
                                (run.track.start_m, run.track.end_m), _REACH_SIGMA * off_m)
            if farther_m:
                k, moves = error.through(moved_m + farther_m), True
        record.append(k)
    if not moves:
        return None
    there = posterior.at(state.effects, state.logs, record, state.size)
    return _followed(posterior, there, worth) or _aligned_from(LinearModel(posterior, there), worth)


def _followed(posterior: Posterior, state: State, worth: float) -> LinearModel | None:
    """A state with the runs followed along the road, and aligned there; None where they lie as near as an alignment
    needs."""
    farther_m = [followed_m(run, one) for run, one in zip(posterior.runs.runs, state.predictions, strict=True)]
    if max(float(np.abs(one).max()) for one in farther_m) < _NEAR_M:
        return None
    record = [error.through(error.moved_m(k) + more) for error, k, more in zip(
        posterior.record_errors, state.record, farther_m, strict=True)]
    followed = posterior.at(state.effects, state.logs, record, state.size)
    return _aligned_from(LinearModel(posterior, followed), worth)


def _aligned_from(start: LinearModel, worth: float, most: int = 40) -> LinearModel:
    best = now = start
    first = least = start.score
    for _ in range(most):
        state, found = now.state, now.eliminated(now.state.predictions)
        now = LinearModel(now.posterior, now.posterior.at(state.effects, state.logs, found.record, now.size))
        gained = least - now.score
        if gained > 0:
            best, least = now, now.score
        if gained < max(CONVERGED, worth * (first - least)):
            break
    return best


@dataclass(frozen=True, eq=False)
class _Point:
    """A model beside a linear one: its predictions, laid out with these record errors, the likeliest ones beside them,
    and half of what is minimised."""

    effects: tuple[Chosen, ...]
    logs: Array
    record: list[Array]
    predictions: list[Array]
    beside: Eliminated
    cost: float


def minimised(linear: LinearModel, state: State, moves: Sequence[Move], small_gain: float = 0.15) -> State:
    """Levenberg and Marquardt's steps on the car's numbers and those of the effects that move, with the most likely
    distance errors to first order at each; at most so many."""
    own: list[Array] | None = None
    p = linear.count
    known: tuple[Array, _Point, list[Array]] | None = None
    realigns = any(state.effects[move.effect].effect.realigns for move in moves)
    predict = linear.posterior.predictor(state)

    def evaluate(x: Array) -> _Point:
        effects, logs = moved(state.effects, moves, x[p:]), x[:p] if p else state.logs
        record = linear.state.record
        if realigns and known is not None:
            # What moves all of a run is made up for by its distance error: laid out without it, no step would be taken.
            there, at, slopes = known
            predictions = [one + (x - there)[p:] @ columns for one, columns in zip(at.predictions, slopes, strict=True)]
            record = linear.eliminated(predictions, at.record).record
        predictions = predict(effects, logs, record)
        beside = linear.eliminated(predictions, record)
        return _Point(effects, logs, record, predictions, beside, 0.5 * (beside.squares + linear.prior.cost(logs)))

    def normal_equations(x: Array, at: _Point, fresh: bool) -> tuple[Array, Array]:
        nonlocal own, known
        if moves and fresh:
            slopes = effect_slopes(linear, at.effects, at.logs, moves, at.record, at.predictions)
            own, known = linear.whitened(slopes), (x.copy(), at, slopes)
        return linear.gradient(at.beside.residuals, at.logs, own), linear.information(at.logs, own)

    start = np.concatenate([state.logs[:p], coordinates_of(state.effects, moves)])
    best = minimise(start, evaluate, normal_equations, small_gain=lambda _at: small_gain, most_rounds=_STEPS).at
    return State(best.effects, best.logs, best.beside.record, linear.size, best.predictions)


def effect_slopes(linear: LinearModel, effects: Sequence[Chosen], logs: Array, moves: Sequence[Move],
                  record: Sequence[Array], fine: Sequence[Array]) -> list[Array]:
    """What the effects' numbers do to predictions, on the scales of the parameters: (m, n) per run, laid out with these
    record errors. They are known well enough by a rough simulation.

    fine    predictions (n,) per run that are known already; a car that does not rub needs no others
    """
    posterior = linear.posterior
    predict = partial(posterior.predict, logs=logs, record=record, rough=True)
    before = predict(effects) if posterior.car(effects, logs).rubs else fine
    here = coordinates_of(effects, moves)
    found = [np.empty((len(moves), len(one))) for one in before]
    for index, step in enumerate(steps_of(effects, moves)):
        there = here.copy()
        there[index] += step
        for column, high, low in zip(found, predict(moved(effects, moves, there)), before, strict=True):
            column[index] = (high - low) / step
    return found


def own_slopes(linear: LinearModel) -> list[Array] | None:
    """What the numbers of a model's own effects do to its predictions: (m, n) per run; None where none moves."""
    state = linear.state
    moves = moves_of(state.effects)
    return effect_slopes(linear, state.effects, state.logs, moves, state.record, state.predictions) if moves else None


def _fine_steps(linear: LinearModel) -> Array:
    """Of the logarithms of the car's numbers (p,): at most five deviations, once these are known."""
    sizes = np.sqrt(np.diag(linear.information(linear.state.logs)))
    return np.minimum(linear.posterior.prior.steps, 5.0 / sizes)
