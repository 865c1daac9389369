"""A model and runs on it, checked together, and what the lab does with them.

Problem: a user of the lab, at a terminal or in a notebook, brings a vehicle, runs and maybe effects of their own,
which may not fit each other; a search takes minutes, and what is wrong has to be said before it. Solution:
``bench_of`` checks all of it once, and its methods are the questions that can be asked.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from copy import copy
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from logger.api.inputs import Run as DrivenRun
from logger.api.inputs import model_of, run_on_road
from logger.api.lab.checks import check_model, check_moves, checked_runs, predicted, with_initial_values
from logger.api.lab.question import LabQuestion
from logger.api.shared_fields import Runs, each
from logger.arrays import Array
from logger.errors import BadInput, as_bad_input
from logger.lab.compare import LabComparison, compare
from logger.lab.diagnosis import LabDiagnosis, begin_search, diagnose
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.record_band import with_pass_bands
from logger.lab.selection.add_effect import AddedEffects, add
from logger.printable import Notify, silent
from logger.profiles.excitation import Excitation
from logger.question import TOLERANCE, UNKNOWN, WrongOption
from logger.runs import Run, are_on_rig
from logger.shipped import vehicle_path
from logger.simulation.virtual_drive import SEARCH_HZ, SimulatedRuns
from logger.store.formats import effect_file
from logger.store.formats.effect_file import check_on, effect_named, own_effect
from logger.store.formats.vehicle_file import CarModel, ModelStep
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, Effect, ForceEffect, SensorEffect, Sought, VehicleEffect, chosen
from logger.vehicle.uncertain import Scales, sized
from logger.vehicle.vehicle import OWN_NAMES

_SLOW = "expect ten minutes or more for each minute driven"


@dataclass(frozen=True, eq=False)
class Bench:
    """A model and runs on it, ready to be worked on.

    word         by which the user knows the vehicle
    effects      those that there are, by name
    files        of the user's own among them
    tolerance    by what the car's numbers may well be off
    last         effects that are tried where all others leave something unexplained, by name
    """

    word: str
    model: CarModel
    runs: SimulatedRuns
    effects: Mapping[str, Effect]
    files: Mapping[str, str]
    tolerance: Tolerance
    last: Mapping[str, Effect] = field(default_factory=dict)

    def posterior(self, searches: bool = False) -> Posterior:
        """What the lab fits; simulated less finely where it ``searches``.

        Raises BadInput when the vehicle lacks what it needs.
        """
        runs = self.runs.in_steps(SEARCH_HZ) if searches else self.runs
        model = self.model
        return Posterior(runs, model.given or model.vehicle, self.tolerance, model.vehicle)

    def try_out(self, one: Chosen) -> None:
        """Raise BadInput where an effect cannot be in the car on these runs, or shakes it to pieces."""
        check_on(self.model.vehicle, one, self.two_tracks, self.timed, self.pushed)
        if one.file is not None and not slow([one.effect]):
            predicted(one.file, self.model, self.runs, [one])

    @property
    def files_read(self) -> list[Path]:
        """Files of the vehicle and of the user's own effects."""
        return [vehicle_path(self.word), *map(Path, self.files.values())]

    def filed(self, one: Chosen) -> Chosen:
        """An effect that knows which file it is from, where it is the user's own."""
        return replace(one, file=self.files.get(one.effect.name))

    @property
    def two_tracks(self) -> bool:
        """Whether the road of every run is known under the right wheels too."""
        return all(run.two_tracks for run in self.runs.runs)

    @property
    def timed(self) -> bool:
        """Whether all runs are driven by time."""
        return are_on_rig(self.runs.runs)

    @property
    def pushed(self) -> bool:
        """Whether forces drive all runs."""
        return all(run.pushed for run in self.runs.runs)

    def compared(self) -> LabComparison:
        """The model against the runs. BadInput when the vehicle lacks what it needs."""
        with self.blamed():
            return compare(self.runs, self.model.vehicle, self.model.effects, self.model.given, self.tolerance)

    def diagnosed(self, notify: Notify = silent, left_out: frozenset[str] = frozenset()) -> LabDiagnosis:
        """Which effects the model lacks, without some that are left out. Where the runs of a rig contradict what is
        known of its numbers and nothing explains that, or a signal's gain had to make up for it, nothing is taken to
        be known of them. BadInput as ``compared``."""
        effects = {name: effect for name, effect in self.effects.items() if name not in left_out}
        last = {name: effect for name, effect in self.last.items() if name not in left_out}
        with self.blamed():
            found = diagnose(self.posterior(searches=True), effects, self.model.effects, notify, last)
            unexplained = found.signals_off or (found.exceeds_noise and not found.verdict)
            if not (self.timed and found.beyond and unexplained):
                return found
            notify("the runs contradict the vehicle's file: searching with its parameters unknown")
            wide = replace(self, tolerance=self.tolerance.widened())
            again = diagnose(wide.posterior(searches=True), effects, self.model.effects, notify)
        return replace(again, contradicted=tuple(found.beyond)) if again.verdict and not again.signals_off else found

    def named(self, name: str) -> tuple[Effect, str | None]:
        """An effect by its name or that of its file, and the file. BadInput where it is not known."""
        if (known := self.effects.get(name) or self.last.get(name)) is not None:
            return known, self.files.get(name)
        effect, file = effect_named(name)
        return (effect if file else sized(effect, self.model.vehicle)), file

    def asked_for(self, name: str, values: Mapping[str, float], said: str) -> tuple[Effect, str | None]:
        """An effect to be added, and the file it is from. BadInput where it is not known, is in the model already, or
        cannot be there with these values.

        said    how it was asked for
        """
        effect, file = self.named(name)
        if effect.name in [one.effect.name for one in self.model.effects]:
            raise BadInput(f"{self.word}: expected a vehicle without {effect.name}, which it has")
        with as_bad_input(said):
            whole = effect.checked({**effect.usual, **values})
        self.try_out(chosen(effect, whole, file=file))
        return effect, file

    def with_effect(self, effect: Effect, file: str | None) -> "Bench":
        """The same where this effect is known, too."""
        return replace(self, effects={**self.effects, effect.name: effect},
                       files={**self.files, effect.name: file} if file is not None else self.files)

    def search_values(self, effect: Effect, values: Mapping[str, float], notify: Notify = silent
                      ) -> tuple[Chosen, State | None]:
        """Where the fit of an effect begins: at these values, and for the rest where a search for it alone ends, with
        its car; None where nothing is left to be searched."""
        if set(values) >= {one.name for one in effect.parameters}:
            return chosen(effect, values), None
        with self.blamed():
            search, base = begin_search(self.posterior(searches=True), {effect.name: effect}, self.model.effects,
                                        notify)
            notify(f"searching for {effect.name}")
            best = search.best_of(effect, base, {one.name: values[one.name] for one in effect.parameters
                                                 if one.choices and one.name in values})
        return chosen(effect, {**best.effects[-1].values, **values}), best.state

    def beside(self, starts: Sequence[Chosen]) -> "Bench":
        """The same with effects in the model that are about to be added."""
        return replace(self, model=replace(self.model, effects=(*self.model.effects, *starts)))

    def added(self, starts: Sequence[Chosen], candidates: int, notify: Notify = silent, near: State | None = None
              ) -> AddedEffects:
        """The effects fitted with the car's numbers on all of the runs, from the best of so many ``candidates``;
        ``near``: where a search for them ended."""
        notify(f"fitting the model without and with {' and '.join(one.effect.name for one in starts)}")
        with self.blamed():
            return add(self.posterior(), self.model.effects, list(map(self.filed, starts)), candidates, near)

    def model_with(self, found: AddedEffects) -> CarModel:
        """The model with what was added, and how it came to it. BadInput for one that could not be read back, because a
        fit ended at numbers that no car has."""
        for one in found.effects:
            check_on(found.vehicle, one, two_tracks=True)
        history = self.model.history
        if not history:
            history = (ModelStep("as it was given", found.error_before, found.noise_floor_error),
                       ModelStep("parameters refitted", found.error_refitted, found.noise_floor_error))
        step = ModelStep(f"added {' and '.join(found.names)}", found.error_after, found.noise_floor_error)
        return CarModel(found.vehicle, found.effects, (*history, step),
                        self.model.given or self.model.vehicle, found.errors, self.model.known)

    def blamed(self) -> AbstractContextManager[None]:
        """What is wrong with the vehicle names it."""
        return as_bad_input(self.word)


def bench_of(word: str, model: CarModel, runs: SimulatedRuns, effect_files: Sequence[str],
             tolerance: Tolerance, searches: str | None = None, warn: Notify = silent, low_pass_hz: float | None = None,
             anyway: bool = False) -> Bench:
    """The model, runs and effects together. Raises BadInput for whatever is wrong with them. Of runs that somebody has
    low-passed, or that say so, only the band that remains is compared.

    word        by which the user knows the vehicle
    tolerance   as ``tolerance_of``
    searches    the command that will search through all effects, and so needs the compiler; None: it will not
    warn        called where it will take long, and with what was wrong where the user goes on ``anyway``
    low_pass_hz what lies above is not compared; None: all is that the records hold
    """
    scales = _scales(word, model, runs)
    effects, files = known_effects(model, effect_files, are_on_rig(runs.runs), scales)
    last = _ready_for(model, are_on_rig(runs.runs), scales, {
        name: one for name, one in effect_file.shipped_effects().items() if one.sought_last and name not in effects})
    if searches is not None:
        require_compiler(searches, effects.values())
    found = Bench(word, model, runs, effects, files, tolerance, last)
    if words := slow_words([one.effect for one in model.effects]):
        warn(words)
    shipped = {name: one for name, one in effects.items() if name not in files}  # the user's own are not tried yet
    predictions = check_model(word, model, runs, warn, shipped, tolerance, anyway)
    _try_own(found, effect_files)
    return replace(found, runs=_in_their_bands(runs, predictions, low_pass_hz))


def planned_bench(word: str, model: CarModel, drives: Sequence[Run], effect_files: Sequence[str],
                  tolerance: Tolerance) -> Bench:
    """The model on drives that nobody has driven yet, without readings. Arguments and BadInput as ``bench_of``, and for
    a road that moves no car."""
    effects, files = known_effects(model, effect_files)
    require_compiler("plan", effects.values())
    found = Bench(word, model, SimulatedRuns(drives), effects, files, tolerance)
    check_moves(word, model, found.runs)
    _try_own(found, effect_files)
    return found


def tolerance_of(said: float | str | None, model: CarModel) -> Tolerance:
    """How well a car's numbers are known: as its file says, and the others to what the user said, a share
    of masses, springs and dampers either way, or that they are unknown; None: the usual one. BadInput for a share that
    no car's numbers have."""
    by_file = replace(Tolerance.of(model.known), guessed=model.is_guessed)
    if said is None:
        return by_file
    if said == UNKNOWN:
        return by_file.widened()
    TOLERANCE.check("tolerance", float(said))
    return replace(by_file, numbers=float(said) / Tolerance.band)


def _scales(word: str, model: CarModel, runs: SimulatedRuns) -> Scales | None:
    """How large forces and motions are on the bench that the runs are of; None where they are those of a car. BadInput
    as ``check_moves``."""
    if model.vehicle.model not in OWN_NAMES:
        return None
    check_moves(word, model, runs)
    responses = runs.respond(compose(model.vehicle, model.effects))
    # Where a part stands (its preload over a spring that nobody knows) is no motion.
    travel_m, rate_mps = (float(np.std(np.concatenate([one - one.mean(axis=0) for one in some]))) for some in (
        [response.travel_m for response in responses], [response.rate_mps for response in responses]))
    front = model.vehicle.front
    forces_n = [np.hypot(front.suspension_stiffness_n_per_m * travel_m, front.suspension_damping_n_s_per_m * rate_mps),
                *(float(np.std(run.measured_mps2)) for run in runs.runs if run.facts.main.measures == "force"),
                *(float(np.std(run.track.force_n)) for run in runs.runs
                  if isinstance(run.track, Excitation) and run.track.force_n is not None)]
    return Scales.of(float(max(forces_n)), travel_m, rate_mps)


def known_effects(model: CarModel, files: Sequence[str], on_rig: bool = False, scales: Scales | None = None
                  ) -> tuple[dict[str, Effect], dict[str, str]]:
    """The effects that a search tries, by name: those that it tries unasked, in the model's sizes, a model's own, and
    those of some more files; and the files of the user's own, by name. BadInput for a name that is there twice.

    files     of effects, or names of such that a search does not try unasked
    on_rig    as ``sought_effects``
    scales    as ``sized``
    """
    own = dict[str, str]()
    effects = _ready_for(model, on_rig, scales, sought_effects(on_rig, model.vehicle.is_part))
    for one in model.effects:
        if one.file is not None:
            effects[one.effect.name], own[one.effect.name] = one.effect, one.file
    for file in files:
        shipped = effect_file.shipped_effects().get(file)
        effect = own_effect(Path(file)) if shipped is None else _ready_for(model, on_rig, scales, {file: shipped})[file]
        if effect.name in effects:
            raise BadInput(f"--effect-file {file}: expected each effect once, found {effect.name} again")
        effects[effect.name] = effect
        if shipped is None:
            own[effect.name] = file
    return effects, own


def _ready_for(model: CarModel, on_rig: bool, scales: Scales | None, effects: Mapping[str, Effect]
               ) -> dict[str, Effect]:
    """Effects in the model's sizes, with advice that can be followed there."""
    vehicle = model.vehicle
    return {name: sized(_shown_on_rig(one.on(vehicle), vehicle.is_part) if on_rig else one, vehicle, scales)
            for name, one in effects.items()}


def _shown_on_rig(effect: Effect, of_part: bool) -> Effect:
    """The same effect, of which no road is asked to show it. A part has no natural frequency: what its law has a place
    or a rate of, by its units, is shown by amplitudes or rates; anything else by frequencies."""
    if effect.sought is Sought.ON_RIGS:
        return effect  # it speaks of rigs
    found, units = copy(effect), [one.name.partition("_per_")[2] for one in effect.parameters]
    if not of_part:
        found.shown_by = ("excite it well above its natural frequencies" if isinstance(effect, SensorEffect) else
                          "weigh it, each end by itself, and measure where the sensor sits"
                          if isinstance(effect, VehicleEffect) else
                          "move it faster and farther, at several amplitudes, through its natural frequencies")
    elif any(unit in ("s", "m2") for unit in units):
        found.shown_by = "move it at one amplitude, at rates far below, near and far above where its force changes"
    elif any(one.name.endswith("_m") for one in effect.parameters) or "m3" in units:
        found.shown_by = "move it at one rate, at amplitudes far below, near and far above where its force changes"
    else:
        found.shown_by = "move it both ways at one amplitude, at frequencies that are far apart"
    return found


def sought_effects(on_rig: bool = False, of_part: bool = False) -> dict[str, Effect]:
    """The effects that come with ridelog and that a search tries unasked, by name.

    on_rig    whether the runs are of a test rig, and not of a road
    of_part   and of a part alone on it
    """
    where = (Sought.ALWAYS, *[Sought.ON_RIGS] * on_rig, *[Sought.ON_PARTS] * of_part)
    return {name: one for name, one in effect_file.shipped_effects().items() if one.sought in where}


def with_candidates(bench: Bench, names: Collection[str] | None) -> Bench:
    """The bench where only effects of these names are tried, as ``among`` has them."""
    return bench if names is None else replace(bench, effects=among(bench.effects, names), last={})


def among(effects: Mapping[str, Effect], names: Collection[str] | None) -> dict[str, Effect]:
    """Those of these names, which may be any that come with ridelog; None: all. BadInput for a name that there is not.
    """
    if names is None:
        return dict(effects)
    effects = dict(sorted({**effect_file.shipped_effects(), **effects}.items()))
    if unknown := set(names) - set(effects):
        raise BadInput(f"no effect {sorted(unknown)[0]!r}: expected one of {', '.join(effects)}")
    return {name: effects[name] for name in sorted(names)}


def _in_their_bands(runs: SimulatedRuns, predictions: Sequence[Array], low_pass_hz: float | None) -> SimulatedRuns:
    """The runs as they are compared. BadInput where next to nothing would be."""
    half_hz = runs.runs[0].rate_hz / 2
    if low_pass_hz is not None and not 0 < low_pass_hz < half_hz:
        raise WrongOption(f"`low_pass_hz` {low_pass_hz:g}: expected above 0 and below {half_hz:g} Hz, half the "
                          "sample rate")
    with as_bad_input():
        found = with_pass_bands(runs.runs, [run.main(one) for run, one in zip(runs.runs, predictions, strict=True)],
                                low_pass_hz)
    same = all(one.low_pass is None and one.facts.pass_band_hz is None for one in found)
    return runs if same else SimulatedRuns(found, runs.fine_hz)


def slow(effects: Iterable[Effect]) -> list[str]:
    """Names of those that are simulated in plain Python, where there is no compiler."""
    names = [one.name for one in effects if isinstance(one, ForceEffect)]
    if names:
        from logger.vehicle.stepping_loop import COMPILED  # loads the compiler, if there is one

        return [] if COMPILED else names
    return []


def slow_words(effects: Iterable[Effect]) -> str:
    """That simulations with these effects take long, if they do."""
    if names := slow(effects):
        return (f"Without the lab extra (pip install 'ridelog[lab]') simulations with {' and '.join(names)} take some "
                f"hundred times longer: {_SLOW}.")
    return ""


def require_compiler(command: str, effects: Collection[Effect]) -> None:
    """Raise BadInput where a search over these effects would take hours: it needs the compiler of the ``lab`` extra.

    A search over the rest alone could not say that nothing is missing, nor that an effect explains most.
    """
    if names := slow(effects):
        raise BadInput(f"{command} needs the lab extra (pip install 'ridelog[lab]'), which is not installed: without "
                       f"it {len(names)} of {len(effects)} effects cannot be tried, and its answer would mislead")


def _try_own(found: Bench, files: Sequence[str]) -> None:
    """Try the effects of these files on the car, at the values that a search begins at."""
    for name, effect in found.effects.items():
        if found.files.get(name) in files and effect.obstacle_on(
                found.model.vehicle, found.two_tracks, found.timed, found.pushed) is None:
            for values in effect.trials():
                found.try_out(chosen(effect, values, file=found.files[name]))


def bench_with(question: LabQuestion, searches: str | None = None, thin: bool = True) -> Bench:
    """Vehicle, runs and effects of a question, checked together."""
    given: Any = question
    drives = lab_drives(given.runs, question.warn)
    model = with_initial_values(model_of(given.vehicle), drives)
    off = tolerance_of(question.tolerance, model)
    runs = checked_runs(drives, thin, model)
    return bench_of(word_of(given.vehicle, model), model, runs, list(map(str, getattr(question, "effect_files", ()))),
                    off, searches, question.warn, question.low_pass_hz, question.anyway)


def lab_drives(runs: Runs, notify: Notify = silent) -> list[DrivenRun]:
    """One run or several, read, with their roads. BadInput for none, for two that are one, or of one name, and for one
    without a road."""
    given = each(runs)
    if not given:
        raise BadInput("expected a run, found none")
    places = [one.path if isinstance(one, DrivenRun) else Path(one).resolve() for one in given]
    if again := next((one for number, one in enumerate(given) if places[number] in places[:number]), None):
        raise BadInput(
            f"{again.path if isinstance(again, DrivenRun) else again}: expected each run once, with a name of "
                       "its own")
    return [run_on_road(one, notify) for one in given]


def word_of(vehicle: CarModel | Path | str, model: CarModel) -> str:
    """By which the user knows a vehicle."""
    return str(vehicle) if isinstance(vehicle, Path | str) else model.vehicle.name
