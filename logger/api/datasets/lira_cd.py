"""LiRA-CD: electric cars on Danish roads, beside the road directorate's profiler (Skar et al., Data in Brief, 2023).

Layout as the readers of the set's own users have it (github.com/rreezN/CrackDetect, Apache 2.0; names and columns alone
were taken from there). ``platoon_CPH1_HH.hdf5``: group GM, below it trips, below those passes, each with signals (n, 2
or more), seconds in the first column: ``acc.xyz`` (gravity in it, whose size tells the unit), ``gps`` (latitude,
longitude), ``spd_veh`` [km/h]. ``cph1_iri_mpd_rut_hh.csv``: IRI of the left and right wheel track of profiler P79 for
10 m each, from ``Distance [m]`` on. ``cph1_zp_hh.csv``: its places by the same distance. ``cph1_aran_hh.csv``: IRI of
another profiler, ARAN, with places. HH and VH are the two carriageways: two roads.
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from logger.api import data_sets
from logger.arrays import Array
from logger.errors import BadInput, as_bad_input
from logger.extraction.along_track import MeasuredLine
from logger.files import read_bounded
from logger.roads.repeated_drives import best_shift_m, matching_cells, mean_between
from logger.roads.road_matching import SEARCH_M
from logger.shipped import vehicle_path
from logger.store.formats.csv_table import columns_of
from logger.store.formats.record_file import MAX_BYTES
from logger.store.formats.vehicle_file import read_model
from logger.studies.study import Item, Picture, Result, Table, Word, Workload
from logger.units import KMH_MPS

_CAR = "sedan-2015"
_CELL_M, _PLACE_EVERY_M = 10.0, 5.0
_FINE_M = 2.0
_MOST_CELLS = 2
_MOST_SHIFT_M = 30.0  # what a second's delay is at 110 km/h
_EXTRA = "expected the 'hdf5' extra to read {}: pip install 'ridelog[hdf5]' ({})"


@dataclass(frozen=True, eq=False)
class ProfiledRoad:
    """A carriageway as P79 measured it: cells (k,) of 10 m, and its places; ARAN's IRI by its own places."""

    name: str
    edges_m: Array
    left_m_per_km: Array
    right_m_per_km: Array
    line: MeasuredLine
    aran_m: Array | None
    aran_m_per_km: Array | None

    @property
    def iri_m_per_km(self) -> Array:
        """The mean of both tracks (k,)."""
        return (self.left_m_per_km + self.right_m_per_km) / 2


@data_sets.study_of(
    "LiRA-CD", "download LiRA-CD, doi 10.11583/DTU.c.6337148, and unpack it; AutoPi_CAN and ref_data are read",
    "Electric cars against the road directorate's profiler, 10 m and 100 m", "IRI of P79",
    "Each pass is processed like any recording (extract --csv, estimate with the noise learned). Its windows are "
    "placed on the profiler's cells by GPS, then moved by up to 30 m to where they fit best. The parameters of the "
    "cars (Renault Zoe) are not published: the model of a sedan replaces them, unless --vehicle names another. The "
    "reader is tested on small files of the same layout.",
    Item("LiRA-CD", Word.NOT_REPRODUCIBLE, data_sets.NOT_RUN),
    source="Skar et al., LiRA-CD, Data in Brief, 2023")
def lira_cd(folder: Path, effort: Workload) -> Result:
    files = data_sets.expected_files(folder, "platoon_*.hdf5", "the cars' records AutoPi_CAN/platoon_CPH1_HH.hdf5")
    parts: list[data_sets.Compared] = []
    refused: list[str] = []
    repeats: list[Any] = []
    for file in files:
        road = profiled_road(folder, file)
        whole, left = recordings(file)
        refused += left
        passes = effort.some(whole, 1) if whole else []
        found, left = data_sets.each_pass(passes, lambda one, road=road: _windows(  # type: ignore[misc]
            one, effort.vehicle or _CAR, road), effort.progress)
        refused += left
        parts += [_beside(road, [one for moved, one in found if moved == moves and one.window_m == window_m], window_m,
                          moves) for window_m in data_sets.WINDOWS_M for moves in (False, True) if found]
        repeats += [row for window_m in data_sets.WINDOWS_M for row in _repeats(road, window_m)]
    if not parts:
        raise BadInput(f"{folder}: expected a pass that can be used, found none; {refused[0]}")
    tables = [data_sets.compared_table(parts, window_m) for window_m in data_sets.WINDOWS_M]
    tables.append(Table("The profilers against each other", data_sets.REPEAT_COLUMNS, tuple(repeats)))
    pictures = tuple(Picture(data_sets.along(one)) for one in parts if one.window_m == data_sets.WINDOWS_M[-1]
                     and one.what == "car")
    return Result(tuple(tables), data_sets.verdict_of(parts, refused, _CEILING), pictures)


_CEILING = ("How well the profilers agree with each other is the ceiling: no car can be shown to agree better with one "
            "of them than the other does.")


# --- files ---


def recordings(file: Path) -> tuple[list[data_sets.RoadRecording], list[str]]:
    """The passes of a file, and a line for each that lacks a signal. Raises BadInput for a file that is not of this
    layout, or where HDF5 cannot be read."""
    try:
        import h5py
    except ImportError as error:
        raise BadInput(_EXTRA.format(file, error)) from None
    try:
        with h5py.File(file, "r") as read:
            trips = read.get("GM")
            if not isinstance(trips, h5py.Group):
                raise BadInput(f"{file}: expected a group GM with the trips, found {', '.join(read)[:80] or 'nothing'}")
            found, lacking = [], []
            for name, group in [(f"{trip}-{one}", group) for trip, passes in trips.items()
                                for one, group in passes.items()]:
                try:
                    found.append(_recording(name, group))
                except BadInput as error:
                    lacking.append(str(error))
            return found, lacking
    except OSError as error:
        raise BadInput(f"{file}: expected an HDF5 file, found {error}") from None


def _recording(name: str, group: Any) -> data_sets.RoadRecording:
    def signal(key: str, columns: int) -> Array:
        found = np.asarray(group[key][()], dtype=np.float64) if key in group else np.empty(0)
        if found.ndim != 2 or found.shape[1] < columns or len(found) < 2:
            size = " x ".join(map(str, found.shape)) if found.size else "nothing"
            raise BadInput(f"{name}: expected {key} with {columns} columns, found {size}")
        return found[np.argsort(found[:, 0], kind="stable")]

    accel, gps, speed = signal("acc.xyz", 4), signal("gps", 3), signal("spd_veh", 2)
    inside = (gps[:, 0] >= speed[0, 0]) & (gps[:, 0] <= speed[-1, 0])
    gps = gps[inside]
    return data_sets.RoadRecording(name, accel[:, 0], accel[:, 1:4], data_sets.unit_by_gravity(accel[:, 1:4]),
                                   gps[:, 0],
                     np.interp(gps[:, 0], speed[:, 0], speed[:, 1] * KMH_MPS), gps[:, 1], gps[:, 2])


def profiled_road(folder: Path, cars: Path) -> ProfiledRoad:
    """The profiler's files of the road of a file of cars. Raises BadInput."""
    named = re.fullmatch(r"platoon_(\w+)_(HH|VH)", cars.stem, re.IGNORECASE)
    if named is None:
        raise BadInput(f"{cars}: expected a name like platoon_CPH1_HH.hdf5")
    route, side = (one.lower() for one in named.groups())
    iri, places = (data_sets.expected_files(folder, f"{route}_{what}_{side}.csv",
                                            f"the profiler's {what} of {cars.name}")[0]
                   for what in ("iri_mpd_rut", "zp"))
    begin_m, left, right = _columns(iri, "Distance [m]", "IRI (5) [m/km]", "IRI (21) [m/km]")
    begin_m, first = np.unique(begin_m, return_index=True)
    edges_m = np.append(begin_m, begin_m[-1] + _CELL_M)
    holes = np.diff(edges_m) > 1.5 * _CELL_M  # a cell is 10 m long, also before a hole
    left, right = (np.where(holes, np.nan, one[first]) for one in (left, right))
    line = _line(places, *_columns(places, "Distance [m]", "Lat", "Lon"))
    found = sorted(folder.rglob(f"{route}_aran_{side}.csv"))
    aran = _aran(found[0], line) if found else (None, None)
    return ProfiledRoad(f"{route.upper()} {side.upper()}", edges_m, left, right, line, *aran)


def _columns(path: Path, *names: str) -> list[Array]:
    """Of a table between semicolons, with cells that may be empty."""
    return columns_of(read_bounded(path, MAX_BYTES), str(path), names)


def _line(path: Path, at_m: Array, lat_deg: Array, lon_deg: Array) -> MeasuredLine:
    known = np.isfinite(at_m) & (np.abs(lat_deg) > 1e-6) & (np.abs(lat_deg) <= 90) & (np.abs(lon_deg) <= 180)
    at_m, lat_deg, lon_deg = at_m[known], lat_deg[known], lon_deg[known]
    cell = np.floor(at_m / _PLACE_EVERY_M)
    kept = np.unique(cell, return_index=True)[1]
    with as_bad_input(path):
        return MeasuredLine.of(at_m[kept], lat_deg[kept], lon_deg[kept])


def _aran(path: Path, line: MeasuredLine) -> tuple[Array, Array]:
    """ARAN's IRI, the mean of both tracks, and where on P79's line each of its rows begins."""
    lat_deg, lon_deg, left, right = _columns(path, "Lat", "Lon", "Venstre IRI (m/km)", "Højre IRI (m/km)")
    known = (np.abs(lat_deg) > 1e-6) & np.isfinite(lat_deg + lon_deg)
    at_m, aside_m = line.passed(lat_deg[known], lon_deg[known])
    on = aside_m <= SEARCH_M
    order = np.argsort(at_m[on], kind="stable")
    at_m, values = at_m[on][order], ((left + right) / 2)[known][on][order]
    grows = np.append(np.diff(at_m) > 1e-3, True)
    return at_m[grows], values[grows]


# --- the car, and one profiler beside the other ---


def _windows(recording: data_sets.RoadRecording, vehicle: str,
             road: ProfiledRoad) -> list[tuple[bool, data_sets.DrivenWindows]]:
    """Of each time that the pass goes over the profiled road, with windows where its cells are; once more, True beside
    it, moved along to where cells of 10 m fit best."""
    model = read_model(vehicle_path(vehicle))
    found: list[tuple[bool, data_sets.DrivenWindows]] = []
    runs = [one for run in data_sets.runs_of(recording, vehicle)
            for one in data_sets.on_line(run, road.line, float(road.edges_m[0]))]
    edges_m = road.edges_m - road.edges_m[0]
    for run in runs:
        if not (each := data_sets.windows_of(run, model, (_FINE_M, *data_sets.WINDOWS_M))):
            continue
        fine, *placed = each
        driven = (edges_m[:-1] >= fine.begin_m[0]) & (edges_m[1:] <= fine.end_m[-1])
        shift_m = best_shift_m(np.append(fine.begin_m, fine.end_m[-1]), fine.iri_m_per_km, edges_m[:-1][driven],
                               edges_m[1:][driven], road.iri_m_per_km[driven], _MOST_SHIFT_M)
        moved = data_sets.windows_of(replace(run, distance_m=run.distance_m - shift_m), model)
        found += [(False, one) for one in placed] + [(True, one) for one in moved]
    if not found:
        raise BadInput("expected a pass over the profiled road, found none")
    return found


def _beside(road: ProfiledRoad, drives: list[data_sets.DrivenWindows], window_m: float,
            moved: bool) -> data_sets.Compared:
    begin_m, end_m, iri, std = (np.concatenate([getattr(one, name) for one in drives]) for name in (
        "begin_m", "end_m", "iri_m_per_km", "iri_std_m_per_km"))
    edges_m = road.edges_m - road.edges_m[0]
    theirs = mean_between(edges_m, road.iri_m_per_km, begin_m, end_m)
    return data_sets.Compared(road.name, window_m, begin_m, iri, std, theirs,
                              "car, shifted along the road to fit" if moved else "car")


def _repeats(road: ProfiledRoad, window_m: float) -> list[tuple[Any, ...]]:
    begin_m = np.arange(road.edges_m[0], road.edges_m[-1] - window_m + 1, window_m)
    left, right = (mean_between(road.edges_m, one, begin_m, begin_m + window_m)
                   for one in (road.left_m_per_km, road.right_m_per_km))
    rows = [data_sets.repeat_row(road.name, f"P79, right track against left, {window_m:g} m", right, left)]
    if road.aran_m is not None and road.aran_m_per_km is not None and len(road.aran_m) > 2:
        theirs, cells = matching_cells(road.edges_m[:-1], road.iri_m_per_km, road.aran_m, road.aran_m_per_km,
                                       _MOST_CELLS)
        known = np.where(np.isfinite(theirs), road.iri_m_per_km, np.nan)
        both = (mean_between(road.edges_m, theirs, begin_m, begin_m + window_m),
                mean_between(road.edges_m, known, begin_m, begin_m + window_m))
        rows.append(data_sets.repeat_row(road.name, f"ARAN against P79, {window_m:g} m", *both, moved_m=_CELL_M
                                         * cells))
    return rows

STUDIES = (lira_cd,)
