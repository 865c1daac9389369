"""A case whose last run is kept back: what a law is learned from, and what it is judged on.

Of a single run the last third is kept back. The reference is the true car with all that it has, driven along the
recorded distance without any fit: as near as anyone comes who knows the law and believes that distance, which is what
``ridelog compare`` does with a model as it stands. ``floor_error`` is the noise alone: nobody comes nearer, whatever is
fitted.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from shutil import copy

import numpy as np

from ..simulator.cars import STEP_S
from ..simulator.recorder import RATE_HZ
from ..simulator.scene import clean_acceleration
from .case_files import write_case
from .random_case import SKIPPED_S, Case

_KEPT_SHARE = 1 / 3
DRIVE, PROFILE = "drive.csv", "profile.csv"


@dataclass(frozen=True)
class KeptBack:
    """Folders of the runs that may be learned from, and of the one that is kept back with the errors there."""

    truth: dict[str, object]
    vehicle: Path
    runs: tuple[Path, ...]
    kept: Path
    attainable_error: float
    floor_error: float


def write_kept_back(case: Case, folder: Path) -> KeptBack:
    """Write a case as ``write_case``, and part it."""
    truth, whole = write_case(case, folder), len(case.recordings) > 1
    last = folder / f"run{len(case.recordings)}"
    count = len(case.recordings[-1].t_s)
    begins = 0 if whole else round((1 - _KEPT_SHARE) * count)
    if whole:
        runs, kept = [folder / f"run{number}" for number in range(1, len(case.recordings))], last
    else:
        runs, kept = [_part(last, folder / "first", 0, begins)], _part(last, folder / "kept", begins, count)
    return KeptBack(truth, folder / "vehicle.yaml", tuple(runs), kept, *_errors(case, begins))


def _part(run: Path, folder: Path, first: int, end: int) -> Path:
    """A copy of the samples from ``first`` until ``end``."""
    folder.mkdir()
    head, *rows = (run / DRIVE).read_text("utf-8").splitlines(keepends=True)
    (folder / DRIVE).write_text(head + "".join(rows[first:end]), "utf-8")
    copy(run / PROFILE, folder / PROFILE)
    return folder


def _errors(case: Case, begins: int) -> tuple[float, float]:
    """Of the truth along the recorded distance, and of the noise, on what is kept back of the last run."""
    run, drive = case.recordings[-1], case.scene.drives[-1]
    believed = clean_acceleration(case.scene, drive, 2 * STEP_S, (run.distance_m, run.speed_mps))
    counts = slice(begins + int(SKIPPED_S * RATE_HZ), None)
    size = np.sqrt(np.mean(run.accel_z_mps2[counts] ** 2))
    attainable, floor = (float(np.sqrt(np.mean((run.accel_z_mps2 - one)[counts] ** 2)) / size)
                         for one in (believed, run.clean_mps2))
    return attainable, floor
