"""A car's free numbers from drives over roads that nobody measured: the fit, from start to verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from logger.identification.identifiability import NotIdentifiable
from logger.identification.unknown_road.drive_operator import Drive
from logger.identification.unknown_road.fisher_scoring import RoadFit, RoadProblem
from logger.identification.unknown_road.road_state import Options, ResponseCar


def fit_roads(car: ResponseCar, roads: Sequence[Sequence[Drive]], options: Options | None = None) -> RoadFit:
    """Fit a car's free numbers to drives, those over one road together.

    Raises NotIdentifiable when the drives cannot identify them, ValueError for no drive or no free number.
    """
    options = options or Options()
    problem = RoadProblem(car, roads, options)
    x = problem.start()
    first = problem.look(problem.shifted(x), information=True)
    findings = problem.structural(first)
    if findings and options.refuse:
        raise NotIdentifiable(findings)
    here = problem.look(x, information=True)
    before = here.error
    here, settled, steps = problem.descend(here)
    if options.last_probes > options.probes:
        problem = RoadProblem(car, roads, replace(options, probes=options.last_probes))
        here, settled, more = problem.descend(problem.look(here.x, information=True))
        steps += more
    here = problem.look(here.x, information=True)
    return problem.result(here, before, findings, settled, steps)
