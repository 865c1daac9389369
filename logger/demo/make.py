"""Makes the drive that ships with ridelog: ``python -m logger.demo.make FILE``.

Not quite six minutes and 4.5 km in a 2009 RAV4 near College Park, Maryland, all of it simulated: town streets,
a red light, a fast smooth road with a long loss of GPS, a rough lane with a speed bump, and home.
"""

from __future__ import annotations

import sys

from logger.demo.simulated_drive import DrivePlan, Reception, RoadStretch, SpeedBump, record, simulate_drive
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle

PLAN = DrivePlan(
    speed_knots=(
        (0, 0), (4, 0), (13, 12), (38, 13), (50, 11), (58, 11), (68, 0), (88, 0),      # town, red light for 20 s
        (99, 15), (125, 16), (137, 24.5), (205, 25), (220, 12), (245, 11), (251, 5),   # the fast road, down to the lane
        (259, 5), (264, 9), (295, 8), (302, 13), (330, 14), (340, 0), (345, 0),        # bump, rough lane, home
    ),
    stretches=(
        RoadStretch(420, 60), RoadStretch(250, 140), RoadStretch(530, 40), RoadStretch(2070, 12), RoadStretch(290, 220),
        RoadStretch(180, 120),
        RoadStretch(270, 800), RoadStretch(100, 300), RoadStretch(500, 90),
    ),
    bumps=(SpeedBump(3695, 0.08, 1.6),),
    reception=Reception(first_fix_s=8, lost=((114, 118), (165, 190)), corrupted_s=30),
    offset_mps2=(0.21, -0.13, 0.16),
    seed=2009,
)


def main() -> None:
    """Write the drive to the file named on the command line."""
    record(simulate_drive(PLAN, read_vehicle(vehicle_file("rav4-2009"))), sys.argv[1])


if __name__ == "__main__":
    main()
