"""Before anybody drives: which effects runs, or planned drives, could show and distinguish."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from logger.api.bench import Bench, Notify, among, bench_of, planned_bench, silent, tolerance_of
from logger.api.lab import Runs, lab_drives, word_of
from logger.api.ranges import ADDED, NOISE, SPEED
from logger.api.roads import Profile, read_profile
from logger.api.run_checks import LEAST_S, checked_runs
from logger.api.shown import CommandResult
from logger.api.vehicles import Model, model_of
from logger.errors import BadInput
from logger.estimation.sensor_noise import NOISE_MPS2
from logger.store.formats import drive_file, vehicle_file

if TYPE_CHECKING:
    from logger.lab.likelihood.priors import Tolerance
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

    detectability    by how much each effect stands out, by name
    isolability      what of the first effect remains when the second one is fitted in its place, by both names
    groups           effects that would be detected, but not separated from each other
    next             drives that may come next, those that add most first
    noise_mps2       of the accelerometer, rounding in it [m/s2]
    """

    detectability: Mapping[str, float]
    isolability: Mapping[str, Mapping[str, float]]
    groups: tuple[tuple[str, ...], ...]
    next: tuple[NextDrive, ...]
    noise_mps2: float
    _figure: Html = field(repr=False)

    def figures(self) -> list[Html]:
        """The matrix of what remains of one effect when another is fitted."""
        return [self._figure]


def plan(
    vehicle: Model | Path | str, runs: Runs = (), *, profile: Profile | Path | str | None = None,
    speeds_mps: Sequence[float] = (), noise_mps2: float | None = None, step_mps2: float = 0.0,
    candidates: Collection[str] | None = None, effect_files: Sequence[Path | str] = (),
    tolerance: float | None = None, low_pass_hz: float | None = None, progress: Notify = silent,
    anyway: bool = False,
) -> Plan:
    """Which effects runs, or drives that are planned, could show and distinguish, and which drive would add most. It
    takes seconds, and the compiler of the ``lab`` extra.

    vehicle, runs, tolerance, low_pass_hz, anyway    as in ``compare``; no runs: only what is planned
    profile       the road of planned drives, and of the next one [m]; None: that of the longest run
    speeds_mps    one planned drive over all of the profile at each [m/s], 100 samples a second
    noise_mps2    r.m.s. of the sensor's noise [m/s2]; None: that of the runs, or 0.05
    step_mps2     what the planned sensor rounds to [m/s2]
    candidates, effect_files, progress    as in ``diagnose``

    Raises BadInput as ``diagnose``, where there is neither a run nor a planned drive, and for a drive that is shorter
    than 5 s.

    >>> found = plan(car, profile=runs[0].profile, speeds_mps=[9.0], candidates=["sensor_gain", "sensor_offset"])
    >>> found.isolability["sensor_offset"]["sensor_gain"] > 6
    True
    >>> found.next[0].more_named > 0
    True
    """
    word, model = word_of(vehicle, model_of(vehicle)), model_of(vehicle)
    given = [] if isinstance(runs, Sequence) and not isinstance(runs, str) and not runs else lab_drives(runs)
    road = None if profile is None else profile if isinstance(profile, Profile) else read_profile(profile)
    name = "profile" if profile is None or isinstance(profile, Profile) else str(profile)
    asked = PlannedDrives(None if road is None else drive_file.track_of(road), name, tuple(speeds_mps), noise_mps2,
                          step_mps2)
    bench = None if not given else bench_of(
        word, model, checked_runs(given, vehicle=model.vehicle), list(map(str, effect_files)), tolerance_of(tolerance),
        "plan", low_pass_hz=low_pass_hz, anyway=anyway)
    return plan_of(planned(word, model, bench, asked, list(map(str, effect_files)), tolerance_of(tolerance),
                           candidates, progress))


@dataclass(frozen=True)
class PlannedDrives:
    """What is planned: a road and its name, speeds over it [m/s], and the sensor to be; ``noise_mps2`` None: that of
    the runs, or a usual one."""

    road: Track | None
    name: str
    speeds_mps: tuple[float, ...] = ()
    noise_mps2: float | None = None
    step_mps2: float = 0.0


def planned(
    word: str, model: vehicle_file.Model, bench: Bench | None, asked: PlannedDrives, effect_files: Sequence[str],
    tolerance: Tolerance, candidates: Collection[str] | None = None, notify: Notify = silent,
) -> plan_results.Plan:
    """What the lab says. Arguments as of ``bench_of``; ``bench``: of the runs that there are. BadInput as ``plan``."""
    from logger.lab.planning.plan import plan as planned_by_lab
    from logger.lab.planning.planned_drive import PlannedCar, SensorNoise

    _check(asked, bench)
    drives = _empty_drives(model, asked)
    ready = bench or planned_bench(word, model, drives, effect_files, tolerance)
    posterior = ready.posterior(searches=True)
    there = PlannedCar(posterior.vehicle, posterior.start_vehicle, tolerance, model.effects,
                       posterior.prior.logs(posterior.vehicle, posterior.start_vehicle))
    usual = SensorNoise(NOISE_MPS2, asked.step_mps2)
    noise = None if asked.noise_mps2 is None else SensorNoise(asked.noise_mps2, asked.step_mps2)
    with ready.blamed():
        return planned_by_lab(there, None if bench is None else posterior, drives, among(ready.effects, candidates),
                              noise, usual, asked.road or _longest_road(bench), notify)


def plan_of(found: plan_results.Plan) -> Plan:
    """What the lab found, as it is shown."""
    from logger.report.plan_page import figure
    from logger.report.plan_text import as_json, plan_lines

    summary = as_json(found)
    return Plan("\n".join(plan_lines(found)), summary, summary["detectability"], summary["isolability"],
                tuple(map(tuple, summary["groups"])),
                tuple(NextDrive(one["do"], one["gains"], one["more_named"]) for one in summary["next"]),
                summary["noise_mps2"], figure(found))


def _check(asked: PlannedDrives, bench: Bench | None) -> None:
    """BadInput for what does not make a plan."""
    if asked.speeds_mps and asked.road is None:
        raise BadInput("plan: expected --profile with --speed, the road to be driven")
    if bench is None and not asked.speeds_mps:
        raise BadInput("plan: expected a run, or --profile and --speed of a planned drive")
    if asked.noise_mps2 is not None:
        NOISE.check("--noise", asked.noise_mps2)
    ADDED.check("--step", asked.step_mps2)
    for number, speed in enumerate(asked.speeds_mps):
        SPEED.check("--speed", speed)
        if speed in asked.speeds_mps[:number]:
            raise BadInput(f"--speed {speed:g}: expected each speed once")


def _empty_drives(model: vehicle_file.Model, asked: PlannedDrives) -> list[Run]:
    """The drives that are planned. BadInput for one that is too short, or too long to be simulated."""
    from logger.lab.planning.planned_drive import at_speed

    found = []
    for speed in asked.speeds_mps:
        assert asked.road is not None
        seconds = (asked.road.end_m - asked.road.start_m) / speed
        if seconds < LEAST_S:
            raise BadInput(f"--speed {speed:g}: expected a drive of {LEAST_S:g} s or longer, found {seconds:.3g} s "
                           f"over {asked.name}")
        try:
            found.append(at_speed(f"{asked.name} at {speed:g} m/s", asked.road, model.vehicle, speed))
        except ValueError as error:
            raise BadInput(f"--speed {speed:g}: {error}") from None
    return found


def _longest_road(bench: Bench | None) -> Track | None:
    """Of the runs; None where none has one."""
    from logger.profiles.track import Track

    roads = [] if bench is None else [run.track for run in bench.runs.runs if isinstance(run.track, Track)]
    return max(roads, key=lambda one: float(np.subtract(one.end_m, one.start_m)), default=None)
