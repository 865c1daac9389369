"""Fields that the questions of several verbs share, and what is read out of their values."""

from collections.abc import Collection, Sequence
from math import isfinite
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Union

from logger import question
from logger.errors import BadInput
from logger.units import INCH_PER_MILE_M_PER_KM

if TYPE_CHECKING:
    from logger.store.formats.drive_file import Drive
    from logger.store.formats.vehicle_file import CarModel

Vehicle = Union["CarModel", Path, str]
"""A model, or the name or file of one."""
Runs = Union["Drive", Path, str, Sequence[Union["Drive", Path, str]]]
"""One run or several: records (``ridelog.Run``), or their folders."""

VehicleName = Annotated[Vehicle, question.Option(
    "a vehicle that comes with ridelog, or a YAML file (with a / or .yaml in its name); in Python a model as well",
    metavar="NAME|FILE", read=str)]
Anyway = Annotated[bool, question.Option("go on even if a run seems to be of another road or car, or in other units")]
TrackedRuns = Annotated[Runs, question.Argument(
    "folder with drive.csv and profile.csv (of a rig: excitation.csv)", metavar="RUN", read=Path, many=list)]
Tolerance = Annotated[float | str | None, question.Option(
    "share by which masses, springs and dampers may be off, where the vehicle's file does not say (default: "
    f"{question.USUAL_TOLERANCE:g}; their standard deviation is 0.625 of that; lengths have 0.02). {question.UNKNOWN}: "
    "nothing is known of these",
    metavar=f"SHARE|{question.UNKNOWN}", read=question.word_or_number(question.UNKNOWN, question.TOLERANCE),
    check=question.check_word_or_number(question.UNKNOWN, question.TOLERANCE))]
Candidates = Annotated[Collection[str] | None, "names of the effects to be tried; None: all"]
LowPass = Annotated[float | None, question.Option(
    "compare record and model up to this frequency only, such as 20 (default: the whole band; ridelog recognises a "
    "low-passed record)", metavar="HZ")]
EffectFiles = Annotated[Sequence[Path | str], question.Option(
    "a Python file with an effect of your own, to be tried as well; may repeat. Or the name of a built-in effect that "
    "is not tried on these runs by default, such as play",
    metavar="FILE.py", read=Path, many=list, flag="--effect-file")]


def limit_of(text: str) -> float:
    """An IRI in m/km, of one with in/mi or m/km written behind it, or nothing."""
    value, is_us = text.strip().removesuffix("in/mi").removesuffix("m/km"), text.strip().endswith("in/mi")
    try:
        return float(value) * (INCH_PER_MILE_M_PER_KM if is_us else 1.0)
    except ValueError:
        raise ValueError("expected a number, as 2.5 (m/km) or 160in/mi") from None


Localized = Annotated[float | None, question.Option(
    "list areas of localized roughness (AASHTO R 54): where the IRI over a sliding base of 25 ft exceeds this, in "
    "m/km, or at a terminal as 160in/mi", question.LIMIT, "IRI", read=limit_of)]
Unit = Annotated[str | None, question.Option(
    "unit of the accelerations (default: m/s2; a record that is plainly in g is then refused)",
    choices=("mps2", "g"))]


def _rate_hz(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError("expected a rate in Hz; put the file before --resample") from None


ResampleHz = Annotated[float | None, question.Option(
    "for a record with uneven times, bursts or repeated samples: drop the repeats and resample it evenly at HZ, "
    "through an anti-alias filter. Without HZ (in Python 0): at its own rate, 100 Hz at least. The result says so",
    metavar="HZ", read=_rate_hz, bare=0.0)]
ResampleM = Annotated[float | None, question.Option(
    "for an unevenly spaced profile: interpolate it linearly, with a sample every M metres. This changes the result, "
    "and the result says so",
    metavar="M")]


def names_of(text: str) -> list[str]:
    """Names with commas between them."""
    return [name.strip() for name in text.split(",") if name.strip()]


def each(given: Any) -> list[Any]:
    """One run or several, as a list."""
    return list(given) if isinstance(given, Sequence) and not isinstance(given, str) else [given]


def paths_of(given: Runs) -> list[Path]:
    """Those of them that are files or folders."""
    return [Path(one) for one in each(given) if isinstance(one, str | PathLike)]


def named_numbers(text: str, option: str) -> tuple[str, dict[str, float]]:
    """NAME and its numbers out of ``NAME:PARAM=VALUE,...``."""
    name, _, rest = text.partition(":")
    if "=" in name and "/" not in name:
        raise BadInput(f"{option} {text}: expected NAME:PARAM=VALUE, with a colon after the name")
    found: dict[str, float] = {}
    for piece in rest.split(",") if rest else ():
        parameter, _, value = piece.partition("=")
        try:
            found[parameter] = float(value)
        except ValueError:
            found[parameter] = float("nan")
        if not isfinite(found[parameter]):
            raise BadInput(f"{option} {text}: expected PARAM=NUMBER, found {piece!r}")
    return name, found


def files_of(vehicle: object) -> list[Path]:
    """The file of a vehicle and those of its own effects; of a model only these. BadInput as ``read_model``."""
    from logger.shipped import vehicle_path
    from logger.store.formats.vehicle_file import CarModel, read_model

    if isinstance(vehicle, CarModel):
        return []
    path = vehicle_path(str(vehicle))
    return [path, *(Path(one.file) for one in read_model(path).effects if one.file is not None)]
