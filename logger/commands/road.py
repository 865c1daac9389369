"""Make random roads of ISO 8608, or classify a measured one.

  ridelog road generate --class B --length 1000 --out road.csv
  ridelog road classify road.csv
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.api.drive_questions import CLASSIFY, GENERATE, RandomRoadQuestion
from logger.commands import options
from logger.errors import EXIT_DONE, BadInput
from logger.files import write_text

if TYPE_CHECKING:
    from logger.roads.elevation_spectrum import Array

_LINES_AT_ONCE = 100_000
VERBS = {"generate": (GENERATE, "make a random road"),
         "classify": (CLASSIFY, "class, degree of roughness and waviness of a profile")}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the two verbs."""
    make = options.add_verbs(parser, "road_verb", VERBS)["generate"]
    make.add_argument("--out", type=Path, metavar="FILE", help="CSV file to write (default: to stdout)")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog road``."""
    return _generate(args) if args.road_verb == "generate" else options.run(CLASSIFY, args)


def _generate(args: argparse.Namespace) -> int:
    """A profile goes to stdout where no file is named, and what was made to stderr."""
    from logger.api.roads import random_road, roughness_of
    from logger.roads.iri import iri
    from logger.roads.iso8608 import road_class

    if args.json and args.out is None:
        raise BadInput("--json: expected --out FILE with it, as stdout holds the JSON")
    with options.respelled(RandomRoadQuestion):
        question: RandomRoadQuestion = options.asked(GENERATE, args)
    road, gd_n0_cm3 = random_road.answer(question), roughness_of(question)
    made = {
        "class": road_class(gd_n0_cm3), "gd_n0_cm3": gd_n0_cm3, "waviness": question.waviness, "seed": question.seed,
        "iri_m_per_km": iri(road.elevation_m, road.spacing_m), "spacing_m": road.spacing_m,
        "samples": len(road.elevation_m),
    }
    lines = _csv(road.elevation_m, road.spacing_m)
    if args.out is None:
        sys.stdout.writelines(lines)
    else:
        write_text(args.out, lines, "ascii")
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
