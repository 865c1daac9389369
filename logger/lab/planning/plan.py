"""A plan: which effects drives could detect and distinguish, and which next drive would add most.

Problem: a search that finds nothing may have had drives that show nothing, and one that names two effects that these
drives cannot distinguish has named none. Solution: the information of each drive on each effect is computed as a search
uses it (``planned_drive``, ``outlook``); that of one more drive is added, and drives are ranked by how many more
effects a search would name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial, reduce
from operator import add

import numpy as np

from logger.arrays import Array
from logger.lab.diagnosis import obstacles_of
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import fit_model
from logger.lab.likelihood.noise_floor import sensor_noise_of
from logger.lab.likelihood.posterior import Posterior
from logger.lab.planning.outlook import (
    ISOLABLE_SIGMA,
    EffectGrid,
    Indices,
    LinearisedDrives,
    Outlook,
    most_likely_sizes,
    outlook,
    refitted_gain,
    representatives,
)
from logger.lab.planning.planned_drive import (
    SIZES,
    DriveOption,
    FisherInformation,
    PlannedCar,
    PlannedDrive,
    SensorNoise,
    information,
    option_drives,
)
from logger.lab.selection.detectability import DETECTABLE_SIGMA
from logger.profiles.track import Track
from logger.runs import Run
from logger.vehicle.effect import Chosen, Effect

Progress = Callable[[str], None]

_LINEAR_SIGMA = 3.0
"""Below this detectability a refit without the effect is linear."""
_LEAST_GAIN_SIGMA = 1.0
"""A smaller gain of isolability is within the noise of a search, which has unit variance."""


@dataclass(frozen=True, eq=False)
class LabNextDrive:
    """A next drive and its gains.

    gains         of isolability, by effect: first those that it makes likelier to be named, then the relatively largest
    more_named    how many more effects a search would name, were each the only one
    """

    option: DriveOption
    gains: Mapping[str, float]
    more_named: float


@dataclass(frozen=True, eq=False)
class LabPlan:
    """The effects that some drives could show, and next drives.

    drives       names and seconds of the runs and the planned drives
    noise        of the accelerometers, or of what else the runs measure first, in its ``unit``; ``measured``: whether
                 it is that of the runs
    names        of the effects (e,)
    effects      with the values that each is tried with (e,)
    now          what the drives could show of them
    obstacles    effects that cannot be present, and why
    next         drives that may come next, the largest gain first
    """

    drives: tuple[tuple[str, float], ...]
    noise: SensorNoise
    unit: str
    measured: bool
    names: tuple[str, ...]
    effects: tuple[Chosen, ...]
    now: Outlook
    obstacles: Mapping[str, str]
    next: tuple[LabNextDrive, ...]

    @property
    def groups(self) -> list[tuple[str, ...]]:
        """Effects that are detectable, and cannot be distinguished from each other."""
        detectable = self.now.detectability >= DETECTABLE_SIGMA
        confused = np.minimum(self.now.pairwise, self.now.pairwise.T) < ISOLABLE_SIGMA
        confused &= detectable & detectable[:, None]
        found: list[set[int]] = []
        for index in np.flatnonzero(detectable):
            near = {int(index), *map(int, np.flatnonzero(confused[index]))}
            joined = [one for one in found if one & near]
            found = [one for one in found if not one & near] + [near.union(*joined)]
        return [tuple(self.names[one] for one in sorted(some)) for some in found if len(some) > 1]


def plan(there: PlannedCar, runs: Posterior | None, planned: Sequence[Run], effects: Mapping[str, Effect],
         noise: SensorNoise | None, usual_noise: SensorNoise, road: Track | None,
         progress: Progress = lambda words: None) -> LabPlan:
    """Analyse what runs and planned drives could show of ``effects``.

    there          the car; its numbers are fitted to the runs first
    planned        drives to be, their records empty
    noise          of the sensor to be; None: that of the runs, or as ``usual_noise``
    road           over which the next drive may go; None: none is known

    ValueError where the vehicle lacks what an effect needs.
    """
    fitted, measured = None, noise is None and runs is not None
    if runs is not None:
        progress("refitting the model's parameters")
        fitted = fit_model(runs, runs.start(there.effects))
        there = replace(there, logs=fitted.state.logs)
        main = runs.runs.runs[0].facts.main
        further_mps2 = None if main.measures == "acceleration" else usual_noise.noise_mps2
        noise = noise or SensorNoise(sensor_noise_of(fitted.posterior, fitted.state).deviation_mps2, 0.0, further_mps2)
    noise = noise or usual_noise
    drives = [PlannedDrive(one, there, noise) for one in planned]
    posteriors = [*([fitted.posterior] if fitted is not None else []), *(one.posterior for one in drives)]
    obstacles = {name: why for one in posteriors for name, why in obstacles_of(one, effects, there.effects).items()}
    settings = EffectGrid.of([one for name, one in effects.items() if name not in obstacles])
    base = [run for one in posteriors for run in one.runs.runs]
    with ThreadPoolExecutor(2) as pool:  # as a search has
        analysis = _Analysis(settings, posteriors[0].prior.precision, pool)
        parts: list[_DriveSet] = []
        if fitted is not None:
            progress("what the runs show")
            parts.append(analysis.of_runs(fitted))
        for number, drive in enumerate(drives, 1):
            progress(f"what planned drive {number} of {len(drives)} would show")
            parts.append(analysis.of_drive(drive))
        total = reduce(add, (one.information for one in parts))
        columns = representatives(settings, total, analysis.precision)
        now = outlook(settings, total, analysis.precision, columns)
        progress("what a refit would leave of each effect")
        refitted = analysis.by_refit(parts, total, columns, now)
        following: list[LabNextDrive] = []
        for number, one in enumerate(option_drives(there, noise, road, base), 1):
            progress(f"what a next drive would add: {number} tried")
            changes = analysis.changes(one.drive)
            for option, signals in one.options:
                after = total + one.drive.information(changes, signals)
                following.append(_next(option, settings, now, outlook(settings, after, analysis.precision, columns)))
    return LabPlan(
        tuple((run.name, (run.count - run.first) / run.rate_hz) for run in base), noise,
        base[0].facts.main.unit, measured,
        tuple(one.name for one in settings.effects), tuple(settings.columns[one] for one in columns), refitted,
        obstacles,
        tuple(sorted(following, key=lambda one: (-round(one.more_named, 1), -len(one.gains)))))


@dataclass(frozen=True, eq=False)
class _DriveSet:
    """Some drives: their linear models, the changes by the effects (m, n) per run, and the information."""

    there: LinearisedDrives
    changes: list[Array]
    information: FisherInformation


@dataclass(frozen=True, eq=False)
class _Analysis:
    """The analysis of drives: effects at some values; ``precision`` (p,) of the prior of the car's numbers."""

    settings: EffectGrid
    precision: Array
    pool: ThreadPoolExecutor

    def changes(self, drive: PlannedDrive) -> Array:
        """Changes of a planned record by the effects (m, (1 + s) n)."""
        return np.array(list(self.pool.map(drive.change, self.settings.columns)))

    def of_drive(self, drive: PlannedDrive) -> _DriveSet:
        """A planned drive, recorded by its sensor alone."""
        linear, changes = drive.model(), self.changes(drive)
        levels = [np.concatenate(drive.levels(run, bands)) for run, bands in zip(
            linear.posterior.runs.runs, linear.posterior.bands, strict=True)]
        return _DriveSet(LinearisedDrives(linear, levels, linear.state.predictions), [changes],
                         information(linear, [changes]))

    def of_runs(self, fitted: LinearModel) -> _DriveSet:
        """Runs of a fitted model."""
        posterior, state = fitted.posterior, fitted.state
        predict = partial(posterior.predict, logs=state.logs, record=state.record, rough=True)
        here = predict(state.effects)
        there = self.pool.map(lambda one: predict((*state.effects, one)), self.settings.columns)
        changes = [np.array(some) for some in zip(*(
            [new - old for new, old in zip(one, here, strict=True)] for one in there), strict=True)]
        levels = [bands.levels(residual) for bands, residual in zip(
            posterior.bands, posterior.residuals(state), strict=True)]
        drives = LinearisedDrives(fitted, levels, here)
        return _DriveSet(drives, changes, information(fitted, changes))

    def by_refit(self, parts: Sequence[_DriveSet], total: FisherInformation, columns: Indices, now: Outlook) -> Outlook:
        """The outlook with detectabilities by a refit of the car without each effect."""
        which, costs = most_likely_sizes(total, self.precision, columns)
        with_size = {size: [one.there.with_size(SIZES[size]) for one in parts] for size in set(which.tolist())}

        def deviations(index: int) -> float:
            first_order = float(now.detectability[index])
            if first_order < _LINEAR_SIGMA:
                return first_order
            changes = [[one[columns[index]] for one in part.changes] for part in parts]
            gain = refitted_gain(with_size[int(which[index])], changes, self.precision) + costs[index]
            return float(np.sqrt(max(gain, 0.0)))

        return now.scaled_to(np.array(list(self.pool.map(deviations, range(len(columns))))))


def _next(option: DriveOption, settings: EffectGrid, now: Outlook, then: Outlook) -> LabNextDrive:
    """The gains of an option, by the outlooks without and with it."""
    gained, likelier = then.isolability - now.isolability, then.chances - now.chances
    order = np.lexsort((now.isolability / np.maximum(then.isolability, 1.0), -likelier.round(2)))
    gains = {settings.effects[one].name: float(gained[one]) for one in order if gained[one] > _LEAST_GAIN_SIGMA}
    return LabNextDrive(option, gains, float(likelier.sum()))
