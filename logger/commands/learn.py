"""Learn a law out of the data, where no known effect explains what a vehicle's model lacks.

  ridelog learn --vehicle mycar.yaml --out law.py run1 run2
  ridelog learn --vehicle mycar.yaml --out law.py run1 run2 --page law.html

First every known effect is tried, as ridelog diagnose does. Where these explain all, or nothing is missing, no law is
learned and nothing is written. Otherwise families of laws are tried (forces by travel and rate, of the tires, with a
memory, a mass on a spring, ...), by the same evidence, in which every number counts. The law is written as an effect of
your own: one Python file, which compare, simulate, diagnose --effect-file and add-effect take:

  ridelog add-effect ./law.py --vehicle mycar.yaml --out with-law.yaml run1 run2
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from logger.api.outputs import check_outs
from logger.commands.lab_model import add_bench_arguments, bench, progress
from logger.errors import EXIT_DONE, BadInput
from logger.files import together, write_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog learn``."""
    add_bench_arguments(parser)
    parser.add_argument("--out", required=True, type=Path, metavar="LAW.py", help="the law's file")
    parser.add_argument("--page", type=Path, metavar="FILE.html", help="write a page with pictures")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog learn``."""
    from logger.api.learning import learned, picture_of
    from logger.report.law_page import page
    from logger.report.law_text import as_json, law_lines, source_of

    if args.out.suffix != ".py":
        raise BadInput(f"--out {args.out}: expected the name of a Python file, which ends in .py")
    given = bench(args, searches="ridelog learn")
    check_outs([("--out", args.out), ("--page", args.page)], args.runs, given.files_read)
    with progress() as notify:
        found = learned(given, notify)
        drawn = picture_of(found)
    source = source_of(found.learning, found.addition)
    with together():
        if source:
            write_text(args.out, source)
        if args.page is not None:
            write_text(args.page, page(found.learning, found.addition, drawn, given.model.vehicle.name,
                                       str(args.out)))
    if args.json:
        print(json.dumps(as_json(found.learning, found.addition, str(args.out)), allow_nan=False))
        return EXIT_DONE
    print(*law_lines(found.learning, found.addition), sep="\n")
    if source:
        law = args.out if args.out.is_absolute() else f"./{args.out}"
        print(f"\nNext: ridelog add-effect {law} --vehicle {args.vehicle} --out with-law.yaml "
              f"{' '.join(map(str, args.runs))}")
    return EXIT_DONE
