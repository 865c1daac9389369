"""A fleet's drives over a town, as rows of logs: streets, cars with biases, roads that decay; all of it known.

Streets are a grid, a block of 100 m wide, driven in both directions. A drive follows one of them from end to end; a
row is a window of 25 ft on it. A receiver's error wanders by 1.5 m across and along the road. An IRI is the road's at
that time, times the car's gain, times an error of its own and one of the pass.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from logger.commands.main import main
from logger.geodesy import EARTH_RADIUS_M
from logger.records import WindowRecord
from logger.store.log.row_format import HEADER, format_row
from logger.units import WINDOW_M

Array = npt.NDArray[np.float64]
YEAR_S = 365.25 * 86400
BLOCK_M = 100.0
START_US = 1_704_067_200_000_000  # 2024-01-01
PLACE_STD_M = 1.5
WINDOW_STD, DRIVE_STD = 0.15, 0.05
"""Of the error of a window, and of what all windows of a drive share, relative."""
STREET_IRI = (1.5, 4.0)


@dataclass(frozen=True, eq=False)
class Town:
    """Streets (s,) of a length, half of them east-west, a block apart; cars (c,).

    iri             (s, w) of each window of each street at the middle of the time [m/km]
    decay           (s,) a year, as a fraction of that
    log_gain        (c,) mean zero
    years           that are driven
    """

    lat0_deg: float
    lon0_deg: float
    street_m: float
    iri: Array
    decay: Array
    log_gain: Array
    years: float

    @property
    def streets(self) -> int:
        """Their number."""
        return len(self.decay)


def town(streets: int, street_m: float, cars: int, years: float = 2.0, seed: int = 1, *, smooth: bool = True,
         lat0_deg: float = 42.36, lon0_deg: float = -83.07) -> Town:
    """A town. ``smooth``: each street has one IRI along all its windows."""
    rng = np.random.default_rng(seed)
    windows = int(street_m / WINDOW_M)
    level = rng.uniform(*STREET_IRI, (streets, 1)) * (1.0 if smooth else rng.uniform(0.8, 1.25, (streets, windows)))
    log_gain = rng.normal(0.0, 0.08, cars)
    return Town(lat0_deg, lon0_deg, street_m, np.broadcast_to(level, (streets, windows)),
                np.where(rng.random(streets) < 0.3, 0.12, 0.0), log_gain - log_gain.mean(), years)


@dataclass(frozen=True, eq=False)
class Drives:
    """Windows (d, w) of d drives, each along one street: columns of a log, and ``car``, ``street``, ``utc_us`` (d,)."""

    car: npt.NDArray[np.intp]
    street: npt.NDArray[np.intp]
    utc_us: npt.NDArray[np.int64]
    lat_deg: Array
    lon_deg: Array
    iri_m_per_km: Array
    speed_mps: float = 12.0


def drives(place: Town, count: int, seed: int | tuple[int, int] = 2, within: tuple[float, float] = (0.0, 1.0)
           ) -> Drives:
    """Drives at random times ``within`` a part of the town's, with random cars and streets, in either direction."""
    rng = np.random.default_rng(seed)
    windows = place.iri.shape[1]
    car, street = rng.integers(len(place.log_gain), size=count), rng.integers(place.streets, size=count)
    first_s, last_s = (part * (place.years * YEAR_S - 3600.0) for part in within)
    when_s = np.sort(rng.uniform(first_s, last_s, count))
    back = rng.random(count) < 0.5
    along_m = (np.arange(windows) + 0.5) * WINDOW_M
    along_m = np.where(back[:, None], along_m[::-1], along_m) + _wander(rng, count, windows)
    # Drivers keep to the right: 2.5 m off the middle of the street.
    across_m = np.where(street % 2 == 0, -1.0, 1.0)[:, None] * np.where(back, -2.5, 2.5)[:, None]
    across_m = across_m + _wander(rng, count, windows) + BLOCK_M * (street // 2 + 0.5)[:, None]
    is_east = (street % 2 == 0)[:, None]
    east_m, north_m = np.where(is_east, along_m, across_m), np.where(is_east, across_m, along_m)
    per_m = 180.0 / np.pi / EARTH_RADIUS_M
    true = place.iri[street]
    true = np.where(back[:, None], true[:, ::-1], true)
    age = when_s / YEAR_S - place.years / 2
    true = true * (1.0 + place.decay[street] * age)[:, None] * np.exp(place.log_gain[car])[:, None]
    error = WINDOW_STD * rng.normal(size=true.shape) + DRIVE_STD * rng.normal(size=(count, 1))
    return Drives(car, street, START_US + (when_s * 1e6).astype(np.int64), place.lat0_deg + north_m * per_m,
                  place.lon0_deg + east_m * per_m / np.cos(np.radians(place.lat0_deg)),
                  np.maximum(true * (1.0 + error), 0.05))


def _wander(rng: np.random.Generator, count: int, windows: int) -> Array:
    """A receiver's error [m]: one that stays over a drive, and one that changes from window to window."""
    return PLACE_STD_M * (0.9 * rng.normal(size=(count, 1)) + 0.3 * rng.normal(size=(count, windows)))


def write_logs(found: Drives, folder: Path, first_session: int = 1) -> None:
    """A folder for each car with a log for each drive, named as a logger does; sessions count over all cars."""
    for number in range(len(found.car)):
        log = folder / f"car{found.car[number]:03d}" / f"{first_session + number:05d}-001.csv"
        log.parent.mkdir(parents=True, exist_ok=True)
        rows = [format_row(record) for record in records(found, number)]
        log.write_text("\n".join([HEADER, *rows, ""]), "ascii")


def ingest(logs: Path, dataset: Path, *options: str) -> None:
    """Each car's folder of logs by the command."""
    for car in sorted(logs.iterdir()):
        assert main(["fleet", "ingest", str(car), "--to", str(dataset), "--car", car.name, *options]) == 0


def ingested(found: Drives, folder: Path) -> Path:
    """The data set of these drives, in a folder beside their logs."""
    write_logs(found, folder / "logs")
    ingest(folder / "logs", folder / "town")
    return folder / "town"


def records(found: Drives, number: int) -> list[WindowRecord]:
    """The rows of one drive."""
    step_us = round(WINDOW_M / found.speed_mps * 1e6)
    start_ms = int(found.utc_us[number]) // 1000
    return [WindowRecord(
        segment=at + 1, drive=1, t_us=at * step_us, utc_us=(start_ms + at * step_us // 1000) * 1000,
        duration_s=step_us / 1e6, distance_start_m=at * WINDOW_M, distance_end_m=(at + 1) * WINDOW_M,
        lat_deg=float(lat), lon_deg=float(lon), speed_mps=found.speed_mps, iri_m_per_km=float(iri),
        iri_std_m_per_km=WINDOW_STD * float(iri), iri_rms_m_per_km=None, a_w_mps2=0.1 * float(iri), mtvv_mps2=None,
        vdv_mps175=None, crest_factor=None, comfort="", iri_class="", accel_rms_mps2=None, samples=60,
        clipped_samples=0, flags=())
        for at, (lat, lon, iri) in enumerate(zip(found.lat_deg[number], found.lon_deg[number],
                                                 found.iri_m_per_km[number], strict=True))]
