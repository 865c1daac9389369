"""Where a folder lies, by tables of mounts as machines have them; on this one as it is."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from logger.store.log import disk_quota
from logger.store.log.disk_quota import Mount, all_mounts, are_on_one_disk, memory_notice, mount_of, why_in_memory

ROOT = "30 1 179:2 / / rw,noatime shared:1 - ext4 /dev/mmcblk0p2 rw"
SIZES = {"/": (4096, 7_500_000, 1_900_000), "/big": (4096, 60_000_000, 15_000_000)}
TMPFS = (4096, 500_000, 500_000)
Table = Callable[..., None]


@pytest.fixture
def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Table:
    """Let the kernel's table have these lines; every mount that ``SIZES`` does not know has the room of a tmpfs. There
    are 4 GB of memory."""
    def write(*lines: str) -> None:
        (tmp_path / "mountinfo").write_text("\n".join((ROOT, *lines)) + "\n")
        monkeypatch.setattr(disk_quota, "MOUNTS", tmp_path / "mountinfo")

    def room(mount: Mount) -> tuple[int, int, int]:
        return SIZES.get(str(mount.point), TMPFS)

    monkeypatch.setattr(disk_quota, "_room", room)
    monkeypatch.setattr(os, "sysconf", {"SC_PHYS_PAGES": 1_000_000, "SC_PAGE_SIZE": 4096}.__getitem__)
    return write


@pytest.mark.parametrize(("line", "words"), [
    ("31 30 0:40 / {} rw - tmpfs tmpfs rw,size=100k", "is a tmpfs"),
    ("31 30 0:40 / {} rw - ramfs none rw", "is a ramfs"),
    ("31 30 0:40 / {} rw - overlay overlay rw,lowerdir=/lower,upperdir=/upper/data,workdir=/upper/work", "overlay"),
    ("31 30 0:40 / {} rw - overlay overlayroot rw,lowerdir=l,upperdir=m/u,workdir=m/w,uuid=on", "overlay"),
    ("31 30 0:40 / {} rw - overlay overlay rw,lowerdir=/l,upperdir=/dev/shm,workdir=/dev/w", "overlay"),
    ("31 30 0:40 / {} rw - overlay overlay rw,lowerdir=/l,upperdir=/usr,workdir=/w", ""),
    ("31 30 254:0 / {} rw - ext4 /dev/zram0 rw", "is on zram0, a disk in memory"),
    ("31 30 1:0 / {} rw - ext4 /dev/ram0 rw", "is on ram0"),
    ("31 30 8:1 / {} rw - ext4 /dev/sda1 rw", ""),
    ("31 30 0:41 / {} rw - btrfs /dev/sda1 rw,subvol=/logs", ""),
    ("31 30 0:42 / {} rw - nfs4 server:/logs rw", ""),
    ("not a line of it", ""),
])
def test_what_lies_in_memory_is_known_by_its_mount(tmp_path: Path, table: Table, line: str, words: str) -> None:
    folder = tmp_path / "with space"
    table("32 30 0:30 / /dev/shm rw - tmpfs tmpfs rw", line.format(str(folder).replace(" ", r"\040")))
    why = why_in_memory(folder / "not" / "there yet")
    assert words in why
    assert bool(why) == bool(words)
    assert ("every drive is lost" in memory_notice(folder)) == bool(words)


@pytest.mark.parametrize(("card", "room", "is_in_memory"), [
    (SIZES["/"], SIZES["/"], False),
    ((4096, 400_000, 100_000), (4096, 400_000, 100_000), False),  # that of a small card: the upper folder lies there
    (SIZES["/"], (4096, 400_000, 100_000), True),  # less than there is memory
    (SIZES["/"], (4096, 9_000_000, 100_000), False),
])
def test_an_overlay_whose_upper_folder_cannot_be_seen_is_known_by_its_room(
        tmp_path: Path, table: Table, monkeypatch: pytest.MonkeyPatch, card: tuple[int, int, int],
        room: tuple[int, int, int], is_in_memory: bool) -> None:
    monkeypatch.setitem(SIZES, "/", card)
    monkeypatch.setitem(SIZES, str(tmp_path), room)
    table(f"31 30 0:40 / {tmp_path} rw - overlay overlay rw,lowerdir=/lower,upperdir=/upper/data,workdir=/upper/work")
    assert bool(why_in_memory(tmp_path)) == is_in_memory


def test_the_last_and_longest_mount_holds_a_folder(tmp_path: Path, table: Table) -> None:
    table(f"31 30 8:1 / {tmp_path} rw - ext4 /dev/sda1 rw", f"32 31 8:2 / {tmp_path} rw - ext4 /dev/sda2 rw",
          f"33 30 8:3 / {tmp_path}-other rw - ext4 /dev/sda3 rw")
    found = mount_of(tmp_path / "logs", all_mounts())
    assert found is not None
    assert found.source == "/dev/sda2"


def test_parts_of_a_disk_are_on_it_and_other_disks_are_not(
        tmp_path: Path, table: Table, monkeypatch: pytest.MonkeyPatch) -> None:
    disks = tmp_path / "devices"
    for name in ("mmcblk0/mmcblk0p1", "mmcblk0/mmcblk0p2", "sda/sda1"):
        (disks / name).mkdir(parents=True)
        (disks / name / "partition").touch()
    (tmp_path / "block").mkdir()
    numbers = {"179:0": "mmcblk0", "179:1": "mmcblk0/mmcblk0p1", "179:2": "mmcblk0/mmcblk0p2", "8:1": "sda/sda1"}
    for number, name in numbers.items():
        (tmp_path / "block" / number).symlink_to(disks / name)
    monkeypatch.setattr(disk_quota, "BLOCK_DEVICES", tmp_path / "block")
    table()

    def at(number: str) -> Path:
        major, minor = map(int, number.split(":"))
        return SimpleNamespace(stat=lambda: SimpleNamespace(st_dev=os.makedev(major, minor)),  # type: ignore[return-value]
                               resolve=lambda: Path("/x"))

    assert are_on_one_disk(at("179:2"), at("179:2"))
    assert are_on_one_disk(at("179:2"), at("179:1"))
    assert are_on_one_disk(at("0:40"), at("0:40"))
    assert not are_on_one_disk(at("179:2"), at("8:1"))
    assert not are_on_one_disk(at("0:40"), at("8:1"))


def test_this_machine_has_a_disk_and_memory(tmp_path: Path) -> None:
    assert are_on_one_disk(tmp_path, tmp_path.parent)
    assert not are_on_one_disk(tmp_path, Path("/dev/shm"))
    assert "/dev/shm is a tmpfs" in why_in_memory(Path("/dev/shm/not/there"))
