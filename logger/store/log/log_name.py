"""The names of a logger's files, how they are found, and the number of a session.

Files are found in a folder of logs, in which a service may be writing, or on a stick with such folders.

``<session>-<part>.csv.part`` while a log is open, ``.csv`` when it is finished; its sidecar ``.json``; recordings
``<session>.dump.gz`` and ``<session>-<part>.dump.gz``, while open with ``.part`` too. What an export found in the way
of one of these on a stick is called ``<name>.<8 hex digits>.old``, those of one export with the same digits. A car
that was learned from the sessions up to one is ``car-<session>.yaml``.

The number of a session is never given twice, whatever is lost.
"""

import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from drivers.disk import FileSystem
from logger.store.log import atomic_file


def inside_of(folder: Path) -> Iterator[Path]:
    """Everything in a folder at any depth but links, which are not followed."""
    return (path for path in folder.rglob("*") if not path.is_symlink())


PART = ".part"
# Nine digits are more sessions and parts than any logger has; a longer number was not given by one.
_SESSION, _NUMBER = "[0-9]{5,9}", "[0-9]{3,9}"
_LOG = re.compile(rf"({_SESSION})-({_NUMBER})(?:(\.csv)(\.part)?|(\.json))")
_DUMP = re.compile(rf"({_SESSION})(?:-([0-9]{{1,9}}))?(\.dump(?:\.gz)?)(\.part)?")
CAR = re.compile(r"car-([0-9]{5,9})\.yaml")
_ASIDE = re.compile(r"(.+)\.([0-9a-f]{8})\.old")
_NUMBERED = re.compile(rf"({_SESSION})[-.]")


@dataclass(frozen=True)
class OwnFile:
    """What the name of a log, a sidecar or a recording says.

    part       0 for a recording that has none
    kind       ``.csv``, ``.json``, ``.dump`` or ``.dump.gz``
    is_open    it is being written, or was when the power went
    """

    session: int
    part: int
    kind: str
    is_open: bool

    @classmethod
    def of(cls, name: str) -> "OwnFile | None":
        """The name of a file, without its folder; None when it is none of a logger's."""
        if match := _LOG.fullmatch(name):
            return cls(int(match[1]), int(match[2]), match[3] or match[5], match[4] is not None)
        if match := _DUMP.fullmatch(name):
            return cls(int(match[1]), int(match[2] or 0), match[3], match[4] is not None)
        return None


def session_of(name: str) -> int | None:
    """The session whose number a name begins with, whatever else it says; None when it has none."""
    match = _NUMBERED.match(name)
    return int(match[1]) if match else None


def log_name(path: Path) -> OwnFile | None:
    """What the name of a log file says; None when it is not that of a log."""
    own = OwnFile.of(path.name)
    return own if own is not None and own.kind == ".csv" else None


def open_path(finished: Path) -> Path:
    """What a finished log or recording was called while it was open."""
    return finished.with_name(finished.name + PART)


def finished_path(part: Path) -> Path:
    """What a log or a recording is called once it is finished; that of a finished one is its own."""
    return part.with_name(part.name.removesuffix(PART)) if part.name.endswith(PART) else part


def old_name(name: str, digits: str) -> str:
    """What a file is called that an export sets aside on a stick."""
    return f"{name}.{digits}.old"


def name_before(old: str) -> str | None:
    """The name that a file had before an export set it aside; None for one that was not."""
    match = _ASIDE.fullmatch(old)
    return match[1] if match else None


def sidecar_path(log: Path) -> Path:
    """The name of a log's sidecar, open, finished, or set aside with it."""
    if match := _ASIDE.fullmatch(log.name):
        return log.with_name(old_name(sidecar_path(Path(match[1])).name, match[2]))
    return log.with_name(log.name.partition(".")[0] + ".json")


COUNTER_NAME = "last-session"
COUNTER = re.compile(COUNTER_NAME + r"(-[0-9]+)?")


def next_session(directory: Path, files: FileSystem | None = None,
                 warn: atomic_file.Warn = atomic_file.warn_in_journal) -> int:
    """A session number that no file of the folder has or ever had, stored before it is given out.

    It counts on from the counter file and from the names that are there, whichever is higher, so that neither a
    lost counter nor logs that were moved away bring a number back. A counter that cannot be read is put aside; where it
    cannot be replaced, another is kept. Raises ``OSError``.
    """
    files = files or FileSystem()
    names = [path.name for path in directory.iterdir()]
    counted = [_read_counter(files, directory / name, warn) for name in names if COUNTER.fullmatch(name)]
    number = max([0, *counted, *(session_of(name) or 0 for name in names)]) + 1
    _store_counter(files, directory / COUNTER_NAME, number, warn)
    return number


def _store_counter(files: FileSystem, path: Path, number: int, warn: atomic_file.Warn) -> None:
    """Store it under the first name that takes it."""
    text = str(number)
    for counter in atomic_file.numbered(path):
        is_in_the_way = atomic_file.is_taken(counter)
        try:
            atomic_file.replace_file(files, counter, [f"{text} {_check(text)}\n".encode()])
        except OSError as error:
            if not is_in_the_way:
                raise
            warn(f"{counter.name}: {atomic_file.file_words(error)}; it cannot be replaced, and another is kept")
        else:
            return


def _read_counter(files: FileSystem, path: Path, warn: atomic_file.Warn) -> int:
    """The last number given out; 0 when the file is missing, damaged or cannot be read."""
    most_bytes = 64
    try:
        with files.open(path) as file:
            text, _, check = file.read(most_bytes).decode("ascii", "replace").strip().partition(" ")
    except FileNotFoundError:
        return 0
    except OSError as error:
        atomic_file.set_aside_if_possible(files, path, atomic_file.disk_words(error), warn)
        return 0
    return int(text) if check == _check(text) and text.isdecimal() else 0


def _check(text: str) -> str:
    return f"{zlib.crc32(text.encode('ascii', 'replace')):08x}"
