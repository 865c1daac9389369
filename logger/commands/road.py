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
from logger.commands.numbers import add_number
from logger.commands.pictures import add_out, check_pictures, write_pictures
from logger.errors import EXIT_DONE, BadInput
from logger.files import together, write_text

if TYPE_CHECKING:
    from logger.roads.elevation_spectrum import Array, BandedSpectrum

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
                            description="Class, degree of roughness and waviness of a profile of at least 100 m.")
    tell.add_argument("profile", type=Path, metavar="PROFILE", help="CSV or ERD file")
    tell.add_argument("--resample", type=float, metavar="M",
                      help="for an unevenly spaced profile: lay straight lines between its samples and take a sample "
                           "every M metres; what was between wide samples stays unknown")
    tell.add_argument("--psd", type=Path, metavar="FILE", help="write the smoothed spectrum of the (left) track as CSV")
    add_out(tell)
    tell.add_argument("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog road``."""
    return _generate(args) if args.road_verb == "generate" else _classify(args)


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


# --- classify ---


def _classify(args: argparse.Namespace) -> int:
    from logger.api.roads import classify

    check_pictures(args.out, [args.profile], [("--psd", args.psd)])
    found = classify(args.profile, args.resample)
    with together():
        if args.psd is not None:
            write_text(args.psd, _psd_csv(found.spectrum), "ascii")
        write_pictures(args.out, "Class of the road", args.profile.name, found.text, found.charts)
    print(json.dumps(found.as_json()) if args.json else found.text)
    return EXIT_DONE


def _psd_csv(found: BandedSpectrum) -> str:
    from logger.roads.elevation_spectrum import acceleration_psd

    columns = (found.edges_cpm[:-1], found.edges_cpm[1:], found.psd_m3,
               acceleration_psd(found.centre_cpm, found.psd_m3), found.freedom)
    rows = zip(*(column.tolist() for column in columns), strict=True)
    header = "lowest_cpm,highest_cpm,displacement_psd_m3,acceleration_psd_per_m,degrees_of_freedom\n"
    return header + "".join(",".join(f"{value:.7g}" for value in row) + "\n" for row in rows)
