"""A day of driving and parking through the service, with files, at many times real time: what grows, is lost or wrong.

New Year's night, six hours in; parking in the open, under ground and with the sensors off; a host clock that is 20 ppm
fast; a raw dump on the side and a quota that it alone would break. Truth comes from the plan of the day.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

from ..support.drives.car_days import START_US, CarDay
from ..support.faults.soak import MAX_FILE_BYTES, Soaked, soak
from .figures import Figures

QUOTA_BYTES = 75_000_000
START_UTC = datetime(2026, 12, 31, 17, 57, tzinfo=UTC)
CYCLE_S = 1800
PATIENCE_S = 300


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=24.0, help="how much of a day; 2 or more")
    day = CarDay(round(parser.parse_args().hours * 3600 / CYCLE_S), START_UTC, CYCLE_S)
    with tempfile.TemporaryDirectory() as name:
        found = soak(day, Path(name), QUOTA_BYTES)
    figures = Figures()
    day_s = day.cycles * CYCLE_S
    print(f"{day_s / 3600:g} h, {found.events / 1e6:.1f} million events in {found.wall_s:.0f} s: "
          f"{day_s / found.wall_s:.0f} times real time")
    figures.at_most("processor time", found.cpu_s, PATIENCE_S, "s")
    _resources(found, START_US + day_s // 3 * 1_000_000, figures)
    _rows(found, day, figures)
    return 1 if figures.missed else 0


def _resources(found: Soaked, warm_us: int, figures: Figures) -> None:
    """The memory that the allocator holds grows in steps, until every kind of hour has been; then it must not."""
    gained_bytes = found.gained(lambda sample: sample.memory_bytes, warm_us)
    gained_blocks = found.gained(lambda sample: sample.blocks, warm_us)
    open_files = [sample.open_files for sample in found.samples]
    figures.at_most("memory gained after the first third", gained_bytes / 1e6, 1, "MB")
    figures.at_most("Python objects gained after it", 100 * gained_blocks / found.samples[0].blocks, 1, "%")
    figures.at_most("open files, most minus fewest", max(open_files) - min(open_files), 1, "")
    folder_bytes = max(sample.folder_bytes for sample in found.samples)
    figures.at_most("largest size of the folder", folder_bytes / 1e6, QUOTA_BYTES / 1e6, "MB")
    figures.at_least("raw dump before logs needed its space", found.dump_s / 3600, 4, "h")
    figures.at_most("largest log file", max(found.log_bytes) / 1e3, MAX_FILE_BYTES / 1e3 + 1, "kB")


def _rows(found: Soaked, day: CarDay, figures: Figures) -> None:
    truth = day.truth()
    logs = [check for check in found.checks if check.kind == "log"]
    others = [problem for check in found.checks if check.kind != "log" for problem in check.problems]
    figures.at_least("log files", len(logs), truth.drives, "")
    figures.at_most("drives miscounted", abs(found.rows[-1].drive - truth.drives), 0, "")
    figures.at_most("problems in logs, by ridelog verify", sum(len(check.problems) for check in logs), 0, "")
    silent = [problem for problem in others if "nothing from the accelerometer" in problem]
    figures.at_most("problems in the raw dump", len(others) - len(silent), 0, "")
    figures.at_least("sensor outages found in the raw dump", len(silent), 1, "")
    figures.at_most("the same, none invented", len(silent), truth.silences, "")
    figures.at_most("rows lost", found.rows_lost, 0, "")
    figures.at_least("rows written", len(found.rows), truth.known_m / 7.62, "")
    segments = [row.segment for row in found.rows]
    figures.at_most("segment numbers out of order", sum(b != a + 1 for a, b in pairwise([0, *segments])), 0, "")
    figures.at_most("error of the logged distance", 100 * abs(found.known_m() / truth.known_m - 1), 0.5, "%")
    figures.at_most("error of the time without speed", 100 * abs(found.blind_s() / truth.blind_s - 1), 0.5, "%")
    figures.at_most("largest error of a row's UTC", 1000 * max(found.utc_errors_s(day)), 100, "ms")


if __name__ == "__main__":
    sys.exit(main())
