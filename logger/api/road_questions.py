"""What the verbs about measured profiles and random ones are asked: iri, road classify, road generate."""

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Union

from logger.api.question import PICTURES, Argument, Option, Out, Question, Verb
from logger.api.ranges import IRI as IRI_RANGE
from logger.api.ranges import LENGTH, MOST_ROAD_SAMPLES, ROAD_WAVINESS, ROUGHNESS, SPACING, Range
from logger.api.terms import Localized, ResampleM

if TYPE_CHECKING:
    from logger.store.formats.profile_file import Profile

ProfileFile = Annotated[Union["Profile", Path, str], Argument("CSV or ERD file", metavar="PROFILE", read=Path)]


@dataclass(frozen=True)
class ProfileQuestion(Question):
    """One about a ``profile``, or its file."""

    profile: ProfileFile


@dataclass(frozen=True)
class IriQuestion(ProfileQuestion):
    """Exact IRI of a measured profile (ASTM E1926; Sayers, TRR 1501, 1995), whole and window by window.

    PROFILE is CSV (distance_m,elevation_m[,elevation_right_m]) or ERD, evenly spaced by 300 mm or less and at least
    11 m long. With two wheel tracks: the IRI of each, their mean (MRI) and that of the half car on both (HRI).

    In Python: raises BadInput for a profile or a window of which there is no IRI, and as ``read_profile``.

    >>> found = iri(random_road(iso_class="B", length_m=400.0, seed=3))
    >>> round(found.iri_m_per_km, 2), found.windows_m_per_km.round(2).tolist()
    (4.44, [4.3, 4.69, 4.44, 4.32])
    """

    window_m: Annotated[float, Option(
        "length of a window [m] (default: 100, as road agencies report; a tenth of a mile is 160.9344, the service's "
        "25 ft are 7.62)", metavar="M")] = 100.0
    resample_m: ResampleM = None
    localized_m_per_km: Localized = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.window_m > 0:
            raise self.wrong("window_m", f" {self.window_m:g}: expected a length above 0 m")


@dataclass(frozen=True)
class IriCommand(IriQuestion):
    __doc__ = IriQuestion.__doc__    # at the terminal the response of the IRI itself can be asked for as well

    profile: Annotated[Union["Profile", Path, str, None], Argument(
        "CSV or ERD file", metavar="PROFILE", read=Path)] = None  # type: ignore[assignment]
    _: KW_ONLY
    response: Annotated[bool, Option(
        "without a profile: how strongly the IRI responds to each wavelength, as a table")] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.response and (self.profile is not None or self.localized_m_per_km is not None):
            raise self.wrong("response", ": expected no PROFILE and no `localized_m_per_km`, it is the response of the "
                                         "IRI itself")
        if not self.response and self.profile is None:
            raise self.complaint("expected a PROFILE, or `response`")


@dataclass(frozen=True)
class ClassifyQuestion(ProfileQuestion):
    """Class, degree of roughness and waviness of a profile of at least 100 m (ISO 8608).

    In Python: raises BadInput for one that is too short or too odd, and as ``read_profile``.

    >>> found = classify(random_road(iso_class="C", length_m=500.0))
    >>> found.road_class, abs(found.waviness - 2.0) < 3 * found.waviness_std
    ('C', True)
    """

    resample_m: ResampleM = None


@dataclass(frozen=True, kw_only=True)
class RandomRoadQuestion(Question):
    """Make a random road with the spectrum of ISO 8608: Gd(n) = Gd(n0) (n / n0)^-w (Eq 4.1, 4.2 of Blum 2015). Same
    numbers, same road.

    In Python: raises BadInput for what is none of this.

    >>> random_road(iso_class="B", length_m=20.0)
    Profile
      length                               20  m
      begins at                             0  m
      spacing                            0.05  m
      samples                             401
      wheel tracks                          1
      elevation, standard deviation  0.005887  m
    """

    iso_class: Annotated[str | None, Option(
        "class; the road gets the geometric mean of its degrees of roughness", metavar="A-H", read=str.upper,
        choices="ABCDEFGH", flag="--class")] = None
    gd_n0_cm3: Annotated[float | None, Option(
        "degree of roughness Gd(n0), n0 = 0.1 cycles per metre [cm3]", ROUGHNESS, "CM3", flag="--gd")] = None
    iri_m_per_km: Annotated[float | None, Option(
        "IRI; Gd(n0) follows from Eq 4.40, or for a waviness other than 2 from its own relation", IRI_RANGE,
        "M_PER_KM")] = None
    length_m: Annotated[float, Option("[m]", LENGTH, "M")] = 1000.0
    spacing_m: Annotated[float, Option("between samples [m]", SPACING, "M")] = 0.05
    seed: Annotated[int, Option("another number, another road (default: 1)", Range(0, float("inf")), "N")] = 1
    waviness: Annotated[float, Option("w", ROAD_WAVINESS, "W")] = 2.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if sum(one is not None for one in (self.iso_class, self.gd_n0_cm3, self.iri_m_per_km)) != 1:
            raise self.complaint("expected one of `iso_class`, `gd_n0_cm3` and `iri_m_per_km`")
        both = f"`length_m` {self.length_m:g} `spacing_m` {self.spacing_m:g}: expected"
        if self.length_m / self.spacing_m > MOST_ROAD_SAMPLES:
            raise self.complaint(f"{both} at most {MOST_ROAD_SAMPLES} samples")
        last_m = int(self.length_m / self.spacing_m + 1e-9) * self.spacing_m
        if last_m < LENGTH.low:
            raise self.complaint(f"{both} the last sample at {LENGTH.low:g} m or more, it lies at {last_m:g} m")


IRI = Verb(IriCommand, "logger.api.roads:asked_iri", (PICTURES,))
CLASSIFY = Verb(ClassifyQuestion, "logger.api.roads:road_class_of", (
    Out("write the smoothed spectrum of the (left) track as CSV", "--psd", "FILE", ("*",), False, False), PICTURES))
GENERATE = Verb(RandomRoadQuestion, "logger.api.roads:random_road_of")
