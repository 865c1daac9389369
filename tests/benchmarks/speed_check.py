"""A receiver whose speed is wrong by a factor: how soon it is found, and how often a good one is doubted."""

from __future__ import annotations

import sys

import numpy as np

from logger.service.doubted_spans import SpeedCheck

from ..support.drives.receivers import town_drive
from .figures import Figures

GOOD_HOURS = 10
FACTORS = {0.5: 30, 0.6: 40, 0.7: 60, 0.8: 120, 1.2: 150, 1.3: 90, 1.4: 60, 2.0: 30}
DRIVES = 20


def doubted_s(factor: float, seed: int, seconds: int = 1200) -> float:
    """Seconds of driving until the receiver is doubted."""
    check, driven_s = SpeedCheck(), 0
    for timed in town_drive(seconds, seed, factor):
        check.take(timed)
        driven_s += (timed.fix.speed_mps or 0.0) > 2.0
        if check.doubt:
            return driven_s
    return float("inf")


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    for factor, goal_s in FACTORS.items():
        times_s = [doubted_s(factor, seed) for seed in range(DRIVES)]
        print(f"  factor {factor}: found after {max(times_s):.0f} s of driving at most")
        figures.at_most(f"a speed that is wrong by {factor}, median", float(np.median(times_s)), goal_s, "s")
    alarm_s = 0
    for seed in range(100, 100 + GOOD_HOURS):
        check, times_us = SpeedCheck(), []
        for timed in town_drive(3600, seed):
            check.take(timed)
            times_us.append(timed.t_us)
        alarm_s += int(check.spans.during(np.array(times_us)).sum())
    figures.at_most(f"false alarms in {GOOD_HOURS} h of a good receiver", alarm_s, 60, "s")
    return 1 if figures.missed else 0


if __name__ == "__main__":
    sys.exit(main())
