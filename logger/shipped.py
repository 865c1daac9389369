"""Files that come with the program.

Problem. ``config/`` and ``systemd/`` stand at the top of the repository, where people look for them; an installed
command has no repository around it. Solution: the installation puts a copy inside the package, and the copy is
taken where there is one, the original otherwise.
"""

from importlib import metadata
from pathlib import Path

from drivers.errors import shortened
from logger.errors import BadInput

_PACKAGE = Path(__file__).parent


def shipped(folder: str) -> Path:
    """The folder ``config`` or ``systemd`` of this installation."""
    installed = _PACKAGE / folder
    return installed if installed.is_dir() else _PACKAGE.parent / folder


def vehicle_names() -> list[str]:
    """Names of the vehicles that come with the program, in alphabetical order."""
    return sorted(path.stem for path in (shipped("config") / "vehicles").glob("*.yaml"))


def vehicle_file(name: str) -> Path:
    """The file of a vehicle that comes with the program. Raises BadInput, which lists the names there are."""
    if name not in vehicle_names():
        raise BadInput(f"no vehicle {shortened(name)} comes with ridelog; expected a path to a .yaml file, or one of: "
                       f"{', '.join(vehicle_names())}")
    return shipped("config") / "vehicles" / f"{name}.yaml"


def is_path(word: str) -> bool:
    """Whether a word that may be a path or a name of something that comes with the program is a path: it has a / in it
    or ends in .yaml."""
    return "/" in word or word.endswith(".yaml")


def vehicle_path(word: str, beside: Path = Path()) -> Path:
    """The file of a vehicle by the word that a person gave: a path (``is_path``), seen from ``beside``, or a name.

    Raises BadInput for a name that is not known here. Whether there is a file at a path shows when it is read.
    """
    return beside / word if is_path(word) else vehicle_file(word)


def version() -> str:
    """The version that is installed, or ``unknown`` when the program runs from a folder that was not."""
    try:
        return metadata.version("ridelog")
    except metadata.PackageNotFoundError:
        return "unknown"
