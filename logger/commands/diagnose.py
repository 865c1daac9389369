"""Which physical effect a vehicle's model lacks: every one that is known is tried, the evidence decides.

Each RUN is a folder with drive.csv (t_s,accel_z_mps2,speed_mps,distance_m) and the profile.csv it was driven on, or, of
a rig, drive.csv (t_s,accel_z_mps2) and the excitation.csv (t_s,elevation_m[,elevation_rear_m]) that drove it.

  ridelog diagnose --vehicle mycar.yaml run1 run2
  ridelog diagnose --vehicle mycar.yaml run1 run2 --effect-file my_effect.py --out diagnosis.html

Errors are rms(measured - model) / rms(measured), on stretches that no fit saw: three sets of them are held out in turn.
The car's numbers may be off by a few per cent (--tolerance) and the distances by as much as the runs show: both are
refitted first, so that no small mistake passes for an effect.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.outputs import check_out
from logger.commands.lab_model import add_bench_arguments, bench, progress
from logger.errors import EXIT_DONE
from logger.files import write_text
from logger.left_out import left_out_json, left_out_paragraph
from logger.report.text_layout import paragraphs
from logger.runs import runs_left_out

if TYPE_CHECKING:
    from logger.api.bench import Bench
    from logger.lab.diagnosis import Diagnosis

_SHOWN = 8


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog diagnose``."""
    add_bench_arguments(parser)
    parser.add_argument("--all", action="store_true", help=f"list all candidates, not the first {_SHOWN}")
    parser.add_argument("--same-road", action="store_true",
                        help="no profile is known: two runs or more (folders, or drive.csv files) over one road, at "
                             "different speeds; what bends its laws is tried by linear stand-ins")
    parser.add_argument("--out", type=Path, metavar="FILE.html", help="write a page with pictures")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog diagnose``."""
    from logger.report.diagnosis_text import as_json
    from logger.report.lab_text import diagnosis_lines

    if args.same_road:
        from logger.commands.diagnose_same_road import run_same_road

        return run_same_road(args)
    given = bench(args, searches="ridelog diagnose")
    if args.out is not None:
        check_out(args.out, args.runs, given.files_read)
    with progress() as notify:
        found = given.diagnosed(notify)
    if args.out is not None:
        from logger.report.diagnosis_page import page

        write_text(args.out, page(found, given.model.vehicle.name))
    if args.json:
        print(json.dumps(as_json(found) | left_out_json(runs_left_out(given.runs.runs)), allow_nan=False))
        return EXIT_DONE
    print(paragraphs([_compared(given)]), "", *diagnosis_lines(found, None if args.all else _SHOWN),
          *left_out_paragraph(runs_left_out(given.runs.runs)), "",
          _next(args, given, found), sep="\n")
    return EXIT_DONE


def _compared(given: Bench) -> str:
    runs, model = given.runs.runs, given.model
    seconds = sum((run.count - run.first) / run.rate_hz for run in runs)
    has = f", with {', '.join(one.effect.name for one in model.effects)}," if model.effects else ""
    return (f"{model.vehicle.name}{has} on {len(runs)} run{'s' * (len(runs) != 1)}, {seconds:.0f} s. "
            f"{len(given.effects)} effects are known.")


def _next(args: argparse.Namespace, given: Bench, found: Diagnosis) -> str:
    """What to do now; a command in one piece, so that it can be copied."""
    if found.missing:
        one = found.missing[0]
        name = given.files.get(one.effect.name, one.effect.name)
        return (f"Next: ridelog add-effect {name} --vehicle {args.vehicle} --out with-{one.effect.name}.yaml "
                f"{' '.join(map(str, args.runs))}")
    if found.conflicts and not found.exceeds_noise:
        names = ", ".join(found.conflicts)
        words = f"Next: see whether {names} of the vehicle's file can be right. From the runs alone they are found by"
        return (f"{paragraphs([words])}\nridelog identify --free {','.join(found.conflicts)} --vehicle {args.vehicle} "
                f"{' '.join(map(str, args.runs))}")
    if found.unexplained:
        return paragraphs(["Next: look at the shape above. An effect of your own is one Python file (--effect-file); "
                           "ridelog compare shows where the residual is."])
    return "Next: nothing. A drive that shows what these runs cannot tell would test the model further."
