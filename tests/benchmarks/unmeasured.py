"""The lab without a profile on cases of the independent simulator: three drives each over one road at three speeds.

Cases hide one of the effects that such drives can show, or nothing; another few hide one that they cannot show, and
must not be given another's name.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from logger.lab.likelihood.priors import Tolerance
from logger.lab.unknown_road.diagnosis import UnknownRoadDiagnosis, diagnose_same_road
from logger.lab.unknown_road.same_road import SameRoad
from logger.profiles.track import Track
from logger.runs import Run
from logger.store.formats.drive_file import read_drive
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle

from .figures import Figures

FOUND = ("sensor_mount_resonance", "tire_damping", "occupant", "body_bending", "sensor_bandwidth",
         "top_mount_compliance", "payload", "sensor_offset", "cg_shift", "time_offset")
NOTHING_SEEDS = range(50, 57)
ABSORBED = ("sensor_gain", "tire_enveloping", "speed_scale")
FIRST_SEED = 1


def diagnosed(seed: int, effect: str | None, folder: Path) -> UnknownRoadDiagnosis:
    """A case, from files."""
    from ..validation.cases.case_files import write_case
    from ..validation.cases.same_road import same_road_case

    write_case(same_road_case(seed, effect, length_m=200.0), folder)
    drives = [read_drive(one / "drive.csv") for one in sorted(folder.glob("run*"))]
    runs = [Run(one.path.parent.name, one.rate_hz, one.accel_z_mps2, one.distance_m, one.speed_mps,
                Track(1.0, np.zeros(2))) for one in drives]
    problem = SameRoad(runs, read_vehicle(folder / "vehicle.yaml"), Tolerance())
    return diagnose_same_road(problem, shipped_effects())


def reported(seed: int, effect: str | None) -> tuple[list[str], tuple[str, ...]]:
    """The verdict of a case, and what its first effect cannot be distinguished from; printed."""
    started = time.process_time()
    with TemporaryDirectory() as folder:
        found = diagnosed(seed, effect, Path(folder))
    verdict = [one.effect.name for one in found.missing]
    alike = found.candidates[0].confused_with if verdict else ()
    print(f"  {effect or 'nothing'} ({seed}): {', '.join(verdict) or 'nothing'}"
          f"{' or ' + ', '.join(alike) if alike else ''}; {found.excess + 1:.2f} of the noise; NRMSE "
          f"{', '.join(f'{one.error:.3f}' for one in found.steps)}; {time.process_time() - started:.0f} s", flush=True)
    return verdict, alike


def main() -> int:
    """Print all figures."""
    figures = Figures()
    right = alarms = extra = 0
    for seed, effect in enumerate(FOUND, FIRST_SEED):
        verdict, alike = reported(seed, effect)
        right += bool(verdict) and effect in (verdict[0], *alike)
        extra += len(verdict) > 1
    for seed in NOTHING_SEEDS:
        alarms += bool(reported(seed, None)[0])
    wrong = sum(bool(reported(seed, effect)[0]) for seed, effect in enumerate(ABSORBED, FIRST_SEED))
    figures.at_least("right effect first, or named as not distinguishable", right / len(FOUND), 0.8, "share")
    figures.at_most("more than the one effect named", extra / len(FOUND), 0.2, "share")
    figures.at_most("false alarms where nothing is missing", alarms / len(NOTHING_SEEDS), 0.05, "share")
    figures.at_most("effects that the road takes, named as others", wrong / len(ABSORBED), 0.34, "share")
    return figures.missed


if __name__ == "__main__":
    sys.exit(bool(main()))
