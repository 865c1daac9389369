"""A Pi's processor, emulated: its wheels, the demo, and the service on an aarch64 Debian."""

from __future__ import annotations

import re
import shutil
import time

from ..bench import INSTALL, Bench, Car
from ..catalogue import Report, trial
from ..drive import Receiver
from ..guest import PATIENT, QemuGuest
from ..image import build
from ..shell import run

SERVICE_S = 1200.0


@trial("on aarch64, pip installs the wheels that a Pi uses, the demo runs, and the service boots and writes rows",
       "aarch64")
def aarch64(bench: Bench, report: Report) -> None:
    """Debian for arm64: programs by qemu's user emulation, then a whole board."""
    began_s = time.monotonic()
    image = build(bench.work, bench.tree, "arm64")
    report.check("Debian for arm64, ridelog and its wheels installed by pip", True,
                 f"{time.monotonic() - began_s:.0f} s; {', '.join(wheels(bench))}")
    folder = bench.new_folder("arm-demo")
    disk, root = folder / "disk.img", folder / "root"
    shutil.copy(image.disk, disk)
    root.mkdir()
    run("mount", "-o", "loop", disk, root)
    try:
        began_s = time.monotonic()
        said = run("chroot", root, "/bin/sh", "-c", "uname -m; cd /tmp && /opt/ridelog/bin/ridelog "
                   "demo --out /tmp/demo && ls -s /tmp/demo/report.html && /opt/ridelog/bin/ridelog verify /tmp/demo",
                   timeout_s=3600)
        verified = next((line for line in said.splitlines() if line.startswith(("ok", "WRONG"))), "")
        report.check("ridelog demo, and ridelog verify of its logs", said.startswith("aarch64"),
                     f"{time.monotonic() - began_s:.0f} s; {verified}")
    finally:
        run("umount", root)
    folder = bench.new_folder("arm-board")
    receiver = Receiver(bench.drive)
    guest = QemuGuest(folder, image, arch="arm64")
    guest.devices = ["-chardev", f"serial,id=receiver,path={receiver.port}", "-device",
                     "usb-serial,chardev=receiver,id=receiver"]
    shutil.copy(bench.drive, guest.share / "drive.dump.gz")
    (guest.share / "ridelog.yaml").write_text(
        "accelerometer: {bma220: {i2c_bus: 'dump:/host/drive.dump.gz'}}\ngps: {port: /dev/ttyUSB0}\n")
    with Car(guest, receiver) as car:
        report.measure("a board boots, seconds to a shell", f"{car.boot():.0f}")
        guest.must(PATIENT + "mkdir -p /etc/ridelog; cp /host/ridelog.yaml /etc/ridelog/", 60)
        began_s = time.monotonic()
        guest.must(INSTALL, 1200)
        report.measure("ridelog install [s]", f"{time.monotonic() - began_s:.0f}")
        took_s = car.wait_for_rows(5, SERVICE_S)
        status = guest.status()
        report.check("the service writes rows", status["rows_written"] >= 5,
                     f"{status['rows_written']} rows after {took_s:.0f} s; accelerometer "
                     f"{status['accelerometer']['state']}, GPS {status['gps']['state']}")
        memory = guest.must("grep VmHWM /proc/$(systemctl show ridelog -p MainPID --value)/status").split()[1]
        report.check("memory at the most [MB]", int(memory) / 1024 < 140, f"{int(memory) / 1024:.0f}")


def wheels(bench: Bench) -> list[str]:
    """Names of the compiled wheels that were installed."""
    names = [path.name for path in (bench.work / "wheels-arm64").glob("*.whl")]
    return sorted(re.sub(r"-cp.*", "", name) for name in names if "aarch64" in name)
