"""A fleet's dataset, ingest and summary, by size: time, peak memory, how both grow, and whether the truth comes out.

  python -m tests.benchmarks.fleet --rows 100000
  python -m tests.benchmarks.fleet --rows 1000000 --growth      # 10^5, 10^6
  python -m tests.benchmarks.fleet --rows 100000000 --growth    # 10^5 ... 10^8; some 10 GB of disk
  python -m tests.benchmarks.fleet --rows 100000000 --named 5   # a fifth of the rows, each file named five times
  python -m tests.benchmarks.fleet --rows 10000000 --log-rows 10000000    # all of them through logs

200 cars (20 below 10^6 rows) with biases of their own drive two years over a town whose streets decay or not. Up to
10^5 windows go through logs and the command, as a user's do; the rest are rows of the same drives, keyed and filed by
the same code without the text of a log. Each step runs in a process of its own; seconds are those of the processor
(of all its cores) and of the clock, memory is the kernel's figure.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix
from scipy.stats import norm

from logger.api.fleet import fleet_summarise
from logger.fleet.dataset import ROW_TYPES, Dataset
from logger.fleet.ingest import BATCH_ROWS, filed_rows, joined_columns, own_key, pseudonym
from logger.fleet.road_map import cell_keys, cells
from logger.units import WINDOW_M

from ..support.drives.fleet_town import BLOCK_M, DRIVE_STD, WINDOW_STD, YEAR_S, Drives, Town, drives, town, write_logs
from .figures import Figures

STREET_M = 2_000.0
CARS = 200
MANY = 1_000_000
LOG_ROWS = 100_000
KEY = b"benchmark"

_STEP = """
import json, resource, sys, time
begin = time.monotonic()
{code}
print(json.dumps({{"clock_s": time.monotonic() - begin, "seconds": time.process_time(),
                  "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}}), file=sys.stderr)
"""


def place(rows: int) -> Town:
    """The town for so many rows: 200 km of streets and 200 cars; of few rows a tenth."""
    scale = 10 if rows >= MANY else 1
    return town(10 * scale, STREET_M, CARS * scale // 10, years=2.0, seed=11)


def step(code: str) -> dict[str, float]:
    """Seconds and peak memory of a piece of code in its own process."""
    done = subprocess.run([sys.executable, "-c", _STEP.format(code=code)], capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(done.stderr.strip().splitlines()[-1])
    return found


def file_rows(dataset: Path, rows: int) -> None:
    """Rows of drives, keyed and filed in the order of time; cars are called as the key of this benchmark says."""
    here = place(rows)
    found, session = Dataset(dataset), 0
    batches = batches_of(here, rows)
    with found.writing():
        for number, count in enumerate(batches):
            commit_drives(drives(here, count, (7, session), (number / len(batches), (number + 1) / len(batches))),
                          found, session)
            session += count


def batches_of(here: Town, rows: int) -> list[int]:
    """Drives of each commit."""
    per_drive = here.iri.shape[1]
    drives_in_all, most = -(-rows // per_drive), BATCH_ROWS // per_drive
    return [min(most, drives_in_all - start) for start in range(0, drives_in_all, most)]


def commit_drives(made: Drives, found: Dataset, session: int) -> None:
    """One batch of drives."""
    count = len(made.car)
    windows = made.lat_deg.shape[1]
    drive = np.repeat(np.arange(count), windows)
    at = np.tile(np.arange(windows), count)
    step_us = round(WINDOW_M / made.speed_mps * 1e6)
    columns: dict[str, Any] = {
        "segment": np.arange(count * windows), "drive": drive, "utc_us": made.utc_us[drive] + at * step_us,
        "lat_deg": made.lat_deg.ravel(), "lon_deg": made.lon_deg.ravel(), "iri_m_per_km": made.iri_m_per_km.ravel(),
        "iri_std_m_per_km": 0.15 * made.iri_m_per_km.ravel(), "a_w_mps2": 0.1 * made.iri_m_per_km.ravel(),
        "speed_mps": np.full(count * windows, made.speed_mps), "distance_start_m": at * WINDOW_M,
        "distance_end_m": (at + 1) * WINDOW_M, "flags": np.full(count * windows, "", dtype=object),
        "crc32": np.random.default_rng(session).integers(2**32, size=count * windows)}
    filed = filed_rows(columns, lambda lat, lon, heading, _: cell_keys(lat, lon, heading), 0.0).columns
    car = np.array([pseudonym(f"car{one:03d}", KEY) for one in range(CARS)])
    rows = {name: values for name, values in filed.items() if name in ROW_TYPES}
    rows["car"], rows["session"] = car[made.car[filed["drive"]]], session + filed["drive"] + 1
    names = ("car", "session", "log", "sha256", "rows", "damaged_lines", "undated", "unplaced", "trimmed", "repeated")
    found.commit(joined_columns([rows]), {name: [] for name in names}, "", 0.0)


def street_of(here: Town, roads: Any) -> np.ndarray:
    """The street that each segment lies on, by its place and direction; -1: not clear."""
    per_deg = np.pi / 180 * 6_371_008.8
    north = (roads.lat_deg - here.lat0_deg) * per_deg
    east = (roads.lon_deg - here.lon0_deg) * per_deg * np.cos(np.radians(here.lat0_deg))
    along_east = np.isin(np.round(cells(roads.key).heading_deg), (90.0, 270.0))
    along_north = np.isin(np.round(cells(roads.key).heading_deg), (0.0, 180.0))
    number = np.floor(np.where(along_east, north, east) / BLOCK_M).astype(int)
    street = np.where(along_east, 2 * number, 2 * number + 1)
    ok = (along_east | along_north) & (number >= 0) & (street < here.streets)
    return np.where(ok, street, -1)


def least_bias_error(rows: int) -> float:
    """The limit of Cramer and Rao for the r.m.s. error of the log gains [1], of so many rows: from the information of
    whole drives about cars, and about level and decay of each street in each direction. Nothing of ``logger.fleet``
    is in it. Of many rows it follows from the first million, whose square root it goes with."""
    counted = min(rows, MANY)
    here = place(rows)
    made = drives(here, -(-counted // here.iri.shape[1]), (7, 0))
    count, cars = len(made.car), len(here.log_gain)
    east_m, north_m = np.ptp(made.lon_deg, axis=1), np.ptp(made.lat_deg, axis=1)
    first, last = (np.where(east_m > north_m, made.lon_deg[:, at], made.lat_deg[:, at]) for at in (0, -1))
    road = cars + 2 * made.street + (last > first)
    years = (made.utc_us - made.utc_us.mean()) / (YEAR_S * 1e6)
    roads = 2 * here.streets
    drive = np.arange(count)
    columns = csr_matrix((np.concatenate([np.ones(2 * count), years]), (
        np.tile(drive, 3), np.concatenate([made.car, road, road + roads]))), shape=(count, cars + 2 * roads))
    inverse = np.linalg.pinv((columns.T @ columns).toarray())[:cars, :cars]
    centre = np.eye(cars) - 1.0 / cars
    variance = DRIVE_STD**2 + WINDOW_STD**2 / here.iri.shape[1]
    return float(np.sqrt(np.diag(centre @ inverse @ centre).mean() * variance * counted / rows))


def check_truth(here: Town, rows: int, figures: Figures, found: Any, key: bytes) -> None:
    """Means, biases and changes beside those that the drives were made with."""
    names = {pseudonym(f"car{car:03d}", key): car for car in range(len(here.log_gain))}
    car = np.array([names[one] for one in found.cars.tolist()])
    error = np.log(found.biases.gain) - here.log_gain[car]
    known = found.biases.known
    inside = np.abs(error) < 2 * found.biases.log_std
    rms, expected = (float(np.sqrt((one[known] ** 2).mean())) * 100 for one in (error, found.biases.log_std))
    limit = 100 * least_bias_error(rows)
    print(f"{'bias, r.m.s. error: limit of Cramer and Rao':48s} {limit:10.4g} %")
    print(f"{'bias, r.m.s. error: as the summary says':48s} {expected:10.4g} %")
    figures.at_most("bias, r.m.s. error (1 %, or the limit)", rms, max(1.0, limit * (1 + _sampling(known))), "%")
    figures.at_least("biases inside two errors (95 %, sampling apart)", float(inside[known].mean()),
                     0.95 - 2 * (0.95 * 0.05 / known.sum()) ** 0.5, "")
    roads = found.roads
    street = street_of(here, roads)
    inside = (street >= 0) & (roads.passes >= 4)
    if not inside.any():
        return
    iri = here.iri[street[inside], 0]
    z = (roads.iri_m_per_km[inside] - iri * _age(here, street[inside], roads, inside)) / roads.iri_std_m_per_km[inside]
    figures.at_least("segment means inside two errors", float((np.abs(z) < 2).mean()), 0.945, "")
    slope, slope_std = iri * here.decay[street[inside]], roads.trend_std_m_per_km_per_year[inside]
    z = (roads.trend_m_per_km_per_year[inside] - slope) / slope_std
    figures.at_least("changes inside two errors", float((np.abs(z) < 2).mean()), 0.945, "")
    decaying = here.decay[street[inside]] > 0
    called = roads.worse[inside]
    if not called.any():
        return
    figures.at_most("false among changes called significant", float((~decaying)[called].mean()), 0.05, "")
    needed = norm.isf(roads.p_value[inside][called].max() / 2)
    power = norm.cdf(slope[decaying] / slope_std[decaying] - needed).mean()
    found_share = float(called[decaying].mean())
    print(f"{'decaying segments found':48s} {found_share:10.4g}")
    figures.at_least("decaying segments found, less the power stated", found_share - power, -0.05, "")


def _sampling(known: np.ndarray) -> float:
    """Two standard deviations of an r.m.s. of so many, relative."""
    return 2 / float(2 * known.sum()) ** 0.5


def _age(here: Town, street: np.ndarray, roads: Any, inside: np.ndarray) -> np.ndarray:
    """What the street has become at the mean time of a segment's passes."""
    return 1.0 + here.decay[street] * (roads.mean_years[inside] - 4.0 - here.years / 2)


def name_again(dataset: Path, times: int) -> None:
    """Name all files of a dataset so many times, as those of further commits: more rows to read and to sum up without
    the disk and the hours that they would take to make."""
    manifest = dataset / "manifest.json"
    content = json.loads(manifest.read_text())
    first = list(content["commits"])
    for again in range(1, times):
        for commit in first:
            files = []
            for file in commit["files"]:
                path = f"{file['path'].removesuffix('.parquet')}-{again}.parquet"
                os.link(dataset / file["path"], dataset / path)
                files.append({**file, "path": path})
            content["commits"].append({**commit, "files": files})
    manifest.write_text(json.dumps(content))


def measure(rows: int, named: int, figures: Figures, folder: Path) -> dict[str, float]:
    """All steps of one size."""
    dataset = folder / f"town{rows}"
    filed = step("from pathlib import Path\nfrom tests.benchmarks.fleet import file_rows\n"
                 f"file_rows(Path({str(dataset)!r}), {rows // named})")
    size = sum(path.stat().st_size for path in dataset.rglob("*.parquet")) * named / rows
    name_again(dataset, named)
    print(f"{rows:.0e} rows: filed in {filed['seconds']:.1f} s; {size:.0f} bytes a row")
    figures.at_most("filing, peak memory", filed["peak_mb"], 2048, "MB")
    summed = summarised(dataset, rows, figures)
    if named == 1:
        check_truth(place(rows), rows, figures, fleet_summarise(dataset).found, KEY)
    return {"rows": rows, "filed_s": filed["seconds"] * named, **summed}


def summarised(dataset: Path, rows: int, figures: Figures) -> dict[str, float]:
    """Time and memory of a summary."""
    done = step(f"from logger.api.fleet import fleet_summarise; fleet_summarise({str(dataset)!r}).text")
    print(f"{'summary, by the clock':48s} {done['clock_s']:10.4g} s")
    figures.at_most("summary, of two cores each", done["seconds"] / 2, max(20.0, 60.0 * rows / 1e8), "s")
    figures.at_most("summary, peak memory", done["peak_mb"], 2048, "MB")
    return {"summary_s": done["seconds"], "summary_mb": done["peak_mb"]}


def through_logs(rows: int, figures: Figures, folder: Path) -> None:
    """Logs through the command, and again; their rows against the truth."""
    here = place(rows)
    session = 0
    for count in batches_of(here, rows):
        write_logs(drives(here, count, (3, session)), folder / "logs", session + 1)
        session += count
    written = session * here.iri.shape[1]
    logged = folder / "logged"
    command = ("from logger.commands.main import main\n"
               f"main(['fleet', 'ingest', {str(folder / 'logs')!r}, '--to', {str(logged)!r}, '--car-folders'])")
    first, again = step(command), step(command)
    figures.at_most(f"ingest of logs, a row ({written:,} rows)", first["seconds"] / written * 1e6, 20, "us")
    figures.at_most("ingest of logs, peak memory", first["peak_mb"], 2048, "MB")
    figures.at_most("the same again, a row", again["seconds"] / written * 1e6, 20, "us")
    figures.at_least("rows that came in", float(Dataset(logged).manifest.rows), written, "")
    figures.at_most("rows that came in", float(Dataset(logged).manifest.rows), written, "")
    if rows >= MANY:
        summarised(logged, rows, figures)
        check_truth(here, rows, figures, fleet_summarise(logged).found, own_key(logged))


def main() -> int:
    """Print the figures beside the goals."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=LOG_ROWS)
    parser.add_argument("--growth", action="store_true", help="all powers of ten from 10^5 on")
    parser.add_argument("--named", type=int, default=1, help="make this part of the rows, and name each file so often")
    parser.add_argument("--log-rows", type=int, default=LOG_ROWS, help="rows that go through logs")
    args = parser.parse_args()
    figures = Figures()
    with tempfile.TemporaryDirectory() as folder:
        begin = time.monotonic()
        through_logs(min(args.rows, args.log_rows), figures, Path(folder))
        sizes = [10**power for power in range(5, 12) if 10**power < args.rows] if args.growth else []
        table = [measure(rows, 1, figures, Path(folder)) for rows in sizes]
        table.append(measure(args.rows, args.named, figures, Path(folder)))
        print("\nSeconds of the processor, all cores")
        print("      rows  filed [s]  summary [s]  memory [MB]  exponent of the summary's time")
        for number, one in enumerate(table):
            before = table[number - 1] if number else None
            grown = (f"{np.log(one['summary_s'] / before['summary_s']) / np.log(one['rows'] / before['rows']):.2f}"
                     if before else "")
            print(f"{one['rows']:10.0e}  {one['filed_s']:9.1f}  {one['summary_s']:11.1f}  "
                  f"{one['summary_mb']:11.0f}  {grown}")
        print(f"all in {time.monotonic() - begin:.0f} s")
    return figures.missed


if __name__ == "__main__":
    sys.exit(main())
