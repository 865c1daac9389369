"""Random roads of ISO 8608, and the class of a measured one.

  ridelog road generate --class B --length 1000 --out road.csv
  ridelog road classify road.csv
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.api.ranges import IRI, LENGTH, MOST_ROAD_SAMPLES, ROAD_WAVINESS, ROUGHNESS, SPACING
from logger.api.road_questions import CLASSIFY
from logger.commands import options
from logger.commands.numbers import add_number
from logger.errors import EXIT_DONE, BadInput
from logger.files import write_text

if TYPE_CHECKING:
    from logger.roads.elevation_spectrum import Array

_LINES_AT_ONCE = 100_000


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the two verbs."""
    verbs = parser.add_subparsers(dest="road_verb", required=True, metavar="generate|classify")
    make = verbs.add_parser("generate", help="make a random road", allow_abbrev=False,
                            description="Make a random road with the spectrum of ISO 8608. Same numbers, same road.")
    rough = make.add_mutually_exclusive_group(required=True)
    rough.add_argument("--class", dest="road_class", metavar="A-H", type=str.upper, choices=list("ABCDEFGH"),
                       help="class; the road gets the geometric mean of its degrees of roughness")
    add_number(rough, "--gd", *ROUGHNESS, metavar="CM3", help="degree of roughness Gd(n0) [cm3]")
    add_number(rough, "--iri", *IRI, metavar="M_PER_KM",
               help="IRI; Gd(n0) follows from Eq 4.40, or for a waviness other than 2 from its own relation")
    add_number(make, "--waviness", *ROAD_WAVINESS, default=2.0, metavar="W", help="1.5 to 3 (default: 2)")
    add_number(make, "--length", *LENGTH, default=1000.0, metavar="M", help="[m] (default: 1000)")
    add_number(make, "--spacing", *SPACING, default=0.05, metavar="M",
               help="between samples [m] (default: 0.05)")
    add_number(make, "--seed", 0, inf, kind=int, default=1, metavar="N",
               help="another number, another road (default: 1)")
    make.add_argument("--out", type=Path, metavar="FILE", help="CSV file to write (default: to stdout)")
    make.add_argument("--json", action="store_true", help="print what was made as one JSON object; needs --out")

    tell = verbs.add_parser("classify", help="class, degree of roughness and waviness of a profile", allow_abbrev=False,
                            description=options.help_of(CLASSIFY.question))
    options.declare(tell, CLASSIFY)


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog road``."""
    return _generate(args) if args.road_verb == "generate" else options.run(CLASSIFY, args)


# --- generate ---


def _generate(args: argparse.Namespace) -> int:
    from logger.api.roads import roughness_of
    from logger.roads.iri import iri
    from logger.roads.iso8608 import generate, road_class

    if args.json and args.out is None:
        raise BadInput("--json: expected --out FILE with it, as stdout holds the JSON")
    if args.length / args.spacing > MOST_ROAD_SAMPLES:
        raise BadInput(f"--length {args.length:g} --spacing {args.spacing:g}: expected at most "
                       f"{MOST_ROAD_SAMPLES} samples")
    gd_n0_cm3 = roughness_of(args.road_class, args.gd, args.iri, args.length, args.waviness)
    last_m = int(args.length / args.spacing + 1e-9) * args.spacing
    if last_m < LENGTH.low:
        raise BadInput(f"--length {args.length:g} --spacing {args.spacing:g}: expected the last sample at "
                       f"{LENGTH.low:g} m or more, it lies at {last_m:g} m")
    elevation = generate(gd_n0_cm3, args.length, args.spacing, args.seed, args.waviness)
    made = {
        "class": road_class(gd_n0_cm3), "gd_n0_cm3": gd_n0_cm3, "waviness": args.waviness, "seed": args.seed,
        "iri_m_per_km": iri(elevation, args.spacing), "spacing_m": args.spacing, "samples": len(elevation),
    }
    if args.out is None:
        sys.stdout.writelines(_csv(elevation, args.spacing))
    else:
        write_text(args.out, _csv(elevation, args.spacing), "ascii")
    if args.json:
        print(json.dumps(made | {"file": str(args.out)}))
    else:
        print(_made_in_words(made, args.out), file=sys.stderr)
    return EXIT_DONE


def _csv(elevation_m: Array, spacing_m: float) -> Iterator[str]:
    """A profile's lines in blocks; a tenth of a micrometre is finer than any profiler."""
    yield "distance_m,elevation_m\n"
    for first in range(0, len(elevation_m), _LINES_AT_ONCE):
        block = elevation_m[first:first + _LINES_AT_ONCE].tolist()
        yield "".join(f"{number * spacing_m:.6f},{value:.7f}\n" for number, value in enumerate(block, start=first))


def _made_in_words(made: dict[str, Any], out: Path | None) -> str:
    length_m = (made["samples"] - 1) * made["spacing_m"]
    return (f"{out or 'stdout'}: {length_m:.10g} m in {made['samples']} samples, class {made['class']}, "
            f"Gd(n0) {made['gd_n0_cm3']:.5g} cm3, waviness {made['waviness']:g}, seed {made['seed']}, "
            f"IRI {made['iri_m_per_km']:.2f} m/km")
