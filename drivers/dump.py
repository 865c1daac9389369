"""A recorded drive as bytes: one text file, written while driving and played back later.

Problem. A recording is made in a car whose power goes without warning, is played back at hundreds of times
real time, and may come from anybody. So the writer must lose no more than what came after its last flush,
the reader must be quick, must never hold more than a few blocks in memory (also for a compressed file that
unpacks to terabytes), and must distinguish a recording that was cut short from one that is damaged.

Solution. One line per event, ``<t_s> <source> <hex>``, after a first line ``# ridelog-dump 1 {JSON}``. Times
are read and written as integers, so the six decimals come back exactly. A last line without its newline, or a
compressed stream without its end, is a torn tail: everything before it is given and ``torn_tail`` says so.
Anything else that is not as it should be is a ``DumpError`` that names file, line and what was expected.
"""

import json
import os
import zlib
from binascii import unhexlify
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Any

from drivers.accelerometers import accelerometers
from drivers.disk import FileSystem, open_regular
from drivers.errors import DumpError, shortened
from drivers.readings import GPS, Event

VERSION = "1"
ACCELEROMETERS = tuple(accelerometers())
SOURCES = (*ACCELEROMETERS, GPS)

LINE_BYTES = 65536  # Longest line, without its newline
EVENT_BYTES = 32000  # Most bytes in one event: in hex, with time and source, they fit a line
LATEST_US = 10**15 - 1  # No monotonic clock has run for 31 years
_SOURCE_OF = {name.encode(): name for name in SOURCES}
_BYTES_OF = {name: kind.event_bytes for name, kind in accelerometers().items()} | {GPS: None}
_HEX_DIGITS_OF = {name.encode(): 2 * size for name, size in _BYTES_OF.items() if size is not None}
_BLOCK_BYTES = LINE_BYTES
_GZIP_MAGIC = b"\x1f\x8b"
_GZIP_WBITS = 31  # zlib: a window of 2^15 bytes with a gzip wrapper
_MEMBER = bytes.fromhex("1f8b0800000000000003")  # how zlib begins a gzip member: no name, no time, Unix


@dataclass(frozen=True)
class DumpHeader:
    """What a recording says about itself.

    start_utc        ISO 8601 time of the start; None where the clock was not known
    accelerometer    ``{"driver": one of ``ACCELEROMETERS``, ...}``, with what that one adds to it
    gps              settings of the receiver's line, such as ``{"baud": 9600}``
    vehicle          name of the vehicle
    wheelbase_m, mass_kg    what the settings said of a vehicle that is not known otherwise; None: nothing
    """

    start_utc: str | None
    accelerometer: dict[str, Any]
    gps: dict[str, Any]
    vehicle: str
    wheelbase_m: float | None = None
    mass_kg: float | None = None


def open_dump(path: str | os.PathLike[str]) -> "DumpReader":
    """Open a recording, compressed or not (its first bytes tell), and read its header.

    Raises ``DumpError`` when the file cannot be read or its first line is not the header of a dump.
    """
    return DumpReader(Path(path))


class DumpReader:
    """The events of a recording, oldest first. Iterate once; a context manager that closes the file.

    header       what the recording says about itself
    torn_tail    after the last event: the recording was cut in its last line or before its compressed end

    Iterating raises ``DumpError`` at the first line that is damaged, of an unknown source, too long, or
    earlier than the line before; the events before it have been given.
    """

    def __init__(self, path: Path) -> None:
        self.torn_tail = False
        self._path = path
        self._lines_read = 0
        try:
            self._file = open_regular(path)
        except OSError as error:
            raise DumpError(f"{path}: expected a recorded dump, but: {error.strerror}") from error
        try:
            self._blocks = self._line_blocks()
            first = next(self._blocks, [])
            self.header = _parse_header(path, first)
        except DumpError:
            self._file.close()
            raise
        self._events = self._parse(first)

    def __enter__(self) -> "DumpReader":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
                 ) -> None:
        self.close()

    def __iter__(self) -> Iterator[Event]:
        return self._events

    def close(self) -> None:
        self._file.close()

    def _parse(self, first: list[bytes]) -> Iterator[Event]:
        """Yield the events of the lines after the header. The hot loop: every microsecond here is paid per event."""
        last_us = 0
        number = 1
        digits_of = _HEX_DIGITS_OF
        lines = first[1:]
        while True:
            for line in lines:
                number += 1
                try:
                    stamp, name, text = line.split(b" ")
                    whole, fraction = stamp.split(b".")
                    digits = whole + fraction
                    t_us = int(digits)
                    event = Event(t_us, _SOURCE_OF[name], unhexlify(text))
                except (ValueError, KeyError):
                    raise _complaint(self._path, number, line, last_us) from None
                if not (last_us <= t_us <= LATEST_US and digits.isdigit() and len(fraction) == 6 and whole and text
                        and len(line) <= LINE_BYTES and len(text) == digits_of.get(name, len(text))):
                    raise _complaint(self._path, number, line, last_us)
                last_us = t_us
                yield event
            following = next(self._blocks, None)
            if following is None:
                return
            lines = following

    def _line_blocks(self) -> Iterator[list[bytes]]:
        """Yield lists of whole lines, without their newlines; a rest without one is a torn tail."""
        carry = b""
        for chunk in self._chunks():
            lines = (carry + chunk).split(b"\n")
            carry = lines.pop()
            if lines:
                self._lines_read += len(lines)
                yield lines
            if len(carry) > LINE_BYTES:
                raise _complaint(self._path, self._lines_read + 1, carry, 0)
        if carry:
            self.torn_tail = True

    def _chunks(self) -> Iterator[bytes]:
        """Yield the text in chunks of bounded size, unpacked where it is compressed."""
        try:
            if self._file.peek(2)[:2] == _GZIP_MAGIC:
                yield from self._unpacked()
            else:
                while chunk := self._file.read(_BLOCK_BYTES):
                    yield chunk
        except zlib.error as error:
            raise DumpError(f"{self._path}:{self._lines_read + 1}: expected undamaged gzip data: {error}") from error
        except OSError as error:
            raise DumpError(f"{self._path}:{self._lines_read + 1}: expected a readable file, but: {error.strerror}"
                            ) from error

    def _unpacked(self) -> Iterator[bytes]:
        engine = zlib.decompressobj(wbits=_GZIP_WBITS)
        inside = False
        while packed := self._file.read(_BLOCK_BYTES):
            while packed:
                inside = True
                yield engine.decompress(packed, _BLOCK_BYTES)
                packed = engine.unconsumed_tail
                if engine.eof:  # recordings may be joined with ``cat``
                    packed = engine.unused_data
                    engine = zlib.decompressobj(wbits=_GZIP_WBITS)
                    inside = False
        if inside:
            yield engine.flush()
            self.torn_tail = True


class DumpWriter:
    """Records events into a new file, compressed when ``.gz`` is among the endings of its name.

    Events are kept back until ``flush`` or until a block is full; a kill loses at most what came after the last flush.
    Each flush of a compressed file ends a gzip member, whose check value covers all that came since the one before:
    so what is damaged in a file that was cut off can be distinguished from what is not (``intact_bytes``). The price is
    a fifth more bytes than one stream.

    Raises ``FileExistsError`` rather than overwrite a recording, and other ``OSError`` of the disk. After one of those
    nothing more can be recorded; ``abandon`` lets go of the file.
    """

    def __init__(self, path: str | os.PathLike[str], header: DumpHeader, files: FileSystem | None = None) -> None:
        said = {key: value for key, value in asdict(header).items() if value is not None or key == "start_utc"}
        first = f"# ridelog-dump {VERSION} {json.dumps(said, allow_nan=False)}\n"
        self._files = files or FileSystem()
        self._is_packed = ".gz" in Path(path).suffixes
        self._engine: zlib._Compress | None = None
        self._pending = [first]
        self._pending_chars = 0
        self._last_us = 0
        self._descriptor: int | None = self._files.create(Path(path), new=True)
        try:
            self.flush(sync=True)
            self._files.sync_directory(Path(path).parent)
        except OSError:
            self.abandon()
            with suppress(OSError):
                self._files.remove(Path(path))
            raise

    def write(self, event: Event) -> None:
        """Add an event. Raises ``ValueError`` for one that no reader would accept: an unknown source, a time
        before the last one's or out of range, no bytes, more than ``EVENT_BYTES``, a chip read of another size."""
        t_us, source, data = event
        fits = 0 < len(data) <= EVENT_BYTES and len(data) == (_BYTES_OF.get(source) or len(data))
        if not (source in SOURCES and self._last_us <= t_us <= LATEST_US and fits):
            raise ValueError(f"event {source!r} at {t_us} us with {len(data)} bytes, after {self._last_us} us, "
                             "cannot be recorded")
        self._last_us = t_us
        line = f"{t_us // 1_000_000}.{t_us % 1_000_000:06d} {source} {data.hex()}\n"
        self._pending.append(line)
        self._pending_chars += len(line)
        if self._pending_chars >= _BLOCK_BYTES:
            self._put(self._packed())

    def flush(self, sync: bool) -> None:
        """Hand everything so far to the system; with ``sync`` wait until it is on the disk."""
        data = self._packed()
        if self._engine is not None:
            data += self._engine.flush()
            self._engine = None
        self._put(data)
        if sync and self._descriptor is not None:
            self._files.sync(self._descriptor)

    def close(self) -> None:
        """End the recording and wait until it is on the disk. Closing twice does nothing."""
        if self._descriptor is not None:
            self.flush(sync=True)
            descriptor, self._descriptor = self._descriptor, None
            self._files.close(descriptor)

    def abandon(self) -> None:
        """Let go of the file as it stands, whatever the disk says."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            with suppress(OSError):
                self._files.close(descriptor)

    def _packed(self) -> bytes:
        text = "".join(self._pending).encode("ascii")
        self._pending.clear()
        self._pending_chars = 0
        if not (self._is_packed and text):
            return text
        if self._engine is None:
            self._engine = zlib.compressobj(wbits=_GZIP_WBITS)
        return self._engine.compress(text)

    def _put(self, data: bytes) -> None:
        if self._descriptor is None:
            raise ValueError("expected a recording that is open")
        if data:
            self._files.write(self._descriptor, data)


def intact_bytes(path: Path, files: FileSystem | None = None) -> int:
    """How far a compressed recording that was cut off is intact, from its begin to the end of a gzip member [bytes].

    It is looked at from its end, for only what was not yet on the disk can be torn. Raises ``OSError``.
    """
    tail_bytes = 1 << 18
    looked = tail_bytes
    with (files or FileSystem()).open(path) as file:
        size = file.seek(0, os.SEEK_END)
        while True:
            file.seek(max(0, size - looked))
            tail = file.read()
            end = _last_member_end(tail)
            if end or looked >= size:
                return size - len(tail) + end if end else 0
            looked *= 4


def _last_member_end(tail: bytes) -> int:
    """The end of the last intact gzip member of an unbroken row of them; 0 when there is none."""
    begin = tail.find(_MEMBER)
    while begin >= 0:
        end = begin
        while (after := _member_end(tail, end)) is not None:
            end = after
        if end > begin:
            return end
        begin = tail.find(_MEMBER, begin + 1)
    return 0


def _member_end(data: bytes, begin: int) -> int | None:
    """Where the gzip member that begins here ends; None when it is cut off or does not fit its check value."""
    engine = zlib.decompressobj(wbits=_GZIP_WBITS)
    rest = data[begin:]
    try:
        while rest and not engine.eof:
            engine.decompress(rest, _BLOCK_BYTES)
            rest = engine.unconsumed_tail
    except zlib.error:
        return None
    return len(data) - len(engine.unused_data) if engine.eof else None


def _parse_header(path: Path, lines: list[bytes]) -> DumpHeader:
    """Check the first line. Raises ``DumpError`` that says what was expected."""
    def refuse(expected: str) -> DumpError:
        return DumpError(f"{path}:1: expected {expected}")

    words = lines[0].split(b" ", 3) if lines else []
    if len(words) != 4 or words[:2] != [b"#", b"ridelog-dump"] or len(lines[0]) > LINE_BYTES:
        raise refuse('the first line of a recorded dump, "# ridelog-dump 1 {...}"')
    if words[2] != VERSION.encode():
        raise refuse(f"dump version {VERSION}, found {shortened(words[2].decode('ascii', 'replace'))}")
    try:
        fields = json.loads(words[3])
    except (ValueError, RecursionError):
        raise refuse("a JSON object after \"# ridelog-dump 1\"") from None
    if not isinstance(fields, dict):
        raise refuse("a JSON object after \"# ridelog-dump 1\"")
    missing = [key for key in ("start_utc", "accelerometer", "gps", "vehicle") if key not in fields]
    if missing:
        raise refuse(f"{missing[0]!r} in the header")
    start_utc, accelerometer, gps, vehicle = (fields[k] for k in ("start_utc", "accelerometer", "gps", "vehicle"))
    if start_utc is not None and not _is_iso_time(start_utc):
        raise refuse("'start_utc' as an ISO 8601 time or null")
    if not isinstance(accelerometer, dict) or accelerometer.get("driver") not in ACCELEROMETERS:
        raise refuse(f"'accelerometer' as an object with \"driver\": {' or '.join(ACCELEROMETERS)}")
    if not isinstance(gps, dict):
        raise refuse("'gps' as an object")
    if not isinstance(vehicle, str):
        raise refuse("'vehicle' as a name")
    return DumpHeader(start_utc, accelerometer, gps, vehicle, fields.get("wheelbase_m"), fields.get("mass_kg"))


def _is_iso_time(value: object) -> bool:
    if not isinstance(value, str):
        return False
    try:
        datetime.fromisoformat(value)
    except ValueError:
        return False
    return True


def _complaint(path: Path, number: int, line: bytes, last_us: int) -> DumpError:
    """Say what is wrong with a line that was refused."""
    fields = line.split(b" ")
    if len(line) > LINE_BYTES:
        expected = f"a line of at most {LINE_BYTES} bytes"
    elif len(fields) != 3:
        expected = '"<t_s> <source> <hex>"'
    elif not _is_time(fields[0]):
        expected = "monotonic seconds with six decimals, such as 12.345678"
    elif fields[1] not in _SOURCE_OF:
        expected = f"a source out of {', '.join(SOURCES)}"
    elif int(fields[0].replace(b".", b"")) < last_us:
        expected = f"a time not before the last one, {last_us // 1_000_000}.{last_us % 1_000_000:06d}"
    else:
        size = _BYTES_OF[_SOURCE_OF[fields[1]]]
        expected = "at least one byte" if size is None else f"{size} bytes"
        expected += ", in pairs of hex digits"
    return DumpError(f"{path}:{number}: expected {expected}, found {line[:60].decode('ascii', 'replace')!r}")


def _is_time(stamp: bytes) -> bool:
    whole, point, fraction = stamp.partition(b".")
    return (whole + fraction).isdigit() and bool(point) and len(fraction) == 6 and 0 < len(whole) <= 9
