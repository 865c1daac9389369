"""A bench quarter car of 2.5 kg with dry friction, from an integrator that shares nothing with ridelog: what is named,
how far off the force is, and how near to the noise the errors come, with one signal and with three."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import ridelog

from ..support.drives.bench_rig import RATE_HZ, Rig, random_table, shaken, swept_table, write_run
from .figures import Figures

FORCE_N, LASTS_S, OFF = 0.5, 20.0, 1.02
NOISE_MPS2, WHEEL_NOISE_MPS2, TRAVEL_NOISE_M = 0.01, 0.02, 2e-5
SIGNALS = ("signals:\n  wheel_accel_mps2: {measures: acceleration, of: front_wheel}\n"
           "  front_travel_m: {measures: travel, of: front_suspension}\n")
TABLES: Mapping[str, np.ndarray] = {"random": random_table(LASTS_S, 7), "sweep": swept_table(LASTS_S)}
GOAL_DEVIATIONS, GOAL_OVER_NOISE, GOAL_S = 3.0, 1.3, 60.0


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    with TemporaryDirectory() as folder:
        vehicle = Path(folder) / "rig.yaml"
        vehicle.write_text(Rig().vehicle_yaml(OFF), "utf-8")
        for name, table in TABLES.items():
            for signals in (False, True):
                words = f"{name}, {'three signals' if signals else 'one signal'}"
                solved(figures, words, vehicle, drive(Path(folder) / f"{name}-{signals}", table, signals))
    return 1 if figures.missed else 0


def drive(folder: Path, table: np.ndarray, signals: bool) -> Path:
    """A run of the rig with friction."""
    seen, rng = shaken(Rig(friction_n=FORCE_N), table), np.random.default_rng(11)
    n = round(LASTS_S * RATE_HZ)
    more = {"wheel_accel_mps2": seen.wheel_mps2 + rng.normal(0, WHEEL_NOISE_MPS2, n),
            "front_travel_m": seen.travel_m + rng.normal(0, TRAVEL_NOISE_M, n)}
    write_run(folder, seen, NOISE_MPS2, 8, more if signals else None)
    if signals:
        (folder / "run.yaml").write_text(SIGNALS, "utf-8")
    return folder


def solved(figures: Figures, words: str, vehicle: Path, run: Path) -> None:
    """Name it, add it, look at the errors."""
    began_s = time.perf_counter()
    verdict = ridelog.diagnose(vehicle, run).verdict
    took_s = time.perf_counter() - began_s
    found = ridelog.add_effect("dry_friction", vehicle, run)
    force_n, error_n = (some["friction_force_n"] for some in (found.parameters, found.standard_errors))
    figures.at_least(f"{words}: dry_friction alone is named", float(verdict == ("dry_friction",)), 1.0, "")
    figures.at_most(f"{words}: force off by", abs(force_n - FORCE_N) / error_n, GOAL_DEVIATIONS, "sd")
    figures.at_most(f"{words}: its standard error", error_n / FORCE_N, 0.02, "")
    figures.at_most(f"{words}: error over noise", found.error_after / found.noise_floor_error, GOAL_OVER_NOISE, "")
    for name, one in found.as_json()["signals"].items():
        figures.at_most(f"{words}: {name}", one["error_after"] / one["noise_floor_error"], GOAL_OVER_NOISE, "")
    figures.at_most(f"{words}: a diagnosis takes", took_s, GOAL_S, "s")


if __name__ == "__main__":
    sys.exit(main())
