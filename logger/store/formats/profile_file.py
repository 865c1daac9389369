"""What was under the wheels, as files: profiles of roads, and excitations of rigs.

Road profiles as files: CSV of ours and ERD of the profilers, read into evenly spaced elevations.

Problem: a profile is long (400,000 lines for 10 km at 25 mm), comes from many hands, and everything computed from it
assumes that its samples are evenly spaced. A hole or an uneven step changes the result without a trace.

Its unit is that of the columns' names: ``elevation_mm``, ``distance_ft``. What can be no road in that unit is refused
(``logger.roads.plausible``).

Solution: distances must lie on an even grid, but for the rounding of their digits; anything else is refused with its
line. Straight lines between the samples are laid through an uneven profile only
when ``resample_m`` asks for it, and the profile says so.

Excitations as files: ``excitation.csv``, what stood under the wheels of a rig over time.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from logger.bounds import DISTANCE, ELEVATION, FORCE, MOST_SAMPLES
from logger.errors import BadInput
from logger.files import file_in, read_bounded
from logger.profiles.excitation import AppliedForce, Excitation
from logger.roads.plausible import UNITS_M, unit_complaint
from logger.store.formats.csv_table import find_table, parse_columns, place, read_rows, taken
from logger.store.formats.erd_file import ErdFile, is_erd, parse_erd
from logger.store.formats.record_file import MAX_BYTES, TIME, laid_evenly

Array = npt.NDArray[np.float64]

COLUMNS = ("distance_m", "elevation_m", "elevation_right_m")
PLACE = ("lat_deg", "lon_deg")
PROFILE_NAME = "profile.csv"
WIDEST_BRIDGED_M = 1.0
"""A straight line is laid across no wider hole than this: what lies in a wider one cannot be known."""
# Distances printed with three decimals are up to half a millimetre off their grid; that much, and of short steps 5 %,
# is taken for rounding.
_ROUNDING_M = 0.0006
_ROUNDING_STEPS = 0.05


@dataclass(frozen=True, eq=False)
class Profile:
    """Elevations (n,) [m] of one or two wheel tracks at start_m, start_m + spacing_m, ... [m].

    widest_step_m    for a profile that was resampled: the widest distance between its samples that a straight line
                     was laid across [m]; None for samples as they were measured
    """

    start_m: float
    spacing_m: float
    elevation_m: Array
    elevation_right_m: Array | None
    widest_step_m: float | None = None


def read_profile(path: Path | str, resample_m: float | None = None, judged: bool = False) -> Profile:
    """Read a profile: CSV ``distance_m,elevation_m[,elevation_right_m]``, or ERD (recognised by its first line).

    resample_m    lay a grid of this spacing [m] over the profile, linearly between its samples
    judged        refuse elevations that no road has, as ``check_road``

    Raises BadInput ("file:line: expected ...") for a file that is neither, for values that are missing or not finite,
    and for distances that do not grow or, without ``resample_m``, are not evenly spaced.
    """
    path = file_in(path, PROFILE_NAME)
    data = read_bounded(path, MAX_BYTES)
    found = (_from_erd(parse_erd(data, path), str(path), resample_m) if is_erd(data) else
             _from_table(*parse_table(data, str(path)), resample_m))
    if judged:
        check_road(found, str(path))
    return found


def check_road(profile: Profile, name: str) -> None:
    """Raise BadInput for a profile that cannot be one in metres; ``name``: what it is called."""
    for track in (profile.elevation_m, profile.elevation_right_m):
        if track is not None and (words := unit_complaint(track, profile.spacing_m)):
            raise BadInput(f"{name}: {words}")


def parse_table(data: bytes, file: str) -> tuple[Array, str]:
    """The numbers of a CSV profile, (n, 2) or (n, 3): distance, elevation, right elevation [m]; and the file's name for
    ``place``. Columns may have another unit, by the ending of their names."""

    def choose(names: tuple[str, ...]) -> tuple[str, ...] | None:
        numbers = names[: -len(PLACE)] if names[-len(PLACE) :] == PLACE else names
        in_metres = tuple(f"{name.rpartition('_')[0]}_m" for name in numbers)
        units = {name.rpartition("_")[2] for name in numbers}
        return numbers if in_metres in (COLUMNS[:2], COLUMNS) and units <= set(UNITS_M) else None

    names, values, named = parse_columns(data, file, choose, f"the header {','.join(COLUMNS[:2])}[,{COLUMNS[2]}] "
                                         "(other units by name: distance_ft,elevation_in)")
    return values * [UNITS_M[name.rpartition("_")[2]] for name in names], named


def read_places(path: Path | str) -> tuple[Array, Array, Array]:
    """Distances [m], growing, latitudes and longitudes [degrees] (m,) of the rows of a CSV profile that have a place.

    Raises BadInput ("file:line: expected ...") for a profile of which fewer than two rows do, and for a place that
    cannot be.
    """
    path = file_in(path, PROFILE_NAME)
    file = str(path)
    wanted = (COLUMNS[0], *PLACE)
    table = find_table(read_bounded(path, MAX_BYTES), file, lambda names: set(wanted) <= set(names))
    if not set(wanted) <= set(table.names):
        raise BadInput(f"{file}:{table.line or 1}: expected a header with {','.join(wanted)}: a drive is found on the "
                       "line by its places")
    rows = read_rows(table, [table.names.index(name) for name in wanted], wanted, gaps=True)
    known = np.isfinite(rows.values)
    for row in np.flatnonzero(known[:, 1:].any(axis=1)):
        _check_place(rows.values[row], f"{file}:{rows.lines[int(row)]}")
    distance_m, lat_deg, lon_deg = rows.values[known[:, 1:].all(axis=1)].T.copy()
    if len(distance_m) < 2:
        raise BadInput(f"{file}: expected two rows or more with {','.join(PLACE)}, found {len(distance_m)}")
    return distance_m, lat_deg, lon_deg


def _check_place(row: Array, where: str) -> None:
    distance_m, lat_deg, lon_deg = row
    if not np.isfinite(row[1:]).all():
        raise BadInput(f"{where}: expected both of {','.join(PLACE)} or neither")
    DISTANCE.taken("distances", np.array([distance_m]), lambda row: where)
    if not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180):
        raise BadInput(f"{where}: expected degrees within 90 north and south and 180 east and west, found "
                       f"{lat_deg:g},{lon_deg:g}")


def _from_table(table: Array, file: str, resample_m: float | None) -> Profile:
    try:
        tracks = [taken(ELEVATION, "elevations", track, file) for track in table.T[1:]]
    except BadInput as error:
        raise BadInput(f"{error} (in mm? Name the column by its unit, as elevation_mm)") from None
    distance = taken(DISTANCE, "distances", table[:, 0], file)
    if len(distance) < 2:
        raise BadInput(f"{place(file, 1)}: expected at least two samples, found the end of the file")
    steps = np.diff(distance)
    if (steps <= 0).any():
        sample = int(np.argmax(steps <= 0)) + 1
        raise BadInput(f"{place(file, sample)}: expected a distance above {distance[sample - 1]:.10g} m, "
                       f"found {distance[sample]:.10g}")
    if resample_m is not None:
        if steps.max() > WIDEST_BRIDGED_M:
            sample = int(np.argmax(steps)) + 1
            raise BadInput(f"{place(file, sample)}: expected no gap above {WIDEST_BRIDGED_M:g} m, found one of "
                           f"{steps[sample - 1]:.6g} m: cut the profile there")
        return _resampled(distance, tracks, resample_m, file)
    return Profile(float(distance[0]), _even_spacing(distance, steps, file), *_pair(tracks))


def _even_spacing(distance: Array, steps: Array, file: str) -> float:
    """Spacing of the even grid nearest to the distances [m]; BadInput when they are off it by more than rounding."""
    number = np.arange(len(distance), dtype=float)
    centred = number - number.mean()
    spacing_m = round(float(centred @ (distance - distance.mean()) / (centred @ centred)), 12)
    off_grid = distance - distance.mean() - spacing_m * centred
    if (np.abs(off_grid) <= _rounding_m(spacing_m)).all():
        return spacing_m
    usual_m = float(np.median(steps))
    hint = f"(--resample {usual_m:.4g} would lay straight lines between the samples)"
    if steps.max() > WIDEST_BRIDGED_M:
        hint = "(cut the profile there)"
    odd = np.abs(steps - usual_m) > 2 * _rounding_m(usual_m)
    if odd.any():
        step = int(np.argmax(odd))
        fault = "a gap" if steps[step] > 1.5 * usual_m else "a step"
        raise BadInput(f"{place(file, step + 1)}: expected even steps of {usual_m:.6g} m, found {fault} of "
                       f"{steps[step]:.6g} m {hint}")
    grid = distance[0] + usual_m * number
    sample = int(np.argmax(np.abs(distance - grid) > _rounding_m(usual_m)))
    raise BadInput(f"{place(file, sample)}: expected even steps of {usual_m:.6g} m to reach {grid[sample]:.10g} m, "
                   f"found {distance[sample]:.10g} m {hint}")


def _rounding_m(spacing_m: float) -> float:
    return min(_ROUNDING_M, _ROUNDING_STEPS * spacing_m)


def _pair(tracks: Sequence[Array]) -> tuple[Array, Array | None]:
    return tracks[0], tracks[1] if len(tracks) > 1 else None


def _resampled(distance: Array, tracks: Sequence[Array], spacing_m: float, file: str) -> Profile:
    length_m = float(distance[-1] - distance[0])
    if not 0 < spacing_m <= length_m <= MOST_SAMPLES * spacing_m:
        raise BadInput(f"{file}: expected a spacing within the {length_m:.6g} m of profile to resample to, "
                       f"found {spacing_m:g} m")
    grid = distance[0] + spacing_m * np.arange(int(length_m / spacing_m + 1e-9) + 1)
    laid = [np.interp(grid, distance, track) for track in tracks]
    return Profile(float(distance[0]), spacing_m, *_pair(laid), float(np.diff(distance).max()))


def _from_erd(erd: ErdFile, file: str, resample_m: float | None) -> Profile:
    tracks = erd.wheel_tracks()
    if resample_m is not None:
        distance = erd.spacing_m * np.arange(len(tracks[0]), dtype=float)
        return _resampled(distance.astype(np.float64), tracks, resample_m, file)
    return Profile(0.0, erd.spacing_m, *_pair(tracks))


EXCITATION_COLUMNS = (TIME, "elevation_m", "elevation_rear_m")
PART_COLUMNS = (TIME, "displacement_m", "velocity_mps")
_FORCE = re.compile("force(_[a-z0-9_]+)?_n")
_OTHER_UNIT = re.compile("(force|elevation|displacement)(_[a-z0-9]+)*?_(kn|mn|lbf|lb|kgf|kg|v|mm|cm|um|in|ft)",
                         re.IGNORECASE)
_FEWEST = 4


def read_excitation(path: Path | str, forces: Sequence[AppliedForce] = ()) -> Excitation:
    """Read CSV ``t_s`` with ``elevation_m[,elevation_rear_m]``, forces (``force_n``, ``force_NAME_n``), or both; or
    of a part alone ``displacement_m``. It begins at the file's own time, and has even ones (``laid_evenly``). A
    ``velocity_mps`` beside that is not read: the displacement says it.

    forces    what each of its forces acts on

    Raises BadInput ("file:line: expected ..., found ...") for anything else, for times that are not even, for
    elevations and forces that no rig has, and for forces of which is not said what they act on.
    """
    known = {one.name: one for one in forces}
    names, table, file = parse_columns(
        read_bounded(path, MAX_BYTES), str(path), partial(_driving, file=str(path)),
        f"the header {','.join(EXCITATION_COLUMNS[:2])}[,{EXCITATION_COLUMNS[2]}][,force_n][,force_NAME_n], in metres "
        f"and newtons, or of a part alone {','.join(PART_COLUMNS[:2])}")
    if len(table) < _FEWEST:
        raise BadInput(f"{place(file, len(table))}: expected at least {_FEWEST} samples, found the end of the file")
    pushes = tuple(name for name in names if _FORCE.fullmatch(name))
    if unsaid := [name for name in pushes if name not in known]:
        raise BadInput(f"{file}:1: expected a run.yaml beside it that says what {unsaid[0]} acts on, as forces: "
                       f"{{{unsaid[0]}: {{on: body}}}}, found none")
    if lost := [name for name in known if name not in pushes]:
        raise BadInput(f"{file}:1: expected a column {lost[0]}, as the run.yaml beside it says what that acts on, "
                       f"found {', '.join(names)}")
    columns = {name: taken(FORCE if name in pushes else ELEVATION, name, column, file)
               for name, column in zip(names[1:], table.T[1:], strict=True)}
    heights = tuple(name for name in (*EXCITATION_COLUMNS, PART_COLUMNS[1]) if name in columns)
    rate_hz, laid = laid_evenly(table[:, 0], np.stack([columns[name] for name in (*heights, *pushes)], axis=1), file)
    moved = laid[:, :len(heights)] if heights else np.zeros((len(laid), 1))
    return Excitation(rate_hz, moved if len(heights) > 1 else moved[:, 0].copy(), float(table[0, 0]),
                      laid[:, len(heights):] if pushes else None, tuple(known[name] for name in pushes),
                      PART_COLUMNS[1] in names)


def _driving(names: tuple[str, ...], file: str) -> tuple[str, ...] | None:
    """All columns, where the times come first and each of the others drives a rig, once; else None. BadInput for one in
    another unit."""
    if other := [name for name in names[1:] if names[0] == TIME and _OTHER_UNIT.fullmatch(name)]:
        raise BadInput(f"{file}:1: expected elevations in metres and forces in newtons (elevation_m, force_n), found "
                       f"{other[0]}: convert its numbers")
    heights = tuple(name for name in names if not _FORCE.fullmatch(name))
    moved = heights in (PART_COLUMNS[:2], PART_COLUMNS)
    if moved and heights != names:
        raise BadInput(f"{file}:1: expected a part that is moved (displacement_m) or forces on it, found both")
    fits = moved or heights in (EXCITATION_COLUMNS[:1], EXCITATION_COLUMNS[:2], EXCITATION_COLUMNS)
    return names if fits and len(set(names)) == len(names) > 1 else None
