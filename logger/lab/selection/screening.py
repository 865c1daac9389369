"""Effects tried on a model without a fit: would this one explain the residuals, and with which numbers?

Problem: most effects do nothing at their null and something quite different at each of their values, so that a slope at
zero strength says little about them (a shape such as a knee or a frequency has no meaning there). Solution: each is
simulated at a few trial values; what the car's own numbers and the distance errors could do as well is projected out
(a score test), and the trial that explains most, at the strength at which it does, is where a fit begins.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import aligned, own_slopes
from logger.lab.likelihood.noise_floor import gain_of_an_explanation
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.selection.holdout import HoldOut, held_out
from logger.runs import Run
from logger.vehicle.effect import Chosen, Effect, Misalignment, Scale, chosen
from logger.vehicle.effect_parameters import Move, coordinates_of, moved
from logger.vehicle.named_parameters import read

Array = npt.NDArray[np.float64]

# How much stronger or weaker than in a trial an effect is taken to be; what moves all waves alike may be tried with
# next to nothing.
_STRONGEST, _STRONGEST_IF_IT_REALIGNS, _WEAKEST = 10.0, 1000.0, 0.03


@dataclass(frozen=True, eq=False)
class _Quadratic:
    """A fitted model to second order, under a prior of the car's numbers.

    residuals      whitened (kept,) per run
    covariance     (p, p) of the car's numbers
    newton_step    (p,) the way to where these fit best
    objective      squares of the residuals there, and the cost of what is off
    """

    linear: LinearModel
    residuals: list[Array]
    covariance: Array
    newton_step: Array
    objective: float

    @staticmethod
    def of(linear: LinearModel) -> _Quadratic:
        """Of a model beside its state."""
        state = linear.state
        here = linear.eliminated(state.predictions)
        covariance = np.asarray(np.linalg.inv(linear.information(state.logs)), float)
        gradient = linear.gradient(here.residuals, state.logs)
        step = covariance @ gradient
        return _Quadratic(linear, here.residuals, covariance, step,
                          here.squares + linear.prior.cost(state.logs) - float(gradient @ step))


@dataclass(frozen=True, eq=False)
class Baseline:
    """A fitted model that effects are tried on.

    score          minus twice the log of its evidence
    explanation    what a full explanation of the residuals would gain
    rough          predictions of a rough simulation, for comparing with others
    quadratics     under the prior, and, where its wall holds a number, without the wall: a car that is bent to the wall
                   hides what effects do
    as_recorded    starts and factors of the distances are those of the record
    """

    score: float
    explanation: float
    rough: list[Array]
    quadratics: tuple[_Quadratic, ...]
    as_recorded: bool = False

    @staticmethod
    def of(linear: LinearModel, as_recorded: bool = False) -> Baseline:
        """Of a model beside its state."""
        state = linear.state
        quadratics = [_Quadratic.of(linear)]
        if linear.prior.at_the_wall(state.logs):
            quadratics.append(_Quadratic.of(linear.without_wall()))
        return Baseline(linear.score, gain_of_an_explanation(linear.posterior, state),
                        _roughly(linear, state.effects, state.logs), tuple(quadratics), as_recorded)

    @property
    def posterior(self) -> Posterior:
        """That which was fitted."""
        return self.linear.posterior

    @property
    def linear(self) -> LinearModel:
        """The model beside its state."""
        return self.quadratics[0].linear

    @property
    def state(self) -> State:
        """The model."""
        return self.linear.state

    @cached_property
    def hold_out(self) -> HoldOut:
        """The model on what its fit did not see."""
        return held_out(self.linear, own_slopes(self.linear))

    def gain(self, objective: float, logs: Array, linear: LinearModel) -> float:
        """By how much an objective is below this model's own; it was found under the prior of ``linear``, at these
        numbers of the car (p,)."""
        wall = self.posterior.prior.cost(logs) - linear.prior.cost(logs)
        return self.quadratics[0].objective - objective - wall


def as_recorded(base: Baseline) -> Baseline:
    """The model in the nominal car, with starts and factors of the distances as they were recorded."""
    posterior, state = base.posterior, base.state
    record = [error.without_trend(k) for error, k in zip(posterior.record_errors, state.record, strict=True)]
    there = posterior.at(state.effects, np.zeros_like(state.logs), record)
    numbers = posterior.number_slopes(there, posterior.prior.steps)
    return Baseline.of(LinearModel(posterior, there, numbers), as_recorded=True)


def others(state: State, name: str) -> tuple[Chosen, ...]:
    """The effects of a model but one."""
    return tuple(one for one in state.effects if one.effect.name != name)


def taken_out(now: Baseline, name: str) -> Baseline:
    """A model without one of its effects, all else as it was with it: whatever belongs in the place of that effect is
    found beside others that have not yet moved to make up for it."""
    posterior, state = now.posterior, now.state
    there = posterior.at(others(state, name), state.logs, state.record, state.size)
    return Baseline.of(LinearModel(posterior, there, posterior.number_slopes(there, posterior.prior.steps)))


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect at one set of values, and what it would do.

    gain      by how much minus twice the log of the evidence would fall, its numbers not counted
    logs      (p,) where the car's numbers are then
    change    what it does to the predictions at its values (n,), per run [m/s2]
    start     where a fit begins, if the runs lie elsewhere with it; None: beside the baseline
    """

    one: Chosen
    gain: float
    logs: Array
    change: list[Array]
    start: State | None = None


@dataclass(frozen=True, eq=False)
class Screened:
    """Trials of an effect where fits may begin, the most promising first: the best of each choice that no fit moves,
    and of a shape (a frequency, a knee) that has two optima both."""

    effect: Effect
    trials: tuple[Trial, ...]

    @property
    def gain(self) -> float:
        """Of the most promising one."""
        return self.trials[0].gain


def shared_numbers(effect: Effect, values: Mapping[str, float]) -> dict[str, float]:
    """Numbers of an effect that another one has as well, as that one has them, inside their ranges: a resonance that is
    taken for one thing lies where it lies when it is another one."""
    return {one.name: min(max(values[one.name], one.low), one.high)
            for one in effect.parameters if one.moves and one.name in values}


def screened(base: Baseline, effect: Effect, seen: Sequence[Misalignment],
             near: Mapping[str, float] = MappingProxyType({})) -> Screened:
    """Trials of an effect on a model.

    seen    ways in which the runs may be misaligned
    near    numbers of an effect in whose place this one is tried
    """
    # Where the distance errors are of a usual size, or none but those of the record, positions are not far wrong.
    anew = base.state.size.is_unusual and not base.as_recorded and not effect.reshapes
    trials: list[dict[str, float]] = []
    for way in seen:
        trials += [values for values in effect.trials(way) if values not in trials]
    prior = base.posterior.prior
    known = [one for one in effect.parameters if one.name in effect.replaces and one.name in prior.names]
    if shared := shared_numbers(effect, near):
        trials.append(trials[0] | shared)
    if known:  # where a fit has brought the car's own numbers is worth a trial
        car = prior.vehicle(base.posterior.vehicle, base.state.logs)
        trials.append(trials[0] | {one.name: min(max(read(car, one.name), one.low), one.high) for one in known})
    nominal = np.zeros_like(base.state.logs)
    found: dict[tuple[float, ...], dict[float, Trial]] = {}
    shape = next((one.name for one in effect.parameters if one.moves and one.null is None), "")
    for values in trials:
        choice = tuple(values[parameter.name] for parameter in effect.parameters if not parameter.moves)
        one = chosen(effect, values)
        ways = [_as_it_is(base, one, base.state.logs)] if effect.replaces else _scaled(base, one)
        if len(base.quadratics) > 1:  # numbers that are bent towards what an effect does say little of what it does
            ways.append(_as_it_is(base, one, nominal))
        if anew and values is not trials[0]:
            ways.append(_aligned_anew(base, one, ways[0]))
        trial = max(ways, key=lambda trial: trial.gain)
        alike = found.setdefault(choice, {})
        if (there := values.get(shape, 0.0)) not in alike or trial.gain > alike[there].gain:
            alike[there] = trial
    best = [one for alike in found.values() for one in _optima([alike[value] for value in sorted(alike)])[:2]]
    return Screened(effect, tuple(sorted(best, key=lambda trial: -trial.gain)))


def _optima(trials: Sequence[Trial]) -> list[Trial]:
    """Those that promise more than their neighbours, the most promising first; of trials in the order of a shape."""
    gains = [-np.inf, *(one.gain for one in trials), -np.inf]
    found = [one for one, before, after in zip(trials, gains, gains[2:], strict=False)
             if one.gain >= max(before, after)]
    return sorted(found, key=lambda one: -one.gain)


def _roughly(linear: LinearModel, effects: Sequence[Chosen], logs: Array) -> list[Array]:
    return linear.posterior.predict(effects, logs, linear.state.record, rough=True)


def _scaled(base: Baseline, one: Chosen) -> list[Trial]:
    """A trial at the strength at which it explains most, under each prior."""
    there = _roughly(base.linear, (*base.state.effects, one), base.state.logs)
    change = [new - old for new, old in zip(there, base.rough, strict=True)]
    return [_trial(base, quadratic, one, change) for quadratic in base.quadratics]


def _trial(base: Baseline, quadratic: _Quadratic, one: Chosen, change: list[Array]) -> Trial:
    linear = quadratic.linear
    white = linear.whitened(change)
    here = base.state.logs + quadratic.newton_step
    mixed, own = linear.mixed(white)
    absorbed = quadratic.covariance @ mixed
    along = (sum(float(c @ r) for c, r in zip(white, quadratic.residuals, strict=True))
             - float(mixed @ quadratic.newton_step))
    own -= float(mixed @ absorbed)

    def at(share: float, values: Chosen) -> Trial:
        logs = here - share * absorbed
        objective = quadratic.objective - 2 * share * along + share**2 * own
        return Trial(values, base.gain(objective, logs, linear), logs, change)

    if not own > 0:
        return Trial(one, 0.0, here, change)
    strongest = _STRONGEST_IF_IT_REALIGNS if one.effect.realigns else _STRONGEST
    strength = float(np.clip(along / own, -strongest if one.effect.realigns else _WEAKEST, strongest))
    scaled = scaled_by(one, strength)
    if scaled is None:
        return at(1.0, one)
    if not any(parameter.scale is Scale.RECIPROCAL for parameter in one.effect.parameters):
        return at(strength, scaled)
    # A resonance that is half as strong lies elsewhere, and may do something else altogether.
    return max((_as_predicted(base, linear, trial) for trial in (at(strength, scaled), at(1.0, one))),
               key=lambda trial: trial.gain)


def _as_predicted(base: Baseline, linear: LinearModel, trial: Trial) -> Trial:
    """The same with the gain that it truly has, the car's numbers counted to first order: sensors are tried on one body
    then."""
    state = base.state
    there = linear.posterior.predict((*state.effects, trial.one), state.logs, state.record)
    step = trial.logs - state.logs
    moved_there = [one + step @ columns for one, columns in zip(there, linear.numbers or (), strict=True)]
    return replace(trial, gain=base.gain(linear.objective(moved_there, trial.logs), trial.logs, linear))


def _as_it_is(base: Baseline, one: Chosen, logs: Array) -> Trial:
    """A trial as it is, in a car with these numbers (p,), which then take one step of Newton's; those that the effect
    sets are held at their nominal values."""
    linear = base.quadratics[-1].linear.holding(one.effect.replaces)
    logs = np.where(np.isin(linear.prior.names, one.effect.replaces), 0.0, logs)
    there = _roughly(linear, (*base.state.effects, one), logs)
    found = linear.eliminated(there)
    pull = linear.gradient(found.residuals, logs)
    step = np.linalg.solve(linear.information(logs), pull)
    change = [new - old for new, old in zip(there, base.rough, strict=True)]
    objective = found.squares + linear.prior.cost(logs) - float(pull @ step)
    return Trial(one, base.gain(objective, logs + step, linear), logs + step, change)


def _aligned_anew(base: Baseline, one: Chosen, trial: Trial) -> Trial:
    """A trial with the distance errors fitted anew from the distances as they were recorded: where positions are wrong,
    those that were fitted without it are worth nothing."""
    posterior, state = base.posterior, base.state
    # It only has to tell where a fit begins: a round that gains a share of 0.4 % is the last.
    found = aligned(posterior, posterior.at((*state.effects, one), state.logs), 0.004)
    return replace(trial, one=one, gain=base.score - found.score, logs=state.logs, start=found.state)


def scaled_by(one: Chosen, strength: float) -> Chosen | None:
    """The effect at a share of its strength: of the way from its null to where it stands; None if it has no null."""
    for place, parameter in enumerate(one.effect.parameters):
        if parameter.null is None or not parameter.moves:
            continue
        move = Move(0, place)
        null = 0.0 if np.isinf(parameter.null) else parameter.coordinate(parameter.null)
        here = float(coordinates_of([one], [move])[0])
        return moved([one], [move], np.array([null + strength * (here - null)]))[0]
    return None


def misalignment_of_record(base: Baseline) -> Misalignment:
    """One factor and one time of all runs together that explain most of a model's distance errors."""
    way, speed, moved_m = (np.concatenate(parts) for parts in zip(*(
        (error.run.distance_m - error.run.distance_m[0], error.run.speed_mps, error.moved_m(k))
        for error, k in zip(base.posterior.record_errors, base.state.record, strict=True)), strict=True))
    (longer, earlier_s), *_ = np.linalg.lstsq(np.stack([way, speed], axis=1), moved_m, rcond=None)
    return Misalignment(float(1 / (1 + longer)), float(-earlier_s), *_filter_of(base.posterior))


def misalignment(posterior: Posterior, state: State, slow_s: float = 0.2) -> Misalignment:
    """How the runs would have to be moved against the model to fit it best: all of them by one factor of their
    distance, or by one time. Both are looked for in the slow part of the motion, whose waves are long."""
    pairs: list[tuple[Run, Array, Array]] = []
    for run, predicted in zip(posterior.runs.runs, state.predictions, strict=True):
        size = max(1, round(slow_s * run.rate_hz))
        hat = np.hanning(size + 2)[1:-1]
        slow = [np.convolve(one, hat / hat.sum(), "same") for one in (run.measured_mps2, run.main(predicted))]
        pairs.append((run, slow[0], slow[1]))

    def alike(scale: float, delay_s: float) -> float:
        """Products of the measurement and the model, moved, over what they are at most."""
        both = of = 0.0
        for run, measured, predicted in pairs:
            time_s = np.arange(run.count) / run.rate_hz
            rising = np.maximum.accumulate(run.distance_m) + 1e-9 * time_s
            at_s = (time_s if run.timed else np.interp(run.distance_m / scale, rising, time_s)) - delay_s
            moved_mps2 = np.interp(at_s, time_s, predicted)[run.first:]
            kept = measured[run.first:]
            both += float(kept @ moved_mps2)
            of += float(np.sqrt((kept @ kept) * (moved_mps2 @ moved_mps2)))
        return both / of if of > 0 else 0.0

    still = alike(1.0, 0.0)
    scales = 1 + _scanned(lambda off: alike(1 + off, 0.0), 0.08, 5e-4)
    delay_s = _scanned(lambda off: alike(1.0, off), 1.5, 0.02)
    return Misalignment(scales if alike(scales, 0.0) > still else 1.0, delay_s if alike(1.0, delay_s) > still else 0.0,
                        *_filter_of(posterior))


def _filter_of(posterior: Posterior) -> tuple[tuple[float, int] | None, float]:
    """The filter that the records seem to have gone through, and their rate."""
    runs = posterior.runs.runs
    causal = [run.low_pass for run in runs if run.low_pass is not None and run.low_pass.causal]
    return (causal[0].cutoff_hz, round(causal[0].order)) if causal else None, runs[0].rate_hz


def _scanned(alike: Callable[[float], float], reach: float, step: float) -> float:
    """Where something is largest between -reach and reach, looked for in steps and then in tenths of a step."""
    count = round(reach / step)
    middle = max((step * k for k in range(-count, count + 1)), key=alike)
    return max((middle + 0.1 * step * k for k in range(-10, 11)), key=alike)
