"""A fleet's dataset, ingest and summary, by size: time, peak memory, how both grow, and whether the truth comes out.

  python -m tests.benchmarks.fleet --rows 100000
  python -m tests.benchmarks.fleet --rows 1000000 --growth      # 10^5, 10^6
  python -m tests.benchmarks.fleet --rows 100000000 --growth    # 10^5 ... 10^8; some 10 GB of disk

200 cars (20 below 10^6 rows) with biases of their own drive two years over a town whose streets decay or not. Up to
10^5 windows go through logs and the command, as a user's do; the rest are rows of the same drives, keyed and filed by
the same code without the text of a log. Each step runs in a process of its own, whose memory is the kernel's figure.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from logger.fleet.dataset import ROW_TYPES, Dataset
from logger.fleet.drive_rows import filed_rows
from logger.fleet.ingest import BATCH_ROWS
from logger.fleet.log_columns import joined_columns
from logger.fleet.pseudonyms import pseudonym, shown_car
from logger.fleet.road_cells import cell_keys, cells
from logger.units import WINDOW_M

from ..support.drives.fleet_town import BLOCK_M, Town, drives, town, write_logs
from .figures import Figures

STREET_M = 2_000.0
MANY = 1_000_000
LOG_ROWS = 100_000

_STEP = """
import json, resource, sys, time
begin = time.monotonic()
{code}
print(json.dumps({{"seconds": time.monotonic() - begin,
                  "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}}), file=sys.stderr)
"""


def place(rows: int) -> Town:
    """The town for so many rows: 200 km of streets and 200 cars; of few rows a tenth."""
    scale = 10 if rows >= MANY else 1
    return town(10 * scale, STREET_M, 20 * scale, years=2.0, seed=11)


def step(code: str) -> dict[str, float]:
    """Seconds and peak memory of a piece of code in its own process."""
    done = subprocess.run([sys.executable, "-c", _STEP.format(code=code)], capture_output=True, text=True, check=True)
    found: dict[str, float] = json.loads(done.stderr.strip().splitlines()[-1])
    return found


def file_rows(dataset: Path, rows: int) -> None:
    """Rows of drives, keyed and filed; cars are called as the key of this benchmark says."""
    here = place(rows)
    per_drive = here.iri.shape[1]
    found, left, session = Dataset(dataset), -(-rows // per_drive), 0
    with found.writing():
        while left > 0:
            count = min(left, BATCH_ROWS // per_drive)
            commit_drives(here, found, count, session)
            session, left = session + count, left - count


def commit_drives(here: Town, found: Dataset, count: int, session: int) -> None:
    """One batch of drives."""
    made = drives(here, count, seed=(7, session))
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
    car = np.array([pseudonym(f"car{one:03d}", b"benchmark") for one in range(len(here.log_gain))])
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


def check_truth(here: Town, figures: Figures, summary: Any) -> None:
    """Means, biases and changes beside those that the drives were made with."""
    found = summary.found
    names = {shown_car(pseudonym(f"car{car:03d}", b"benchmark")): car for car in range(len(here.log_gain))}
    car = np.array([names[shown_car(one)] for one in found.cars.tolist()])
    error = np.log(found.biases.gain) - here.log_gain[car]
    known = found.biases.known
    inside = np.abs(error) < 2 * found.biases.log_std
    if known.sum() >= 100:
        figures.at_least("biases inside two errors", float(inside[known].mean()), 0.9, "")
    rms, expected = (float(np.sqrt((one[known] ** 2).mean())) * 100 for one in (error, found.biases.log_std))
    # Drives are 5 % off as a whole: a car needs some hundred of them for half a per cent.
    figures.at_most("bias, r.m.s. error", rms, max(1.0, 1.3 * expected), "%")
    roads = found.roads
    street = street_of(here, roads)
    inside = (street >= 0) & (roads.passes >= 4)
    if not inside.any():
        return
    iri = here.iri[street[inside], 0]
    z = (roads.iri_m_per_km[inside] - iri * _age(here, street[inside], roads, inside)) / roads.iri_std_m_per_km[inside]
    figures.at_least("segment means inside two errors", float((np.abs(z) < 2).mean()), 0.94, "")
    slope = iri * here.decay[street[inside]]
    z = (roads.trend_m_per_km_per_year[inside] - slope) / roads.trend_std_m_per_km_per_year[inside]
    figures.at_least("changes inside two errors", float((np.abs(z) < 2).mean()), 0.94, "")
    decaying = here.decay[street[inside]] > 0
    called = roads.worse[inside]
    if called.any():
        figures.at_most("false among changes called significant", float((~decaying)[called].mean()), 0.07, "")
    print(f"{'decaying segments that are found':48s} {called[decaying].mean():10.4g}")


def _age(here: Town, street: np.ndarray, roads: Any, inside: np.ndarray) -> np.ndarray:
    """What the street has become at the mean time of a segment's passes."""
    return 1.0 + here.decay[street] * (roads.mean_years[inside] - 4.0 - here.years / 2)


def measure(rows: int, figures: Figures, folder: Path) -> dict[str, float]:
    """All steps of one size."""
    from logger.api.fleet import fleet_summarise

    dataset = folder / f"town{rows}"
    filed = step("from pathlib import Path\nfrom tests.benchmarks.fleet import file_rows\n"
                 f"file_rows(Path({str(dataset)!r}), {rows})")
    size = sum(path.stat().st_size for path in dataset.rglob("*.parquet"))
    reported = step(f"from logger.api.fleet import fleet_summarise; fleet_summarise({str(dataset)!r}).text")
    print(f"{rows:.0e} rows: filed in {filed['seconds']:.1f} s; {size / rows:.0f} bytes a row")
    figures.at_most("summary, time", reported["seconds"], max(20.0, 60.0 * rows / 1e8), "s")
    figures.at_most("summary, peak memory", reported["peak_mb"], 2048, "MB")
    figures.at_most("filing, peak memory", filed["peak_mb"], 2048, "MB")
    check_truth(place(rows), figures, fleet_summarise(dataset))
    return {"rows": rows, "filed_s": filed["seconds"], "summary_s": reported["seconds"],
            "summary_mb": reported["peak_mb"]}


def through_logs(rows: int, figures: Figures, folder: Path) -> None:
    """Logs through the command, and again."""
    here = place(rows)
    found = drives(here, max(rows // here.iri.shape[1], 1), seed=3)
    write_logs(found, folder / "logs")
    count = found.lat_deg.size
    command = ("from logger.commands.main import main\n"
               f"main(['fleet', 'ingest', {str(folder / 'logs')!r}, '--to', {str(folder / 'logged')!r}, "
               "'--car-folders'])")
    first, again = step(command), step(command)
    figures.at_most(f"ingest of logs, a row ({count:,} rows)", first["seconds"] / count * 1e6, 100, "us")
    figures.at_most("the same again, a row", again["seconds"] / count * 1e6, 50, "us")
    figures.at_least("rows that came in", float(Dataset(folder / "logged").manifest.rows), count, "")
    figures.at_most("rows that came in", float(Dataset(folder / "logged").manifest.rows), count, "")


def main() -> int:
    """Print the figures beside the goals."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=LOG_ROWS)
    parser.add_argument("--growth", action="store_true", help="all powers of ten from 10^5 on")
    args = parser.parse_args()
    figures = Figures()
    with tempfile.TemporaryDirectory() as folder:
        begin = time.monotonic()
        through_logs(min(args.rows, LOG_ROWS), figures, Path(folder))
        sizes = [10**power for power in range(5, 12) if 10**power < args.rows] if args.growth else []
        table = [measure(rows, figures, Path(folder)) for rows in [*sizes, args.rows]]
        print("\n      rows  filed [s]  summary [s]  memory [MB]  exponent of the summary's time")
        for number, one in enumerate(table):
            before = table[number - 1] if number else None
            grown = (f"{np.log(one['summary_s'] / before['summary_s']) / np.log(one['rows'] / before['rows']):.2f}"
                     if before else "")
            print(f"{one['rows']:10.0e}  {one['filed_s']:9.1f}  {one['summary_s']:11.1f}  {one['summary_mb']:11.0f}  "
                  f"{grown}")
        print(f"all in {time.monotonic() - begin:.0f} s")
    return figures.missed


if __name__ == "__main__":
    sys.exit(main())
