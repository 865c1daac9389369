"""Before anybody drives: which effects runs, or planned drives, could show and distinguish."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from logger.api.bench import Bench, among, planned_bench, tolerance_of
from logger.api.lab import bench_with, word_of
from logger.api.lab_questions import PlanQuestion
from logger.api.question import function
from logger.api.roads import read_profile
from logger.api.run_checks import LEAST_S
from logger.api.shown import CommandResult
from logger.api.terms import each
from logger.api.vehicles import model_of
from logger.errors import BadInput
from logger.estimation.sensor_noise import NOISE_MPS2
from logger.store.formats import drive_file, profile_file, vehicle_file

if TYPE_CHECKING:
    from logger.lab.planning import plan as plan_results
    from logger.profiles.track import Track
    from logger.report.html import Html
    from logger.runs import Run


@dataclass(frozen=True)
class NextDrive:
    """A drive that may come next.

    do            in words
    gains         deviations by which effects would be separated better from what is most like them
    more_named    how many more effects ``diagnose`` would name, were each of them there by itself
    """

    do: str
    gains: Mapping[str, float]
    more_named: float


@dataclass(frozen=True, eq=False, repr=False)
class Plan(CommandResult):
    """What drives could show of effects at their usual strength, in standard deviations, the car's numbers and the
    distances being free within their tolerance.

    found            all that the lab says, of the ``vehicle`` of this name
    detectability    by how much each effect stands out, by name
    isolability      what of the first effect remains when the second one is fitted in its place, by both names
    groups           effects that would be detected, but not separated from each other
    next             drives that may come next, those that add most first
    noise_mps2       of the accelerometer, rounding in it [m/s2]
    """

    found: plan_results.Plan
    vehicle: str
    detectability: Mapping[str, float]
    isolability: Mapping[str, Mapping[str, float]]
    groups: tuple[tuple[str, ...], ...]
    next: tuple[NextDrive, ...]
    noise_mps2: float

    def figures(self) -> list[Html]:
        """The matrix of what remains of one effect when another is fitted."""
        from logger.report.plan_page import figure

        return [figure(self.found)]

    def as_page(self, of: str) -> Html:
        """The plan as one HTML document."""
        from logger.report.plan_page import page

        return page(self.found, self.vehicle)


def plan_by(question: PlanQuestion) -> Plan:
    """The answer to ``PlanQuestion``, which says what is raised."""
    from logger.lab.planning.plan import plan as planned_by_lab
    from logger.lab.planning.planned_drive import PlannedCar, SensorNoise

    model, tolerance, bench = model_of(question.vehicle), tolerance_of(question.tolerance), None
    road = None if question.profile is None else drive_file.track_of(
        question.profile if isinstance(question.profile, profile_file.Profile) else read_profile(question.profile))
    if each(question.runs):
        bench = bench_with(question, "ridelog plan")
    elif not question.speeds_mps:
        raise BadInput("plan: expected a run, or --profile and --speed of a planned drive")
    drives = _empty_drives(model, road, question)
    ready = bench or planned_bench(word_of(question.vehicle, model), model, drives,
                                   list(map(str, question.effect_files)), tolerance)
    posterior = ready.posterior(searches=True)
    there = PlannedCar(posterior.vehicle, posterior.start_vehicle, tolerance, model.effects,
                       posterior.prior.logs(posterior.vehicle, posterior.start_vehicle))
    usual = SensorNoise(NOISE_MPS2, question.step_mps2)
    noise = None if question.noise_mps2 is None else SensorNoise(question.noise_mps2, question.step_mps2)
    with ready.blamed():
        found = planned_by_lab(there, None if bench is None else posterior, drives,
                               among(ready.effects, question.candidates), noise, usual, road or _longest_road(bench),
                               question.progress)
    return plan_of(found, model.vehicle.name)


plan = function("plan", PlanQuestion, plan_by)


def plan_of(found: plan_results.Plan, vehicle: str) -> Plan:
    """What the lab found, as it is shown."""
    from logger.report.plan_text import as_json, do_words, plan_lines

    summary = as_json(found)
    return Plan("\n".join(plan_lines(found)), summary, found, vehicle, summary["detectability"],
                summary["isolability"], tuple(map(tuple, found.groups)),
                tuple(NextDrive(do_words(one.option), dict(one.gains), one.more_named) for one in found.next),
                summary["noise_mps2"])


def _empty_drives(model: vehicle_file.Model, road: Track | None, question: PlanQuestion) -> list[Run]:
    """The drives that are planned. WrongOption for one that is too short, or too long to be simulated."""
    from logger.lab.planning.planned_drive import at_speed

    name = str(question.profile) if isinstance(question.profile, Path | str) else "profile"
    found = []
    for speed in question.speeds_mps:
        assert road is not None
        seconds = (road.end_m - road.start_m) / speed
        if seconds < LEAST_S:
            raise question.wrong("speeds_mps", f" {speed:g}: expected a drive of {LEAST_S:g} s or longer, found "
                                               f"{seconds:.3g} s over {name}")
        try:
            found.append(at_speed(f"{name} at {speed:g} m/s", road, model.vehicle, speed))
        except ValueError as error:
            raise question.wrong("speeds_mps", f" {speed:g}: {error}") from None
    return found


def _longest_road(bench: Bench | None) -> Track | None:
    """Of the runs; None where none has one."""
    from logger.profiles.track import Track

    roads = [] if bench is None else [run.track for run in bench.runs.runs if isinstance(run.track, Track)]
    return max(roads, key=lambda one: float(np.subtract(one.end_m, one.start_m)), default=None)
