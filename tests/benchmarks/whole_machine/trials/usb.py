"""Real USB, in an emulated PC with Debian's own kernel: sticks on usb-storage, a receiver on usb-serial."""

from __future__ import annotations

import shutil
import time

from ..bench import SETTINGS, Bench, Car
from ..catalogue import Report, trial
from ..drive import Receiver
from ..guest import PATIENT, QemuGuest
from ..shell import run
from .sensors import rows
from .sticks import DUMPS, NOTES, Sticks, words

STICK_BYTES = 64_000_000
EXPORT_S = 600.0


class UsbSticks(Sticks):
    """Sticks at the USB sockets of an emulated PC, pulled and plugged in by QEMU's monitor."""

    def __init__(self, bench: Bench, name: str, contents: list[str], dumps: int = DUMPS) -> None:
        """``contents``: per stick the command of the host that makes its file system in ``IMAGE``, a partition."""
        folder = bench.new_folder(name)
        receiver = Receiver(bench.drive)
        guest = QemuGuest(folder, bench.image, bench.installed)
        guest.devices = ["-chardev", f"serial,id=receiver,path={receiver.port}",
                         "-device", "usb-serial,chardev=receiver,id=receiver"]
        shutil.copy(bench.drive, guest.share / "drive.dump.gz")
        (guest.share / "ridelog.yaml").write_text(
            "accelerometer: {bma220: {i2c_bus: 'dump:/host/drive.dump.gz'}}\ngps: {port: /dev/ttyUSB0}\n")
        guest.on_boot(SETTINGS + PATIENT)
        self.car = Car(guest, receiver)
        self.guest = guest
        self._dumps = dumps
        self._images = []
        for number, command in enumerate(contents):
            image = folder / f"stick-{number}.img"
            with image.open("wb") as file:
                file.truncate(STICK_BYTES)
            run("sh", "-c", command.replace("IMAGE", str(image)))
            self._images.append(image)

    def __enter__(self) -> UsbSticks:
        self.car.__enter__()
        self.car.boot()
        self.car.wait_for("the service", "systemctl is-active ridelog", 600)
        return self

    def fill(self) -> None:
        """Leave something to fetch."""
        self.guest.must(f"systemctl restart ridelog; cd /var/lib/ridelog; for n in $(seq {self._dumps}); do "
                        "cp /host/drive.dump.gz 000$((n + 10)).dump.gz; done; chown ridelog: *.gz; sync", 600)

    def plug(self, number: int) -> None:
        """Put it in."""
        self.guest.ask("blockdev-add", driver="raw", **{"node-name": f"node{number}"},
                       file={"driver": "file", "filename": str(self._images[number])})
        self.guest.ask("device_add", driver="usb-storage", id=f"stick{number}", drive=f"node{number}", bus="usb.0",
                       removable=True)

    def pull(self, number: int) -> None:
        """Take it out, without asking anybody."""
        self.guest.ask("device_del", id=f"stick{number}")
        for _ in range(200):
            time.sleep(0.1)
            try:
                self.guest.ask("blockdev-del", **{"node-name": f"node{number}"})
            except Exception:  # noqa: BLE001
                continue
            return

    def name(self) -> str:
        """The block device of the one stick that is plugged in, a partition or the disk."""
        return self.guest.must("ls -t /sys/class/block | grep '^sd' | sort | tail -1").strip()

    def verify_plugged(self) -> tuple[int, str]:
        """What ``ridelog verify`` says of the one stick that is plugged in."""
        done = self.guest.run(f"mkdir -p /mnt/look; mount -o ro /dev/{self.name()} /mnt/look; cd /mnt/look; "
                              "ridelog verify . 2>&1 | sed -n 1p; rc=${PIPESTATUS[0]}; cd /; umount /mnt/look; "
                              "exit $rc", EXPORT_S)
        lines = done.out.strip().splitlines()
        return done.rc, lines[-1] if lines else ""


def partitioned(make: str) -> str:
    """A host's command: a disk with one partition that ``make`` fills, as sticks are sold."""
    return ("truncate -s 60000000 IMAGE.part && " + make.replace("IMAGE", "IMAGE.part") + " >/dev/null && "
            "printf 'label: dos\\n2048,,7\\n' | sfdisk -q IMAGE && "
            "dd if=IMAGE.part of=IMAGE bs=1M seek=1 conv=notrunc status=none")


@trial("sticks on real USB: exFAT on a partition, FAT; copied, checked, unmounted; pulled in mid-copy and back within "
       "a second; two at once", "QEMU")
def usb_sticks(bench: Bench, report: Report) -> None:
    """usb-storage at an xHCI controller, one boot for all."""
    exfat, fat = partitioned("mkfs.exfat -L RIDELOG IMAGE"), partitioned("mkfs.vfat -n RIDELOG IMAGE")
    report.times = 1 if bench.quick else 6
    with UsbSticks(bench, "usb-sticks", [exfat, fat, fat]) as sticks:
        report.measure("boot, seconds to a shell", f"{sticks.guest.booted_s:.0f}")
        sticks.fill()
        for number, kind in ((0, "exFAT"), (1, "FAT")):
            began_s = time.monotonic()
            sticks.plug(number)
            notes = sticks.ready(timeout_s=EXPORT_S)
            report.check(f"{kind}: everything is on it, it may be pulled", len(notes) == 1 and notes[0]["ok"],
                         f"{time.monotonic() - began_s:.0f} s; {words(notes)}")
            rc, last = sticks.verify_plugged()
            report.check("ridelog verify of it", rc == 0, last)
            sticks.pull(number)
            report.check("pulled: status no longer mentions it", sticks.no_notes(120))
        early = 0
        for number in range(report.times):
            sticks.guest.must("systemctl restart ridelog; sleep 5", 300)
            sticks.plug(1)
            sticks.car.wait_for("a mount", "grep -q ridelog-stick /proc/mounts", EXPORT_S, 0.2)
            time.sleep(number)
            early += "copying" in sticks.guest.run(NOTES).out
            sticks.pull(1)
            time.sleep(0.5)
            sticks.plug(1)
            notes = sticks.ready(timeout_s=EXPORT_S)
            report.check("pulled early and back within a second: served", len(notes) == 1 and notes[0]["ok"],
                         words(notes))
            rc, last = sticks.verify_plugged()
            report.check("ridelog verify of it", rc == 0, last)
            sticks.pull(1)
            sticks.no_notes(120)
        report.measure("of these pulled while it copied", f"{early} of {report.times}")
        sticks.plug(1)
        sticks.plug(2)
        notes = sticks.ready(2, 2 * EXPORT_S)
        report.check("two at once: everything is on both", len(notes) == 2 and all(note["ok"] for note in notes),
                     words(notes))
        if not report.held:
            report.check("journal", False, sticks.journal()[-800:])


@trial("a USB receiver that comes late, falls out and comes back, is opened by itself", "QEMU")
def usb_receiver(bench: Bench, report: Report) -> None:
    """usb-serial: pulled three times."""
    report.times = 1 if bench.quick else 3
    with UsbSticks(bench, "usb-receiver", []) as sticks:
        car, guest = sticks.car, sticks.guest
        car.wait_for_rows(8, 600)
        for _ in range(report.times):
            guest.ask("device_del", id="receiver")
            took_s = car.wait_for("status to say so", "ridelog status | grep -E 'GPS +(retrying|absent)'", 180)
            report.check("pulled: status says so", True, f"after {took_s:.0f} s")
            time.sleep(10)
            guest.ask("device_add", driver="usb-serial", chardev="receiver", id="receiver")
            took_s = car.wait_for("the receiver", "ridelog status | grep -E 'GPS +ok'", 180)
            report.check("back: opened by itself", True, f"after {took_s:.0f} s")
        time.sleep(30)
        found = rows(car)
        report.check("rows of the outage are flagged", any("gps_lost" in row["flags"] for row in found[3:]))
        report.check("rows hold places again", any(row["lat_deg"] for row in found[-6:]),
                     found[-1]["flags"] or "no flag")
        restarted = guest.must("systemctl show ridelog -p NRestarts --value").strip()
        report.check("restarts", restarted == "0", restarted)


