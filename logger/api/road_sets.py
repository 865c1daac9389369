"""Studies of public records of real roads: what a folder has to hold, and what is said where it does not.

Every file of ``logger/api/datasets`` knows one set and offers a study of it: it reads the folder that a person
downloaded and compares what ridelog says of the car's acceleration with what a profiler measured. Nothing of a set is
kept here.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from logger.errors import BadInput
from logger.shipped import vehicle_path
from logger.store.formats.vehicle_file import read_model
from logger.studies.study import Effort, Result

NOT_RUN = "Only a person can download the real files; ridelog's developers have not run them and claim nothing of them."


def from_folder(called: str, download: str, read: Callable[[Path, Effort], Result]) -> Callable[[Effort], Result]:
    """A study's ``run`` that reads a folder: where that is not what it should be, it says where to download it.

    ``read`` raises FileNotFoundError for a file that is not there, and BadInput for one that is something else.
    """
    def run(effort: Effort) -> Result:
        if effort.folder is None or not effort.folder.is_dir():
            found = "a file" if effort.folder is not None and effort.folder.exists() else "nothing there"
            raise BadInput(f"{effort.folder}: expected a folder with {called}, found {found}: {download}")
        if effort.vehicle is not None:
            read_model(vehicle_path(effort.vehicle))  # refused now, not after an hour
        try:
            return read(effort.folder, effort)
        except FileNotFoundError as error:
            raise BadInput(f"{error}: {download}") from None

    return run


def expected_files(folder: Path, pattern: str, what: str) -> list[Path]:
    """Files of a pattern anywhere below a folder, in order of their names. FileNotFoundError with what was expected."""
    found = sorted(one for one in folder.rglob(pattern) if one.is_file())
    if not found:
        raise FileNotFoundError(f"{folder}: expected {what} ({pattern}), found none")
    return found
