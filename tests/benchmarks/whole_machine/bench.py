"""What all trials share: the images, the recorded drive, and a car (a guest, its chip and its receiver)."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Self

from .drive import Receiver, make_drive
from .guest import Guest, GuestFailed, UmlGuest
from .image import Image, build
from .shell import run

INSTALL = "/opt/ridelog/bin/ridelog install"
CARD_BYTES = 600_000_000
"""More than the 200 MB that ridelog leaves to others."""

# unless they are there: a root that is read-only takes none
SETTINGS = "cmp -s /host/ridelog.yaml /etc/ridelog/ridelog.yaml || cp /host/ridelog.yaml /etc/ridelog/ridelog.yaml\n"
CHIP = """modprobe i2c-stub chip_addr=0x0a; modprobe i2c-dev
/opt/ridelog/bin/python /host/in_guest/chip.py /host/drive.dump.gz 0 >>/host/chip.log 2>&1 &
"""
CARD = """modprobe nbd nbds_max=1
python3 /host/in_guest/volatile_disk.py /host/card.img /dev/nbd0 {lies} &
for i in $(seq 100); do [ "$(cat /sys/block/nbd0/size)" -gt 0 ] && break; sleep 0.05; done
e2fsck -p /dev/nbd0
mkdir -p /var/lib/ridelog && mount /dev/nbd0 /var/lib/ridelog
"""
WATCH = "python3 /host/in_guest/watch.py /host/looks.txt $(ls /var/lib/ridelog 2>/dev/null) &\n"


@dataclass
class Bench:
    """Where the bench works and what it tries. ``quick``: fewer repetitions."""

    work: Path
    tree: Path
    quick: bool = False
    commit: str = field(init=False)

    def __post_init__(self) -> None:
        self.commit = run("git", "-C", self.tree, "rev-parse", "--short=12", "HEAD").strip()
        self.work.mkdir(parents=True, exist_ok=True)

    @cached_property
    def image(self) -> Image:
        """Debian with ridelog's program on it."""
        return build(self.work, self.tree)

    @cached_property
    def installed(self) -> Path:
        """A disk on which ``ridelog install`` was carried out once."""
        disk = self.work / f"installed-{self.commit}.img"
        if not disk.exists():
            with UmlGuest(self.new_folder("install"), self.image.disk) as guest:
                guest.boot()
                guest.must(INSTALL, 180)
                guest.shut_down()
                guest.save_as(disk)
        return disk

    @cached_property
    def drive(self) -> Path:
        """A drive of 20 minutes, by which the sensors speak."""
        path = self.work / "drive-1200s.dump.gz"
        if not path.exists():
            new = path.with_name("new.dump.gz")
            make_drive(new, 1200)
            new.rename(path)
        return path

    def new_folder(self, name: str) -> Path:
        """An empty folder for a guest."""
        folder = self.work / "guests" / name
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        return folder

    def car(self, name: str, chip: str = "stub", card: str = "", watch: bool = False, settings: str = "",
            base: Path | None = None, before: str = "") -> Car:
        """A car whose guest was installed by the README.

        chip       "stub": on /dev/i2c-0, played into the kernel's i2c-stub; "dump": played by the service itself;
                   "late" and "none": no bus; the trial brings it
        card       "honest": the logs are on a disk with a write cache that a cut empties; "lies": it ignores flushes
        watch      write down what the service promises
        settings   more lines of ridelog.yaml
        before     more of what the guest does before the service starts
        """
        folder = self.new_folder(name)
        receiver = Receiver(self.drive)
        guest = UmlGuest(folder, base or self.installed, receiver.port)
        shutil.copy(self.drive, guest.share / "drive.dump.gz")
        bus = "'dump:/host/drive.dump.gz'" if chip == "dump" else "0"
        (guest.share / "ridelog.yaml").write_text(
            f"accelerometer: {{bma220: {{i2c_bus: {bus}}}}}\ngps: {{port: /dev/ttyS0}}\n{settings}")
        if card:
            image = guest.share / "card.img"
            with image.open("wb") as file:
                file.truncate(CARD_BYTES)
            run("mkfs.ext4", "-q", "-b", "4096", image)
        guest.on_boot(SETTINGS
                      + (CARD.format(lies="lies" if card == "lies" else "") if card else "")
                      + (CHIP if chip == "stub" else "") + (WATCH if watch else "") + before)
        return Car(guest, receiver)


@dataclass
class Car:
    """A guest and its receiver, which speaks from power on."""

    guest: Guest
    receiver: Receiver

    def __enter__(self) -> Self:
        self.receiver.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
                 ) -> None:
        self.guest.cut_power()
        self.receiver.__exit__(kind, error, trace)

    def start(self) -> None:
        """Power on."""
        self.receiver.begin()
        self.guest.start()

    def boot(self) -> float:
        """Power on, and wait until it takes commands; the seconds that took."""
        self.start()
        return self.guest.wait_until_up()

    def wait_for(self, what: str, script: str, timeout_s: float = 120, every_s: float = 1.0) -> float:
        """Run a script until its exit status is 0; the seconds that took. GuestFailed when it never is."""
        began_s = time.monotonic()
        while True:
            done = self.guest.run(script, timeout_s)
            waited_s = time.monotonic() - began_s
            if done.rc == 0:
                return waited_s
            if waited_s > timeout_s:
                raise GuestFailed(f"{what}: not within {timeout_s:.0f} s; the last look said: {done.out[-600:]}")
            time.sleep(every_s)

    def wait_for_rows(self, rows: int = 1, timeout_s: float = 180) -> float:
        """Wait until the service says that so many rows were written."""
        script = ("python3 -c \"import json; n=json.load(open('/run/ridelog/status.json'))['rows_written']; print(n); "
                  f"raise SystemExit(n < {rows})\"")
        return self.wait_for(f"{rows} rows", script, timeout_s)
