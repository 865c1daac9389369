"""Exact IRI of a measured profile (ASTM E1926), whole and window by window.

PROFILE is CSV (distance_m,elevation_m[,elevation_right_m]) or ERD, evenly spaced by 300 mm or less and at least 11 m
long. With two wheel tracks: the IRI of each, their mean (MRI) and that of the half car on both (HRI).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from logger.commands.numbers import add_limit
from logger.commands.pictures import add_out, check_pictures, write_pictures
from logger.errors import EXIT_DONE, BadInput

WINDOW_M = 100.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("profile", type=Path, metavar="PROFILE", nargs="?", help="CSV or ERD file")
    parser.add_argument("--response", action="store_true",
                        help="without a profile: how strongly the IRI responds to each wavelength, as a table")
    parser.add_argument("--window", type=float, default=WINDOW_M, metavar="M",
                        help="length of a window [m] (default: 100, as road agencies report; a tenth of a mile is "
                             "160.9344, the service's 25 ft are 7.62)")
    parser.add_argument("--resample", type=float, metavar="M",
                        help="for an unevenly spaced profile: lay straight lines between its samples and take a "
                             "sample every M metres; this changes the IRI, and the result says that it was done")
    add_limit(parser, "--localized", metavar="IRI",
              help="list where the IRI over 25 ft, which slides along, is above this, in m/km, or as 160in/mi (AASHTO "
                   "R 54)")
    add_out(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog iri``."""
    if args.response:
        if args.profile is not None or args.localized is not None:
            raise BadInput("--response: expected no PROFILE and no --localized, it is the response of the IRI itself")
        table = response()
        print(json.dumps({"response": table}) if args.json else "\n".join(response_screen(table)))
        return EXIT_DONE
    if args.profile is None:
        raise BadInput("expected a PROFILE, or --response")
    from logger.api.roads import iri

    if not args.window > 0:
        raise BadInput(f"--window {args.window:g}: expected a length above 0 m")
    check_pictures(args.out, [args.profile])
    found = iri(args.profile, args.window, args.resample, args.localized)
    write_pictures(args.out, "International Roughness Index", args.profile.name, found.text, found.charts)
    print(json.dumps(found.as_json(), allow_nan=False) if args.json else found.text)
    return EXIT_DONE


def response() -> list[dict[str, float]]:
    """Fig 2.13: gain for slope, and IRI of a sine of 1 mm amplitude, at third-octave wavelengths, 100 m to 0.3 m."""
    import numpy as np

    from logger.roads.wavelength import sinusoid_iri, slope_gain

    wavelengths_m = 100.0 / 2.0 ** (np.arange(26) / 3.0)
    gain, iri_1_mm = slope_gain(1.0 / wavelengths_m), sinusoid_iri(0.001, 1.0 / wavelengths_m)
    columns = {"wavelength_m": wavelengths_m, "slope_gain": gain, "iri_of_1_mm_m_per_km": iri_1_mm}
    return [dict(zip(columns, row, strict=True)) for row in zip(*(c.tolist() for c in columns.values()), strict=True)]


def response_screen(table: list[dict[str, float]]) -> list[str]:
    """The same for a person, with bars."""
    lines = ["IRI of a sinusoidal road by wavelength (80 km/h, 250 mm moving average)", "",
             "wavelength  slope gain  IRI of 1 mm"]
    for row in table:
        bar = "#" * round(20 * row["slope_gain"])
        figures = f"{row['slope_gain']:11.3f} {row['iri_of_1_mm_m_per_km']:12.3f}"
        lines.append(f"{row['wavelength_m']:8.2f} m {figures}  {bar}")
    return lines
