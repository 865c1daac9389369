"""A folder is a catalogue: dropping in a file is the whole registration, and so is installing a package that has one.

Problem: a list of what there is, kept beside the files themselves, is forgotten when a file is added. Solution: each
file of a folder offers one thing under an agreed name, and the folder is read. The thing is called after its file. The
one file that offers nothing is the one that says what such a thing is (``weighting.py`` for the offers ``WEIGHTING``);
a file whose name begins with ``_`` is a part of another one. Another installed package offers the same by an entry
point that is called as the thing is, in a group called after the folder: ``ridelog.effects`` beside
``logger.vehicle.effects``.
"""

from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pkgutil import iter_modules
from typing import Any


class CatalogueError(ValueError):
    """A file of a catalogue, or an installed package, that offers nothing or another name, and what was expected."""


def names(package: str, offer: str) -> list[str]:
    """The names of the files of ``package`` that are to offer ``offer``, in alphabetical order. None of them is run."""
    found = sorted(module.name for module in iter_modules(import_module(package).__path__))
    return [name for name in found if name != offer.lower() and not name.startswith("_")]


def offers(package: str, offer: str) -> dict[str, Any]:
    """What the files of ``package`` offer as ``offer``, by name, in alphabetical order, then what other installed
    packages do. Raises CatalogueError."""
    found: dict[str, Any] = {}
    for name in names(package, offer):
        module = import_module(f"{package}.{name}")
        if not hasattr(module, offer):
            raise CatalogueError(f"{module.__file__}: expected it to offer {offer}")
        found[name] = getattr(module, offer)
        if found[name].name != name:
            raise CatalogueError(f"{module.__file__}: expected {offer} to be named {name!r}, as the file is, "
                                 f"found {found[name].name!r}")
    for entry, thing in _installed(package):
        whose = f"{entry.value} (entry point {entry.name!r} of {entry.group}, package {entry.dist and entry.dist.name})"
        if entry.name in found:
            raise CatalogueError(f"{whose}: expected a name of its own, there is {entry.name!r} already")
        if getattr(thing, "name", None) != entry.name:
            raise CatalogueError(f"{whose}: expected {offer} to be named as its entry point is, "
                                 f"found {getattr(thing, 'name', thing)!r}")
        found[entry.name] = thing
    return found


def _installed(package: str) -> Iterator[tuple[EntryPoint, Any]]:
    """The entry points of the group of ``package``, in alphabetical order, and what they name. CatalogueError for one
    that cannot be imported, whatever it raises."""
    for entry in sorted(entry_points(group=f"ridelog.{package.rpartition('.')[2]}"), key=lambda one: one.name):
        try:
            yield entry, entry.load()
        except Exception as error:
            raise CatalogueError(f"{entry.value} (entry point {entry.name!r} of {entry.group}): expected it to be "
                                 f"imported, found {type(error).__name__}: {error}; fix or uninstall its package"
                                 ) from error
