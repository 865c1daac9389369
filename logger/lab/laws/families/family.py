"""The interface of a family of laws.

A family is one file that offers ``FAMILY``: in the field's words what it is, the laws to be tried (``drafts``), given
what the runs show of the car's motions, and the sentence with numbers for one that was found.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from logger.lab.laws.draft import Draft
from logger.lab.likelihood.posterior import Posterior, State
from logger.runs import Run
from logger.vehicle.compose import Response
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]
_EXPONENT = "power_ratio"  # what laws that are powers call theirs
FormatNumber = Callable[..., str]
"""A number of the law in words, with its standard error and unit, by its name: ``say("yield_force_n")`` is "161 ± 4 N";
``say("yield_travel_m", 1000.0, "mm")`` the number in another unit."""


@dataclass(frozen=True, eq=False)
class LawContext:
    """The fitted model without a law, from which laws are drafted.

    posterior    of the runs
    state        the fitted model
    """

    posterior: Posterior
    state: State

    @property
    def vehicle(self) -> Vehicle:
        """The fitted car."""
        return self.posterior.prior.vehicle(self.posterior.vehicle, self.state.logs)

    @property
    def runs(self) -> Sequence[Run]:
        """The measured runs."""
        return self.posterior.runs.runs

    @cached_property
    def residuals(self) -> list[Array]:
        """Measured minus predicted acceleration (n,), per run, whole [m/s2]."""
        return [run.measured_mps2 - run.main(one)
                for run, one in zip(self.runs, self.state.predictions, strict=True)]

    @cached_property
    def responses(self) -> list[Response]:
        """Motions of the suspensions and tires in each run."""
        return self.posterior.runs.respond(self.posterior.car(self.state.effects, self.state.logs),
                                           self.posterior.distance_error_m(self.state.record))

    def reach(self, what: str, share: float) -> float:
        """Quantile of the size of a motion of all wheels (``travel_m``, ``rate_mps`` or ``deflection_m``) for a share
        of the time, rounded to two digits, as it stands in a file."""
        size = np.concatenate([np.abs(getattr(one, what)[run.first:]).ravel()
                               for run, one in zip(self.runs, self.responses, strict=True)])
        return rounded(float(np.quantile(size, share)))

    @property
    def axles(self) -> tuple[str, ...]:
        """Axles that a law may act on alone."""
        return () if self.vehicle.rear is None else ("front", "rear")

    @property
    def is_driven(self) -> bool:
        """Whether all runs are of a road, with a speed and a distance."""
        return not any(run.timed for run in self.runs)


class Family(ABC):
    """A family of laws.

    name               as the file's
    title              in a few words
    related_effects    names of effects of the list that one of its laws may nearly be
    shown_by           the drive that shows it best, as an instruction
    straight_at        the exponent at which its laws are straight lines, which are numbers of the car; None: at none
    stands_out         whether its laws are loud at few frequencies and drafted only where those stand out of the noise:
                       a whole residual may be no louder than the noise for all that
    """

    name: str
    title: str
    related_effects: tuple[str, ...] = ()
    shown_by: str
    straight_at: float | None = None
    stands_out: bool = False

    @abstractmethod
    def drafts(self, context: LawContext) -> list[Draft]:
        """Laws to be tried, simple ones first; none where such a law cannot be there."""

    def narrower(self, draft: Draft, context: LawContext) -> list[Draft]:
        """Variations of a law that promises something: a force at one axle alone."""
        if draft.kind != "ForceEffect" or draft.axle:
            return []
        return [draft.of_axle(axle) for axle in context.axles]

    def is_straight(self, draft: Draft, found: Chosen, sigma: float) -> bool:
        """Whether a law that was found is a straight line, within so many standard errors."""
        if self.straight_at is None or _EXPONENT not in found.values:
            return False
        error = found.standard_errors.get(_EXPONENT, np.inf)
        return abs(found.values[_EXPONENT] - self.straight_at) < sigma * error

    @abstractmethod
    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        """The law in words, with numbers and their standard errors: "friction with memory, 161 ± 4 N over 4.0 ± 0.2
        mm". The axle is added by the caller."""


def rounded(value: float, digits: int = 2) -> float:
    """A number rounded to so many significant digits."""
    return float(f"{value:.{digits}g}")
