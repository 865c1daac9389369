"""Small folders of the layouts of public records of roads, from an independent simulation: truth is known.

Roads and cars are those of the examination's simulator; the profiler's IRI is that of a Golden Car solved by SciPy as a
linear system in time, which shares nothing with the program's.
"""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from functools import cache
from math import cos, radians, sin
from pathlib import Path

import numpy as np
from scipy.io import loadmat, savemat
from scipy.ndimage import uniform_filter1d
from scipy.signal import lsim

from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from tests.validation.simulator.cars import Axle, Car
from tests.validation.simulator.roads import random_road
from tests.validation.simulator.scene import Drive, Scene, clean_acceleration

CAR = "rav4-2009"
SPACING_M, LENGTH_M, START_M, SPEED_MPS, DRIVEN_S = 0.05, 900.0, 30.0, 18.0, 45.0
EARTH_M, GRAVITY_MPS2 = 6_371_008.8, 9.80665
HEADING_RAD = 0.3  # off north, or south
NOISE_MPS2, PLACE_M, MOUNTED = 0.02, 0.3, (0.1, -0.2)


def golden_car_iri(elevation_m: np.ndarray, spacing_m: float, window_m: float) -> np.ndarray:
    """IRI [m/km] of windows: Sayers' car at 80 km/h, its equations as they are printed, solved by SciPy."""
    ks, kt, mu, c, speed_mps = 63.3, 653.0, 0.15, 6.0, 80 / 3.6
    smooth = uniform_filter1d(elevation_m - elevation_m[0], round(0.25 / spacing_m), mode="nearest")
    a = np.array([[0, 1, 0, 0], [-ks, -c, ks, c], [0, 0, 0, 1], [ks / mu, c / mu, -(ks + kt) / mu, -c / mu]])
    b = np.array([[0], [0], [0], [kt / mu]])
    t_s = np.arange(len(smooth)) * spacing_m / speed_mps
    _, rate, _ = lsim((a, b, np.array([[0, 1, 0, -1]]), np.array([[0]])), smooth, t_s)
    cells = round(window_m / spacing_m)
    whole = (len(rate) // cells) * cells
    return 1000 * np.abs(rate[:whole]).reshape(-1, cells).mean(axis=1) / speed_mps


def simulator_car(name: str = CAR) -> Car:
    """The simulator's car with the numbers of a vehicle that comes along."""
    vehicle = read_vehicle(vehicle_file(name))
    front, rear = (Axle(axle.cg_distance_m, axle.unsprung_mass_kg, axle.suspension_stiffness_n_per_m,
                        axle.suspension_damping_n_s_per_m, axle.tire_stiffness_n_per_m)
                   for axle in (vehicle.front, vehicle.rear) if axle is not None)
    assert vehicle.pitch_inertia_kg_m2 is not None
    return Car("half_car", vehicle.sprung_mass_kg, vehicle.pitch_inertia_kg_m2, front, rear, vehicle.contact_patch_m)


@dataclass(frozen=True, eq=False)
class SurveyedRoad:
    """A straight road to the north (or south), as it is, and a car's drive over it: (n,) at 100 Hz."""

    elevation_m: np.ndarray
    lat_deg: float
    lon_deg: float
    north: float
    time_s: np.ndarray
    driven_m: np.ndarray
    accel_mps2: np.ndarray

    def places(self, at_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Latitude and longitude of distances."""
        lat = self.lat_deg + self.north * cos(HEADING_RAD) * np.degrees(at_m / EARTH_M)
        return lat, self.lon_deg + sin(HEADING_RAD) * np.degrees(at_m / EARTH_M) / cos(radians(self.lat_deg))

    def force(self, rng: np.random.Generator) -> np.ndarray:
        """Specific force (n, 3) [m/s2] of a device that lies a little askew."""
        up = self.accel_mps2 + GRAVITY_MPS2
        level = np.stack([np.zeros_like(up), np.zeros_like(up), up], axis=1)
        a, b = MOUNTED
        turned = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]]) @ np.array(
            [[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
        return level @ turned.T + NOISE_MPS2 * rng.standard_normal(level.shape)


@cache
def surveyed(seed: int, grade: str = "B", lat_deg: float = 55.7, lon_deg: float = 12.5, north: float = 1.0
             ) -> SurveyedRoad:
    road = random_road(np.random.default_rng(seed), LENGTH_M, SPACING_M, grade, features=False)
    drive = Drive(road, DRIVEN_S, SPEED_MPS, START_M, ((0.1, 17.0, 0.3),))
    accel = clean_acceleration(Scene(simulator_car(), (drive,)), drive)
    return SurveyedRoad(np.round(road.left_m, 6), lat_deg, lon_deg, north, drive.times_s,
                        drive.distance_m(drive.times_s), accel)


# --- LiRA-CD ---


def lira_cd(folder: Path, roads: dict[str, SurveyedRoad], aran_m: float = 7.0) -> Path:
    """``roads`` by carriageway, HH or VH; ARAN's places are so far ahead [m]."""
    import h5py

    rng = np.random.default_rng(5)
    cars, profiler = folder / "AutoPi_CAN", folder / "ref_data"
    cars.mkdir(parents=True)
    profiler.mkdir()
    for side, road in roads.items():
        with h5py.File(cars / f"platoon_CPH1_{side}.hdf5", "w") as file:
            group = file.create_group("GM/16006/pass_1")
            clock_s = 1.6e9 + road.time_s
            fix_s = np.arange(0.3, road.time_s[-1], 1.0)
            stood_m = np.interp(fix_s, road.time_s, road.driven_m) + PLACE_M * rng.standard_normal(len(fix_s))
            lat, lon = road.places(stood_m)
            speed = np.gradient(road.driven_m, road.time_s)
            group["acc.xyz"] = np.column_stack([clock_s, road.force(rng) / GRAVITY_MPS2])
            group["gps"] = np.column_stack([1.6e9 + fix_s, lat, lon])
            group["spd_veh"] = np.column_stack([clock_s[::10], 3.6 * speed[::10]])
        iri = golden_car_iri(road.elevation_m, SPACING_M, 10.0)
        at_m = 10.0 * np.arange(len(iri))
        _table(profiler / f"cph1_iri_mpd_rut_{side.lower()}.csv",
               "Distance [m]; IRI (5) [m/km]; IRI (21) [m/km]; Venstre sporkøring [mm]", at_m, iri,
               iri * np.exp(0.05 * rng.standard_normal(len(iri))), 0 * iri)
        fine_m = np.arange(0.0, LENGTH_M, 1.0)
        _table(profiler / f"cph1_zp_{side.lower()}.csv", "Distance [m];Laser 1 [mm];Lat;Lon", fine_m, 0 * fine_m,
               *road.places(fine_m))
        _table(profiler / f"cph1_aran_{side.lower()}.csv", "Lat;Lon;Venstre IRI (m/km);Højre IRI (m/km)",
               *road.places(at_m + aran_m), iri, iri * np.exp(0.1 * rng.standard_normal(len(iri))))
    return folder


def _table(path: Path, header: str, *columns: np.ndarray) -> None:
    rows = "\n".join(";".join(f"{one:.9g}" for one in row) for row in zip(*columns, strict=True))
    path.write_text(f"{header}\n{rows}\n", "latin-1")


# --- Zenodo 4386256 ---


def zenodo_4386256(folder: Path, roads: tuple[SurveyedRoad, SurveyedRoad, SurveyedRoad], driven: tuple[int, ...]
                   ) -> Path:
    """The northbound, the southbound and the third road; phones drove over those of these numbers."""
    folder.mkdir(parents=True)
    north, south, third = roads
    every = round(0.25 / SPACING_M)
    at_km = [np.arange(len(one.elevation_m[::every])) * 0.25e-3 for one in roads]
    heights = [100 * one.elevation_m[::every] for one in roads]
    savemat(folder / "road_elevation_NB_SB.mat", {
        "dist": np.concatenate([at_km[0], at_km[0][-1] + 0.25e-3 + at_km[1]]),
        "elevation": np.concatenate(heights[:2])})
    savemat(folder / "road_elevation_concord.mat", {"dist": at_km[2], "elevation": heights[2]})
    along_m = np.linspace(0.0, LENGTH_M, 150)
    geopoint(folder / "geopoint_Massachusetts_NB_INSIDE.mat", *north.places(along_m))
    geopoint(folder / "geopoint_Massachusetts_SB_INSIDE.mat", *south.places(along_m))
    lat, lon = third.places(along_m)
    savemat(folder / "geopoint_ConcordTurnpike_LongLoop_MIDDLE.mat", {"lat": lat, "lon": lon})
    rng = np.random.default_rng(6)
    for number in driven:
        road = roads[number]
        lat, lon = road.places(road.driven_m + PLACE_M * rng.standard_normal(len(road.driven_m)))
        x, y, z = road.force(rng).T
        savemat(folder / f"phone-2019-{number}.mat", {
            "t": road.time_s, "x": x, "y": y, "z": z, "speedMS": np.gradient(road.driven_m, road.time_s), "LAT": lat,
            "LON": lon})
    return folder


def geopoint(path: Path, lat_deg: np.ndarray, lon_deg: np.ndarray) -> None:
    """Coordinates as MATLAB keeps those of an object: in a variable without a name, a file within the file."""
    inner = io.BytesIO()
    cells = np.empty((2, 1), dtype=object)
    cells[:, 0] = [lat_deg, lon_deg]
    savemat(inner, {"w": {"MCOS": cells}})
    held = b"\x00\x01IM" + bytes(4) + _without_name(inner.getvalue()[128:])
    outer = io.BytesIO()
    savemat(outer, {"p": 1.0, "w": np.frombuffer(held, dtype=np.uint8)[None]})
    whole = outer.getvalue()
    at = whole.rindex(b"\x01\x00\x01\x00w\x00\x00\x00")  # the second variable's name, in the short form
    named = whole[:at] + b"\x01" + bytes(7) + whole[at + 8:]
    assert "__function_workspace__" in loadmat(io.BytesIO(named))
    path.write_bytes(named)


def _without_name(matrix: bytes) -> bytes:
    at = matrix.index(b"\x01\x00\x01\x00w\x00\x00\x00")
    return matrix[:at] + b"\x01" + bytes(7) + matrix[at + 8:]


# --- LiRA-Map and comma2k19 ---


def lira_map(folder: Path, errors: dict[str, tuple[float, float]]) -> Path:
    """Passes over one road by their names: each begins so far behind [m] and its IRI is off by so much (r.m.s. of the
    logarithm)."""
    folder.mkdir(parents=True)
    rng = np.random.default_rng(7)
    true = np.exp(0.4 * np.sin(np.cumsum(0.2 * rng.standard_normal(20_000))) + 0.2)  # every metre
    for name, (behind_m, off) in errors.items():
        begin_m = behind_m + 10.0 * np.arange(1900)
        points = [{"pos": {"lat": 55.7 + float(np.degrees(at / EARTH_M)), "lng": 12.5}, "timestamp": str(10 * number),
                   "value": float(true[round(at):round(at) + 10].mean() * np.exp(off * rng.standard_normal()))}
                  for number, at in enumerate(begin_m)]
        (folder / f"trip_iri_{name}.json").write_text(json.dumps({"path": {"data": points}}))
    return folder


def comma2k19(folder: Path, road: SurveyedRoad, late_s: float = 0.2, faster_mps: float = 0.15) -> Path:
    """A segment; the receiver's speed comes so late and is so much higher than the car's."""
    rng = np.random.default_rng(8)
    fix_s = np.arange(1.0, road.time_s[-1], 0.1)
    speed = np.gradient(road.driven_m, road.time_s)
    lat, lon = road.places(np.interp(fix_s - late_s, road.time_s, road.driven_m))
    force = road.force(rng) * [1, -1, -1]  # forward, right, down
    receiver = np.column_stack([lat, lon, np.interp(fix_s - late_s, road.time_s, speed) + faster_mps, fix_s, 0 * fix_s])
    for where, time_s, value in (("IMU/accelerometer", road.time_s, force), ("GNSS/live_gnss_ublox", fix_s, receiver),
                                 ("CAN/speed", road.time_s, speed)):
        place = folder / "40" / "processed_log" / where
        place.mkdir(parents=True)
        for name, one in (("t", 5e3 + time_s), ("value", value)):
            with (place / name).open("wb") as file:
                np.save(file, one)
    return folder
