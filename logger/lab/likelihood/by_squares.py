"""Fits by least squares, which lead to where the likelihood may decide.

Problem: with a free noise level in each band (``whittle``) the likelihood of a model that is far off gains in one band
what it loses in all others, and has optima all over the place. Solution: squares that weigh all bands alike have fewer;
only from their minimum the likelihood goes on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import CONVERGED, optimise_numbers
from logger.lab.likelihood.posterior import NotSimulated, Posterior, State
from logger.lab.likelihood.repeats import repeat_each_other
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.effect import Chosen
from logger.vehicle.named_parameters import free_parameters_of

Array = npt.NDArray[np.float64]


class BySquares:
    """Least squares over runs of which none repeats another, all bands weighed alike."""

    def __init__(self, posterior: Posterior) -> None:
        runs, kept = posterior.runs.runs, list[int]()
        for index, run in enumerate(runs):
            if not any(repeat_each_other(runs[one], run) for one in kept):
                kept.append(index)
        self.kept, self.whole = kept, posterior
        self.posterior = posterior if len(kept) == len(runs) else Posterior(
            SimulatedRuns([runs[one] for one in kept], posterior.runs.fine_hz), posterior.vehicle, posterior.tolerance,
            posterior.start_vehicle, posterior.prior, [posterior.readings[one] for one in kept])
        self.whiteners = [bands.flat_whitener(np.concatenate([run.measured_mps2 * run.read, *run.more]))
                          for bands, run in zip(self.posterior.bands, self.posterior.runs.runs, strict=True)]
        self.freedom = self.posterior.freedom

    def squares(self, state: State) -> float:
        """Sum of the squares of a state's residuals, weighed, and cost of its priors."""
        return self.posterior.prior.cost(state.logs) + sum(float((whitener(one)**2).sum()) for whitener, one in zip(
            self.whiteners, self.posterior.residuals(state), strict=True))

    def at(self, effects: Sequence[Chosen], logs: Array, near: State) -> tuple[float, State] | None:
        """The state with these numbers and the records' errors of another state, of these runs or of all, and its
        squares; None where it cannot be."""
        record = near.record if len(near.record) == len(self.kept) else [near.record[one] for one in self.kept]
        try:
            with np.errstate(all="ignore"):
                state = self.posterior.state_at(effects, logs, record, near.size)
                squares = self.squares(state)
        except NotSimulated:
            return None
        return (squares, state) if np.isfinite(squares) else None

    def improved(self, start: State, rounds: int) -> tuple[float, State]:
        """A state improved in so many rounds of steps, and its squares."""
        least, best = self.squares(start), start
        for _ in range(rounds):
            try:
                with np.errstate(all="ignore"):
                    linear = LinearModel(self.posterior, best, self.posterior.number_slopes(
                        best, self.posterior.prior.steps), self.whiteners)
                    found = optimise_numbers(linear, best, free_parameters_of(best.effects))
                    found = self.posterior.state_at(found.effects, found.logs, found.record, found.size)
                    squares = self.squares(found)
            except NotSimulated:
                break
            if not squares < least:
                break
            enough = squares > least * (1 - CONVERGED / self.freedom)
            least, best = squares, found
            if enough:
                break
        return least, best

    def of_all(self, state: State, near: State) -> State:
        """The state on all runs."""
        record = list(near.record)
        for index, one in zip(self.kept, state.record, strict=True):
            record[index] = one
        return self.whole.state_at(state.effects, state.logs, record, near.size)
