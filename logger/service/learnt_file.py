"""What drives taught, from one start of the service to the next: a small file in the folder of the logs.

It is written every few minutes, as a car cuts the power. A file that cannot be read is as none, and one that cannot be
written is tried again.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from drivers.disk import FileSystem
from logger.store.log.atomic_file import replace_file
from logger.units import US_PER_S

SAVE_EVERY_US = 120 * US_PER_S
_LARGEST_BYTES = 1000
_MOST_DRIVES = 10**9

log = logging.getLogger(__name__)
Learnt = TypeVar("Learnt")


def value_of(fields: Any, keys: Sequence[str], least: float, most: float) -> tuple[float, float, int]:
    """A value, its standard error and the number of drives that it was learnt over, by these keys; one that is missing
    is 0. ValueError where the value is not from ``least`` to ``most``, or the others cannot be."""
    value, std, drives = (fields.get(key, 0) for key in keys)
    numbers = [one for one in (value, std) if isinstance(one, (int, float)) and not isinstance(one, bool)]
    if len(numbers) < 2 or not (least <= value <= most and 0 <= std <= most) \
            or isinstance(drives, bool) or not isinstance(drives, int) or not 0 <= drives < _MOST_DRIVES:
        raise ValueError(f"expected {keys[0]} and {keys[1]} from {least:g} to {most:g}, and a number of drives")
    return float(value), float(std), drives


def drives_words(drives: int) -> str:
    """How many drives something was learnt over."""
    return "learnt over 1 drive" if drives == 1 else f"learnt over {drives} drives"


class LearntFile:
    """One such file.

    what     is learnt, for messages: "the receiver's delay"
    saved    what is in it already
    """

    def __init__(self, path: Path, what: str, files: FileSystem | None = None,
                 saved: Mapping[str, Any] | None = None) -> None:
        self._path, self._what = path, what
        self._files = files or FileSystem()
        self._saved = saved
        self._tried_us: int | None = None
        self._failed = False

    def read(self, meaning: Callable[[Any], Learnt | None]) -> Learnt | None:
        """What earlier drives left, as ``meaning`` makes it of the file's content (ValueError for what cannot be); None
        where there is nothing that can be read."""
        try:
            with self._files.open(self._path) as file:
                return meaning(json.loads(file.read(_LARGEST_BYTES)))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, RecursionError) as error:
            log.warning("%s: what was learnt of %s cannot be read, it is learnt again (%s)", self._path, self._what,
                        error)
            return None

    def tend(self, now_us: int, save: Callable[[], None]) -> None:
        """To be called now and then: saves every few minutes."""
        if self._tried_us is None:
            self._tried_us = now_us
        if now_us - self._tried_us >= SAVE_EVERY_US:
            self._tried_us = now_us
            save()

    def save(self, fields: Mapping[str, Any]) -> None:
        """Put what is learnt into the file, whole, if it is new."""
        if fields == self._saved:
            return
        try:
            replace_file(self._files, self._path, [(json.dumps(fields) + "\n").encode("ascii")])
            self._saved, self._failed = dict(fields), False
        except OSError as error:
            if not self._failed:
                log.warning("%s: what was learnt of %s cannot be written: %s", self._path, self._what, error.strerror)
            self._failed = True
