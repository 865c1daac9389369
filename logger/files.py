"""Files as a whole: read up to a size that fits the machine, and written so that an older one survives.

Problem: a file that somebody else made may be of any size; and a disk that is full, fails or is read-only shows so in
the middle of a file, when an older one of its name is gone already. Solution: reading stops at a limit. Whatever a
command writes is written here: beside its place, waited for, and renamed into it; what fails leaves nothing behind,
and says which file it was. What is no file, such as a pipe, is written as it is.

Every change goes through ``drivers.disk``, as in the car: so a test can refuse any of them.
"""

import errno
import hashlib
import json
import os
import shutil
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from drivers.disk import FileSystem, open_regular
from logger.errors import BadInput

DISK = FileSystem()  # Where all of it goes
BESIDE = ".ridelog-"  # How files begin that are being written; one that a killed process has left may be removed
SETTINGS_BYTES = 256 * 1024  # Most of a file that a person writes
STATE_BYTES = 4 * SETTINGS_BYTES  # Most of one that a program keeps, such as settings and vehicle beside a log
MAP_BYTES = 256 << 20  # Most of a file that is unfolded whole in memory, as JSON is
_BLOCK_BYTES = 1 << 20  # of the size of a large file's extents; a call costs nothing beside it
_AGREED: "ContextVar[_Agreed | None]" = ContextVar("_AGREED", default=None)
_WRITTEN: ContextVar[list[Path] | None] = ContextVar("_WRITTEN", default=None)


def read_bounded(path: Path | str, max_bytes: int) -> bytes:
    """All bytes of a file. Raises BadInput for one that cannot be read or is longer than ``max_bytes``."""
    grown_bytes = 1 << 20
    try:
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            too_long = size > max_bytes
            data = b"" if too_long else file.read(size + 1)  # what is asked for is held, also where nothing comes
            while size < len(data) <= max_bytes and (more := file.read(grown_bytes)):  # it grows, or tells no size
                data += more
    except OSError as error:
        raise BadInput(f"{path}: expected a readable file ({error.strerror})") from None
    if too_long or len(data) > max_bytes:
        raise BadInput(f"{path}: expected at most {max_bytes} bytes")
    return data


def file_in(path: Path | str, name: str) -> Path:
    """A file or, of a folder, the file of that name in it. Raises BadInput for a folder without one."""
    place = Path(path)
    if not place.is_dir():
        return place
    if not (place / name).is_file():
        raise BadInput(f"{path}: expected a file, or a folder with {name}, found a folder without it")
    return place / name


# --- writing ---


def write_file(path: Path | str, blocks: Iterable[bytes]) -> None:
    """Write a whole file, in place of an older one, whose mode it gets, or not at all. A link stays, and what it leads
    to is written. Raises OSError with the file's name."""
    _write(Path(path), blocks, is_result=True)


def write_text(path: Path | str, text: str | Iterable[str], encoding: str = "utf-8") -> None:
    """The same of text, or of its pieces."""
    write_file(path, (piece.encode(encoding) for piece in ([text] if isinstance(text, str) else text)))


def replace_bytes(path: Path, data: bytes, mode: int | None = None) -> None:
    """The same of a file that nobody asked for by name, such as one of many in a folder. With a ``mode`` it gets that,
    and takes the place of a link."""
    _write(path, [data], is_result=False, mode=mode)


@contextmanager
def together() -> Iterator[None]:
    """All files that are written in here are new, or none is. Raises OSError as ``write_file``, at the end too."""
    if _AGREED.get() is not None:
        yield
        return
    agreed = _Agreed([], [])
    before = _AGREED.set(agreed)
    try:
        yield
        _put(agreed.changes)
    except BaseException:
        for one in agreed.changes:
            _remove(one.beside)
        for folder in reversed(agreed.folders):
            with suppress(OSError):
                folder.rmdir()
        raise
    finally:
        _AGREED.reset(before)


def make_folder(path: Path) -> None:
    """Make a folder, and those that it is in, where there is none. Raises OSError with its name."""
    with naming(path):
        missing = [folder for folder in (path, *path.parents) if not folder.exists()]
        path.mkdir(parents=True, exist_ok=True)
    if (agreed := _AGREED.get()) is not None:
        agreed.folders.extend(reversed(missing))


def remove_file(path: Path) -> None:
    """Take a file away, if it is there, and its folder where nothing else is in it. Raises OSError with its name."""
    if path.exists():
        _agree(_Change(path, path, None, is_result=False))


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """A folder to fill, which takes the place of an older one with all that is in that, or is gone when this fails.
    Raises OSError with the folder's name."""
    with naming(path):
        place = _place(path)
        new = _free(place)
        new.mkdir()
        old = _free(place)
        outside = _WRITTEN.set(None), _AGREED.set(None)
        try:
            yield new
            if place.exists():
                new.chmod(stat.S_IMODE(place.stat().st_mode))
                DISK.rename(place, old)
            DISK.rename(new, place)
            shutil.rmtree(old, ignore_errors=True)
        finally:
            _WRITTEN.reset(outside[0])
            _AGREED.reset(outside[1])
            if old.exists() and not place.exists():
                with suppress(OSError):
                    old.rename(place)
            shutil.rmtree(new, ignore_errors=True)
    note(path)


def why_not_written(path: Path) -> str:
    """Why a file cannot be written, as far as that shows without writing it; empty where it can. A file is made beside
    it and taken away: permissions alone do not show all that root, or a file system, cannot do."""
    try:
        place = _place(path)
        if (place.exists() or not _is_file(place)) and not os.access(place, os.W_OK):
            return os.strerror(errno.EACCES)
        if _is_file(place):
            beside = _free(place)
            beside.touch(exist_ok=False)
            beside.unlink()
    except OSError as error:
        return f"no file can be made in {path.parent}: {error.strerror}"
    return ""


@contextmanager
def written_files() -> Iterator[list[Path]]:
    """Every file, or whole folder, that is written in here, in its turn and by the name that was asked for."""
    found: list[Path] = []
    before = _WRITTEN.set(found)
    try:
        yield found
    finally:
        _WRITTEN.reset(before)


def note(path: Path) -> None:
    """Say that this was written, for ``written_files``."""
    found = _WRITTEN.get()
    if found is not None and path not in found:
        found.append(path)


@contextmanager
def naming(path: Path | str) -> Iterator[None]:
    """Give an OSError the name of the file that is written in here."""
    try:
        yield
    except OSError as error:
        error.filename, error.filename2 = str(path), None
        raise


@dataclass(frozen=True)
class _Change:
    """A file that is on the disk ``beside`` the place that it is to have; None: what has that place is to go."""

    asked: Path
    place: Path
    beside: Path | None
    is_result: bool


@dataclass(frozen=True)
class _Agreed:
    """What is to happen together, and the folders that were made for it."""

    changes: list[_Change]
    folders: list[Path]


def _write(path: Path, blocks: Iterable[bytes], is_result: bool, mode: int | None = None) -> None:
    with naming(path):
        place = _place(path) if mode is None else path
        if not _is_file(place):
            _pass_on(place, blocks)
            if is_result:
                note(path)
            return
        beside = _written_beside(place, blocks, mode)
    _agree(_Change(path, place, beside, is_result))


def _agree(change: _Change) -> None:
    agreed = _AGREED.get()
    if agreed is None:
        _put([change])
    else:
        agreed.changes.append(change)


def _place(path: Path) -> Path:
    """Where links lead: a name that is none, or that of an open file (``/dev/stdout`` leads below ``/proc``)."""
    most_links = 40  # So many links are followed, as the system does (path_resolution(7)).
    place = path
    for _ in range(most_links):
        place = Path(os.path.realpath(place.parent), place.name)
        if place.parts[:2] == ("/", "proc") or not place.is_symlink():
            return place
        place = place.parent / place.readlink()
    raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))


def _is_file(place: Path) -> bool:
    """True for a file, and where there is nothing yet; False for a device, a pipe, a folder, a file that is open."""
    return place.parts[:2] != ("/", "proc") and (not place.exists() or place.is_file())


def _pass_on(place: Path, blocks: Iterable[bytes]) -> None:
    """Write into what is no file."""
    mine = place.parent == Path(f"/proc/{os.getpid()}/fd")
    descriptor = os.dup(int(place.name)) if mine else os.open(place, os.O_WRONLY | os.O_CLOEXEC | os.O_NOCTTY)
    try:
        for block in _large(blocks):
            DISK.write(descriptor, block)
    finally:
        DISK.close(descriptor)


def _written_beside(place: Path, blocks: Iterable[bytes], mode: int | None) -> Path:
    """A file on the disk, in the folder that it is to have its name in."""
    old = place.stat() if mode is None and place.exists() else None
    if old is not None and not os.access(place, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    beside, descriptor = _created(place)
    try:
        try:
            if old is not None:
                with suppress(PermissionError):  # it is another's, or the file system knows neither
                    os.fchown(descriptor, old.st_uid, old.st_gid)
                with suppress(PermissionError):
                    os.fchmod(descriptor, stat.S_IMODE(old.st_mode))
            if mode is not None:
                os.fchmod(descriptor, mode)
            for block in _large(blocks):
                DISK.write(descriptor, block)
            DISK.sync(descriptor)
        finally:
            DISK.close(descriptor)
    except BaseException:
        _remove(beside)
        raise
    return beside


def _large(blocks: Iterable[bytes]) -> Iterator[bytes]:
    """The same bytes in blocks that are worth a call of the system each."""
    waiting = bytearray()
    for block in blocks:
        waiting += block
        if len(waiting) >= _BLOCK_BYTES:
            yield bytes(waiting)
            waiting.clear()
    yield bytes(waiting)


def _created(place: Path) -> tuple[Path, int]:
    while True:
        beside = _free(place)
        with suppress(FileExistsError):
            return beside, DISK.create(beside, new=True)


def _free(place: Path) -> Path:
    """A name beside a file that is nobody's; it is no longer than a file system takes, however long the file's is."""
    names = (place.with_name(f"{BESIDE}{os.getpid()}-{number}") for number in count(1))
    return next(name for name in names if not os.path.lexists(name))


def _put(changes: list[_Change]) -> None:
    """Rename files into their places: all of them, or none."""
    undo: list[tuple[Path, Path | None]] = []
    try:
        for one in changes:
            with naming(one.asked):
                if one is not changes[-1]:
                    undo.append((one.place, _kept(one.place)))
                if one.beside is None:
                    DISK.remove(one.place)
                else:
                    DISK.rename(one.beside, one.place)
    except BaseException:
        for place, kept in reversed(undo):
            _take_back(place, kept)
        for one in changes:
            _remove(one.beside)
        raise
    for _, kept in undo:
        _remove(kept)
    for one in changes:
        if one.is_result:
            note(one.asked)
        if one.beside is None:
            with suppress(OSError):
                one.place.parent.rmdir()


def _kept(place: Path) -> Path | None:
    """The older file under another name; None where there is none. Raises OSError."""
    if not place.exists():
        return None
    kept = _free(place)
    try:
        os.link(place, kept)
    except OSError:  # FAT knows no two names of a file
        try:
            shutil.copy2(place, kept)
        except BaseException:
            _remove(kept)
            raise
    return kept


def _take_back(place: Path, kept: Path | None) -> None:
    """Put the older file in its place again, as far as the disk lets us."""
    with suppress(OSError):
        if kept is None:
            place.unlink()
            return
        try:
            kept.replace(place)
        except OSError:  # a disk that renames nothing any more
            place.unlink()
            os.link(kept, place)
        kept.unlink(missing_ok=True)


def _remove(path: Path | None) -> None:
    if path is not None:
        with suppress(OSError):
            path.unlink(missing_ok=True)


def json_sha256(content: object) -> str:
    """SHA-256 of the canonical text of plain JSON values: keys in order, no spaces, ASCII; 64 hex digits."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode("ascii")).hexdigest()
