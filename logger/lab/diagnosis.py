"""Diagnosis: which physical effects a model lacks, how certain that is, and what the runs could not show.

Problem: a name alone is no answer. The reader wants to know how much an effect explains, how certain that is, what else
it could be, and what these runs could not have shown anyway. Solution: a search by evidence (``selection.stepwise``)
names the effects; the model with them is fitted finely, and its residual is compared with the noise that the sensor has
where no car moves it. A residual above that is unexplained, and so is one that takes numbers of the car in conflict
with their priors. Noise that has a colour is distinguished from physics by what it does not depend on.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from logger.bounds import UNUSUAL_SIGMA
from logger.lab.likelihood.distance_error import signals_off
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import fit_model
from logger.lab.likelihood.noise_floor import (
    NoiseLevel,
    SignalErrors,
    excess_by_signal,
    excess_over_noise,
    floor_error,
    sensor_noise_with_rounding,
    signal_errors_of,
)
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.record_band import ComparedBand, compared_band
from logger.lab.likelihood.standard_errors import StandardErrors, deviations_from_null, standard_errors
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.residuals.breakdown import ModelResiduals
from logger.lab.residuals.fitted_laws import FittedCar, fitted_car
from logger.lab.residuals.force_gain import force_gain
from logger.lab.residuals.road_coherence import best_linear_share, share_proportional
from logger.lab.residuals.unexplained import Removed, Shape, coloured_noise, removed_from, shape_of
from logger.lab.selection.candidate_fit import CandidateFit
from logger.lab.selection.detectability import Undetectable, effect_as_moved, undetectable_effects
from logger.lab.selection.evidence import FALSE_ALARM, IMITATION, INDISTINGUISHABLE
from logger.lab.selection.filter_without_delay import below_filter_without_delay
from logger.lab.selection.holdout import REFITTED, ErrorStep, HoldOut, as_filed, cross_validate
from logger.lab.selection.screening import Baseline, Screened, effects_without, misalignment
from logger.lab.selection.starts import UnknownNumbers, needs_starts
from logger.lab.selection.stepwise import F, M, MeasuredRoad, P, Search, SearchEffort, Selection, is_outside_data
from logger.printable import Notify, silent
from logger.runs import BY_ROAD, Past, are_on_rig
from logger.simulation.virtual_drive import steps_hz
from logger.vehicle import named_parameters
from logger.vehicle.effect import Chosen, Effect, SensorEffect
from logger.vehicle.effects.force_gain import EFFECT as FORCE_GAIN
from logger.vehicle.named_parameters import free_parameters_of

ALREADY_PRESENT = "the model has it"
LAID_BY_THE_ROAD = ("ridelog extract has already shifted these runs to fit the road (run.yaml says by how much)")


@dataclass(frozen=True, eq=False)
class CandidateEffect:
    """An effect that was tried.

    one                    the effect with its values
    error                  of the refitted model with it alone, on stretches that no fit saw; without a profile, of all
                           drives, each predicted by the others
    p_value                probability, at most, that noise alone gains as much with any of the candidates
    gain, held_out_gain    of minus twice the log of the evidence, and of the likelihood on held-out stretches; None:
                           not known
    confused_with          effects that explain the same as well
    fitted                 with the car's numbers; else it was added at the best strength of its score test
    stands_in              whether it bends the laws of the car, so that linear ones stood in for it
    """

    one: Chosen
    error: float
    p_value: float
    gain: float
    held_out_gain: float | None = None
    confused_with: tuple[str, ...] = ()
    fitted: bool = True
    stands_in: bool = False

    @property
    def effect(self) -> Effect:
        """The effect itself."""
        return self.one.effect


@dataclass(frozen=True, eq=False)
class LabDiagnosis:
    """The result of a diagnosis.

    runs                 their names
    catalogue            all effects that were asked for, by name
    baseline_error       of the model as it stands
    final_error          of the model that it ends with
    best_linear          share of the measured power that a linear car could explain at most; None: the runs do not say,
                         or a linear one explains more
    noise                of the sensors, their rounding in it
    candidates           missing effects first, with their final values; then the others of the first round that are
                         better than the refitted model, the least probable by chance first
    obstacles            effects that could not be tried, and why
    verdict              names of the effects that the model lacks, the most certain first
    excess               share by which the residual is above the noise in the run where it is largest
    over_noise           as ``excess``, but over the noise alone, as if sensors had no gain that may be off; 0 where a
                         test of the residual does not distinguish it from noise
    proportional         share of the residual's power that is proportional to the model's motion, as what a sensor's
                         gain leaves is
    beyond               numbers of the car that the runs move beyond their tolerance, with their relative change
    in_conflict          whether one of these is farther off than numbers are by chance
    moved                the others that the runs move for sure: their relative change and its standard error, the
                         farthest first, by their tolerance; of masses and forces, against their mean
    left_open            numbers of which less was known than is usual: their value and its standard error
    shows_forces         whether a force was measured, so that these are known for themselves
    as_moved             the effect that changes the records as the move of all of these does; None: none does
    effects              of the model that it ends with, with standard errors
    undetectable         effects that these runs could not show at their usual strength
    shape                of the unexplained residual; None where it is noise
    removed              sensor drift, distance error and filtering, removed from the error before it is judged
    signals              errors of other signals than the sensor's acceleration, by name
    signals_off          by what share one of these reads more than all else that was measured says, by name, where it
                         is more than a sensor's gain is off by
    force_gain           of the refitted model, as ``force_gain``; None: as they say
    excess_of            as ``excess``, by signal; empty: the sensor's acceleration
    band                 in which the runs were compared; None: all
    overfit              share of the noise's power that its fitted numbers, which chance moves, add on what no fit saw:
                         their count over that of samples (H. Akaike, Ann. Inst. Statist. Math. 21, 1969)
    state                of the model that it ends with
    car                  numbers and laws as fitted
    coloured             whether the noise has a colour: it is louder at some frequencies than at the highest
    ends                 of how many starts the fit of an effect ended at the best, by name; where numbers are not known
    not_searched         what the search stopped before, as it had simulated as much as it may
    contradicted         numbers that the runs took so far beyond their tolerance that all were taken to be unknown
    tolerance            share by which the car's masses, springs and dampers may well be off
    no_better            names of the other effects that were tried
    """

    runs: tuple[str, ...]
    catalogue: Mapping[str, Effect]
    baseline_error: float
    final_error: float
    noise: NoiseLevel
    noise_floor_error: float
    candidates: tuple[CandidateEffect, ...]
    obstacles: Mapping[str, str]
    verdict: tuple[str, ...]
    excess: float
    beyond: Mapping[str, float]
    in_conflict: bool
    steps: tuple[ErrorStep, ...]
    effects: tuple[Chosen, ...]
    undetectable: tuple[Undetectable, ...]
    shape: Shape | None
    removed: Removed
    signals: Mapping[str, SignalErrors] = field(default_factory=dict)
    signals_off: Mapping[str, float] = field(default_factory=dict)
    force_gain: float | None = None
    excess_of: Mapping[str, float] = field(default_factory=dict)
    band: ComparedBand | None = None
    state: State | None = None
    car: FittedCar | None = None
    coloured: bool = False
    tolerance: float = Tolerance().share
    no_better: tuple[str, ...] = ()
    moved: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    left_open: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    ends: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    contradicted: tuple[str, ...] = ()
    not_searched: tuple[str, ...] = ()
    as_moved: Chosen | None = None
    best_linear: float | None = None
    shows_forces: bool = False
    over_noise: float = 0.0
    overfit: float = 0.0
    proportional: float = 1.0

    @property
    def explained(self) -> tuple[float, float]:
        """Shares of the measured power that are explained on stretches that no fit saw: with the numbers refitted, and
        by the model that it ends with."""
        refitted, last = (next(one.error for one in self.steps if one.words == REFITTED), self.steps[-1].error)
        return 1 - refitted**2, 1 - last**2

    @property
    def exceeds_noise(self) -> bool:
        """Whether the residual is above the sensor's noise."""
        return self.excess > UNEXPLAINED

    @property
    def within_calibration(self) -> bool:
        """Whether the residual is above the sensor's noise, but no more than calibrated sensors may leave."""
        return self.over_noise > UNEXPLAINED and not self.exceeds_noise

    @property
    def mostly_proportional(self) -> bool:
        """Whether most of what is left beyond the noise is proportional to the motion."""
        power = (1 + self.over_noise) ** 2
        return (1 - self.proportional) * power - 1 < 0.5 * (power - 1)

    @property
    def reaches_floor(self) -> bool:
        """Whether the error on what no fit saw is the noise floor's, and what its fitted numbers add there."""
        return self.steps[-1].error < (1 + UNEXPLAINED) * self.noise_floor_error * (1 + self.overfit)**0.5

    @property
    def unexplained(self) -> bool:
        """Whether the effects of the verdict, in a car within its priors, do not explain all."""
        return self.exceeds_noise or self.in_conflict

    @property
    def is_doubtful(self) -> bool:
        """Whether the residual is above the sensor's noise, even if no more than calibrated sensors may leave, of a car
        that contradicts its priors: then its effects may imitate another one."""
        return self.in_conflict and self.over_noise > UNEXPLAINED

    def may_imitate(self, name: str) -> bool:
        """Whether an effect of the verdict may imitate something else, or be a part of it: what is left of all signals
        beyond the noise is ``IMITATION`` or more of what the effect and that explain together."""
        left = sum(max(after**2 - floor**2, 0.0) for after, floor in (
            (self.final_error, self.noise_floor_error),
            *((one.after, one.noise_floor) for one in self.signals.values())))
        removed = sum(before.power - there.power for before, there in pairwise(self.steps)
                      if there.words == f"with {name}")
        return self.is_doubtful or (self.exceeds_noise and left >= IMITATION * (removed + left))

    def left_of(self, signal: str) -> float:
        """Error that is left of a signal: as far may what makes it have moved the signal's gain; 0 where nothing is
        missing."""
        one = self.signals.get(signal)
        return (self.final_error if one is None else one.after) if self.exceeds_noise else 0.0

    def is_off(self, signal: str) -> bool:
        """Whether one of ``signals_off`` is so for sure."""
        return abs(self.signals_off[signal]) > self.left_of(signal)

    @property
    def contradicted_by(self) -> tuple[str, ...]:
        """Signals whose residual alone is above their noise: they contradict the others."""
        above = tuple(name for name, excess in self.excess_of.items() if excess > UNEXPLAINED)
        return above if len(above) < len(self.excess_of) and "" not in above else ()

    @property
    def missing(self) -> tuple[Chosen, ...]:
        """The effects that the model lacks, the most certain first."""
        by_name = {one.effect.name: one for one in self.effects}
        return tuple(by_name[name] for name in self.verdict)

    @property
    def not_tried(self) -> dict[str, str]:
        """Effects that could not be tried, and why."""
        return {name: why for name, why in self.obstacles.items() if why != ALREADY_PRESENT}

    def candidate(self, name: str) -> CandidateEffect:
        """The candidate of that name."""
        return next(one for one in self.candidates if one.effect.name == name)


@dataclass(frozen=True, eq=False)
class Searched:
    """A search for effects that has ended, on what, and the diagnosis by its result."""

    posterior: Posterior
    search: Search[Baseline, Screened, CandidateFit]
    selection: Selection[Baseline, Screened, CandidateFit]
    diagnosis: LabDiagnosis


def diagnose(posterior: Posterior, effects: Mapping[str, Effect], present: Sequence[Chosen] = (),
             progress: Notify = silent, last: Mapping[str, Effect] = MappingProxyType({})
             ) -> LabDiagnosis:
    """The diagnosis of ``search_to_the_last``."""
    return search_to_the_last(posterior, effects, present, progress, last).diagnosis


def search_to_the_last(posterior: Posterior, effects: Mapping[str, Effect], present: Sequence[Chosen],
                       progress: Notify, last: Mapping[str, Effect]) -> Searched:
    """Find the effects of ``effects`` that the model, with those that are ``present``, lacks; where these leave
    something unexplained, also of those that are tried ``last``.

    ValueError where the vehicle lacks what an effect needs.
    """
    search, selection = search_effects(posterior, effects, present, progress)
    below = below_filter_without_delay(search, selection)
    if below is not None:
        progress("the records were filtered forwards and backwards: searching below that frequency")
        posterior = below
        search, selection = search_effects(posterior, effects, present, progress)
    found = Searched(posterior, search, selection, assess(posterior, effects, present, search, selection))
    tried = {name: one for name, one in last.items() if name not in obstacles_of(posterior, last, present)}
    if not (tried and (found.diagnosis.exceeds_noise or found.diagnosis.within_calibration)):
        return found
    if search.likelihood.stops_before(last_names := " and ".join(tried)):
        return replace(found, diagnosis=replace(found.diagnosis, not_searched=(
            *found.diagnosis.not_searched, last_names)))
    progress(f"something is left unexplained: searching with {last_names}, too")
    search, selection = search.with_more(selection, [*tried.values()])
    if not {*selection.gains} & {*tried}:
        return found
    more = assess(posterior, {**effects, **last}, present, search, selection)
    return Searched(posterior, search, selection, more) if {*more.verdict} & {*tried} else found


def search_effects(posterior: Posterior, effects: Mapping[str, Effect], present: Sequence[Chosen] = (),
                   progress: Notify = silent) -> tuple[Search, Selection]:
    """The search of a diagnosis and its result; arguments as of ``diagnose``. Where forces of another gain or sign
    would explain most of what a rig does, it begins with these: what is left without is not the rig's, and effects
    imitate it (an occupant of twice the body's mass where an actuator pulled as its record pushed)."""
    search, before = begin_search(posterior, effects, present, progress)
    if FORCE_GAIN in search.effects and force_gain(before.linear) is not None:
        progress("the forces are not what they say: fitting their gain")
        begun = search.best_of(FORCE_GAIN, before, {})
        if begun.hold_out.explains_most_beyond(before.hold_out):
            tried = search.round(begun, [one for one in search.effects if one is not FORCE_GAIN])
            return search, search.go_on(Selection(before, begun, {}, {}, tried, ((FORCE_GAIN.name, begun.hold_out),)),
                                        tried)
    return search, search.run(before)


def exceeds_noise(model: Baseline) -> bool:
    """Whether the residual of a model is above the sensor's noise, or a number of the car conflicts with its prior."""
    return (excess_over_noise(model.posterior, model.state, FALSE_ALARM) > UNEXPLAINED
            or model.posterior.prior.is_in_conflict(model.state.logs, standard_errors(model.linear).logs))


def begin_search(posterior: Posterior, effects: Mapping[str, Effect], present: Sequence[Chosen] = (),
                 progress: Notify = silent) -> tuple[Search, Baseline]:
    """The search and the fitted model that it begins at; arguments as of ``diagnose``."""
    obstacles = obstacles_of(posterior, effects, present)
    tried = [one for name, one in effects.items() if name not in obstacles]
    progress("refitting the model's parameters")
    nominal = posterior.start(present)
    unknown = UnknownNumbers() if needs_starts(posterior) else None
    before = refit(posterior, nominal) if unknown is None else unknown.fitted(posterior, present)
    search: Search[Baseline, Screened, CandidateFit] = Search(
        tried, len(present), misalignment(posterior, nominal), progress,
        # Of a part, whose motion is given, fits take a hundredth of those of a car.
        effort=SearchEffort(beginnings=2 * posterior.vehicle.is_part) if unknown is None else SearchEffort(fitted=3),
        likelihood=unknown or MeasuredRoad())
    return search, before


def assess(posterior: Posterior, effects: Mapping[str, Effect], present: Sequence[Chosen], search: Search,
           selection: Selection) -> LabDiagnosis:
    """The diagnosis by the result of a search, which is fitted again by a fine simulation."""
    selection, after = _fit_finely(search, selection)
    progress, tried = search.progress, search.effects
    nominal = posterior.start(present)
    fine, state = after.posterior, after.state
    noise = sensor_noise_with_rounding(fine, state)
    starts = search.likelihood if isinstance(search.likelihood, UnknownNumbers) else UnknownNumbers()
    progress("standard errors of the parameters")
    errors = standard_errors(after)
    progress("what these runs could not show")
    excess_of = excess_by_signal(fine, state, FALSE_ALARM)
    excess = max(excess_of.values())
    baseline = fine.start(present)
    removed = removed_from(fine, baseline.predictions, state)
    over_noise = max(excess_by_signal(fine, state, FALSE_ALARM, sigma=0.0).values())
    shape = shape_of(fine, state, removed) if max(excess, over_noise) > UNEXPLAINED else None
    if shape is None or not shape.tests.found:
        over_noise = 0.0  # a record of a second has few degrees of freedom in its quietest band
    colour = None if shape is None or excess <= UNEXPLAINED else coloured_noise(fine.bands, shape)
    if colour is not None:
        noise, excess_of = colour, excess_by_signal(fine, state, FALSE_ALARM, colour)
        excess, over_noise = max(excess_of.values()), 0.0
    left_open, beyond = _left_open(fine, state, errors), fine.prior.beyond_tolerance(state.logs, errors.covariance)
    moved = {name: one for name, one in fine.prior.moved(state.logs, errors.covariance, fine.shows_forces).items()
             if name not in {**beyond, **left_open}}
    candidates, no_better = candidates_of(search, selection, state.effects,
                                          partial(_best_of_screened, selection.before))
    hidden = undetectable_effects(after, [one for one in tried if one.name not in state.names])
    return LabDiagnosis(
        runs=tuple(run.name for run in fine.runs.runs), catalogue=effects,
        baseline_error=fine.error(baseline), final_error=fine.error(state),
        noise=noise,
        # A colour is known in the bands that are compared: what all of the noise makes is no more than what is left.
        noise_floor_error=floor_error(fine, noise) if colour is None else min(floor_error(fine, noise),
                                                                               fine.error(state)),
        candidates=candidates, no_better=no_better,
        obstacles=obstacles_of(posterior, effects, present), verdict=tuple(selection.gains), excess=excess,
        over_noise=over_noise, proportional=1.0 if shape is None else share_proportional(shape.residuals),
        beyond=beyond, in_conflict=fine.prior.is_in_conflict(state.logs, errors.logs), moved=moved, left_open=left_open,
        ends=starts.ends, not_searched=tuple(starts.not_tried),
        as_moved=effect_as_moved(after, [one for one in tried if one.name not in state.names], left_open)
        if moved or beyond else None,
        steps=_steps(selection, ErrorStep(as_filed(posterior.tolerance), posterior.error(nominal))),
        effects=errors.effects,
        undetectable=hidden, shape=shape if excess > UNEXPLAINED else None, coloured=colour is not None,
        removed=removed, band=compared_band(fine.runs.runs), signals=signal_errors_of(fine, baseline, state),
        shows_forces=fine.shows_forces, best_linear=_best_linear(selection),
        signals_off=signals_off(fine.record_errors, state.record), excess_of=excess_of,
        overfit=(len(state.logs) + len(free_parameters_of(state.effects))) / sum(
            run.count - run.first for run in fine.runs.runs),
        force_gain=force_gain(selection.before.linear),
        state=state, car=fitted_car(fine, baseline, state), tolerance=posterior.tolerance.share,
    )


def _best_linear(selection: Selection) -> float | None:
    """What a linear car could explain at most, by the refitted model, where that is linear; None where the model that
    was found is linear too, and explains more: what resonates longer than a segment is less coherent there."""
    before, now = selection.before, selection.now
    runs = before.posterior.runs.runs
    car, found = (one.posterior.car(one.state.effects, one.state.logs) for one in (before, now))
    if car.bends_laws:
        return None
    main = [run.main(one) for run, one in zip(runs, before.state.predictions, strict=True)]
    share = best_linear_share(ModelResiduals(runs, car, main, ()), before.hold_out.error)
    return share if share is None or found.bends_laws or share > 1 - now.hold_out.error**2 else None


def refit(posterior: Posterior, nominal: State) -> Baseline:
    """The baseline of a search: the car's own numbers and the distance errors fitted."""
    return Baseline.of(fit_model(posterior, nominal))


def _left_open(posterior: Posterior, state: State, errors: StandardErrors) -> dict[str, tuple[float, float]]:
    """As of ``LabDiagnosis``."""
    vehicle, found = posterior.prior.vehicle(posterior.vehicle, state.logs), {}
    for name, error, deviation in zip(posterior.prior.names, errors.logs, posterior.prior.deviations, strict=True):
        if deviation > Tolerance().numbers:
            value = named_parameters.read(vehicle, name)
            found[name] = value, value * float(error)
    return found


def obstacles_of(posterior: Posterior, effects: Mapping[str, Effect], present: Sequence[Chosen]) -> dict[str, str]:
    """Effects that cannot be tried, and why."""
    runs = posterior.runs.runs
    driven = (all(run.two_tracks for run in runs), are_on_rig(runs), all(run.pushed for run in runs))
    by_road = all(run.facts.places_by == BY_ROAD for run in runs)
    at_rest = posterior.vehicle.model == "single_mass" and all(run.at_rest for run in runs)
    there = {one.effect.name for one in present}
    sensors = [run.facts.main for run in runs]
    found = {}
    for name, effect in effects.items():
        why = ALREADY_PRESENT if name in there else effect.obstacle_on(posterior.vehicle, *driven)
        if why is None and all({one.kind, one.measures} & set(effect.not_of) for one in sensors):
            why = f"no {' or '.join(sorted({one.kind or f'sensor of {one.measures}' for one in sensors}))} has it"
        if why is None and all(one.measures in effect.found_of for one in sensors):
            why = f"the scale of a {' or '.join(sorted({one.measures for one in sensors}))} is always estimated"
        if why is None and isinstance(effect, SensorEffect) and all(run.past is Past.FREE for run in runs):
            why = "nothing drives the run: another initial state would look the same as this sensor effect"
        if why is None and effect.against_ground and at_rest:
            why = "its base is at rest, so a force against the ground equals one against the base"
        if why is None and by_road and not effect.reshapes:
            why = LAID_BY_THE_ROAD
        if why is not None:
            found[name] = why
    return found


def _fit_finely(search: Search, selection: Selection) -> tuple[Selection, LinearModel]:
    """The model that was found, fitted by fine simulations. Effects that are at an end of their range then are dropped,
    and what they imitated is sought without them (a damper whose knee goes to 0 is friction). Dropped are those, too,
    that are not unusually far from doing nothing and gain no more than chance: they made up for the roughness of the
    search's simulations (a delay beside dry friction, whose force comes part of a step late). What does nearly the same
    as the car's own numbers has large standard errors however much it gains (W. Hauck and A. Donner, Journal of the
    American Statistical Association 72, 1977)."""
    search.progress("fitting it finely")
    posterior = selection.before.posterior
    fine = posterior.simulated(steps_hz(posterior.vehicle))
    while True:
        state = selection.now.state
        start = fine.state_at(state.effects, state.logs, state.record, state.size)
        after = fit_model(fine, start, selection.now.linear.numbers)
        ended = [one.effect.name for one in after.state.effects[search.present:] if is_outside_data(fine, one)]
        if ended:
            selection = search.without_effect(selection, ended[0])
            search = replace(search, effects=[one for one in search.effects if one.name != ended[0]])
            selection = search.go_on(selection)
        else:
            errors = standard_errors(after)
            far = {one.effect.name: deviations_from_null(one, errors.numbers)
                   for one in errors.effects[search.present:]}
            weakest = min(far, key=far.__getitem__, default=None)
            if weakest is None or far[weakest] > UNUSUAL_SIGMA or _gains_more_than_chance(
                    search, selection.before, after, weakest):
                return selection, after
            selection = search.without_effect(selection, weakest)


def _gains_more_than_chance(search: Search, before: Baseline, after: LinearModel, name: str) -> bool:
    """Whether one of a model's effects gains more than chance would."""
    fine, state = after.posterior, after.state
    one = next(each for each in state.effects if each.effect.name == name)
    rest = fit_model(fine, fine.state_at(effects_without(state, name), state.logs, state.record, state.size),
                     after.numbers)
    return search.likelihood.chance(one, rest.score - after.score, before, len(search.effects)) < FALSE_ALARM


def _steps(selection: Selection, nominal: ErrorStep) -> tuple[ErrorStep, ...]:
    """The models of the search in order."""
    steps = [nominal, ErrorStep.of(REFITTED, selection.before.hold_out)]
    steps += [ErrorStep.of(f"with {name}", hold_out) for name, hold_out in selection.steps]
    last = selection.steps[-1][1] if selection.steps else selection.before.hold_out
    if selection.now.hold_out is not last:
        steps.append(ErrorStep.of("with the final model", selection.now.hold_out))
    return tuple(steps)


def candidates_of(search: Search[M, P, F], selection: Selection[M, P, F], after: Sequence[Chosen],
                  best_of: Callable[[P], tuple[Chosen, float, HoldOut]]
                  ) -> tuple[tuple[CandidateEffect, ...], tuple[str, ...]]:
    """The missing effects, then the others that are better than the refitted model, the least likely by chance first,
    each with its error on top of that model; and the names of those that are no better.

    after      effects of the model that was found, with their final values
    best_of    an effect that was screened only at its best strength, its gain by the score test less what its numbers
               cost, and the refitted model with it on data that no fit saw
    """
    base, count, found = selection.before, len(search.effects), []
    before, last, fits = base.hold_out, selection.now.hold_out, selection.first.fits
    final = {one.effect.name: Chosen(one.effect, one.values) for one in after}

    def candidate(one: Chosen, gain: float, there: HoldOut, rivals: tuple[str, ...] = (), fitted: bool = True
                  ) -> CandidateEffect:
        unseen = before.deviance - there.deviance
        return CandidateEffect(one, there.error, search.likelihood.chance(one, gain, base, count), gain,
                               unseen if np.isfinite(unseen) else None, rivals, fitted)

    alone = dict[str, CandidateEffect]()
    for fit in fits:
        there = candidate(fit.chosen, fit.gain, fit.hold_out)
        alone[fit.effect.name] = replace(there, confused_with=tuple(
            one.effect.name for one in fits if one is not fit and abs(one.gain - fit.gain) < INDISTINGUISHABLE
            and there.p_value < FALSE_ALARM))
    for screened in selection.first.unfitted:
        best, gain, unseen = best_of(screened)
        alone[screened.effect.name] = candidate(best, gain - selection.first.refit_gain, unseen, fitted=False)
    for name, gain in selection.gains.items():
        here = candidate(final[name], gain, last, selection.rivals.get(name, ()))
        by_itself = alone.pop(name, here)
        found.append(replace(here, error=by_itself.error, held_out_gain=by_itself.held_out_gain))
    better = [one for one in alone.values() if one.gain > 0 and one.error < before.error]
    return ((*found, *sorted(better, key=lambda one: (one.p_value, -one.gain))),
            tuple(one.effect.name for one in alone.values() if one not in better))


def _best_of_screened(base: Baseline, one: Screened) -> tuple[Chosen, float, HoldOut]:
    """As ``candidates_of`` asks for it."""
    trial = one.trials[0]
    gain = trial.gain - len(free_parameters_of([trial.one])) * float(np.log(base.posterior.freedom))
    return trial.one, gain, cross_validate(base.linear, [change[None] for change in trial.change()])
