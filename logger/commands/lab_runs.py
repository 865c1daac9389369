"""Runs that the lab's commands are given: folders on the command line, read and checked together."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from logger.errors import BadInput

if TYPE_CHECKING:
    from logger.lab.prediction import Runs
    from logger.store.drive_file import Run as Drive

_SAME_RATE = 1e-6
LEAST_S = 5.0
_SKIP_S = 2.0  # what the lab leaves out of each run
_MOST_MEAN_MPS2 = 2.0


def lab_runs(folders: Sequence[Path]) -> Runs:
    """The runs in some folders, of one sample rate.

    Raises BadInput for one that cannot be read, is there twice, is shorter than 5 s, has another rate than the first,
    stands nowhere on its own profile, or recorded nothing.
    """
    from logger.lab.prediction import Run, Runs
    from logger.store.drive_file import read_run

    drives: list[Drive] = []
    for folder in folders:
        if folder.resolve() in [one.path.resolve() for one in drives]:
            raise BadInput(f"{folder}: expected each run once")
        drives.append(_checked(read_run(folder), drives))
    return Runs([Run(str(one.path), one.rate_hz, one.accel_z_mps2, one.distance_m, one.speed_mps, one.track)
                 for one in drives])


def _checked(drive: Drive, others: Sequence[Drive]) -> Drive:
    """A drive that the lab can use beside the others."""
    file = drive.path / "drive.csv"
    lasts_s = len(drive.time_s) / drive.rate_hz
    if lasts_s < LEAST_S:
        raise BadInput(f"{file}: expected a drive of {LEAST_S:g} s or longer, found {lasts_s:.3g} s")
    if others and abs(drive.rate_hz / others[0].rate_hz - 1) > _SAME_RATE:
        raise BadInput(f"{file}: expected {others[0].rate_hz:g} samples a second, as in {others[0].path}, found "
                       f"{drive.rate_hz:g}")
    first_m, last_m = float(drive.distance_m.min()), float(drive.distance_m.max())
    if last_m < drive.track.start_m or first_m > drive.track.end_m:
        raise BadInput(f"{file}: expected distances on the profile, {drive.track.start_m:g} to {drive.track.end_m:g} "
                       f"m, found {first_m:g} to {last_m:g} m")
    counted = drive.accel_z_mps2[int(_SKIP_S * drive.rate_hz):]
    if not counted.any():
        raise BadInput(f"{file}: expected accelerations after the first {_SKIP_S:g} s, found zeros only")
    if abs(counted.mean()) > _MOST_MEAN_MPS2:
        raise BadInput(f"{file}: expected gravity to be removed, found {counted.mean():.3g} m/s2 on average")
    return drive
