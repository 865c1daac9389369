"""Exact IRI of a measured profile (ASTM E1926), whole and window by window.

PROFILE is CSV (distance_m,elevation_m[,elevation_right_m]) or ERD, evenly spaced by 300 mm or less and at least 11 m
long. With two wheel tracks: the IRI of each, their mean (MRI) and that of the half car on both (HRI).
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.errors import EXIT_DONE, BadInput

if TYPE_CHECKING:
    from logger.roads.iri import Array, IriWindow
    from logger.store.formats.profile_file import Profile

WINDOW_M = 100.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("profile", type=Path, metavar="PROFILE", nargs="?", help="CSV or ERD file")
    parser.add_argument("--response", action="store_true",
                        help="without a profile: what the IRI hears of each wavelength, as a table")
    parser.add_argument("--window", type=float, default=WINDOW_M, metavar="M",
                        help="length of a window [m] (default: 100, as road agencies report; a tenth of a mile is "
                             "160.9344, the service's 25 ft are 7.62)")
    parser.add_argument("--resample", type=float, metavar="M",
                        help="for an unevenly spaced profile: lay straight lines between its samples and take a "
                             "sample every M metres; this changes the IRI, and the result says that it was done")
    parser.add_argument("--json", action="store_true", help="print one JSON object for a program")


def run(args: argparse.Namespace) -> int:
    """Carry out ``ridelog iri``."""
    if args.response:
        table = response()
        print(json.dumps({"response": table}) if args.json else "\n".join(response_screen(table)))
        return EXIT_DONE
    if args.profile is None:
        raise BadInput("expected a PROFILE, or --response")
    from logger.store.formats.profile_file import read_profile

    if not args.window > 0:
        raise BadInput(f"--window {args.window:g}: expected a length above 0 m")
    profile = read_profile(args.profile, args.resample)
    try:
        result = measure(profile, args.window)
    except ValueError as error:
        raise BadInput(f"{args.profile}: {error}") from None
    if args.json:
        print(json.dumps(as_json(result, profile), allow_nan=False))
    else:
        print("\n".join(screen(result, profile, args.profile.name)))
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
    lines = ["What the IRI hears of a sinusoidal road (80 km/h, 250 mm moving average)", "",
             "wavelength  slope gain  IRI of 1 mm"]
    for row in table:
        bar = "#" * round(20 * row["slope_gain"])
        heard = f"{row['slope_gain']:11.3f} {row['iri_of_1_mm_m_per_km']:12.3f}"
        lines.append(f"{row['wavelength_m']:8.2f} m {heard}  {bar}")
    return lines


@dataclass(frozen=True)
class Measured:
    """IRI [m/km] by JSON name, each (1 + w,): of the whole profile, then of its windows."""

    windows: list[IriWindow]
    columns: dict[str, Array]

    def row(self, number: int) -> dict[str, float]:
        """One value of each name: 0 is the whole, 1 the first window."""
        return {name: float(column[number]) for name, column in self.columns.items()}


def measure(profile: Profile, window_m: float) -> Measured:
    """IRI of each track of a profile, and MRI and HRI of two. ValueError as in ``logger.roads.iri``."""
    left, windows = _track(profile.elevation_m, profile.spacing_m, window_m)
    columns = {"iri_m_per_km": left}
    if profile.elevation_right_m is not None:
        right, _ = _track(profile.elevation_right_m, profile.spacing_m, window_m)
        middle = (profile.elevation_m + profile.elevation_right_m) / 2
        half_car, _ = _track(middle, profile.spacing_m, window_m)
        columns |= {"iri_right_m_per_km": right, "mri_m_per_km": (left + right) / 2, "hri_m_per_km": half_car}
    return Measured(windows, columns)


def _track(elevation_m: Array, spacing_m: float, window_m: float) -> tuple[Array, list[IriWindow]]:
    import numpy as np

    from logger.roads.iri import PER_KM, IriWindows, rectified_slope

    cutter = IriWindows(spacing_m, window_m)
    slope = rectified_slope(elevation_m, spacing_m)
    windows = cutter.push(slope) + cutter.finish()
    return np.array([PER_KM * slope.mean(), *(window.iri_m_per_km for window in windows)]), windows


def as_json(result: Measured, profile: Profile) -> dict[str, Any]:
    """One track: ``iri_m_per_km`` and ``windows``; two: the right track, MRI and HRI as well; and any resampling."""
    windows = [
        {"distance_start_m": profile.start_m + window.distance_start_m,
         "distance_end_m": profile.start_m + window.distance_end_m, **result.row(number)}
        for number, window in enumerate(result.windows, start=1)
    ]
    resampled = {} if profile.widest_step_m is None else {
        "resampled_to_m": profile.spacing_m, "widest_step_m": profile.widest_step_m}
    return {**result.row(0), "windows": windows, **resampled}


def screen(result: Measured, profile: Profile, name: str) -> list[str]:
    """The lines a person sees; ``name`` is that of the file."""
    from logger.roads.roughness_words import ride_words, road_kinds

    whole = result.row(0)
    roughness = whole.get("mri_m_per_km", whole["iri_m_per_km"])
    length_m = (len(profile.elevation_m) - 1) * profile.spacing_m
    lines = [f"{name}: {length_m:.2f} m, one sample every {profile.spacing_m * 1000:.4g} mm"]
    if profile.widest_step_m is not None:
        lines.append(f"Resampled: straight lines between samples up to {profile.widest_step_m:.3g} m apart.")
    lines += [
        "", ", ".join(f"{_HEADS[key]} {value:.3f}" for key, value in whole.items()) + " m/km",
        f"Roads like this: {', '.join(road_kinds(roughness)) or 'none of the usual'}",
        f"Ride: {ride_words(roughness)}", "",
        f"{'from m':>10} {'to m':>10}" + "".join(f" {_HEADS[key]:>10}" for key in whole),
    ]
    for number, window in enumerate(result.windows, start=1):
        start_m, end_m = (profile.start_m + m for m in (window.distance_start_m, window.distance_end_m))
        values = "".join(f" {value:10.3f}" for value in result.row(number).values())
        lines.append(f"{start_m:10.2f} {end_m:10.2f}{values}" + ("   partial" if window.partial else ""))
    return lines


_HEADS = {"iri_m_per_km": "IRI", "iri_right_m_per_km": "IRI right", "mri_m_per_km": "MRI", "hri_m_per_km": "HRI"}
