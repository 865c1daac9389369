"""Roads: measured profiles, random ones, and their International Roughness Index."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from logger.api.question import function
from logger.api.road_questions import ClassifyQuestion, IriCommand, IriQuestion, RandomRoadQuestion
from logger.api.shown import CommandResult, Shown, table
from logger.chart_data import line
from logger.errors import BadInput
from logger.files import write_text
from logger.store.formats import drive_file, profile_file

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.roads.elevation_spectrum import BandedSpectrum
    from logger.roads.iri import Area

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Profile(profile_file.Profile, Shown):
    """The elevations of a road under one or two wheel tracks.

    start_m              distance of the first sample [m]
    spacing_m            between samples [m]
    elevation_m          (n,) of the left track, or of the only one [m]
    elevation_right_m    (n,) of the right one [m], or None
    widest_step_m        for one that was resampled: the widest hole that a straight line was laid across [m]
    """

    @property
    def distance_m(self) -> Array:
        """(n,) where the samples lie [m]."""
        return self.start_m + self.spacing_m * np.arange(len(self.elevation_m), dtype=np.float64)

    def __repr__(self) -> str:
        return table("Profile", [
            ("length", self.spacing_m * (len(self.elevation_m) - 1), "m"), ("begins at", self.start_m, "m"),
            ("spacing", self.spacing_m, "m"), ("samples", len(self.elevation_m), ""),
            ("wheel tracks", 1 if self.elevation_right_m is None else 2, ""),
            ("elevation, standard deviation", float(self.elevation_m.std()), "m"),
            ("resampled across", self.widest_step_m, "m")])

    def charts(self) -> Sequence[Chart]:
        """The elevation of each track."""
        from logger.chart_data import Curves

        tracks = {"left": self.elevation_m, "right": self.elevation_right_m}
        return [Curves("Profile", "distance [m]", "elevation [m]", tuple(
            line(name, self.distance_m, track) for name, track in tracks.items() if track is not None))]


def read_profile(path: Path | str, resample_m: float | None = None) -> Profile:
    """Read a road profile.

    path          CSV ``distance_m,elevation_m[,elevation_right_m]``, or ERD (recognised by its first line)
    resample_m    for one that is unevenly spaced: lay straight lines between its samples, and take one every so many
                  metres [m]

    Raises BadInput (``file:line: expected ...``) for anything else, and for distances that are not evenly spaced.

    >>> road = read_profile(folder / "profile.csv")
    >>> road.elevation_m.shape, road.spacing_m
    ((2001,), 0.1)
    """
    return Profile(**vars(profile_file.read_profile(path, resample_m, judged=True)))


def write_profile(path: Path | str, profile: Profile) -> None:
    """Write a profile as CSV, to a tenth of a micrometre. OSError if that fails.

    >>> write_profile(folder / "smooth.csv", random_road(iso_class="A", length_m=50.0))
    """
    drive_file.write_profile(Path(path), drive_file.track_of(profile))


def random_road_of(question: RandomRoadQuestion) -> Profile:
    """The answer to ``RandomRoadQuestion``, which says what is raised."""
    from logger.roads.iso8608 import generate

    elevation_m = generate(roughness_of(question), question.length_m, question.spacing_m, question.seed,
                           question.waviness)
    return Profile(0.0, question.spacing_m, elevation_m, None)


random_road = function("random_road", RandomRoadQuestion, random_road_of)


def roughness_of(question: RandomRoadQuestion) -> float:
    """Gd(n0) of the road that is asked for [cm3]."""
    from logger.roads import elevation_spectrum, iso8608

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
        from logger.chart_data import Curves, Line
        from logger.roads.iri import continuous_iri
        from logger.units import WINDOW_M

        road = self.profile
        distance_m, continuous = continuous_iri(road.elevation_m, road.elevation_right_m, road.spacing_m, WINDOW_M)
        return [
            Curves("Roughness", "distance [m]", "IRI [m/km]", (
                line("25 ft, continuous", road.start_m + distance_m, continuous),
                Line("windows", np.repeat(self.edges_m, 2)[1:-1], np.repeat(self.windows_m_per_km, 2)))),
            *road.charts()]


def iri_of(question: IriQuestion) -> Iri:
    """The answer to ``IriQuestion``, which says what is raised."""
    from logger.report.iri_text import as_json, lines
    from logger.report.localized_text import area_lines, area_values
    from logger.roads.iri import areas, continuous_iri, profile_iri
    from logger.roads.plausible import spacing_hint, unit_complaint
    from logger.units import WINDOW_M

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
    said, values = lines(found, road, Path(name).name), as_json(found, road)
    rough: tuple[Area, ...] = ()
    if localized_m_per_km is not None:
        middle_m, sliding = continuous_iri(road.elevation_m, road.elevation_right_m, road.spacing_m, WINDOW_M)
        rough = tuple(areas(road.start_m + middle_m, sliding, localized_m_per_km))
        said += ["", *area_lines(rough, localized_m_per_km)]
        values |= {"localized": [area_values(one) for one in rough]}
    return Iri("\n".join(said), values, whole["iri_m_per_km"],
               whole.get("iri_right_m_per_km"), whole.get("mri_m_per_km"), whole.get("hri_m_per_km"),
               road.start_m + np.array(ends_m), shown[1:], road, rough)


iri = function("iri", IriQuestion, iri_of)


def asked_iri(question: IriCommand) -> CommandResult:
    """What the terminal asked: the IRI of a profile, or how the IRI responds to each wavelength (Fig 2.13 of Blum
    2015): gain for slope, and IRI of a sine of 1 mm amplitude, at third-octave wavelengths, 100 m to 0.3 m."""
    from logger.report.iri_text import response_screen
    from logger.roads.iri import sinusoid_iri, slope_gain

    if not question.response:
        return iri_of(question)
    wavelengths_m = 100.0 / 2.0 ** (np.arange(26) / 3.0)
    gain, iri_1_mm = slope_gain(1.0 / wavelengths_m), sinusoid_iri(0.001, 1.0 / wavelengths_m)
    columns = {"wavelength_m": wavelengths_m, "slope_gain": gain, "iri_of_1_mm_m_per_km": iri_1_mm}
    table = [dict(zip(columns, row, strict=True)) for row in zip(*(c.tolist() for c in columns.values()), strict=True)]
    return CommandResult("\n".join(response_screen(table)), {"response": table})


@dataclass(frozen=True, eq=False, repr=False)
class RoadClass(CommandResult):
    """What kind of road a profile is, by its (left) track; of two, the right one is in ``as_json``.

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

    def write(self, path: Path, option: str = "--psd") -> None:
        """Write the spectrum as CSV."""
        from logger.roads.elevation_spectrum import acceleration_psd

        found = self.spectrum
        columns = (found.edges_cpm[:-1], found.edges_cpm[1:], found.psd_m3,
                   acceleration_psd(found.centre_cpm, found.psd_m3), found.freedom)
        rows = zip(*(column.tolist() for column in columns), strict=True)
        header = "lowest_cpm,highest_cpm,displacement_psd_m3,acceleration_psd_per_m,degrees_of_freedom\n"
        write_text(path, header + "".join(",".join(f"{value:.7g}" for value in row) + "\n" for row in rows), "ascii")

    def charts(self) -> Sequence[Chart]:
        """The spectrum of the (left) track, the line through it, and the limits of the classes (ISO 8608)."""
        from logger.chart_data import Curves, Line
        from logger.roads.iso8608 import CLASS_GD_N0_CM3, displacement_psd

        found = self.spectrum
        lines = [Line("measured", found.centre_cpm, found.psd_m3),
                 Line("line through it", found.centre_cpm,
                      displacement_psd(found.centre_cpm, self.gd_n0_cm3, self.waviness))]
        ends = found.centre_cpm[[0, -1]]
        lines += [Line(f"{smoother} | {rougher}", ends, displacement_psd(ends, mean_cm3 / 2), faint=True)
                  for smoother, (rougher, mean_cm3) in zip(CLASS_GD_N0_CM3, list(CLASS_GD_N0_CM3.items())[1:],
                                                           strict=False)]
        return [Curves("Spectrum of the road", "wave number [cycles/m]", "displacement PSD [m3]", tuple(lines),
                       log_x=True, log_y=True)]


def road_class_of(question: ClassifyQuestion) -> RoadClass:
    """The answer to ``ClassifyQuestion``, which says what is raised."""
    from logger.report.road_text import as_json, lines
    from logger.roads.elevation_spectrum import track_class
    from logger.roads.plausible import spacing_hint

    name, road = _named(question.profile, question.resample_m)
    profile_file.check_road(road, name)
    tracks = [one for one in (road.elevation_m, road.elevation_right_m) if one is not None]
    try:
        found = [track_class(one, road.spacing_m, road.widest_step_m) for one in tracks]
    except ValueError as error:
        raise BadInput(f"{name}: {error}{spacing_hint(road.spacing_m)}") from None
    left = found[0].roughness
    return RoadClass("\n".join(lines(found, road, Path(name).name)), as_json(found), left.road_class, left.gd_n0_cm3,
                     left.gd_n0_std_cm3, left.waviness, left.waviness_std, found[0].iri_m_per_km, left.bands)


classify = function("classify", ClassifyQuestion, road_class_of)


def _named(profile: profile_file.Profile | Path | str, resample_m: float | None) -> tuple[str, Profile]:
    """A profile and what to call it, not judged."""
    if isinstance(profile, Profile):
        return "profile", profile
    read = profile if isinstance(profile, profile_file.Profile) else profile_file.read_profile(profile, resample_m)
    return "profile" if read is profile else str(profile), Profile(**vars(read))
