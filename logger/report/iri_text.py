"""The IRI of a profile, for a person and for a program."""

from __future__ import annotations

from typing import Any

from logger.roads.iri import ProfileIri
from logger.roads.plausible import doubts_of, unit_doubt
from logger.roads.sections import ride_words, road_kinds
from logger.store.formats.profile_file import Profile

_HEADS = {"iri_m_per_km": "IRI", "iri_right_m_per_km": "IRI right", "mri_m_per_km": "MRI", "hri_m_per_km": "HRI"}


def as_json(result: ProfileIri, profile: Profile) -> dict[str, Any]:
    """One track: ``iri_m_per_km`` and ``windows``; two: the right track, MRI and HRI as well; and any resampling."""
    windows = [
        {"distance_start_m": profile.start_m + window.distance_start_m,
         "distance_end_m": profile.start_m + window.distance_end_m, **result.row(number)}
        for number, window in enumerate(result.windows, start=1)
    ]
    resampled = {} if profile.widest_step_m is None else {
        "resampled_to_m": profile.spacing_m, "widest_step_m": profile.widest_step_m}
    return {**result.row(0), "windows": windows, **resampled, **doubts_of(_roughest(result))}


def _roughest(result: ProfileIri) -> float:
    return max(result.row(0).values())


def _cut_short(result: ProfileIri) -> list[str]:
    """What is to be said of a profile that no window fits into."""
    return ["The profile is shorter than one window (--window): its IRI is of all there is.", ""] if (
        all(window.partial for window in result.windows)) else []


def lines(result: ProfileIri, profile: Profile, name: str) -> list[str]:
    """The lines a person sees; ``name`` is that of the file."""
    whole = result.row(0)
    roughness = whole.get("mri_m_per_km", whole["iri_m_per_km"])
    length_m = (len(profile.elevation_m) - 1) * profile.spacing_m
    printed = [f"{name}: {length_m:.2f} m, one sample every {profile.spacing_m * 1000:.4g} mm"]
    if doubt := unit_doubt(_roughest(result)):
        printed.append(doubt)
    if profile.widest_step_m is not None:
        printed.append(f"Resampled: straight lines between samples up to {profile.widest_step_m:.3g} m apart.")
    printed += [
        "", ", ".join(f"{_HEADS[key]} {value:.3f}" for key, value in whole.items()) + " m/km",
        f"Roads like this: {', '.join(road_kinds(roughness)) or 'none of the usual'}",
        f"Ride: {ride_words(roughness)}", "", *_cut_short(result),
        f"{'from m':>10} {'to m':>10}" + "".join(f" {_HEADS[key]:>10}" for key in whole) + "  m/km",
    ]
    for number, window in enumerate(result.windows, start=1):
        start_m, end_m = (profile.start_m + m for m in (window.distance_start_m, window.distance_end_m))
        values = "".join(f" {value:10.3f}" for value in result.row(number).values())
        printed.append(f"{start_m:10.2f} {end_m:10.2f}{values}" + ("   partial" if window.partial else ""))
    return printed


def response_screen(table: list[dict[str, float]]) -> list[str]:
    """How the IRI responds to each wavelength, with bars."""
    lines = ["IRI of a sinusoidal road by wavelength (80 km/h, 250 mm moving average)", "",
             "wavelength  slope gain  IRI of 1 mm"]
    for row in table:
        bar = "#" * round(20 * row["slope_gain"])
        figures = f"{row['slope_gain']:11.3f} {row['iri_of_1_mm_m_per_km']:12.3f}"
        lines.append(f"{row['wavelength_m']:8.2f} m {figures}  {bar}")
    return lines
