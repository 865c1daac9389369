"""Compare a vehicle's model with measurements: the error, where it sits, and what kind of thing is missing.

Each RUN is a folder with drive.csv (t_s,accel_z_mps2,speed_mps,distance_m) and the profile.csv it was driven on.

  ridelog compare --vehicle mycar.yaml run1 run2
  ridelog compare --vehicle mycar.yaml run1 run2 --out compare.html

The error is rms(measured - model) / rms(measured), the first 2 s of each run left out. Then the car's numbers and the
distances are refitted within what they are usually off, and what is left is read: only that is evidence of physics that
the model lacks. ridelog diagnose says which.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from logger.commands.lab_model import add_tolerance, check_model, check_out, deviation_of, paragraphs
from logger.commands.lab_runs import lab_runs
from logger.errors import EXIT_DONE, BadInput
from logger.files import write_text

if TYPE_CHECKING:
    from logger.lab.beside import Part
    from logger.lab.compare import Comparison

_PLACES = 5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``ridelog compare``."""
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder with drive.csv and profile.csv")
    parser.add_argument("--vehicle", required=True, metavar="NAME|FILE",
                        help="a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name)")
    add_tolerance(parser)
    parser.add_argument("--out", type=Path, metavar="FILE.html", help="write a page with pictures")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog compare``."""
    from logger.lab.compare import as_json, compare
    from logger.lab.nuisance import Tolerance
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import read_model

    tolerance = Tolerance(numbers=deviation_of(args.tolerance))
    path = vehicle_path(args.vehicle)
    model = read_model(path)
    if args.out is not None:
        check_out(args.out, args.runs, [path, *(Path(one.file) for one in model.effects if one.file is not None)])
    runs = lab_runs(args.runs, thin=False)  # an error is that of all samples
    check_model(args.vehicle, model, runs)
    try:
        found = compare(runs, model.vehicle, model.effects, model.given, tolerance)
    except ValueError as error:
        raise BadInput(f"{args.vehicle}: {error}") from None
    if args.out is not None:
        from logger.report.lab_page import page

        write_text(args.out, page(found))
    if args.json:
        print(json.dumps(as_json(found), allow_nan=False))
    else:
        print("\n".join(_lines(found)))
        if args.out is not None:
            print(f"\nPage: {args.out}")
    return EXIT_DONE


def _lines(found: Comparison) -> list[str]:
    from logger.lab.compare import conclusion, evidence, headline

    beside = found.plain.beside
    seconds = sum(map(len, beside.left)) / beside.rate_hz
    return [
        f"{found.vehicle} on {len(beside.runs)} run{'s' * (len(beside.runs) != 1)}, {seconds:.0f} s", "",
        paragraphs(headline(found)), "", "After the refit:", paragraphs(evidence(found), "- "), "",
        paragraphs([conclusion(found)]), "",
        *_tables(found),
    ]


def _tables(found: Comparison) -> list[str]:
    """Where what is left sits, as the model stands and refitted."""
    from logger.lab.beside import paired, short_names
    from logger.lab.marks import worst_places

    lines = [f"{'Where':46}{'share of residual':>13}{'error':>12}", f"{'':44}{'file':>8}{'refit':>7}{'file':>8}"
                                                                    f"{'refit':>8}"]
    plain, refitted = found.plain.where, found.refitted.where
    for title, unit, one, other in (
        ("Frequency", "Hz", plain.frequency, refitted.frequency), ("Speed", "m/s", plain.speed, refitted.speed),
    ):
        lines += [title, *(_row(a, b, unit) for a, b in paired(one, other))]
    lines += ["Model's acceleration", *(_row(None, part, "m/s2") for part in refitted.amplitude)]
    names = short_names(found.plain.beside.runs)
    lines += ["Worst places", *(_place(part, names[part.name]) for part in worst_places(refitted, _PLACES))]
    return lines


def _row(plain: Part | None, refitted: Part, unit: str) -> str:
    name = f"  {refitted.low:.3g} to {refitted.high:.3g} {unit}" + (f" {refitted.name}" if refitted.name else "")
    share, error = (f"{plain.share:.1%}", plain.error_told(3)) if plain else ("", "")
    return f"{name:46}{share:>6}{refitted.share:>7.1%}{error:>8}{refitted.error_told(3):>8}"


def _place(part: Part, run: str) -> str:
    name = f"  {run}, {part.low:g} to {part.high:g} m"
    return f"{name:46}{'':6}{part.share:>7.1%}{'':8}{part.error_told(3):>8}"
