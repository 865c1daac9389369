"""Public records of real roads: which there are, what a folder of each holds, and what is made of it.

Every file of ``logger/api/datasets`` knows one set, offered as ``SET``: it reads the folder that a person downloaded
and compares what ridelog says of the car's acceleration with what a profiler measured. Nothing of a set is kept here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from logger.errors import BadInput
from logger.plugins import catalogue
from logger.studies.study import Effort, Result

PACKAGE, OFFER = "logger.api.datasets", "SET"


@dataclass(frozen=True)
class Asked:
    """What is asked of a set: its folder; the car, a name or a file, None: what the set takes; how much work."""

    folder: Path
    vehicle: str | None
    effort: Effort


@dataclass(frozen=True)
class RoadSet:
    """A public record of roads.

    name        as its file is called; people write it with - for _
    title       what it shows
    where       its authors or its place
    how         what is done with it, and whether it was run on the real files
    download    from where, under which licence
    run         make it; raises BadInput (``path: expected ..., found ...``) for a folder that is not it
    """

    name: str
    title: str
    where: str
    how: str
    download: str
    run: Callable[[Asked], Result]

    @property
    def called(self) -> str:
        """The name as people write it."""
        return self.name.replace("_", "-")

    def of(self, asked: Asked) -> Result:
        """What is found in a folder. BadInput says what was expected, and where to download it."""
        if not asked.folder.is_dir():
            found = "a file" if asked.folder.exists() else "nothing there"
            raise BadInput(f"{asked.folder}: expected a folder with {self.called}, found {found}: {self.download}")
        try:
            return self.run(asked)
        except FileNotFoundError as error:
            raise BadInput(f"{error}: {self.download}") from None


def road_sets() -> dict[str, RoadSet]:
    """All there are, by the names that people write."""
    found: Iterable[RoadSet] = catalogue(PACKAGE, OFFER).values()
    return {one.called: one for one in found}


def expected_files(folder: Path, pattern: str, what: str) -> list[Path]:
    """Files of a pattern anywhere below a folder, in order of their names. FileNotFoundError with what was expected."""
    found = sorted(one for one in folder.rglob(pattern) if one.is_file())
    if not found:
        raise FileNotFoundError(f"{folder}: expected {what} ({pattern}), found none")
    return found
