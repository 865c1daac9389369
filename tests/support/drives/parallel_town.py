"""Drives through a town with parallel streets 15 to 30 m apart, by a receiver whose error stays for minutes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from logger.geodesy import EARTH_RADIUS_M
from logger.roads.road_matching import Matched, RoadNetwork, Trace

WINDOW_M = 7.62
LANE_M = 1.75
BLOCK_M = 150.0


@dataclass(frozen=True, eq=False)
class TownDrive:
    """Windows (n,): what the receiver says, and the truth.

    trace               as it is matched
    east_m, north_m     true places of the middles [m]
    heading_rad         true direction
    said_east_m, said_north_m    places as the receiver says
    """

    trace: Trace
    east_m: np.ndarray
    north_m: np.ndarray
    heading_rad: np.ndarray
    said_east_m: np.ndarray
    said_north_m: np.ndarray


def street_places(streets: int, rng: np.random.Generator) -> np.ndarray:
    """Norths of streets that run east, 15 to 30 m apart [m]."""
    return np.concatenate([[0.0], np.cumsum(rng.uniform(15.0, 30.0, streets - 1))])


def town_drives(drives: int, windows: int, streets: int = 8, avenues: int = 6, seed: int = 1, lat_deg: float = 46.5,
                lon_deg: float = 6.5, error_m: tuple[float, float] = (2.0, 4.0)) -> list[TownDrive]:
    """Random ways through a grid: at each crossing straight on, left or right. The error is a Gauss-Markov process in
    each component, its standard deviation and correlation time (1 to 5 min) drawn for each drive, and 0.3 m of white
    noise."""
    rng = np.random.default_rng(seed)
    norths = street_places(streets, rng)
    easts = BLOCK_M * np.arange(avenues)
    return [_drive(rng, windows, easts, norths, lat_deg, lon_deg, error_m) for _ in range(drives)]


def _drive(rng: np.random.Generator, windows: int, easts: np.ndarray, norths: np.ndarray, lat_deg: float,
           lon_deg: float, error_m: tuple[float, float]) -> TownDrive:
    corners = _corners(rng, windows * WINDOW_M + 50.0, easts, norths)
    east, north, heading = _sampled(corners, windows)
    speed = rng.uniform(8.0, 13.0)
    t_s: np.ndarray = np.arange(windows) * WINDOW_M / speed + rng.uniform(0, 1e5)
    std_m, correlation_s = rng.uniform(*error_m), rng.uniform(60.0, 300.0)
    keeps = np.exp(-WINDOW_M / speed / correlation_s)
    slow = rng.normal(0.0, std_m, (2, windows))
    for window in range(1, windows):
        slow[:, window] = keeps * slow[:, window - 1] + np.sqrt(1 - keeps**2) * slow[:, window]
    said_e, said_n = (np.array([east, north]) + slow + rng.normal(0.0, 0.3, (2, windows)))
    lat = lat_deg + np.degrees(said_n / EARTH_RADIUS_M)
    lon = lon_deg + np.degrees(said_e / EARTH_RADIUS_M) / np.cos(np.radians(lat_deg))
    lon = (lon + 180.0) % 360.0 - 180.0
    distance_m: np.ndarray = WINDOW_M * (np.arange(windows) + 0.5) * (1 + rng.normal(0.0, 0.001))
    return TownDrive(Trace(lat, lon, distance_m, t_s), east, north, heading, said_e, said_n)


def _corners(rng: np.random.Generator, length_m: float, easts: np.ndarray, norths: np.ndarray) -> np.ndarray:
    """Crossings that a drive passes, lane by lane: places (k, 2) to drive to in turn."""
    at = [int(rng.integers(len(easts))), int(rng.integers(len(norths)))]
    ways = [(1, 0), (0, 1), (-1, 0), (0, -1)]
    way = int(rng.integers(4))
    found, driven_m = [(easts[at[0]], norths[at[1]])], 0.0
    while driven_m < length_m:
        turn = int(rng.choice([0, 0, 1, -1]))
        for tried in (turn, -turn, 1, -1, 0):
            ahead = ways[(way + tried) % 4]
            new = [at[0] + ahead[0], at[1] + ahead[1]]
            if 0 <= new[0] < len(easts) and 0 <= new[1] < len(norths):
                way = (way + tried) % 4
                break
        else:
            way = (way + 2) % 4
            continue
        at = new
        found.append((easts[at[0]], norths[at[1]]))
        driven_m += abs(found[-1][0] - found[-2][0]) + abs(found[-1][1] - found[-2][1])
    return np.array(found)


def _sampled(corners: np.ndarray, windows: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middles of windows along the corners, on the right of the streets' middles, corners rounded by some metres."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    fine = np.arange(0.0, windows * WINDOW_M, WINDOW_M / 8)
    east, north = np.interp(fine, length, corners[:, 0]), np.interp(fine, length, corners[:, 1])
    leg = np.clip(np.searchsorted(length, fine, side="right") - 1, 0, len(corners) - 2)
    step = np.diff(corners, axis=0)
    heading = np.arctan2(step[:, 0], step[:, 1])[leg]
    east, north = east + LANE_M * np.cos(heading), north - LANE_M * np.sin(heading)
    rounded = [np.convolve(np.pad(axis, 6, mode="edge"), np.full(13, 1 / 13), "valid") for axis in (east, north)]
    middle = np.arange(windows) * 8 + 4
    east, north = rounded[0][middle], rounded[1][middle]
    return east, north, np.arctan2(np.gradient(east), np.gradient(north))


# --- roughness of the town, and what is matched of it ---


def road_values(east_m: np.ndarray, north_m: np.ndarray, heading_rad: np.ndarray, length_m: float, seed: int = 9
                ) -> np.ndarray:
    """True mean IRI over a length about places [m/km]: a field over the town, another one for each direction, that
    varies within 25 m upwards: 3 m/km with a deviation of some 45 %."""
    rng = np.random.default_rng(seed)
    quarter = np.round(heading_rad / (np.pi / 2)).astype(int) % 4
    found = np.zeros(len(quarter))
    waves, parts = 60, np.linspace(-0.5, 0.5, 2 * int(np.ceil(length_m / 4)) + 1)
    lengths, turns, phases = np.geomspace(25.0, 400.0, waves), rng.uniform(0, 2 * np.pi, waves), rng.uniform(
        0, 2 * np.pi, (4, waves))
    for part in (parts[1:] + parts[:-1]) / 2:
        east = east_m + part * length_m * np.sin(heading_rad)
        north = north_m + part * length_m * np.cos(heading_rad)
        angle = 2 * np.pi / lengths * (east[:, None] * np.cos(turns) + north[:, None] * np.sin(turns)) + phases[quarter]
        found += np.exp(0.43 * np.sqrt(2 / waves) * np.sin(angle).sum(axis=1)) / (len(parts) - 1)
    return 3.0 * found


@dataclass(frozen=True, eq=False)
class Judged:
    """Windows of all drives that were laid on a way (m,): where that way's founder truly was, beside where they were.

    wrong      on another street, against the direction, or more than 25 m along it
    slip_m     how far along the road the measure lies wrong, of those that are not wrong
    """

    wrong: np.ndarray
    slip_m: np.ndarray
    repeats: int
    missed: int


def judged(drives: Sequence[TownDrive], found: Sequence[Matched], network: RoadNetwork) -> Judged:
    """Compare with the truth. Missed is a repeat of a place within 4 m that became a way of its own. What was
    left out as doubtful is neither."""
    truth = np.full((len(network.point), 3), np.nan)
    wrong, slips, missed, repeats = [], [], 0, 0
    seen = np.zeros((0, 3))
    for number, (drive, matched) in enumerate(zip(drives, found, strict=True)):
        here = np.column_stack([drive.east_m, drive.north_m, drive.heading_rad])
        point = matched.point
        founds = (point >= 0) & (matched.aside_m == 0.0) & (network.founder[np.maximum(point, 0)] == number)
        truth[point[founds]] = here[founds]
        if len(seen):
            distance, near = cKDTree(seen[:, :2]).query(here[founds, :2], 6, distance_upper_bound=4.0)
            heading = np.append(seen[:, 2], np.nan)[near]
            alike = np.cos(heading - here[founds, 2][:, None]) > 0.9
            missed += int((alike & np.isfinite(distance)).any(axis=1).sum())
        laid = (point >= 0) & ~founds
        was, now = truth[point[laid]], here[laid]
        east, north = (now - was)[:, :2].T
        aside = east * np.cos(now[:, 2]) - north * np.sin(now[:, 2])
        along = east * np.sin(now[:, 2]) + north * np.cos(now[:, 2])
        bad = (np.abs(aside) > 10) | (np.abs(along) > 25) | (np.cos(now[:, 2] - was[:, 2]) < 0.5)
        wrong.append(bad)
        slips.append((along + network.along_m[point[laid]] - matched.along_m[laid])[~bad])
        seen = np.concatenate([seen, here])
        repeats += int(laid.sum())
    return Judged(np.concatenate(wrong), np.concatenate(slips), repeats + missed, missed)
