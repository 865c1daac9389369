"""How much of some runs one effect explains at most, the car's numbers within what they are usually off by.

Problem: a record of which a model explains next to nothing may be another car's, and may be this one's with a large
change by one effect, as a sensor far behind the centre of gravity. Solution: one round of the search for effects, on
the car as its file has it: numbers that were refitted to such a record are no car's any more.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from logger.lab.diagnosis import obstacles_of
from logger.lab.likelihood.map_fit import align
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.priors import Tolerance
from logger.lab.selection.candidate_fit import CandidateFit
from logger.lab.selection.screening import Baseline, Screened, misalignment
from logger.lab.selection.stepwise import Search
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.effect import Chosen, Effect, ForceEffect
from logger.vehicle.stepping_loop import COMPILED
from logger.vehicle.vehicle import Vehicle


def error_with_best_effect(runs: SimulatedRuns, vehicle: Vehicle, present: Sequence[Chosen],
                           known: Mapping[str, Effect], numbers: float) -> float:
    """Error of this car with the one effect that explains most, its numbers refitted under their prior; infinite
    where none can be tried. Without the compiler forces are not, as each would take minutes."""
    posterior = Posterior(runs, vehicle, Tolerance(numbers=numbers))
    obstacles = obstacles_of(posterior, known, present)
    tried = [one for name, one in known.items()
             if name not in obstacles and (COMPILED or not isinstance(one, ForceEffect))]
    if not tried:
        return np.inf
    start = posterior.start(present)
    search: Search[Baseline, Screened, CandidateFit] = Search(tried, len(present), misalignment(posterior, start))
    nominal = align(posterior, start).with_number_slopes(posterior.number_slopes(start, posterior.prior.steps))
    fits = search.round(Baseline.of(nominal), tried).fits
    return min((posterior.error(one.found.state) for one in fits), default=np.inf)
