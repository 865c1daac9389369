"""Zenodo 4386256: phones in two cars on three roads of Massachusetts, beside laser profiles (Botshekan et al., CC0).

Layout as a reader of the set has it (github.com/JMMA84/DIMMIT-V1; names alone were taken from there), files of MATLAB:
``*-2019-*.mat``, one trip each: ``t`` [s], ``x``, ``y``, ``z`` (acceleration with gravity, 100 Hz), ``speedMS`` [m/s],
``LAT``, ``LON``. ``road_elevation_NB_SB.mat``: ``dist`` [km] and ``elevation`` [cm], northbound, then southbound.
``road_elevation_concord.mat``: the same of Route 2. ``geopoint_*.mat``: the places of those, evenly spread.
"""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from logger.api import data_sets
from logger.api.data_sets import FIX_S
from logger.arrays import Array
from logger.errors import BadInput
from logger.geodesy import EARTH_RADIUS_M
from logger.store.formats.drive_file import write_table
from logger.store.formats.mat_file import read_arrays, read_geopoint
from logger.studies.study import Item, Picture, Result, Word, Workload

_CAR = "sedan-2015"
_BOTH = "road_elevation_NB_SB.mat"
_ROADS = (
    ("Massachusetts Avenue, north", _BOTH, 0, "geopoint_Massachusetts_NB_INSIDE.mat"),
    ("Massachusetts Avenue, south", _BOTH, 1, "geopoint_Massachusetts_SB_INSIDE.mat"),
    ("Route 2, Concord", "road_elevation_concord.mat", 0, "geopoint_ConcordTurnpike_LongLoop_MIDDLE.mat"),
)
_TRIP = ("t", "x", "y", "z", "speedMS", "LAT", "LON")
_OFF = "of driving on the profile, found none"  # a trip over another of the roads
_UNEVEN = 0.01


@dataclass(frozen=True, eq=False)
class LaserRoad:
    """A profile (n,) with a place for each of its points."""

    name: str
    spacing_m: float
    elevation_m: Array
    lat_deg: Array
    lon_deg: Array

    def write(self, path: Path) -> None:
        """As a profile with places."""
        columns = (self.spacing_m * np.arange(len(self.elevation_m)), self.elevation_m, self.lat_deg, self.lon_deg)
        write_table(path, ("distance_m", "elevation_m", "lat_deg", "lon_deg"), np.column_stack(columns), "%.10g")


@data_sets.study_of(
    "Zenodo 4386256", "download doi 10.5281/zenodo.4386256 (CC0) and unpack it into one folder",
    "Phones at 100 Hz against laser profiles, 10 m and 100 m", "Three roads",
    "Each trip is processed like any recording: extract --csv --profile aligns it with the laser profile, by the "
    "phone's positions and then by the road that the car felt. Then estimate compares its windows with the profile's "
    "exact IRI. The cars' parameters are not published: the model of a sedan replaces them, unless --vehicle names "
    "another. The reader is tested on small files of the same layout.",
    Item("Zenodo 4386256", Word.NOT_REPRODUCIBLE, data_sets.NOT_RUN),
    source="Botshekan et al., Zenodo 4386256, 2021")
def zenodo_4386256(folder: Path, effort: Workload) -> Result:
    roads = laser_roads(folder)
    trips = [trip(one) for one in data_sets.expected_files(folder, "*-2019-*.mat", "the phones' trips")]
    found: list[tuple[str, data_sets.DrivenWindows]] = []
    refused: list[str] = []
    elsewhere: list[str] = []
    pairs = effort.some([(road, one) for road in roads for one in trips], 1)
    with TemporaryDirectory() as scratch:
        for number, road in enumerate(roads):
            line = Path(scratch) / f"profile-{number}.csv"
            road.write(line)
            mine = [one for each, one in pairs if each is road]
            windows, left = data_sets.each_pass(mine, lambda one,
                                                line=line: data_sets.driven_windows(  # type: ignore[misc]
                one, effort.vehicle or _CAR, profile=line), effort.progress)
            found += [(road.name, one) for one in windows]
            elsewhere += [one for one in left if _OFF in one]
            refused += [one for one in left if _OFF not in one]
    parts = [part for road in roads for window_m in data_sets.WINDOWS_M
             if (part := _together(road.name, window_m, found)) is not None]
    if not parts:
        raise BadInput(f"{folder}: expected trips on the profiled roads, found none; {(refused + elsewhere)[0]}")
    tables = tuple(data_sets.compared_table(parts, window_m) for window_m in data_sets.WINDOWS_M)
    spans = [f"{low:.2f} to {high:.2f} per {window_m:g} m" for window_m, (low, high) in data_sets.REPEAT_R2.items()]
    ceiling = ("The set holds one profile of each road, no repeat; passes of another profiler repeat each other with "
               f"R2 {' and '.join(spans)} (lira-map).")
    return Result(tables, data_sets.verdict_of(parts, refused, ceiling),
                  tuple(Picture(data_sets.along(one)) for one in parts if one.window_m == data_sets.WINDOWS_M[-1]))


def laser_roads(folder: Path) -> list[LaserRoad]:
    """The three roads. Raises BadInput and FileNotFoundError."""
    return [_laser_road(name, data_sets.expected_files(folder, elevation, "the laser profiles")[0], half,
                        data_sets.expected_files(folder, places, "their places")[0])
            for name, elevation, half, places in _ROADS]


def _laser_road(name: str, elevation: Path, half: int, places: Path) -> LaserRoad:
    at_km, elevation_cm = read_arrays(elevation, ("dist", "elevation"))
    if len(at_km) != len(elevation_cm):
        raise BadInput(f"{elevation}: expected dist and elevation of one length, found {len(at_km)} and "
                       f"{len(elevation_cm)}")
    if elevation.name == _BOTH:
        middle = len(at_km) // 2
        part = slice(half * middle, (half + 1) * middle)
        at_km, elevation_cm = at_km[part], elevation_cm[part]
    at_m, elevation_m = 1000.0 * (at_km - at_km[0]), elevation_cm / 100.0
    spacing_m = float(at_m[-1]) / (len(at_m) - 1)
    if not spacing_m > 0 or np.abs(np.diff(at_m) / spacing_m - 1).max() > _UNEVEN:
        raise BadInput(f"{elevation}: expected dist evenly spaced, found steps of {np.diff(at_m).min():.4g} to "
                       f"{np.diff(at_m).max():.4g} m")
    lat_deg, lon_deg = read_geopoint(places)
    north_m, east_m = (EARTH_RADIUS_M * np.radians(np.diff(one)) for one in (lat_deg, lon_deg))
    way_m = np.concatenate([[0.0], np.cumsum(np.hypot(north_m, east_m * np.cos(np.radians(lat_deg[0]))))])
    if not way_m[-1] > 0:
        raise BadInput(f"{places}: expected positions along a road, found one")
    along_m = way_m * (at_m[-1] / way_m[-1])  # both are the whole road
    return LaserRoad(name, spacing_m, elevation_m, *(np.interp(at_m, along_m, one) for one in (lat_deg, lon_deg)))


def trip(file: Path) -> data_sets.RoadRecording:
    """A phone's record. Raises BadInput."""
    columns = read_arrays(file, _TRIP)
    if len(set(map(len, columns))) > 1:
        raise BadInput(f"{file}: expected {', '.join(_TRIP)} of one length, found "
                       f"{', '.join(str(len(one)) for one in columns)}")
    time_s, x, y, z, speed_mps, lat_deg, lon_deg = columns
    accel = np.column_stack([x, y, z])
    fixed = (np.abs(lat_deg) > 1e-6) & np.isfinite(lat_deg + lon_deg + speed_mps)
    second = np.floor((time_s - time_s[0]) / FIX_S)
    kept = np.flatnonzero(fixed)[np.unique(second[fixed], return_index=True)[1]]
    return data_sets.RoadRecording(file.stem, time_s, accel, data_sets.unit_by_gravity(accel), time_s[kept],
                                   speed_mps[kept], lat_deg[kept],
                     lon_deg[kept])


def _together(road: str,
              window_m: float, found: list[tuple[str, data_sets.DrivenWindows]]) -> data_sets.Compared | None:
    chosen = [one for name, one in found if name == road and one.window_m == window_m]
    if not chosen:
        return None
    begin_m, iri, std, exact = (np.concatenate([getattr(one, name) for one in chosen]) for name in (
        "begin_m", "iri_m_per_km", "iri_std_m_per_km", "exact_m_per_km"))
    return data_sets.Compared(road, window_m, begin_m, iri, std, exact)

STUDIES = (zenodo_4386256,)
