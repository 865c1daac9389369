"""Roads: the IRI and the class (ISO 8608) of measured ones, and random ones, each with its words and JSON."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from logger.api.drive_questions import ClassifyQuestion, IriQuestion, RandomRoadQuestion
from logger.api.inputs import Profile
from logger.api.shown import CommandResult
from logger.chart_data import Array, Chart, Curves, Line, line
from logger.errors import BadInput
from logger.question import function
from logger.report.blocks import Block, Blocks, Lines, Table, area_blocks
from logger.report.quantities import area_values, measured
from logger.report.summary import IRI_CLASSES
from logger.roads import elevation_spectrum, iso8608
from logger.roads.elevation_spectrum import BandedSpectrum, TrackClass, track_class
from logger.roads.iri import (
    Area,
    ProfileIri,
    areas,
    continuous_iri,
    doubts_of,
    profile_iri,
    spacing_hint,
    unit_complaint,
    unit_doubt,
)
from logger.roads.iso8608 import CLASS_GD_N0_CM3, displacement_psd, generate, iri_from_gd_n0
from logger.roads.sections import ride_words, road_kinds
from logger.store.formats import profile_file
from logger.units import FOOT_M, INCH_PER_MILE_M_PER_KM, WINDOW_M


@function(RandomRoadQuestion)
def random_road(question: RandomRoadQuestion) -> Profile:
    elevation_m = generate(roughness_of(question), question.length_m, question.spacing_m, question.seed,
                           question.waviness)
    return Profile(0.0, question.spacing_m, elevation_m, None)


def roughness_of(question: RandomRoadQuestion) -> float:
    """Gd(n0) of the road that is asked for [cm3]."""
    if question.iso_class is not None:
        return iso8608.CLASS_GD_N0_CM3[question.iso_class]
    if question.gd_n0_cm3 is not None:
        return question.gd_n0_cm3
    assert question.iri_m_per_km is not None
    if question.waviness == iso8608.STANDARD_WAVINESS:
        return iso8608.gd_n0_from_iri(question.iri_m_per_km)
    return elevation_spectrum.gd_of_road(question.iri_m_per_km, question.length_m, question.waviness).value


@dataclass(frozen=True, eq=False, repr=False)
class Iri(CommandResult):
    """The IRI of a profile [m/km], whole and in w windows.

    iri_m_per_km          of the left track, or of the only one
    iri_right_m_per_km    of the right one; ``mri_m_per_km`` the mean of both; ``hri_m_per_km`` of the half car on both;
                          None where there is one track
    edges_m               (w + 1,) ends of the windows [m]; the last one may be shorter
    windows_m_per_km      (w,) IRI of each, of two tracks their mean
    profile               the road
    localized             areas of localized roughness, where they were asked for
    """

    iri_m_per_km: float
    iri_right_m_per_km: float | None
    mri_m_per_km: float | None
    hri_m_per_km: float | None
    edges_m: Array
    windows_m_per_km: Array
    profile: Profile
    localized: tuple[Area, ...] = ()

    title: ClassVar[str] = "International Roughness Index"

    def charts(self) -> Sequence[Chart]:
        """The IRI of the windows along the way, the continuous one over 25 ft (AASHTO R 54), and the profile."""
        road = self.profile
        distance_m, continuous = continuous_iri(road.elevation_m, road.elevation_right_m, road.spacing_m, WINDOW_M)
        return [
            Curves("Roughness", "distance [m]", "IRI [m/km]", (
                line("25 ft, continuous", road.start_m + distance_m, continuous),
                Line("windows", np.repeat(self.edges_m, 2)[1:-1], np.repeat(self.windows_m_per_km, 2)))),
            *road.charts()]


@function(IriQuestion)
def iri(question: IriQuestion) -> Iri:
    name, road = _named(question.profile, question.resample_m)
    localized_m_per_km = question.localized_m_per_km
    try:
        found = profile_iri(road.elevation_m, road.elevation_right_m, road.spacing_m, question.window_m)
    except ValueError as error:
        words = unit_complaint(road.elevation_m, road.spacing_m) or f"{error}{spacing_hint(road.spacing_m)}"
        raise BadInput(f"{name}: {words}") from None
    ends_m = [0.0, *(window.distance_end_m for window in found.windows)]
    shown = found.columns.get("mri_m_per_km", found.columns["iri_m_per_km"])
    whole = found.row(0)
    content, values = iri_blocks(found, road, Path(name).name), iri_json(found, road)
    rough: tuple[Area, ...] = ()
    if localized_m_per_km is not None:
        middle_m, sliding = continuous_iri(road.elevation_m, road.elevation_right_m, road.spacing_m, WINDOW_M)
        rough = tuple(areas(road.start_m + middle_m, sliding, localized_m_per_km))
        content += area_blocks(rough, localized_m_per_km)
        values |= {"localized": [area_values(one) for one in rough]}
    return Iri(Blocks(content), values, whole["iri_m_per_km"],
               whole.get("iri_right_m_per_km"), whole.get("mri_m_per_km"), whole.get("hri_m_per_km"),
               road.start_m + np.array(ends_m), shown[1:], road, rough)


@dataclass(frozen=True, eq=False, repr=False)
class RoadClass(CommandResult):
    """The class of a profile, by its left track; ``as_json`` has the right one as well.

    road_class       A to H (ISO 8608)
    gd_n0_cm3        degree of roughness Gd(n0) [cm3], and ``gd_n0_std_cm3`` its standard error
    waviness         w, and ``waviness_std`` its standard error
    iri_m_per_km     exact
    spectrum         smoothed in bands (ISO 8608, annex C)
    """

    road_class: str
    gd_n0_cm3: float
    gd_n0_std_cm3: float
    waviness: float
    waviness_std: float
    iri_m_per_km: float
    spectrum: BandedSpectrum

    title: ClassVar[str] = "Class of the road"

    def charts(self) -> Sequence[Chart]:
        """The spectrum of the (left) track, the line through it, and the limits of the classes (ISO 8608)."""
        found = self.spectrum
        lines = [Line("measured", found.centre_cpm, found.psd_m3),
                 Line("line through it", found.centre_cpm,
                      displacement_psd(found.centre_cpm, self.gd_n0_cm3, self.waviness))]
        ends = found.centre_cpm[[0, -1]]
        lines += [Line(f"{smoother} | {rougher}", ends, displacement_psd(ends, mean_cm3 / 2), faint=True)
                  for smoother, (rougher, mean_cm3) in zip(CLASS_GD_N0_CM3, list(CLASS_GD_N0_CM3.items())[1:],
                                                           strict=False)]
        return [Curves("Spectrum of the road", "wave number [cycles/m]", "displacement power spectral density [m3]",
                       tuple(lines), log_x=True, log_y=True)]


@function(ClassifyQuestion)
def classify(question: ClassifyQuestion) -> RoadClass:
    name, road = _named(question.profile, question.resample_m)
    profile_file.check_road(road, name)
    tracks = [one for one in (road.elevation_m, road.elevation_right_m) if one is not None]
    try:
        found = [track_class(one, road.spacing_m, road.widest_step_m) for one in tracks]
    except ValueError as error:
        raise BadInput(f"{name}: {error}{spacing_hint(road.spacing_m)}") from None
    left = found[0].roughness
    return RoadClass("\n".join(class_lines(found, road, Path(name).name)), class_json(found), left.road_class,
                     left.gd_n0_cm3, left.gd_n0_std_cm3, left.waviness, left.waviness_std, found[0].iri_m_per_km,
                     left.bands)


def _named(profile: profile_file.Wheelpaths | Path | str, resample_m: float | None) -> tuple[str, Profile]:
    """A profile and what to call it, not judged."""
    if isinstance(profile, Profile):
        return "profile", profile
    read = profile if isinstance(profile, profile_file.Wheelpaths) else profile_file.read_profile(profile, resample_m)
    return "profile" if read is profile else str(profile), Profile(**vars(read))


_HEADS = {"iri_m_per_km": "IRI", "iri_right_m_per_km": "IRI right", "mri_m_per_km": "MRI", "hri_m_per_km": "HRI"}


def iri_json(result: ProfileIri, profile: Profile) -> dict[str, Any]:
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


def _of_profile(profile: Profile, name: str) -> str:
    length_m = (len(profile.elevation_m) - 1) * profile.spacing_m
    return (f"{name}: {length_m:.2f} m ({length_m / FOOT_M:.1f} ft), one sample every "
            f"{profile.spacing_m * 1000:.4g} mm ({profile.spacing_m / FOOT_M * 12:.4g} in)")


def iri_blocks(result: ProfileIri, profile: Profile, name: str) -> list[Block]:
    """What a person sees; ``name`` is that of the file."""
    whole = result.row(0)
    first = "mri_m_per_km" if "mri_m_per_km" in whole else "iri_m_per_km"
    roughness = whole[first]
    rows = []
    for number, window in enumerate(result.windows, start=1):
        start_m, end_m = (profile.start_m + m for m in (window.distance_start_m, window.distance_end_m))
        row = result.row(number)
        rows.append((f"{start_m:.2f}", f"{end_m:.2f}", f"{start_m / FOOT_M:.1f}", f"{end_m / FOOT_M:.1f}",
                     *(f"{value:.3f}" for value in row.values()),
                     f"{row[first] / INCH_PER_MILE_M_PER_KM:.1f}", "partial" if window.partial else ""))
    heads = ("from m", "to m", "from ft", "to ft", *(f"{_HEADS[key]} m/km" for key in whole), "in/mi", "")
    resampled = [] if profile.widest_step_m is None else [
        f"Resampled: interpolated between samples up to {profile.widest_step_m:.3g} m apart."]
    return [
        Lines([
            ", ".join(f"{_HEADS[key]} {value:.3f} m/km ({value / INCH_PER_MILE_M_PER_KM:.1f} in/mi)"
                      for key, value in whole.items()),
            f"Roads like this: {', '.join(road_kinds(roughness)) or 'none of the usual'}",
            f"Ride: {ride_words(roughness)}",
            *([doubt] if (doubt := unit_doubt(_roughest(result))) else [])]),
        Lines(["The profile is shorter than one window (--window): its IRI is that of the whole profile."]
              * all(window.partial for window in result.windows)), Table(heads, rows, (len(heads) - 1,)),
        Lines([_of_profile(profile, name), *resampled])]


def class_json(tracks: Sequence[TrackClass]) -> dict[str, Any]:
    """Named fields, SI units in the names; a second track is ``right``."""
    return (_track_json(tracks[0]) | ({"right": _track_json(tracks[1])} if len(tracks) > 1 else {})
            | doubts_of(max(track.iri_m_per_km for track in tracks)))


def _track_json(track: TrackClass) -> dict[str, Any]:
    found = track.roughness
    return {
        "class": found.road_class, "gd_n0_cm3": found.gd_n0_cm3, "waviness": found.waviness,
        "iri_m_per_km": track.iri_m_per_km, "gd_n0_std_cm3": found.gd_n0_std_cm3,
        "waviness_std": found.waviness_std, "classes_possible": list(found.classes),
        "iri_of_gd_m_per_km": iri_from_gd_n0(found.gd_n0_cm3),
        "iri_expected_m_per_km": track.expected.value, "iri_expected_std_m_per_km": track.expected.std,
        "lowest_cpm": found.lowest_cpm, "highest_cpm": found.highest_cpm,
    }


def class_lines(tracks: Sequence[TrackClass], profile: Profile, name: str) -> list[str]:
    """The lines a person sees; ``name`` is that of the file."""
    doubt = unit_doubt(max(track.iri_m_per_km for track in tracks))
    printed = [doubt, ""] if doubt else []
    for side, track in zip(("left track", "right track") if len(tracks) > 1 else ("",), tracks, strict=True):
        printed += [*([side] if side else []), *_track_lines(track), ""]
    return [*printed, _of_profile(profile, name)]


def _track_lines(track: TrackClass) -> list[str]:
    found = track.roughness
    doubt = "" if len(found.classes) == 1 else \
        f"; the road is too short or too irregular to be sure: it may be {' or '.join(found.classes)}"
    return [
        f"class      {found.road_class}: {IRI_CLASSES[found.road_class]}{doubt}",
        f"Gd(n0)     {measured(found.gd_n0_cm3, found.gd_n0_std_cm3)} cm3, from waves of "
        f"{1 / found.highest_cpm:.2g} to {1 / found.lowest_cpm:.2g} m",
        f"waviness   {found.waviness:.2f} ± {found.waviness_std:.2f} (the classes have 2)",
        f"IRI        {track.iri_m_per_km:.2f} m/km; this Gd(n0) means {iri_from_gd_n0(found.gd_n0_cm3):.2f} by "
        f"Eq 4.39, with this waviness {track.expected.value:.2f} ± {track.expected.std:.2f}",
    ]
