"""What the lab's commands share: the model that they are given, the effects that there are, and progress on the screen.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

from logger.commands.lab_runs import lab_runs
from logger.errors import BadInput
from logger.units import STANDARD_GRAVITY_MPS2

if TYPE_CHECKING:
    from logger.lab.fitting import Problem
    from logger.runs import Array
    from logger.simulation.simulated_runs import SimulatedRuns
    from logger.store.formats.vehicle_file import Model
    from logger.vehicle.effect import Chosen, Effect

WIDTH = 100
TOLERANCE = 0.04
_TOLERANCES = (0.001, 0.5)
_BAND_DEVIATIONS = 1.6  # a band of 4 % either way is taken for a deviation of 2.5 %
_LEAST_MPS2 = 1e-4
_ALIKE, _NEAR = 0.8, 0.3
_UNITS_MPS2 = {"g": STANDARD_GRAVITY_MPS2, "thousandths of g": STANDARD_GRAVITY_MPS2 / 1000, "mm/s2": 0.001}
_SLOW = "expect ten minutes or more for each minute driven"
_SEARCH_HZ = 500.0  # a search needs no more steps a second than this; what is told is computed with the usual ones


@dataclass(frozen=True, eq=False)
class Bench:
    """A model and runs on it, ready to be worked on.

    word        by which the vehicle was named on the command line
    effects     those that there are, by name
    files       of the user's own among them
    numbers     deviation of what the car's numbers are usually off by, as a share
    """

    word: str
    model: Model
    runs: SimulatedRuns
    effects: Mapping[str, Effect]
    files: Mapping[str, str]
    numbers: float

    def problem(self, whole: bool, firm: bool) -> Problem:
        """To search on (a third of the runs is kept to judge), or on the whole of the runs, finely simulated; holding
        on to the car's numbers or not.

        Raises BadInput when the vehicle lacks what it needs.
        """
        from logger.lab.fitting import Problem
        from logger.lab.nuisance import Tolerance
        from logger.simulation.simulated_runs import SimulatedRuns

        runs = self.runs if whole else SimulatedRuns(self.runs.runs, fine_hz=_SEARCH_HZ)
        model = self.model
        return Problem(runs, model.given or model.vehicle, Tolerance(numbers=self.numbers), whole, model.vehicle,
                       firm)

    def try_out(self, one: Chosen) -> None:
        """Raise BadInput where an effect cannot be in the car on these runs, or shakes it to pieces."""
        from logger.store.formats.effect_file import check_on

        check_on(self.model.vehicle, one, self.two_tracks)
        if one.file is not None and not slow([one.effect]):
            _predicted(one.file, self.model, self.runs, [one])

    @property
    def files_read(self) -> list[Path]:
        """Files of the vehicle and of the user's own effects."""
        from logger.shipped import vehicle_path

        return [vehicle_path(self.word), *map(Path, self.files.values())]

    def filed(self, one: Chosen) -> Chosen:
        """An effect that knows which file it is from, where it is the user's own."""
        return replace(one, file=self.files.get(one.effect.name))

    @property
    def two_tracks(self) -> bool:
        """Whether the road of every run is known under the right wheels too."""
        return all(run.two_tracks for run in self.runs.runs)


def add_bench_arguments(parser: argparse.ArgumentParser) -> None:
    """RUN..., --vehicle, --tolerance, --effect-file and --json."""
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder with drive.csv and profile.csv")
    parser.add_argument("--vehicle", required=True, metavar="NAME|FILE",
                        help="a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name)")
    add_tolerance(parser)
    parser.add_argument("--effect-file", action="append", default=[], metavar="FILE.py",
                        help="an effect of your own to be tried as well; may repeat")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def add_tolerance(parser: argparse.ArgumentParser) -> None:
    """--tolerance, for ``deviation_of``."""
    parser.add_argument("--tolerance", type=float, default=TOLERANCE, metavar="SHARE",
                        help="how far off the vehicle's masses, springs and dampers may well be (default: "
                             f"{TOLERANCE:g}, 4 %%)")


def bench(args: argparse.Namespace, searches: str | None = None) -> Bench:
    """The model, runs and effects of a command line, as ``bench_of``."""
    return bench_of(args.vehicle, args.runs, args.effect_file, args.tolerance, searches)


def bench_of(vehicle: str, folders: Sequence[Path], effect_files: Sequence[str], tolerance: float,
             searches: str | None = None) -> Bench:
    """The model, runs and effects. Raises BadInput for whatever is wrong with them.

    searches    the command that will search through all effects, and so needs the compiler; None: it will not
    """
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import read_model

    numbers = deviation_of(tolerance)
    model = read_model(vehicle_path(vehicle))
    effects, files = known_effects(model, effect_files)
    if searches is not None:
        require_compiler(searches, effects.values())
    found = Bench(vehicle, model, lab_runs(folders), effects, files, numbers)
    check_model(vehicle, model, found.runs)
    _try_own(found, effect_files)
    return found


def deviation_of(tolerance: float) -> float:
    """The deviation, as a share, that a band of ``--tolerance`` either way is taken for. BadInput for one that no car's
    numbers have."""
    low, high = _TOLERANCES
    if not low <= tolerance <= high:
        raise BadInput(f"--tolerance {tolerance:g}: expected {low:g} to {high:g}")
    return tolerance / _BAND_DEVIATIONS


def known_effects(model: Model, files: Sequence[str]) -> tuple[dict[str, Effect], dict[str, str]]:
    """The effects that there are, by name: those that come with ridelog, a model's own, and those of some more files;
    and the files of the user's own, by name. BadInput for a name that is there twice."""
    from logger.store.formats.effect_file import own_effect, shipped_effects

    effects, own = dict(shipped_effects()), {}
    for one in model.effects:
        if one.file is not None:
            effects[one.effect.name], own[one.effect.name] = one.effect, one.file
    for file in files:
        effect = own_effect(Path(file))
        if effect.name in effects:
            raise BadInput(f"--effect-file {file}: expected each effect once, found {effect.name} again")
        effects[effect.name], own[effect.name] = effect, file
    return effects, own


def check_model(word: str, model: Model, runs: SimulatedRuns) -> None:
    """Raise BadInput where an effect of the model cannot be on one of the runs, the model's motion grows without bound,
    the road moves no car, or the sensor was upside down or reads in another unit; say so first where it takes long.

    word    by which the vehicle was named on the command line
    """
    for run in runs.runs:
        for one in model.effects:
            why = one.effect.obstacle(model.vehicle, run.two_tracks)
            if why is not None:
                raise BadInput(f"{word}: its effect {one.effect.name} cannot be on {run.name}: {why}")
    tell_slow([one.effect for one in model.effects])
    _check_sensor(runs, _predicted(word, model, runs, model.effects))


def _check_sensor(runs: SimulatedRuns, predictions: Sequence[Array]) -> None:
    """Raise BadInput where no road moves the car, or what was measured is the model upside down or in another unit."""
    import numpy as np

    moves = False
    for run, prediction in zip(runs.runs, predictions, strict=True):
        measured, model = run.measured_mps2[run.first:], prediction[run.first:]
        power = float(model @ model)
        if power < _LEAST_MPS2**2 * len(model):
            continue
        moves = True
        both = float(measured @ model)
        alike = both / float(np.sqrt((measured @ measured) * power))
        if alike < -_ALIKE:
            raise BadInput(f"{run.name}: expected accelerations up positive, found them upside down: turned over, they "
                           f"go with the model (correlation {-alike:.2f})")
        if alike > _ALIKE:
            unit = next((unit for unit, size in _UNITS_MPS2.items() if abs(both / power * size - 1) < _NEAR), None)
            if unit is not None:
                raise BadInput(f"{run.name}: expected accelerations in m/s2, found {both / power:.3g} times what the "
                               f"model says: they seem to be in {unit}")
    if not moves:
        raise BadInput(f"{runs.runs[0].name}: expected a drive over a road that moves the car; where it was the "
                       "profile is flat, or it stood still")


def _predicted(word: str, model: Model, runs: SimulatedRuns, effects: Sequence[Chosen]) -> list[Array]:
    """What the car with these effects would have recorded. BadInput where it shakes itself to pieces."""
    from logger.vehicle.compose import bounded, compose

    try:
        predictions = runs.predict(compose(model.vehicle, effects))
    except ValueError as error:
        raise BadInput(f"{word}: {error}") from None
    if not bounded(predictions):
        names = " and ".join(one.effect.name for one in effects)
        raise BadInput(f"{word}: with {names} the car's motion grows without bound")
    return predictions


def slow(effects: Iterable[Effect]) -> list[str]:
    """Names of those that are simulated in plain Python, where there is no compiler."""
    from logger.vehicle.effect import ForceEffect

    names = [one.name for one in effects if isinstance(one, ForceEffect)]
    if names:
        from logger.vehicle.stepping_loop import COMPILED  # loads the compiler, if there is one

        return [] if COMPILED else names
    return []


def tell_slow(effects: Iterable[Effect]) -> None:
    """Say on stderr that simulations with these effects take long, if they do."""
    if names := slow(effects):
        print(f"Without the lab extra (pip install '.[lab]') simulations with {' and '.join(names)} take some hundred "
              f"times longer: {_SLOW}.", file=sys.stderr, flush=True)


def require_compiler(command: str, effects: Collection[Effect]) -> None:
    """Raise BadInput where a search over these effects would take hours: it needs the compiler of the ``lab`` extra.

    A search over the rest alone could not say that nothing is missing, nor that an effect explains most.
    """
    if names := slow(effects):
        raise BadInput(f"{command} needs the lab extra (pip install '.[lab]'), which is not installed: without it "
                       f"{len(names)} of {len(effects)} effects cannot be tried, and what it says would mislead")


def _try_own(found: Bench, files: Sequence[str]) -> None:
    """Try the effects of these files on the car, at the values that a search begins at."""
    from logger.vehicle.effect import chosen

    for name, effect in found.effects.items():
        if found.files.get(name) in files and effect.obstacle(found.model.vehicle, found.two_tracks) is None:
            for values in effect.trials():
                found.try_out(chosen(effect, values, file=found.files[name]))


def check_out(out: Path, runs: Iterable[Path], read: Iterable[Path] = (), option: str = "--out") -> None:
    """Raise BadInput where a file to write is one of a run or another that is read, or cannot be written.

    runs    their folders
    """
    from logger.store.formats.drive_file import DRIVE, PROFILE

    if out.resolve() in {(folder / name).resolve() for folder in runs for name in (DRIVE, PROFILE)}:
        raise BadInput(f"{option} {out}: expected a file that is none of a run's")
    if out.resolve() in {path.resolve() for path in read}:
        raise BadInput(f"{option} {out}: expected another file than those that are read")
    if not out.parent.is_dir() or out.is_dir():
        raise BadInput(f"{option} {out}: expected a file in a folder that there is")
    if not _may_be_written(out):
        raise BadInput(f"{option} {out}: expected a file that may be written")


def _may_be_written(path: Path) -> bool:
    """Whether a file can be written, as far as that shows without writing. What is there stays as it is; one that is
    not there is made and taken away: permissions alone do not tell of all that root, or a file system, cannot do."""
    if path.exists():
        return os.access(path, os.W_OK)
    try:
        path.touch(exist_ok=False)
        path.unlink()
    except OSError:
        return False
    return True


def on_screen() -> Callable[[str], None]:
    """Progress on one line of the terminal, on stderr; said to nobody where that is no terminal."""
    return _tell if sys.stderr.isatty() else _say_nothing


def wipe() -> None:
    """End the line of progress."""
    if sys.stderr.isatty():
        print("\r" + " " * (WIDTH - 1) + "\r", end="", file=sys.stderr, flush=True)


def _tell(words: str) -> None:
    print(f"\r{words[:WIDTH - 1]:{WIDTH - 1}}", end="", file=sys.stderr, flush=True)


def _say_nothing(_words: str) -> None:
    pass


def paragraphs(lines: Sequence[str], mark: str = "") -> str:
    """Lines of text as wide as a screen, each after a mark."""
    return "\n".join(fill(line, WIDTH, initial_indent=mark, subsequent_indent=" " * len(mark),
                          break_long_words=False, break_on_hyphens=False) for line in lines)


def columns(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of words as columns, the last one as wide as it is."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
