"""Runs in the guest: a disk with a write cache of its own that a power cut empties, as a card's or a drive's may be.

Serves a file of the shared folder as /dev/nbd0 (the kernel's network block device, over a socket pair). A write is
answered at once and kept in this process's memory. FLUSH, and a write with FUA, put it into the file, which outlives
the guest. Now and then, in no order, some blocks are written out unasked, as real caches do: so what is on the disk
after a cut is what was flushed, plus any part of the rest. Started as ``volatile_disk.py FILE DEVICE [lies]``; one that
lies takes no notice of FLUSH and FUA, to show that its trial can fail.
"""

import fcntl
import os
import random
import socket
import struct
import sys
from pathlib import Path

NBD_SET_SOCK, NBD_SET_BLKSIZE, NBD_DO_IT, NBD_CLEAR_SOCK = 0xAB00, 0xAB01, 0xAB03, 0xAB04
NBD_SET_SIZE_BLOCKS, NBD_SET_FLAGS = 0xAB07, 0xAB0A
HAS_FLAGS, SEND_FLUSH, SEND_FUA = 1, 4, 8
READ, WRITE, DISCONNECT, FLUSH = 0, 1, 2, 3
FUA = 1 << 16
REQUEST, REPLY = struct.Struct(">IIQQI"), struct.Struct(">IIQ")
REQUEST_MAGIC, REPLY_MAGIC = 0x25609513, 0x67446698
BLOCK = 4096
EARLY_SHARE = 0.02
"""Share of the writes after which some cached blocks reach the disk unasked and out of order."""


class Cache:
    """Blocks over a file; ``flush`` puts all of them into it."""

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_RDWR)
        self._blocks: dict[int, bytes] = {}
        self.size = path.stat().st_size

    def read(self, at: int, length: int) -> bytes:
        """``length`` bytes from ``at``, whole blocks both."""
        data = bytearray(os.pread(self._file, length, at))
        for offset in range(0, length, BLOCK):
            block = self._blocks.get(at + offset)
            if block is not None:
                data[offset:offset + BLOCK] = block
        return bytes(data)

    def write(self, at: int, data: bytes) -> None:
        """Keep whole blocks in memory."""
        for offset in range(0, len(data), BLOCK):
            self._blocks[at + offset] = data[offset:offset + BLOCK]
        if random.random() < EARLY_SHARE:
            for place in random.sample(sorted(self._blocks), len(self._blocks) // 2):
                self._put(place)

    def flush(self) -> None:
        """Everything to the file."""
        for place in list(self._blocks):
            self._put(place)

    def put(self, at: int, length: int) -> None:
        """These blocks to the file."""
        for place in range(at, at + length, BLOCK):
            self._put(place)

    def _put(self, place: int) -> None:
        block = self._blocks.pop(place, None)
        if block is not None:
            os.pwrite(self._file, block, place)


class LyingCache(Cache):
    """It says that all is on the disk and does nothing."""

    def flush(self) -> None:
        pass

    def put(self, at: int, length: int) -> None:
        pass


def serve(wire: socket.socket, cache: Cache) -> None:
    """Answer requests until the kernel disconnects."""
    while True:
        magic, kind, handle, at, length = REQUEST.unpack(received(wire, REQUEST.size))
        if magic != REQUEST_MAGIC or kind & 0xFFFF == DISCONNECT:
            return
        answer = b""
        if kind & 0xFFFF == READ:
            answer = cache.read(at, length)
        elif kind & 0xFFFF == WRITE:
            cache.write(at, received(wire, length))
            if kind & FUA:
                cache.put(at, length)
        elif kind & 0xFFFF == FLUSH:
            cache.flush()
        wire.sendall(REPLY.pack(REPLY_MAGIC, 0, handle) + answer)


def received(wire: socket.socket, length: int) -> bytes:
    """Exactly that many bytes. SystemExit when the other end has gone."""
    parts = bytearray()
    while len(parts) < length:
        part = wire.recv(length - len(parts))
        if not part:
            raise SystemExit(0)
        parts += part
    return bytes(parts)


def main(path: Path, device: str, lies: bool) -> None:
    """Set the device up; one process stays in the kernel, the other serves."""
    cache = LyingCache(path) if lies else Cache(path)
    kernel, ours = socket.socketpair()
    nbd = os.open(device, os.O_RDWR)
    for request, value in ((NBD_CLEAR_SOCK, 0), (NBD_SET_BLKSIZE, BLOCK), (NBD_SET_SIZE_BLOCKS, cache.size // BLOCK),
                           (NBD_SET_FLAGS, HAS_FLAGS | SEND_FLUSH | SEND_FUA), (NBD_SET_SOCK, kernel.fileno())):
        fcntl.ioctl(nbd, request, value)
    if os.fork() == 0:
        ours.close()
        fcntl.ioctl(nbd, NBD_DO_IT)
        return
    kernel.close()
    serve(ours, cache)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], sys.argv[3:] == ["lies"])
