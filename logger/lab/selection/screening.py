"""Score tests of effects: how much each would gain on top of a model, before it is fitted.

Problem: most effects do nothing at their null and something quite different at each of their values, so that a
derivative at zero strength says little about them (a shape such as a knee or a frequency has no meaning there).
Solution: each is simulated at a few trial values; what the car's own numbers and the distance errors could do as well
is projected out (a score test), and the trial that explains most, at its best strength, is where a fit begins. Of a
part on its bench, what the numbers of its effects could do is, too (C. R. Rao, Proc. Cambridge Phil. Soc. 44, 1948).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise

import numpy as np

from logger.arrays import Array
from logger.fitting.fisher_scoring import inverse, inverse_with_prior
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import align, effect_slopes, own_slopes
from logger.lab.likelihood.noise_floor import excess_over_noise, gain_of_full_explanation
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.selection.evidence import FALSE_ALARM, INDISTINGUISHABLE, min_gain
from logger.lab.selection.holdout import HoldOut, cross_validate
from logger.runs import Run, are_on_rig
from logger.vehicle.effect import AXLE, Chosen, Effect, Misalignment, Scale, SensorEffect, chosen
from logger.vehicle.effects.time_offset import EFFECT as TIME_OFFSET
from logger.vehicle.named_parameters import FreeParameter, coordinates_of, read, with_coordinates

# Bounds of the best strength over that of a trial, as far as a quadratic is to be believed (judgements). An effect that
# shifts all of a run is linear much farther, and is tried with next to nothing.
_STRONGEST, _STRONGEST_SHIFT, _WEAKEST = 10.0, 1000.0, 0.03


@dataclass(frozen=True, eq=False)
class _Quadratic:
    """The objective of a fitted model to second order in the numbers of the car (p) and of its effects (m).

    own            whitened derivatives by the latter (m, kept), per run; m = 0: they are held
    residuals      whitened (kept,) per run
    covariance     of all these numbers (p + m, p + m)
    newton_step    of these to the minimum (p + m,)
    objective      there: sum of squares of the residuals and cost of the priors
    """

    own: list[Array]
    residuals: list[Array]
    covariance: Array
    newton_step: Array
    objective: float

    @staticmethod
    def of(linear: LinearModel, own: list[Array]) -> _Quadratic:
        """The quadratic of a linearised model."""
        state = linear.state
        here = linear.fit_record_errors(state.predictions)
        covariance = inverse_with_prior(linear.information(own))
        gradient = linear.gradient(here.residuals, state.logs, own)
        step = covariance @ gradient
        return _Quadratic(own, here.residuals, covariance, step,
                          here.squares + linear.prior.cost(state.logs) - float(gradient @ step))

    def beside(self, white: Sequence[Array]) -> list[Array]:
        """Whitened columns (k, kept), per run, below those of the effects' numbers."""
        return [np.vstack(pair) for pair in zip(self.own, white, strict=True)]


@dataclass(frozen=True, eq=False)
class Baseline:
    """A fitted model that effects are tried on.

    linear           linearised at its state
    score            minus twice the log of its evidence
    explanation      gain of a full explanation of the residuals
    rough            predictions of a rough simulation, for comparison with others
    trend_removed    whether start and scale errors of the distances are taken to be 0
    """

    linear: LinearModel
    score: float
    explanation: float
    rough: list[Array]
    trend_removed: bool = False

    @staticmethod
    def of(linear: LinearModel, trend_removed: bool = False) -> Baseline:
        """The baseline of a linearised model."""
        state = linear.state
        return Baseline(linear, linear.score, gain_of_full_explanation(linear.posterior, state),
                        linear.posterior.predict(state.effects, state.logs, state.record, rough=True), trend_removed)

    @cached_property
    def quadratic(self) -> _Quadratic:
        """Of its objective; with the numbers of its effects free where its motion is given, as derivatives by them are
        exact then and take milliseconds. (Differences of a motion that is simulated are not: with them a mount was
        found in a beam that has none.)"""
        whiteners, of_part = self.linear.whiteners, self.posterior.vehicle.is_part
        slopes = own_slopes(self.posterior, self.state, whiteners) if of_part else None
        return _Quadratic.of(self.linear, [np.empty((0, one.kept)) for one in whiteners]
                             if slopes is None else self.linear.whitened(slopes))

    @property
    def posterior(self) -> Posterior:
        """The posterior that was fitted."""
        return self.linear.posterior

    @property
    def state(self) -> State:
        """The fitted state."""
        return self.linear.state

    @property
    def effects(self) -> tuple[Chosen, ...]:
        """The effects of the model."""
        return self.state.effects

    @cached_property
    def hold_out(self) -> HoldOut:
        """Cross-validation of the model."""
        return cross_validate(self.linear)

    @property
    def on_rig(self) -> bool:
        """Whether all runs are driven by time."""
        return are_on_rig(self.posterior.runs.runs)

    @cached_property
    def is_within_calibration(self) -> bool:
        """Whether what is left of a rig's records is no more than noise and what calibrated sensors may be off by."""
        return self.on_rig and excess_over_noise(self.posterior, self.state, FALSE_ALARM) < UNEXPLAINED


def without_distance_trend(base: Baseline) -> Baseline:
    """The model of the nominal car, without start and scale errors of the distances."""
    posterior, state = base.posterior, base.state
    record = [error.without_trend(k) for error, k in zip(posterior.record_errors, state.record, strict=True)]
    there = posterior.state_at(state.effects, np.zeros_like(state.logs), record)
    numbers = posterior.number_slopes(there, posterior.prior.steps)
    return Baseline.of(LinearModel(posterior, there, numbers), trend_removed=True)


def effects_without(state: State, name: str) -> tuple[Chosen, ...]:
    """The effects of a model without one."""
    return tuple(one for one in state.effects if one.effect.name != name)


def without_effect(now: Baseline, name: str) -> Baseline:
    """A model without one of its effects, all other numbers unchanged: a substitute is searched for before the others
    have moved to compensate for it."""
    posterior, state = now.posterior, now.state
    there = posterior.state_at(effects_without(state, name), state.logs, state.record, state.size)
    return Baseline.of(LinearModel(posterior, there, posterior.number_slopes(there, posterior.prior.steps)))


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect at one set of values, and its expected gain.

    gain      by how much minus twice the log of the evidence would fall, its numbers not counted
    logs      the car's numbers then (p,)
    change    of the predictions by the effect at its values (n,), per run [m/s2]; simulated when it is asked for, as
              those of all trials of all effects would be many times the records
    start     where a fit begins, if with other distance errors; None: at the baseline
    """

    one: Chosen
    gain: float
    logs: Array
    change: Callable[[], list[Array]]
    start: State | None = None


@dataclass(frozen=True, eq=False)
class Screened:
    """Trials of an effect where fits may begin, of the largest gain first: the best for each combination of parameters
    that no fit moves, and both optima of a shape (a frequency, a knee) that has two."""

    effect: Effect
    trials: tuple[Trial, ...]

    @property
    def gain(self) -> float:
        """The largest gain of the trials."""
        return self.trials[0].gain

    def with_form(self, other: Screened) -> Screened:
        """The trials of two forms of an effect together."""
        first, last = sorted((self, other), key=lambda one: -one.gain)
        return Screened(first.effect, tuple(sorted((*first.trials, *last.trials), key=lambda one: -one.gain)))


def shared_parameters(effect: Effect, values: Mapping[str, float]) -> dict[str, float]:
    """Values of those parameters of an effect that another one has as well, clipped to their ranges: a resonance keeps
    its frequency when it is attributed to something else."""
    return {one.name: min(max(values[one.name], one.low), one.high)
            for one in effect.parameters if one.is_free and one.name in values}


def screen(base: Baseline, effect: Effect, misaligned: Sequence[Misalignment],
             near: Chosen | None = None) -> Screened:
    """Trials of an effect on a model. One of suspensions is tried in those of all wheels and, where it gains more there
    than chance, with the same numbers in those of each axle.

    misaligned    ways in which the runs may be misaligned
    near          the effect in whose place this one is tried; the fit that would begin at that itself is known
    """
    # Where the distance errors are of a usual size, or their trend was removed, positions are not far wrong.
    realigns = base.state.size.is_unusually_large and not base.trend_removed and not effect.reshapes
    trials: list[dict[str, float]] = []
    for one_way in misaligned:
        trials += [values for values in effect.trials(one_way) if values not in trials]
    prior = base.posterior.prior
    known = [one for one in effect.parameters if one.name in effect.replaces and one.name in prior.names]
    if near is not None and (shared := shared_parameters(effect, near.values)):
        trials.append(trials[0] | shared)
    if known:  # the fitted values of the car's own numbers are a trial as well
        car = prior.vehicle(base.posterior.vehicle, base.state.logs)
        trials.append(trials[0] | {one.name: min(max(read(car, one.name), one.low), one.high) for one in known})
    found: dict[tuple[float, ...], dict[float, Trial]] = {}
    shape = next((one.name for one in effect.parameters if one.is_free and one.null is None), "")

    def try_out(values: dict[str, float]) -> None:
        one = chosen(effect, values)
        choice = (*(values[parameter.name] for parameter in effect.parameters if not parameter.is_free), one.is_plain)
        ways = [_trial_at_values(base, one) if effect.replaces else
                _trial_at_best_strengths(base, one, strengths) if len(strengths := _strengths_of(one)) > 1 else
                _trial_at_best_strength(base, one)]
        if realigns and values is not trials[0]:
            ways.append(_realigned_trial(base, one, ways[0]))
        trial = max(ways, key=lambda trial: trial.gain)
        by_shape = found.setdefault(choice, {})
        if (there := values.get(shape, 0.0)) not in by_shape or trial.gain > by_shape[there].gain:
            by_shape[there] = trial

    for values in _of_own_strengths(effect, trials):
        try_out(values)
    if AXLE in effect.parameters and base.posterior.vehicle.rear is not None:
        both = max((trial for by_shape in found.values() for trial in by_shape.values()),
                   key=lambda one: one.gain - INDISTINGUISHABLE * (not one.one.is_plain))
        if both.gain > min_gain(1):
            for axle in AXLE.choices[1:]:
                try_out({**both.one.values, AXLE.name: axle})
    best = [one for by_shape in found.values()
            for one in _optima([by_shape[value] for value in sorted(by_shape)])[:2]]
    best += _delayed_trials(base, effect, misaligned[0])
    best = [trial for trial in best if near is None or not trial.one.is_shaped_as(near)]
    return Screened(effect, tuple(sorted(best, key=lambda trial: -trial.gain)))


def _strengths_of(one: Chosen) -> list[int]:
    """Places of an effect's parameters, in its form, at whose nulls nothing is left of it or of one of its terms."""
    return [place for place, each in enumerate(one.effect.parameters)
            if each in one.freed and (each.null is not None or each.name in one.effect.terms)]


def _of_own_strengths(effect: Effect, trials: Sequence[dict[str, float]]) -> list[dict[str, float]]:
    """The trials, of those that differ in several strengths alone the first: at their nulls they have one derivative
    each, whatever a search begins at."""
    found: dict[tuple[object, ...], dict[str, float]] = {}
    for values in trials:
        places = _strengths_of(chosen(effect, values))
        free = [effect.parameters[place].name for place in places if len(places) > 1]
        found.setdefault((*free, *(value for name, value in values.items() if name not in free)), values)
    return [*found.values()]


def _delayed_trials(base: Baseline, effect: Effect, seen: Misalignment) -> list[Trial]:
    """The best trials of an effect that delays, with the delay taken out of the distances: fitted without the effect,
    these have absorbed it, and a delay by half a wave more is beyond what is linear. On a rig, whose clock is one,
    nothing has. After three trials of one kind, each of which gains less than the one before, no more are tried. Four
    kinds at most that gain four fifths of the best are starts of fits (judgements: a trial gains nine tenths of its
    fit)."""
    bests = []
    timed = base.on_rig
    for kind in effect.delaying_trials(seen):
        tried: list[tuple[Trial, float]] = []
        for values in kind:
            one = chosen(effect, values)
            delay_s = 0.0 if timed else _delay_s(one)
            earlier = (chosen(TIME_OFFSET, {"delay_s": -delay_s}),) if delay_s else ()
            tried.append((_trial_at_values(base, one, earlier), delay_s))
            last = [trial.gain for trial, _ in tried[-4:]]
            if len(last) > 3 and all(later < before for before, later in pairwise(last)):
                break
        bests.append(max(tried, key=lambda pair: pair[0].gain))
    bests.sort(key=lambda pair: -pair[0].gain)
    worth = [(trial, delay_s) for trial, delay_s in bests[:4]
             if trial.gain > max(0.8 * bests[0][0].gain, 0.0)]
    speeds = [error.coefficients_of(error.run.speed_mps) for error in base.posterior.record_errors] if worth else []
    return [_begun_earlier(base, trial, [delay_s * one for one in speeds]) for trial, delay_s in worth]


def _delay_s(one: Chosen) -> float:
    """By how much an effect on the sensor delays slow motions, of 1 Hz as a body's bounce [s]."""
    assert isinstance(one.effect, SensorEffect)
    return float(-np.angle(one.effect.factor(one.p, np.array([2j * np.pi]))[0]) / (2 * np.pi))


def _begun_earlier(base: Baseline, trial: Trial, farther: Sequence[Array]) -> Trial:
    """The trial with a start of fits at which the car was farther along: by distance errors with these numbers (k,) per
    run more."""
    posterior, state = base.posterior, base.state
    record = [k + more for k, more in zip(state.record, farther, strict=True)]
    return replace(trial, start=posterior.state_at((*state.effects, trial.one), trial.logs, record, state.size))


def _optima(trials: Sequence[Trial]) -> list[Trial]:
    """Local maxima of the gain of trials in the order of their shape, the largest first."""
    gains = [-np.inf, *(one.gain for one in trials), -np.inf]
    found = [one for one, before, after in zip(trials, gains, gains[2:], strict=False)
             if one.gain >= max(before, after)]
    return sorted(found, key=lambda one: -one.gain)


def _change(base: Baseline, more: Sequence[Chosen], logs: Array) -> list[Array]:
    """Change (n,) of the predictions, per run, by more effects and by the car's numbers."""
    state = base.state
    there = base.posterior.predict((*state.effects, *more), logs, state.record, rough=True)
    return [new - old for new, old in zip(there, base.rough, strict=True)]


def _trial_at_best_strength(base: Baseline, one: Chosen) -> Trial:
    """The trial at its best strength."""
    linear, quadratic = base.linear, base.quadratic
    change = partial(_change, base, [one], base.state.logs)
    white = linear.whitened(change())
    p, here = linear.count, base.state.logs + quadratic.newton_step[: linear.count]
    by_car, among = linear.cross_products(quadratic.beside([one[None] for one in white]))
    mixed, own = np.concatenate([by_car[-1], among[-1, :-1]]), float(among[-1, -1])
    absorbed = quadratic.covariance @ mixed
    along = (sum(float(c @ r) for c, r in zip(white, quadratic.residuals, strict=True))
             - float(mixed @ quadratic.newton_step))
    own -= float(mixed @ absorbed)

    def at(share: float, values: Chosen) -> Trial:
        logs = here - share * absorbed[:p]
        objective = quadratic.objective - 2 * share * along + share**2 * own
        return Trial(values, quadratic.objective - objective, logs, change)

    if not own > 0:
        return Trial(one, 0.0, here, change)
    strongest = _STRONGEST_SHIFT if one.effect.realigns else _STRONGEST
    weakest = -strongest if one.effect.realigns or _goes_both_ways(one.effect) else _WEAKEST
    strength = float(np.clip(along / own, weakest, strongest))
    scaled = scale_strength(one, strength)
    if scaled is None:
        return at(1.0, one)
    if not any(parameter.scale is Scale.RECIPROCAL for parameter in one.effect.parameters):
        return at(strength, scaled)
    # A resonance half as strong has another frequency, and its change may be of another shape.
    return max(_with_predicted_gain(base, at(strength, scaled)), at(1.0, one), key=lambda trial: trial.gain)


def _trial_at_best_strengths(base: Baseline, one: Chosen, strengths: Sequence[int]) -> Trial:
    """The trial of an effect with several strengths, its parameters at these places, after one Gauss-Newton step of
    these, from their nulls, and of all other numbers."""
    linear, state = base.linear, base.state
    nulls = {each.name: each.null or 0.0 for each in map(one.effect.parameters.__getitem__, strengths)}
    effects = (*state.effects, replace(one, values={**one.values, **nulls}))
    free = [FreeParameter(len(state.effects), place) for place in strengths]
    slopes = effect_slopes(base.posterior, effects, state.logs, free, state.record, None)
    white, residuals = base.quadratic.beside(linear.whitened(slopes)), base.quadratic.residuals
    gradient, information = linear.gradient(residuals, state.logs, white), linear.information(white)
    p, others = linear.count, len(gradient) - len(free)
    # A point of a curve beyond all motions has no derivative, and stays at 0.
    step = inverse(information) @ gradient
    without = float(gradient[:others] @ base.quadratic.newton_step)
    there = with_coordinates(effects, free, coordinates_of(effects, free) + step[others:])
    return Trial(there[-1], float(gradient @ step) - without, state.logs + step[:p],
                 lambda: [step[others:] @ one for one in slopes])


def _goes_both_ways(effect: Effect) -> bool:
    """Whether an effect's first strength may have either sign."""
    first = next((one for one in effect.parameters if one.null is not None and one.is_free), None)
    return first is not None and first.scale is Scale.LINEAR and first.low < 0 == first.null


def _with_predicted_gain(base: Baseline, trial: Trial) -> Trial:
    """The trial with the gain of a full prediction, the car's numbers to first order."""
    state, linear = base.state, base.linear
    step = trial.logs - state.logs
    moved_there = [fine + more + step @ columns for fine, more, columns in zip(
        state.predictions, _change(base, [trial.one], state.logs), linear.numbers or (), strict=True)]
    return replace(trial, gain=base.quadratic.objective - linear.objective(moved_there, trial.logs))


def _trial_at_values(base: Baseline, one: Chosen, besides: tuple[Chosen, ...] = ()) -> Trial:
    """The trial at its own values; all other numbers take one Newton step, and those of the car that the effect sets
    are held at their nominal values.

    besides    what else differs
    """
    linear = base.linear.hold_fixed(one.effect.replaces)
    logs = np.where(np.isin(linear.prior.names, one.effect.replaces), 0.0, base.state.logs)
    change = partial(_change, base, (one, *besides), logs)
    found = linear.fit_record_errors([fine + more for fine, more in zip(base.state.predictions, change(), strict=True)])
    gradient = linear.gradient(found.residuals, logs, base.quadratic.own)
    step = inverse_with_prior(linear.information(base.quadratic.own)) @ gradient
    objective = found.squares + linear.prior.cost(logs) - float(gradient @ step)
    return Trial(one, base.quadratic.objective - objective, logs + step[: linear.count], change)


def _realigned_trial(base: Baseline, one: Chosen, trial: Trial) -> Trial:
    """The trial with the distance errors fitted again from the recorded distances: where positions are wrong, those
    that were fitted without the effect are too."""
    posterior, state = base.posterior, base.state
    # It only decides where a fit begins: a round that gains less than 0.4 % of the whole gain is the last.
    found = align(posterior, posterior.state_at((*state.effects, one), state.logs), min_share=0.004)
    return replace(trial, one=one, gain=base.score - found.score, logs=state.logs, start=found.state)


def scale_strength(one: Chosen, strength: float) -> Chosen | None:
    """The effect with its first strength times a factor, on its scale from the null on; None without a strength."""
    for place, parameter in enumerate(one.effect.parameters):
        if parameter.null is None or not parameter.is_free:
            continue
        free = FreeParameter(0, place)
        null = 0.0 if np.isinf(parameter.null) else parameter.coordinate(parameter.null)
        here = float(coordinates_of([one], [free])[0])
        return with_coordinates([one], [free], np.array([null + strength * (here - null)]))[0]
    return None


def misalignment_of_record(base: Baseline) -> Misalignment:
    """The scale error and the delay, of all runs together, that explain most of a model's distance errors."""
    way, speed, distance_error_m = (np.concatenate(parts) for parts in zip(*(
        (error.run.distance_m - error.run.distance_m[0], error.run.speed_mps, error.distance_error_m(k))
        for error, k in zip(base.posterior.record_errors, base.state.record, strict=True)), strict=True))
    (longer, earlier_s), *_ = np.linalg.lstsq(np.stack([way, speed], axis=1), distance_error_m, rcond=None)
    return Misalignment(float(1 / (1 + longer)), float(-earlier_s), *_filter_of(base.posterior))


def misalignment(posterior: Posterior, state: State) -> Misalignment:
    """The scale error and the delay at which all runs together correlate most with the model, each by itself. Both are
    searched for in the slow part of the motion, over 0.2 s, whose waves are long."""
    pairs: list[tuple[Run, Array, Array]] = []
    for run, predicted in zip(posterior.runs.runs, state.predictions, strict=True):
        size = min(max(1, round(0.2 * run.rate_hz)), run.count - 2)
        hat = np.hanning(size + 2)[1:-1]
        slow = [np.convolve(one, hat / hat.sum(), "same") for one in (run.measured_mps2, run.main(predicted))]
        pairs.append((run, slow[0], slow[1]))

    def correlation(scale: float, delay_s: float) -> float:
        """Correlation of the measurement and the shifted model."""
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

    unshifted = correlation(1.0, 0.0)
    scale = 1 + _grid_maximum(lambda off: correlation(1 + off, 0.0), 0.08, 5e-4)
    delay_s = _grid_maximum(lambda off: correlation(1.0, off), 1.5, 0.02)
    return Misalignment(
        scale if correlation(scale, 0.0) > unshifted else 1.0,
        delay_s if correlation(1.0, delay_s) > unshifted else 0.0, *_filter_of(posterior))


def _filter_of(posterior: Posterior) -> tuple[tuple[float, int] | None, float, bool]:
    """Cut-off and order of the causal filter that was detected in the records (None: none), their rate, and whether the
    lab thinned them to it."""
    runs = posterior.runs.runs
    causal = [run.low_pass for run in runs if run.low_pass is not None and run.low_pass.causal]
    low_pass = (causal[0].cutoff_hz, round(causal[0].order)) if causal else None
    return low_pass, runs[0].rate_hz, runs[0].thinned_by > 1


def _grid_maximum(correlation: Callable[[float], float], reach: float, step: float) -> float:
    """Maximum of a function between -reach and reach, on a grid of steps and then of tenths of a step."""
    count = round(reach / step)
    middle = max((step * k for k in range(-count, count + 1)), key=correlation)
    return max((middle + 0.1 * step * k for k in range(-10, 11)), key=correlation)
