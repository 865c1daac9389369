"""Makes the logs of ``ridelog demo --years``: ``python -m tests.support.drives.years FILE.zip``.

Three drives along one road in June 2025 and three a year later, in which a stretch had broken up and another had been
paved again. The bytes of a BMA220 and a GPS receiver went through the service; its logs are kept.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from logger.commands.replay import ReplayQuestion, replayed
from logger.files import write_file, write_text
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle

from .lab_drives import LONG_AGO
from .simulated_drive import DrivePlan, Reception, RoadStretch, build_road, record, simulate_drive

_LENGTH_M, _SEED = 1700.0, 2025
BROKEN_M, PAVED_M = (600.0, 800.0), (1100.0, 1300.0)
"""From where to where along the drive."""


def _road(broken_cm3: float, paved_cm3: float) -> Sequence[RoadStretch]:
    return (RoadStretch(BROKEN_M[0], 25), RoadStretch(200, broken_cm3), RoadStretch(300, 25),
            RoadStretch(200, paved_cm3), RoadStretch(400, 25))


ROADS: Mapping[int, Sequence[RoadStretch]] = {2025: _road(25, 120), 2026: _road(140, 15)}


def _plan(year: int, day: int) -> DrivePlan:
    """A drive of 1.6 km, each day at a speed of its own."""
    speed_mps, seed = 12.5 + 0.5 * day, 10 * year + day
    end_s = 12.0 + 1600.0 / speed_mps
    return DrivePlan(
        speed_knots=[(0.0, 0.0), (6.0, 0.0), (14.0, speed_mps), (end_s - 6.0, speed_mps), (end_s, 0.0),
                     (end_s + 5.0, 0.0)],
        stretches=(), seed=seed, reception=Reception(first_fix_s=2.0), offset_mps2=(0.21, -0.13, 0.16),
        start_utc=f"{year}-06-0{day}T08:00:00.400+00:00")


def main() -> None:
    """Write the logs to the archive named on the command line."""
    made, car = BytesIO(), read_vehicle(vehicle_file("rav4-2009"))
    with TemporaryDirectory() as folder, ZipFile(made, "w") as archive:
        settings = Path(folder) / "settings.yaml"
        write_text(settings, "gps:\n  earliest_date: 2025-01-01\nvehicle: rav4-2009\n")
        for year, stretches in ROADS.items():
            road = build_road(stretches, (), _LENGTH_M, _SEED)
            for day in (1, 2, 3):
                plan = _plan(year, day)
                dump, out = Path(folder) / f"{year}-{day}.dump.gz", Path(folder) / f"{year}-{day}"
                record(simulate_drive(plan, car, road=road), dump)
                replayed(ReplayQuestion(dump=dump, out=out, config=settings))
                for file in sorted(out.glob("00001-001.*")):
                    entry = ZipInfo(f"{year}/day-{day}/{file.name}", LONG_AGO)
                    entry.compress_type = ZIP_DEFLATED
                    archive.writestr(entry, file.read_bytes())
    write_file(sys.argv[1], [made.getvalue()])


if __name__ == "__main__":
    main()
