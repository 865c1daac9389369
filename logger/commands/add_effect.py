"""Add a physical effect to a vehicle: fit it with the car's numbers on all of the runs, and show what that changed.

  ridelog add-effect dry_friction --vehicle mycar.yaml --out mycar-2.yaml run1 run2
  ridelog add-effect sensor_bandwidth:order=2,cutoff_hz=20 --vehicle mycar.yaml --out mycar-2.yaml run1 run2
  ridelog add-effect ./my_effect.py --vehicle mycar.yaml --out mycar-2.yaml run1 run2

What is said of the effect's numbers is where the fit begins; the rest is searched for. The new vehicle file holds the
effects with their standard errors, the car's refitted numbers, and the history of the model. The old one stays as it is
unless --out names it.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from logger.commands.lab_model import (
    Bench,
    add_bench_arguments,
    bench,
    check_out,
    columns,
    on_screen,
    paragraphs,
    tell_slow,
    wipe,
)
from logger.commands.simulate import named_numbers
from logger.errors import EXIT_DONE, BadInput

if TYPE_CHECKING:
    from logger.lab.gained import Gained
    from logger.store.formats.vehicle_file import Model
    from logger.vehicle.effect import Chosen, Effect


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog add-effect``."""
    parser.add_argument("effect", metavar="NAME[:PARAM=VALUE,...]",
                        help="an effect that comes with ridelog, or the path of the Python file of one of your own")
    add_bench_arguments(parser)
    parser.add_argument("--out", required=True, type=Path, metavar="V2.yaml", help="the new vehicle file")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog add-effect``."""
    from logger.lab.gained import as_json
    from logger.store.formats.vehicle_file import write_model

    check_out(args.out, args.runs)
    given = bench(args)
    effect, file, values = asked_for(args.effect, given)
    check_out(args.out, args.runs, map(Path, [*given.files.values(), *([] if file is None else [file])]))
    given = replace(given, effects={**given.effects, effect.name: effect},
                    files={**given.files, effect.name: file} if file is not None else given.files)
    try:
        is_given = set(values) >= {one.name for one in effect.parameters}
        found = added(given, searched(given, effect, values), 1 if is_given else len(effect.trials()))
    finally:
        wipe()
    write_model(args.out, model_of(given, found))
    if args.json:
        print(json.dumps(as_json(found) | {"vehicle": str(args.out)}, allow_nan=False))
    else:
        print("\n".join(lines(found)))
        print(f"\nVehicle: {args.out}")
    return EXIT_DONE


def asked_for(text: str, given: Bench) -> tuple[Effect, str | None, dict[str, float]]:
    """An effect as it was asked for, the file it is from, and what was said of its numbers. BadInput where it is not
    known, is in the model already, or cannot be there."""
    from logger.store.formats.effect_file import effect_named
    from logger.vehicle.effect import chosen

    name, values = named_numbers(text, "add-effect")
    if name in given.effects:
        effect, file = given.effects[name], given.files.get(name)
    else:
        effect, file = effect_named(name)
    if effect.name in [one.effect.name for one in given.model.effects]:
        raise BadInput(f"{given.word}: expected a vehicle without {effect.name}, which it has")
    try:
        whole = effect.checked(effect.usual | values)
    except ValueError as error:
        raise BadInput(f"{text}: {error}") from None
    given.try_out(chosen(effect, whole, file=file))
    tell_slow([effect])
    return effect, file, values


_ROUNDS = 3


def searched(given: Bench, effect: Effect, values: Mapping[str, float]) -> Chosen:
    """Where the fit of an effect begins: as it was said, and for the rest where a search for it alone ends."""
    from logger.lab.candidates import best_choice, fitted, misalignment, screened, settled_further
    from logger.lab.diagnosis import refitted
    from logger.vehicle.effect import chosen

    if set(values) >= {one.name for one in effect.parameters}:
        return chosen(effect, values)
    tell = on_screen()
    try:
        problem = given.problem(whole=False, firm=True)
        tell("refitting the car's own numbers")
        nominal = problem.start(given.model.effects)
        seen = misalignment(problem, nominal)
        problem, base = refitted(problem, nominal)
        tell(f"searching for {effect.name}")
        tries = fitted(problem, base, screened(problem, base, effect, seen))
    except ValueError as error:
        raise BadInput(f"{given.word}: {error}") from None
    choices = {one.name for one in effect.parameters if one.choices} & set(values)
    said = [one for one in tries if all(one.state.effects[-1].values[name] == values[name] for name in choices)]
    best = best_choice([settled_further(problem, base, one, _ROUNDS) for one in said or tries])
    return chosen(effect, {**best.state.effects[-1].values, **values})


def added(given: Bench, start: Chosen, starts: int) -> Gained:
    """The effect fitted with the car's numbers on all of the runs, from the best of so many ``starts``."""
    from logger.lab.addition import add
    from logger.lab.gained import gained

    on_screen()(f"fitting the car without and with {start.effect.name}")
    problem = given.problem(whole=True, firm=True)
    try:
        found = add(problem, given.problem(whole=True, firm=False), given.model.effects, [given.filed(start)])
        return gained(found, [start.effect.name], starts)
    except ValueError as error:
        raise BadInput(f"{given.word}: {error}") from None


def model_of(given: Bench, found: Gained) -> Model:
    """The model with the effect, and how it came to it. BadInput for one that could not be read back, because a fit
    ended at numbers that no car has."""
    from logger.store.formats.effect_file import check_on
    from logger.store.formats.vehicle_file import Model, Step

    for one in found.added.effects:
        check_on(found.added.vehicle, one, two_tracks=True)
    history = given.model.history
    if not history:
        history = (Step("as it was given", found.added.error_before, found.floor),
                   Step("numbers refitted", found.added.error_refitted, found.floor))
    step = Step(f"added {' and '.join(found.names)}", found.added.error_after, found.floor)
    return Model(found.added.vehicle, found.added.effects, (*history, step), given.model.given or given.model.vehicle)


def lines(found: Gained) -> list[str]:
    """What a person reads."""
    from logger.lab.gained import MOVED_HEADS, MOVED_HINT, bias, errors, judgement, moved_rows

    rows = [(f"Error {which}:" if which else "", f"{error:.4f}", what) for which, error, what in errors(found)]
    return [
        paragraphs(judgement(found)), "", *columns(rows), "",
        paragraphs([bias(found.names, found.moved)]), "",
        *columns([MOVED_HEADS, *moved_rows(found.moved)]), "", paragraphs([MOVED_HINT]),
    ]
