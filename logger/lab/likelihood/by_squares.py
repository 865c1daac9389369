"""Fits by least squares, which lead to where the likelihood may decide.

Problem: with a free noise level in each band (``whittle``) the likelihood of a model that is far off gains in one band
what it loses in all others, and has optima all over the place. Solution: squares that weigh all bands alike have fewer;
only from their minimum the likelihood goes on. Their level is free, so that priors weigh as little as they do there:
were the noise as large as all that was measured, a damper known to a factor of two would stay at what its file says.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.distance_error import ErrorSize
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import CONVERGED, optimise_numbers, record_by_lag
from logger.lab.likelihood.noise_floor import repeat_each_other
from logger.lab.likelihood.posterior import NotSimulated, Posterior, State
from logger.lab.likelihood.signals import JointWhitener
from logger.vehicle.effect import Chosen
from logger.vehicle.named_parameters import free_parameters_of

ROUNDS = 12
"""So many rounds of steps lead to the end."""


class BySquares:
    """Least squares over some runs (``kept``) of a posterior, of which none repeats another, all bands weighed alike.
    """

    def __init__(self, posterior: Posterior, kept: Sequence[int]) -> None:
        runs = posterior.runs.runs
        self.kept, self.whole = kept, posterior
        self.posterior = posterior if len(kept) == len(runs) else Posterior(
            posterior.runs.some(kept), posterior.vehicle, posterior.tolerance, posterior.start_vehicle, posterior.prior,
            [posterior.readings[one] for one in kept])
        self.whiteners = self._whiteners(1.0)

    @classmethod
    def of(cls, posterior: Posterior) -> "BySquares":
        """Those over the runs of a posterior."""
        runs, kept = posterior.runs.runs, list[int]()
        for index, run in enumerate(runs):
            if not any(repeat_each_other(runs[one], run) for one in kept):
                kept.append(index)
        return cls(posterior, kept)

    def _whiteners(self, noise: float) -> list[JointWhitener]:
        """For a noise that is such a share of what was measured."""
        return [bands.flat_whitener(noise * np.concatenate([run.measured_mps2 * run.read, *run.more]))
                for bands, run in zip(self.posterior.bands, self.posterior.runs.runs, strict=True)]

    def _power(self, state: State) -> float:
        """Mean square of a state's residuals over that of what was measured."""
        return sum(float((whitener(one)**2).sum()) for whitener, one in zip(
            self.whiteners, self.posterior.residuals(state), strict=True)) / self.posterior.freedom

    def deviance(self, state: State) -> float:
        """Minus twice the log of the likelihood of a state under white noise of any level, and cost of its priors."""
        return float(self.posterior.freedom * np.log(self._power(state))) + self.posterior.prior.cost(state.logs)

    def at(self, effects: Sequence[Chosen], logs: Array, near: State) -> tuple[float, State] | None:
        """The state with these numbers and the records' errors of another state, of these runs or of all, and its
        deviance; None where it cannot be. Another car took a wave sooner or later, and its distance errors make up for
        that: those that the lags behind this one amount to are taken where they are likelier."""
        return self._at(effects, logs, self._kept_of(near.record), near.size)

    def rank(self, effects: Sequence[Chosen], logs: Array, near: State) -> float:
        """The deviance of a car by the loudest run alone, simulated roughly: enough to tell which of many cars are
        near. Arguments as of ``at``; infinite where it cannot be."""
        record = self._kept_of(near.record)[self.kept.index(self._loudest.kept[0])]
        found = self._loudest._at(effects, logs, [record], near.size, rough=True)
        return np.inf if found is None else found[0]

    def _kept_of(self, record: Sequence[Array]) -> list[Array]:
        return list(record) if len(record) == len(self.kept) else [record[one] for one in self.kept]

    def _at(self, effects: Sequence[Chosen], logs: Array, record: list[Array], size: ErrorSize, rough: bool = False
            ) -> tuple[float, State] | None:
        def there(record: list[Array]) -> tuple[float, State]:
            predictions = self.posterior.predict(effects, logs, record, rough, () if rough else None)
            state = State(tuple(effects), logs, record, size, predictions)
            return self.deviance(state), state

        try:
            with np.errstate(all="ignore"):
                found = there(record)
                if (aligned := record_by_lag(self.posterior, found[1])) is not None:
                    found = min(found, there(aligned), key=lambda one: one[0])
        except NotSimulated:
            return None
        return found if np.isfinite(found[0]) else None

    @cached_property
    def _loudest(self) -> "BySquares":
        loudest = max(self.kept, key=lambda one: float(self.whole.runs.runs[one].kept_mps2.std()))
        return self if len(self.kept) == 1 else BySquares(self.whole, [loudest])

    def improved(self, start: State, rounds: int = ROUNDS, to_reach: float = np.inf, min_share: float = 0.0,
                 later: int = 0) -> tuple[float, State]:
        """A state improved in so many rounds of steps, and its deviance; as long as those that are left, and so many
        ``later``, may reach a deviance at the pace of the last, and a round gains such a share of the whole gain."""
        least = first = self.deviance(start)
        best = start
        for left in reversed(range(later, later + rounds)):
            try:
                with np.errstate(all="ignore"):
                    linear = LinearModel(self.posterior, best, self.posterior.number_slopes(
                        best, self.posterior.prior.steps), self._whiteners(float(np.sqrt(self._power(best)))))
                    found = optimise_numbers(linear, best, free_parameters_of(best.effects))
                    found = self.posterior.state_at(found.effects, found.logs, found.record, found.size)
                    deviance = self.deviance(found)
            except NotSimulated:
                break
            if not deviance < least:
                break
            enough = least - deviance < max(CONVERGED, (deviance - to_reach) / max(left, 1),
                                            min_share * (first - deviance))
            least, best = deviance, found
            if enough:
                break
        return least, best

    def of_all(self, state: State, near: State) -> State:
        """The state on all runs."""
        record = list(near.record)
        for index, one in zip(self.kept, state.record, strict=True):
            record[index] = one
        return self.whole.state_at(state.effects, state.logs, record, near.size)
