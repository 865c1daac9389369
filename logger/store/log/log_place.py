"""Where a folder lies: on which disk, and whether on one at all.

Problem. What is written to memory is gone with the power, and a copy on the disk that holds the original saves nothing;
neither shows in a path. Solution. The kernel's table of mounts and its tree of block devices are asked.

Sources: Linux, Documentation/filesystems/proc.rst (3.5, mountinfo), overlayfs.rst (statfs and options),
Documentation/ABI/testing/sysfs-block.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

MOUNTS = Path("/proc/self/mountinfo")
BLOCK_DEVICES = Path("/sys/dev/block")
_IN_MEMORY = ("tmpfs", "ramfs", "rootfs")
_OVERLAYS = ("overlay", "overlayfs", "fuse.fuse-overlayfs")
_MEMORY_DISK = re.compile(r"(zram|ram)\d+")
_OCTAL = re.compile(r"\\([0-7]{3})")


@dataclass(frozen=True)
class Mount:
    """A line of the table: where it is mounted, the kind of file system, its device or name, and its upper folder where
    it is an overlay; empty: it has none."""

    point: Path
    kind: str
    source: str
    upper: str


def all_mounts() -> list[Mount]:
    """The table, in the order of mounting; empty where it cannot be read."""
    try:
        lines = MOUNTS.read_text("utf-8", "surrogateescape").splitlines()
    except OSError:
        return []
    return [mount for line in lines if (mount := _mount(line)) is not None]


def mount_of(folder: Path, mounts: Sequence[Mount]) -> Mount | None:
    """The mount that holds a folder, or would if it were made; None where the table does not say it."""
    place = folder.resolve()
    holding = [mount for mount in mounts if place.is_relative_to(mount.point)]
    longest = max((len(mount.point.parts) for mount in holding), default=0)
    return next((mount for mount in reversed(holding) if len(mount.point.parts) == longest), None)


def are_on_one_disk(one: Path, other: Path) -> bool:
    """Whether two folders lie on the same file system, by whatever path, or on parts of the same disk. Raises
    ``OSError``."""
    devices = [folder.stat().st_dev for folder in (one, other)]
    if devices[0] == devices[1]:
        return True
    mounts = all_mounts()
    disks = [_disk(device, mount_of(folder, mounts)) for device, folder in zip(devices, (one, other), strict=True)]
    return disks[0] is not None and disks[0] == disks[1]


def why_in_memory(folder: Path) -> str:
    """In words, why what lies in a folder is lost with the power; empty: it lies on a disk, as far as is known."""
    mounts = all_mounts()
    mount = mount_of(folder, mounts)
    return _why(mount, mounts) if mount is not None else ""


def memory_notice(folder: Path) -> str:
    """The same for a person, with what to do about it; empty: nothing has to be done."""
    if not (why := why_in_memory(folder)):
        return ""
    return (f"logs: {folder} lies in memory ({why}): every drive is lost when the power goes. Name a folder on a disk "
            "in log.directory, or switch the Overlay File System off (sudo raspi-config, Performance Options)")


def _why(mount: Mount, mounts: Sequence[Mount]) -> str:
    if mount.kind in _IN_MEMORY:
        return f"{mount.point} is a {mount.kind}, a file system in memory"
    if mount.kind in _OVERLAYS:
        in_memory = _keeps_in_memory(mount, mounts)
        return f"{mount.point} is an overlay whose changes are kept in memory" if in_memory else ""
    if _MEMORY_DISK.fullmatch(name := Path(mount.source).resolve().name):
        return f"{mount.point} is on {name}, a disk in memory"
    return ""


def _keeps_in_memory(overlay: Mount, mounts: Sequence[Mount]) -> bool:
    """Whether an overlay's upper folder lies in memory. Its path is that of whoever mounted it and may lead nowhere
    here; then the room tells, which is that of the upper folder: it is that of a file system that is known, or, as no
    disk is so small, not more than there is memory."""
    upper = Path(overlay.upper)
    if upper.is_absolute() and upper.is_dir():
        mount = mount_of(upper, mounts)
        return mount is not None and mount != overlay and bool(_why(mount, mounts))
    room = _room(overlay)
    if room is None:
        return False
    for mount in mounts:
        if mount.kind not in _OVERLAYS and _room(mount) == room:
            return bool(_why(mount, mounts))
    return room[0] * room[1] <= os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def _room(mount: Mount) -> tuple[int, int, int] | None:
    """Size of a block, how many, and of how many files; None where it has none or cannot be asked."""
    try:
        said = os.statvfs(mount.point)
    except OSError:
        return None
    return (said.f_frsize, said.f_blocks, said.f_files) if said.f_blocks else None


def _disk(device: int, mount: Mount | None) -> Path | None:
    """The disk of a device number, which a file system of several devices or volumes does not have: then that of what
    is mounted."""
    for number in (device, _device_of(mount)):
        place = (BLOCK_DEVICES / f"{os.major(number)}:{os.minor(number)}").resolve()
        if place.is_dir():
            return place.parent if (place / "partition").exists() else place
    return None


def _device_of(mount: Mount | None) -> int:
    try:
        return Path(mount.source).stat().st_rdev if mount is not None and mount.source.startswith("/") else 0
    except OSError:
        return 0


def _mount(line: str) -> Mount | None:
    before, _, after = line.partition(" - ")
    fields, said = before.split(" "), after.split(" ")
    if len(fields) < 6 or len(said) < 3:
        return None
    options = dict(option.partition("=")[::2] for option in said[2].split(","))
    return Mount(Path(_plain(fields[4])), said[0], _plain(said[1]), _plain(options.get("upperdir", "")))


def _plain(text: str) -> str:
    """A field of the table, in which space, tab, line end and backslash stand as octal numbers."""
    return _OCTAL.sub(lambda match: chr(int(match[1], 8)), text)
