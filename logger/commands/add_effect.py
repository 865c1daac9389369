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
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.outputs import check_out
from logger.commands.lab_model import add_bench_arguments, bench, progress, warn_of_slow_effects
from logger.commands.numbers import named_numbers
from logger.errors import EXIT_DONE

if TYPE_CHECKING:
    from logger.api.bench import Bench
    from logger.vehicle.effect import Effect


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog add-effect``."""
    parser.add_argument("effect", metavar="NAME[:PARAM=VALUE,...]",
                        help="an effect that comes with ridelog, or the path of the Python file of one of your own")
    add_bench_arguments(parser)
    parser.add_argument("--out", required=True, type=Path, metavar="V2.yaml", help="the new vehicle file")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog add-effect``."""
    from logger.report.add_effect_text import as_json
    from logger.report.lab_text import addition_lines
    from logger.store.formats.vehicle_file import write_model

    check_out(args.out, args.runs)
    given = bench(args)
    effect, file, values = asked_for(args.effect, given)
    check_out(args.out, args.runs, map(Path, [*given.files.values(), *([] if file is None else [file])]))
    given = given.with_effect(effect, file)
    with progress() as notify:
        is_given = set(values) >= {one.name for one in effect.parameters}
        found = given.added(given.search_values(effect, values, notify), 1 if is_given else len(effect.trials()),
                            notify)
    write_model(args.out, given.model_with(found))
    if args.json:
        print(json.dumps(as_json(found) | {"vehicle": str(args.out)}, allow_nan=False))
    else:
        print("\n".join(addition_lines(found)))
    return EXIT_DONE


def asked_for(text: str, given: Bench) -> tuple[Effect, str | None, dict[str, float]]:
    """An effect as it was asked for, the file it is from, and what was said of its numbers. BadInput as
    ``Bench.asked_for``."""
    name, values = named_numbers(text, "add-effect")
    effect, file = given.asked_for(name, values, text)
    warn_of_slow_effects([effect])
    return effect, file, values
