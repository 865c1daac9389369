"""Bytes into frames.

The problem: a serial line delivers bytes in chunks that mean nothing. A chunk may hold half a message or five;
bytes get lost, a cable adds some, and a receiver mixes two protocols on one wire. Whoever reads must find the
place again, must not need more memory the worse the line gets, and must say how much was thrown away.

The solution: framers with ``feed(data) -> list[Frame]``. What comes out depends on the bytes alone, never on how
they were cut into chunks. A frame knows the stream offset of its first byte, and ``Arrivals`` turns offsets into
the time at which the chunk holding that byte came in.

- ``NmeaFramer``   NMEA sentences with UBX binary frames in between
- ``LineFramer``   lines of text
- ``FixedFramer``  frames of one length, with or without start bytes
"""

import re
from bisect import bisect_right
from collections.abc import Callable
from itertools import accumulate
from typing import NamedTuple

import numpy as np
import numpy.typing as npt


class Frame(NamedTuple):
    """Bytes that belong together.

    start        stream offset of the first byte; the first byte ever fed has offset 0
    data         the bytes. ``FixedFramer`` puts frames that follow one another into one ``Frame``
    after_loss   bytes were dropped since the frame before
    """

    start: int
    data: bytes
    after_loss: bool


class Arrivals:
    """When which byte of a stream came in."""

    def __init__(self) -> None:
        self._end = 0
        self._starts = [0]
        self._times_us = [0]

    def note(self, t_us: int, size: int) -> None:
        """The next ``size`` bytes of the stream arrived at ``t_us``."""
        if size == 0:
            return
        if self._end == self._starts[-1]:
            self._times_us[-1] = t_us
        elif t_us != self._times_us[-1]:
            self._starts.append(self._end)
            self._times_us.append(t_us)
        self._end += size

    def at(self, offset: int) -> int:
        """Arrival [us] of the byte at a stream offset."""
        return self._times_us[bisect_right(self._starts, offset) - 1]

    def many(self, offsets: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Arrivals [us] of the bytes at (n,) stream offsets."""
        place = np.searchsorted(np.array(self._starts, dtype=np.int64), offsets, side="right") - 1
        return np.array(self._times_us, dtype=np.int64)[place]

    def forget(self, before: int) -> None:
        """Nobody will ask again about offsets below ``before``."""
        keep = bisect_right(self._starts, before) - 1
        if keep > 0:
            del self._starts[:keep]
            del self._times_us[:keep]


def exclusive_or(data: bytes) -> int:
    """Of all bytes, at most 128: the string as one number is folded in half until one byte is left."""
    folded = int.from_bytes(data, "big")
    for bits in (512, 256, 128, 64, 32, 16, 8):
        folded ^= folded >> bits
    return folded & 0xFF


class _Framer:
    """What all framers share: the bytes that wait for more, where they stand, what was dropped."""

    def __init__(self) -> None:
        self._waiting = b""
        self._lost_before = False
        self.position = 0
        self.dropped_bytes = 0

    def _drop(self, size: int) -> None:
        if size:
            self.dropped_bytes += size
            self._lost_before = True

    def _frame(self, start: int, data: bytes) -> Frame:
        frame = Frame(start, data, self._lost_before)
        self._lost_before = False
        return frame

    def _keep(self, buffer: bytes, used: int) -> None:
        """The first ``used`` bytes of the buffer are dealt with, the others wait."""
        self._waiting = buffer[used:]
        self.position += used


SENTENCE_BYTES_MAX = 130
UBX_PAYLOAD_BYTES_MAX = 2048

_LINE_ENDS = b"\r\n"
_START = re.compile(rb"[$\xb5]")
_SENTENCE = re.compile(rb"\$[ -#%-~]*")


class NmeaFramer(_Framer):
    """Finds NMEA sentences and steps over UBX frames.

    A sentence is ``$`` and the printable ASCII characters after it, without the line end. It ends before the first
    other byte and also before the next ``$``, since real captures hold the beginning of a sentence run together
    with a whole one. A longer one than ``SENTENCE_BYTES_MAX`` (the limit gpsd uses) is two that lost the end of the
    first, and is dropped. Whether the checksum is right is not asked here.

    A UBX frame (B5 62, class, id, length u16 little-endian, payload, Fletcher-8 over class to payload; u-blox
    protocol specification, "UBX frame structure") is taken by its length, because a payload may hold ``$`` and line
    ends. If its check bytes are wrong one byte is dropped and the search goes on behind it. Longer payloads than
    ``UBX_PAYLOAD_BYTES_MAX`` are not believed: a false start must not hold back sentences for seconds.

    ``dropped_bytes`` counts everything that is neither sentence, nor line end, nor UBX frame.
    """

    def __init__(self) -> None:
        super().__init__()
        self.ubx_frames = 0

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes of the stream; return the sentences that they complete."""
        buffer = self._waiting + data
        frames: list[Frame] = []
        at = 0
        while at < len(buffer):
            start = _START.search(buffer, at)
            begin = start.start() if start else len(buffer)
            self._drop(len(buffer[at:begin].translate(None, _LINE_ENDS)))
            at = begin
            if begin == len(buffer):
                break
            used = self._sentence(buffer, at, frames) if buffer[at] == ord("$") else self._ubx(buffer, at)
            if used == 0:
                break
            at += used
        self._keep(buffer, at)
        return frames

    def _sentence(self, buffer: bytes, at: int, frames: list[Frame]) -> int:
        """Bytes used up from ``at``, where a ``$`` stands; 0 to wait for more."""
        match = _SENTENCE.match(buffer, at, at + SENTENCE_BYTES_MAX + 1)
        assert match is not None
        size = match.end() - at
        if size > SENTENCE_BYTES_MAX:
            self._drop(size)
        elif match.end() == len(buffer):
            return 0
        else:
            frames.append(self._frame(self.position + at, match[0]))
        return size

    def _ubx(self, buffer: bytes, at: int) -> int:
        """Bytes used up from ``at``, where a B5 stands; 0 to wait for more."""
        head = buffer[at : at + 6]
        if not b"\xb5\x62".startswith(head[:2]):
            self._drop(1)
            return 1
        if len(head) < 6:
            return 0
        payload = int.from_bytes(head[4:6], "little")
        size = payload + 8
        if payload <= UBX_PAYLOAD_BYTES_MAX:
            if len(buffer) < at + size:
                return 0
            if fletcher8(buffer[at + 2 : at + size - 2]) == buffer[at + size - 2 : at + size]:
                self.ubx_frames += 1
                return size
        self._drop(1)
        return 1


def fletcher8(data: bytes) -> bytes:
    """The two check bytes of a UBX frame: the sum of the bytes and the sum of those running sums, modulo 256."""
    return bytes((sum(data) & 0xFF, sum(accumulate(data)) & 0xFF))


LINE_BYTES_MAX = 80

_LINE_END = re.compile(rb"[\r\n]")
_NUMBER = re.compile(rb"(?<![\w.^+-])[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?(?![\w^])")


def numbers_in(line: bytes) -> list[float]:
    """The decimal numbers that stand by themselves in a line, whatever stands between them: not the 2 of ``m/s^2``."""
    return [float(word) for word in _NUMBER.findall(line)]


class LineFramer(_Framer):
    """Lines of text, ended by CR, LF or both, without their ends; empty lines are no frames.

    What comes before the first line end is dropped: it may be the rest of a line, and the rest of ``12.5,0,1`` reads
    as another number. A line longer than ``LINE_BYTES_MAX`` is dropped up to its end.
    """

    def __init__(self) -> None:
        super().__init__()
        self._in_line = False

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes of the stream; return the lines that they complete."""
        buffer = self._waiting + data
        frames: list[Frame] = []
        at = 0
        for end in _LINE_END.finditer(buffer):
            line = buffer[at : end.start()]
            if not self._in_line or len(line) > LINE_BYTES_MAX:
                self._drop(len(line))
            elif line:
                frames.append(self._frame(self.position + at, line))
            self._in_line = True
            at = end.end()
        if not self._in_line or len(buffer) - at > LINE_BYTES_MAX:
            self._drop(len(buffer) - at)
            self._in_line = False
            at = len(buffer)
        self._keep(buffer, at)
        return frames


Plausible = Callable[[npt.NDArray[np.uint8]], npt.NDArray[np.bool_]]

_SEARCH_BYTES = 4096


class FixedFramer(_Framer):
    """Frames of one length. Finds where they begin by what they say.

    length      bytes of a frame
    plausible   (n, length) bytes -> (n,) bool: could each be a frame?
    oriented    (m, group, length) bytes -> (m,) bool: could these consecutive frames, taken together, begin where
                frames begin? For layouts where a shifted frame still looks like one. None: not asked
    sync        bytes that every frame starts with; empty when there are none
    group       frames in a row that must be plausible before a place is believed

    In place, frames come out as soon as they are complete. A single implausible one comes out too (a flipped bit;
    the profile refuses it), but ``PATIENCE`` in a row mean that the place is lost, and so do two groups in a row that
    are not oriented. Then the search begins again at the first of the implausible frames, or after the second
    group: up to two groups that began at a wrong byte have come out by then.
    """

    PATIENCE = 3

    def __init__(self, length: int, plausible: Plausible, oriented: Plausible | None = None, sync: bytes = b"",
                 group: int = 16) -> None:
        super().__init__()
        self._length, self._plausible, self._oriented = length, plausible, oriented
        self._sync = np.frombuffer(sync, dtype=np.uint8)
        self._group = group
        self._in_place = False
        self._part_group = b""
        self._doubted = False

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes of the stream; return the frames that they complete."""
        buffer = self._waiting + data
        frames: list[Frame] = []
        at = 0
        waits = False
        while not waits:
            if self._in_place:
                size, waits = self._follow(buffer[at:])
                if size:
                    frames.append(self._frame(self.position + at, buffer[at : at + size]))
            else:
                size, waits = self._search(buffer[at : at + _SEARCH_BYTES + self._group * self._length])
                self._drop(size)
            at += size
        self._keep(buffer, at)
        return frames

    def _good(self, frames: npt.NDArray[np.uint8]) -> npt.NDArray[np.bool_]:
        starts: npt.NDArray[np.bool_] = (frames[:, : len(self._sync)] == self._sync).all(axis=1)
        return starts & self._plausible(frames)

    def _search(self, data: bytes) -> tuple[int, bool]:
        """(bytes before the place where frames begin, or before where it may yet turn out to be; wait for more?)"""
        span = self._group * self._length
        places = len(data) - span + 1
        if places <= 0:
            return 0, True
        raw = np.frombuffer(data, dtype=np.uint8)
        good = self._good(np.lib.stride_tricks.sliding_window_view(raw, self._length))
        held = good[:places].copy()
        for k in range(1, self._group):
            held &= good[k * self._length : k * self._length + places]
        found = np.flatnonzero(held)
        if self._oriented is not None and found.size:
            groups = np.lib.stride_tricks.sliding_window_view(raw, span)[found]
            found = found[self._oriented(groups.reshape(-1, self._group, self._length))]
        if found.size:
            self._in_place = True
            self._part_group = b""
            self._doubted = False
            return int(found[0]), False
        return places, places <= _SEARCH_BYTES

    def _follow(self, data: bytes) -> tuple[int, bool]:
        """(bytes of the frames that follow in place; wait for more?)"""
        count = len(data) // self._length
        if count == 0:
            return 0, True
        raw = np.frombuffer(data, dtype=np.uint8, count=count * self._length)
        good = self._good(raw.reshape(count, self._length))
        use, lost = count, False
        if not good.all():
            bad = np.concatenate((~good, np.zeros(self.PATIENCE, dtype=np.bool_)))
            streak = bad[:count].copy()
            for k in range(1, self.PATIENCE):
                streak &= bad[k : k + count]
            lost = bool(streak.any())
            last_good = np.flatnonzero(good)
            use = int(np.argmax(streak)) if lost else int(last_good[-1]) + 1 if last_good.size else 0
        if self._oriented is not None:
            turned = self._turned(data[: use * self._length])
            if turned is not None:
                use, lost = turned, True
        self._in_place = not lost
        return use * self._length, not lost

    def _turned(self, data: bytes) -> int | None:
        """Frames of ``data`` up to the end of the second group in a row that is not oriented; None if there is none."""
        assert self._oriented is not None
        span = self._group * self._length
        before = len(self._part_group)
        joined = self._part_group + data
        count = len(joined) // span
        self._part_group = joined[count * span :]
        if count == 0:
            return None
        groups = np.frombuffer(joined, dtype=np.uint8, count=count * span)
        doubts = ~self._oriented(groups.reshape(count, self._group, self._length))
        twice = doubts & np.concatenate(([self._doubted], doubts[:-1]))
        self._doubted = bool(doubts[-1])
        if not twice.any():
            return None
        return ((int(np.argmax(twice)) + 1) * span - before) // self._length
