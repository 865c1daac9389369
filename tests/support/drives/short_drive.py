"""A drive that many tests share: 70 s with a halt, a short loss of fix, a damaged sentence and a bump."""

from __future__ import annotations

from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle

from .simulated_drive import DemoDrive, DrivePlan, Reception, RoadStretch, SpeedBump, simulate_drive

SHORT_PLAN = DrivePlan(
    speed_knots=((0, 0), (3, 0), (9, 10), (30, 12), (36, 0), (41, 0), (47, 14), (70, 14)),
    stretches=(RoadStretch(200, 60), RoadStretch(200, 250)),
    bumps=(SpeedBump(330, 0.05, 1.5),),
    reception=Reception(first_fix_s=6, lost=((20, 24),), corrupted_s=15),
    seed=5,
)


def short() -> DemoDrive:
    """It, as the RAV4 felt it."""
    return simulate_drive(SHORT_PLAN, read_vehicle(vehicle_file("rav4-2009")))
