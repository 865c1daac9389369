"""A model with effects added: fitted on all that there is, with what is known of every number.

Problem: whoever adds an effect wants its numbers with their errors, and wants to see what else changed: a missing
effect biases the car's own numbers, and adding it removes the bias; and a fit always gains a little when it gets one
more number. Solution: the car is fitted with and without the effect on all of the runs, each number comes with its
standard error from the information matrix, and the gain in evidence says how often noise would do as much. Evidence
weighs frequencies by their noise: where it gains and the error on what no fit saw rises, the effect does not help. What
is written holds on to the numbers that were given; what is compared side by side does not, on either side, so that
nothing but the effect makes the difference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import aligned, fit, own_slopes, read_beside
from logger.lab.likelihood.noise_floor import SignalErrors, floor_error, noise_as_read, signal_errors_of
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.record_band import ComparedBand, compared_band
from logger.lab.likelihood.standard_errors import number_errors, standard_errors
from logger.lab.residuals.removed import Removed, removed_from
from logger.lab.selection.evidence import FALSE_ALARM, probability_by_chance
from logger.lab.selection.holdout import HoldOut, held_out
from logger.vehicle.effect import Chosen
from logger.vehicle.named_parameters import read
from logger.vehicle.uncertain import NumberErrors
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

BIASED = 2.0
"""A number that an effect moves by more standard errors than this had been biased by its absence."""


@dataclass(frozen=True)
class Number:
    """A number of the car: as it was given, refitted without the added effects, and with them, as far off as the runs
    ask for; with standard errors, which include how far off it may have been.

    shift      from the one to the other, in standard errors of the last
    written    with the effects, held near what was given: what the vehicle has then
    """

    name: str
    nominal: float
    without: float
    without_standard_error: float
    found: float
    standard_error: float
    written: float

    @property
    def shift(self) -> float:
        """From without to with, in standard errors of the last."""
        return (self.found - self.without) / self.standard_error if self.standard_error > 0 else 0.0

    @property
    def biased(self) -> bool:
        """Whether the missing effects had biased it."""
        return abs(self.shift) > BIASED


@dataclass(frozen=True, eq=False)
class AddedEffects:
    """A vehicle with effects added.

    vehicle             with its numbers refitted
    effects             all, with values and standard errors
    names               of those that were added
    numbers             of the car
    error_before        of the vehicle and effects as they were
    error_refitted      of those with their numbers refitted and the distance errors taken out
    error_after         of the model with the effects, fitted in the same way
    error_as_written    of that model on the distances as recorded: what a comparison with it begins at
    noise_floor_error   the error that the sensor's noise makes
    p_value             how often, at most, noise alone would gain as much
    unseen_before, unseen_after    the model without and with the effects on what its fit did not see; None: not known
    band                what of the runs was compared; None: all of it
    removed             what is taken out of the errors before they are judged: drift, wrong distances
    errors              of the numbers of vehicle and effects together
    signals             errors of signals beside the sensor's acceleration, by name: refitted without and with
    """

    vehicle: Vehicle
    effects: tuple[Chosen, ...]
    names: tuple[str, ...]
    numbers: tuple[Number, ...]
    error_before: float
    error_refitted: float
    error_after: float
    error_as_written: float
    noise_floor_error: float
    p_value: float
    removed: Removed
    errors: NumberErrors
    signals: Mapping[str, SignalErrors] = field(default_factory=dict)
    unseen_before: HoldOut | None = None
    unseen_after: HoldOut | None = None
    band: ComparedBand | None = None

    @property
    def gains(self) -> bool:
        """Whether the effects gain more than noise would."""
        return self.p_value < FALSE_ALARM

    @property
    def raises(self) -> bool:
        """Whether the error on what no fit saw is larger with them. Of effects that do no more than move runs nothing
        is asked: without them the distance errors do the same, and these are known on all of a run."""
        before, after = self.unseen_before, self.unseen_after
        if before is None or after is None or not any(one.effect.reshapes for one in self.new):
            return False
        return after.raises(before)

    @property
    def helps(self) -> bool:
        """Whether the effects gain more than noise would, and not only where the fit looked."""
        return self.gains and not self.raises

    @property
    def new(self) -> tuple[Chosen, ...]:
        """The effects that were added."""
        return tuple(one for one in self.effects if one.effect.name in self.names)

    @property
    def moved(self) -> list[Number]:
        """The car's numbers, those that the effects moved most first."""
        return moved_between(self, self)


def moved_between(first: AddedEffects, last: AddedEffects) -> list[Number]:
    """The car's numbers without the effects that ``first`` added, and with all that ``last`` has; those that moved most
    first."""
    found = [Number(one.name, one.nominal, one.without, one.without_standard_error, now.found, now.standard_error,
                    now.written)
             for one, now in zip(first.numbers, last.numbers, strict=True)]
    return sorted(found, key=lambda one: -abs(one.shift))


def add(posterior: Posterior, present: Sequence[Chosen], added: Sequence[Chosen], candidates: int = 1) -> AddedEffects:
    """Fit the vehicle, with the effects that are present, without and with those that are added; the values that these
    have are where the fit begins, and were chosen among so many candidates.

    ValueError where the vehicle lacks what an effect needs.
    """
    before = read_beside(fit(aligned(posterior, posterior.start(present))))
    posterior = before.posterior
    after = _with(posterior, before, (*before.state.effects, *added), (*present, *added))
    loose = posterior.without_wall()
    (bent, spread_before), (freed, spread_after) = (_freed(loose, one) for one in (before, after))
    prior, nominal = posterior.prior, posterior.vehicle
    vehicle, without, found = (prior.vehicle(nominal, logs) for logs in (
        after.state.logs, bent.state.logs, freed.state.logs))
    numbers = tuple(
        Number(name, read(nominal, name), read(without, name), read(without, name) * float(was), read(found, name),
               read(found, name) * float(now), read(vehicle, name))
        for name, was, now in zip(prior.names, spread_before, spread_after, strict=True)
    )
    effects, _ = standard_errors(after)
    start, state = posterior.start(present), after.state
    return AddedEffects(
        vehicle, effects, tuple(one.effect.name for one in added), numbers,
        error_before=posterior.error(start), error_refitted=posterior.error(before.state),
        error_after=posterior.error(state), error_as_written=posterior.error(posterior.at(state.effects, state.logs)),
        noise_floor_error=floor_error(posterior, noise_as_read(posterior, state)),
        p_value=probability_by_chance(before.score - after.score, candidates),
        removed=removed_from(posterior, start.predictions, state), errors=number_errors(after),
        unseen_before=held_out(before, own_slopes(before)), unseen_after=held_out(after, own_slopes(after)),
        band=compared_band(posterior.runs.runs), signals=signal_errors_of(posterior, before.state, state))


def _with(posterior: Posterior, before: LinearModel, beside: tuple[Chosen, ...],
          anew: tuple[Chosen, ...]) -> LinearModel:
    """The model with more effects. A car that was refitted without what is missing may be bent too far, or lie too
    wrong, to begin with."""
    state = before.state
    starts = [aligned(posterior, one) for one in (
        posterior.at(beside, state.logs, state.record, state.size), posterior.start(anew))]
    return fit(min(starts, key=lambda one: one.score))


def _freed(loose: Posterior, found: LinearModel) -> tuple[LinearModel, Array]:
    """The model fitted without holding on to the car's numbers, and standard errors of their logarithms (p,)."""
    if found.posterior.prior.at_the_wall(found.state.logs):
        found = fit(LinearModel(loose, found.state), found.numbers)
    return found, standard_errors(found)[1]
