"""A folder is a catalogue: dropping in a file is the whole registration.

Problem: a list of what there is, kept beside the files themselves, is forgotten when a file is added. Solution: each
file of a folder offers one thing under an agreed name, and the folder is read. The thing is called after its file. The
one file that offers nothing is the one that says what such a thing is (``weighting.py`` for the offers ``WEIGHTING``);
a file whose name begins with ``_`` is a part of another one.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from typing import Any


class CatalogueError(Exception):
    """A file of a catalogue that offers nothing, or something of another name: file, and what was expected."""


def names(package: str, offer: str) -> list[str]:
    """The names of the files of ``package`` that are to offer ``offer``, in alphabetical order. None of them is run."""
    found = sorted(module.name for module in iter_modules(import_module(package).__path__))
    return [name for name in found if name != offer.lower() and not name.startswith("_")]


def offers(package: str, offer: str) -> dict[str, Any]:
    """What the files of ``package`` offer as ``offer``, by name, in alphabetical order. Raises CatalogueError."""
    found = {}
    for name in names(package, offer):
        module = import_module(f"{package}.{name}")
        if not hasattr(module, offer):
            raise CatalogueError(f"{module.__file__}: expected it to offer {offer}")
        found[name] = getattr(module, offer)
        if found[name].name != name:
            raise CatalogueError(f"{module.__file__}: expected {offer} to be named {name!r}, as the file is, "
                                 f"found {found[name].name!r}")
    return found
