"""Effects added to a model: both fitted to all data, with the standard error of every number.

Problem: whoever adds an effect wants its numbers with their errors, and wants to see what else changed: a missing
effect biases the car's own numbers, and adding it removes the bias; and a fit always gains a little when it gets one
more number. Solution: the car is fitted with and without the effect on all of the runs, each number comes with its
standard error from the information matrix, and the gain in evidence bounds how probably noise would do as much.
Where error and likelihood on stretches that no fit saw are both worse, the effect does not help. The
numbers are free in both fits, so that the effect alone makes the difference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from logger.bounds import SURE_SIGMA
from logger.lab.likelihood.by_squares import BySquares
from logger.lab.likelihood.distance_error import zero_of
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import align, fit_to_the_end
from logger.lab.likelihood.noise_floor import (
    SignalErrors,
    excess_over_noise,
    floor_error,
    sensor_noise_with_rounding,
    signal_errors_of,
)
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.record_band import ComparedBand, compared_band
from logger.lab.likelihood.standard_errors import standard_errors
from logger.lab.residuals.unexplained import Removed, removed_from
from logger.lab.selection.candidate_fit import chance_of
from logger.lab.selection.evidence import FALSE_ALARM
from logger.lab.selection.holdout import AS_FILED, REFITTED, ErrorStep, as_filed, cross_validate, rising
from logger.lab.selection.starts import fitted_from_starts
from logger.runs import are_on_rig
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.named_parameters import read
from logger.vehicle.uncertain import NumberErrors
from logger.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class ShiftedNumber:
    """A parameter of the car: nominal, refitted without the added effects, and with them; with standard errors, which
    include the prior; and whether less was known of it than is usual, so that the nominal value is a guess."""

    name: str
    nominal: float
    without: float
    without_standard_error: float
    found: float
    standard_error: float
    left_open: bool = False

    @property
    def shift(self) -> float:
        """Change from the fit without the effects to that with them, in standard errors of the latter."""
        return (self.found - self.without) / self.standard_error if self.standard_error > 0 else 0.0

    @property
    def biased(self) -> bool:
        """Whether the absence of the effects had biased it."""
        return abs(self.shift) > SURE_SIGMA


@dataclass(frozen=True, eq=False)
class AddedEffects:
    """A vehicle with effects added.

    vehicle                        with its numbers refitted
    effects                        all, with values and standard errors
    names                          of those that were added
    numbers                        of the car
    error_before                   of the vehicle and effects as they were
    error_refitted                 of those with their numbers refitted, on stretches that no fit saw
    error_after                    of the model with the effects, likewise
    error_as_written               of that model at the recorded distances: the error of a comparison with it
    noise_floor_error              the error that the sensor's noise makes
    p_value                        probability, at most, that noise alone gains as much
    held_out_gain                  of minus twice the log-likelihood on those stretches, by the effects
    band                           in which the runs were compared; None: all
    removed                        sensor drift, distance error and filtering, removed from the errors
    errors                         of the numbers of vehicle and effects together
    excess                         share by which the residual is above the noise in the run where it is largest
    signals                        errors of other signals than the sensor's acceleration, without and with the effects
    tolerance                      share by which the car's masses, springs and dampers may well be off
    filed                          what is said of the vehicle and effects as they were
    on_rig                         whether the runs have no distances
    """

    vehicle: Vehicle
    effects: tuple[Chosen, ...]
    names: tuple[str, ...]
    numbers: tuple[ShiftedNumber, ...]
    error_before: float
    error_refitted: float
    error_after: float
    error_as_written: float
    noise_floor_error: float
    p_value: float
    removed: Removed
    errors: NumberErrors
    excess: float
    signals: Mapping[str, SignalErrors] = field(default_factory=dict)
    held_out_gain: float = 0.0
    band: ComparedBand | None = None
    tolerance: float = Tolerance().share
    filed: str = AS_FILED
    on_rig: bool = False

    @property
    def gains(self) -> bool:
        """Whether the effects gain more than noise would."""
        return self.p_value < FALSE_ALARM

    @property
    def steps(self) -> tuple[ErrorStep, ...]:
        """The model as it was, refitted, and with the effects, on one scale."""
        return (ErrorStep(self.filed, self.error_before), ErrorStep(REFITTED, self.error_refitted),
                ErrorStep(f"with {' and '.join(self.names)}", self.error_after))

    @property
    def worsens_hold_out(self) -> bool:
        """Whether both the error and the likelihood of what no fit saw are worse with them. Not asked of effects that
        only shift runs: without them the distance errors do the same, and these are fitted to all of a run."""
        return (bool(rising(self.steps[1:])) and self.held_out_gain < 0
                and any(one.effect.reshapes for one in self.new))

    @property
    def helps(self) -> bool:
        """Whether the effects gain more than noise would, and are not worse on what no fit saw."""
        return self.gains and not self.worsens_hold_out

    @property
    def new(self) -> tuple[Chosen, ...]:
        """The effects that were added."""
        return tuple(one for one in self.effects if one.effect.name in self.names)

    @property
    def moved(self) -> list[ShiftedNumber]:
        """The car's numbers, those that the effects moved most first."""
        return moved_between(self, self)


def moved_between(first: AddedEffects, last: AddedEffects) -> list[ShiftedNumber]:
    """The car's numbers without the effects that ``first`` added, and with all that ``last`` has; those that moved most
    first."""
    found = [replace(one, found=now.found, standard_error=now.standard_error)
             for one, now in zip(first.numbers, last.numbers, strict=True)]
    return sorted(found, key=lambda one: -abs(one.shift))


def add(posterior: Posterior, present: Sequence[Chosen], added: Sequence[Chosen], candidates: int = 1,
        near: State | None = None) -> AddedEffects:
    """Fit the vehicle, with the effects that are present, without and with those that are added; the values that these
    have are where the fit begins, and were chosen among so many candidates.

    near    car and distances of a search that found the effects; the fit begins there, where that is better

    ValueError where the vehicle lacks what an effect needs.
    """
    before = fitted_from_starts(posterior, present)
    posterior = before.posterior
    after = _fit_with_effects(posterior, before, (*before.state.effects, *added), (*present, *added), near)
    errors = standard_errors(after)
    prior, nominal = posterior.prior, posterior.vehicle
    p_value = chance_of(after.state.effects[len(before.state.effects):], before.score - after.score, posterior.freedom,
                        candidates)
    without, found = (prior.vehicle(nominal, one.state.logs) for one in (before, after))
    numbers = tuple(
        ShiftedNumber(name, read(nominal, name), read(without, name), read(without, name) * float(was),
                      read(found, name), read(found, name) * float(now), bool(known > Tolerance().numbers))
        for name, was, now, known in zip(prior.names, standard_errors(before).logs, errors.logs, prior.deviations,
                                         strict=True)
    )
    start, state = posterior.start(present), after.state
    unseen_before, unseen_after = cross_validate(before), cross_validate(after)
    zero_n, exact = zero_of(posterior.record_errors, state.record)
    return AddedEffects(
        replace(found, preload_n=found.preload_n + zero_n), errors.effects, tuple(one.effect.name for one in added),
        numbers,
        error_before=posterior.error(start), error_refitted=unseen_before.error, error_after=unseen_after.error,
        error_as_written=posterior.error(posterior.state_at(state.effects, state.logs, exact)),
        noise_floor_error=floor_error(posterior, sensor_noise_with_rounding(posterior, state)),
        p_value=p_value, removed=removed_from(posterior, start.predictions, state), errors=errors.numbers,
        excess=excess_over_noise(posterior, state, FALSE_ALARM),
        held_out_gain=unseen_before.deviance - unseen_after.deviance,
        band=compared_band(posterior.runs.runs), signals=signal_errors_of(posterior, before.state, state),
        tolerance=posterior.tolerance.share, filed=as_filed(posterior.tolerance),
        on_rig=are_on_rig(posterior.runs.runs))


def _fit_with_effects(posterior: Posterior, before: LinearModel, refitted: tuple[Chosen, ...],
                      nominal: tuple[Chosen, ...], near: State | None) -> LinearModel:
    """Fit the model with more effects, from the refitted car, from the nominal one, or from one that a search found,
    whichever aligns better: numbers and distances that were refitted without what is missing may be too far off to
    begin with."""
    places = [posterior.state_at(refitted, one.logs, one.record, one.size)
              for one in (before.state, near) if one is not None]
    starts = [align(posterior, one) for one in (*places, posterior.start(nominal))]
    found = fit_to_the_end(min(starts, key=lambda one: one.score))
    begun = _best_trial(posterior, before.state, nominal)
    return found if begun is None else min(found, fit_to_the_end(LinearModel(posterior, begun)),
                                           key=lambda one: one.score)


def _best_trial(posterior: Posterior, near: State, nominal: tuple[Chosen, ...]) -> State | None:
    """On rigs, whose numbers are known less, where squares are least from sizes of the last effect that a search begins
    at, the best three of them improved; None on roads."""
    if not are_on_rig(posterior.runs.runs):
        return None
    by_squares, one = BySquares.of(posterior), nominal[-1]
    cars = (near.logs, posterior.prior.logs(posterior.vehicle, posterior.start_vehicle))
    trials = [trial for values in one.effect.trials()
              if (trial := chosen(one.effect, values, file=one.file)).is_plain is one.is_plain]
    begun = [by_squares.at((*nominal[:-1], trial), logs, near) for trial in trials for logs in cars]
    best = sorted((there for there in begun if there is not None), key=lambda there: there[0])[:3]
    ends = [by_squares.improved(state, 6) for _, state in best]
    return by_squares.of_all(min(ends, key=lambda end: end[0])[1], near) if ends else None

