"""What files offer: those of a folder of the package (``drivers.catalogue``), and a user's own.

A user's own file outside the package offers its one thing in the same way. It is Python that nobody has checked, so
whatever goes wrong in it becomes one line that names the file and the line in it, and whatever it prints goes to
stderr: stdout is for what the command was asked.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from re import fullmatch
from threading import Lock
from traceback import extract_tb
from types import ModuleType
from typing import Any

from drivers.catalogue import CatalogueError, offers
from logger.errors import BadInput, RidelogError, as_bad_input
from logger.files import SETTINGS_BYTES, read_bounded


def catalogue(package: str, offer: str) -> dict[str, Any]:
    """What the files of ``package`` offer as ``offer``, by name, in alphabetical order.

    Raises BadInput that names the file when one offers nothing, or something of another name than the file's.
    """
    with as_bad_input(kind=CatalogueError):
        return offers(package, offer)


def offered_by(path: Path, offer: str) -> Any:
    """What a user's own Python file offers as ``offer``. The file is run, once per call.

    Raises BadInput that names the file, and the line where there is one, for a file that cannot be read, is not Python,
    raises, or does not offer it.
    """
    source = read_bounded(path, SETTINGS_BYTES)
    module = ModuleType(f"ridelog_own_{path.stem}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # dataclasses and pickles look for it there
    with blamed_on(path):
        exec(compile(source, str(path), "exec"), module.__dict__)
        if not hasattr(module, offer):
            raise BadInput(f"{path}: expected it to offer {offer}, as in {offer} = ...")
        return getattr(module, offer)


class _Aside:
    """Sends what is printed to stderr as long as anybody is in it. Threads come and go in any order, so that the last
    one out, and not the first one in, gives stdout back."""

    def __init__(self) -> None:
        self._lock, self._inside, self._stdout = Lock(), 0, sys.stdout

    def __enter__(self) -> None:
        with self._lock:
            if not self._inside:
                self._stdout, sys.stdout = sys.stdout, sys.stderr
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if not self._inside:
                sys.stdout = self._stdout


_ASIDE = _Aside()


@contextmanager
def blamed_on(path: Path) -> Iterator[None]:
    """Turn whatever a user's own file raises, or is found to lack, into BadInput that names it, and the line in it
    that was reached; what it prints meanwhile goes to stderr."""
    try:
        with _ASIDE:
            yield
    except RidelogError:
        raise
    except SyntaxError as error:
        raise BadInput(f"{error.filename}:{error.lineno or 1}: expected Python, found {error.msg}") from error
    except (Exception, SystemExit) as error:
        lines = [frame.lineno for frame in extract_tb(error.__traceback__) if frame.filename == str(path)]
        lacks = fullmatch(r"Can't instantiate abstract class (\w+) (?:with|without).* (\S+)", str(error))
        what = (f"expected a function {lacks[2]} in the class {lacks[1]}" if lacks else
                f"{type(error).__name__}: {error}")
        said = f":{lines[-1]}: {what}" if lines else f": {error}"
        raise BadInput(f"{path}{said}") from error
