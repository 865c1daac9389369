"""A running guest: boot it, run commands in it, cut its power.

Two kinds with one interface. ``UmlGuest`` is user-mode Linux: quick to boot, its receiver a pseudo-terminal of the
host. ``QemuGuest`` is a whole emulated PC (or an aarch64 board) with Debian's own kernel: slow, and the only one with
real USB. Each begins from a base disk that is never written to; what it writes goes to a layer (or copy) of its own,
which stays over a power cut and can be thrown away.
"""

from __future__ import annotations

import itertools
import json
import os
import shutil
import signal
import socket
import subprocess
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from .image import IN_GUEST, Image
from .shell import run

UML_MEMORY = "mem=512M"
KERNEL_WORDS = ("rw", "systemd.show_status=0", "loglevel=4", "systemd.unified_cgroup_hierarchy=1")
POLL_S = 0.05
PATIENT = """mkdir -p /etc/systemd/system/ridelog.service.d
printf '[Service]\\nWatchdogSec=10min\\n' >/etc/systemd/system/ridelog.service.d/emulated.conf
systemctl daemon-reload
"""
"""Without KVM an emulated machine on a busy host may stand still for longer than the service's watchdog waits."""


class GuestFailed(Exception):
    """A guest did not come up, or a command in it never ended."""


@dataclass(frozen=True)
class Done:
    """A command that ended: its exit status and what it printed."""

    rc: int
    out: str


class Guest:
    """What both kinds share: the folder through which commands go, and the process."""

    boot_limit_s = 300.0
    layer: Path

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.share = folder / "share"
        self._process: subprocess.Popen[bytes] | None = None
        self._numbers = itertools.count()
        self.booted_s = 0.0
        self.started_s = 0.0
        self.share.mkdir(parents=True, exist_ok=True)
        shutil.copytree(IN_GUEST, self.share / "in_guest", dirs_exist_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
                 ) -> None:
        self.cut_power()

    def on_boot(self, script: str) -> None:
        """What the guest does first at every boot, before the service starts."""
        (self.share / "boot.sh").write_text(script)

    def boot(self) -> float:
        """Start it, and wait until it takes commands; the seconds that took."""
        self.start()
        return self.wait_until_up()

    def start(self) -> None:
        """Switch it on."""
        for name in ("in", "out"):
            shutil.rmtree(self.share / name, ignore_errors=True)
            (self.share / name).mkdir()
        (self.share / "up").unlink(missing_ok=True)
        self.started_s = time.monotonic()
        log = (self.folder / "console.log").open("ab")
        log.write(b"\n==== power on\n")
        self._process = subprocess.Popen(self._command(), stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                         cwd=self.folder, start_new_session=True)
        log.close()

    def wait_until_up(self) -> float:
        """Seconds from power on until it takes commands. GuestFailed when it never does."""
        while not (self.share / "up").exists():
            if not self.is_on or time.monotonic() > self.started_s + self.boot_limit_s:
                raise GuestFailed(f"no boot within {self.boot_limit_s:.0f} s; see {self.folder / 'console.log'}")
            time.sleep(POLL_S)
        self.booted_s = time.monotonic() - self.started_s
        return self.booted_s

    def forget(self) -> None:
        """Throw away all that was written since the base disk."""
        self.layer.unlink(missing_ok=True)

    @property
    def is_on(self) -> bool:
        """Whether the guest's process runs."""
        return self._process is not None and self._process.poll() is None

    def begin(self, script: str) -> str:
        """Hand a script of bash to the guest without waiting for its end; its name."""
        name = f"{next(self._numbers):05d}"
        temporary = self.share / "in" / f"{name}.tmp"
        temporary.write_text(script)
        temporary.rename(temporary.with_suffix(".sh"))
        return name

    def end_of(self, name: str, timeout_s: float = 120) -> Done:
        """Wait for a script that was begun. GuestFailed after ``timeout_s``."""
        rc = self.share / "out" / f"{name}.rc"
        end = time.monotonic() + timeout_s
        while not rc.exists():
            if time.monotonic() > end or not self.is_on:
                raise GuestFailed(f"script {name} did not end within {timeout_s:.0f} s (guest on: {self.is_on})")
            time.sleep(POLL_S)
        return Done(int(rc.read_text()), (self.share / "out" / f"{name}.out").read_text(errors="replace"))

    def run(self, script: str, timeout_s: float = 120) -> Done:
        """Run a script of bash to its end, whatever its exit status."""
        return self.end_of(self.begin(script), timeout_s)

    def must(self, script: str, timeout_s: float = 120) -> str:
        """What a script printed. GuestFailed when its exit status is not 0."""
        done = self.run(script, timeout_s)
        if done.rc != 0:
            raise GuestFailed(f"in the guest: {script[:200]!r} gave {done.rc}: {done.out[-2000:]}")
        return done.out

    def status(self) -> dict[str, Any]:
        """What ``ridelog status --json`` says; empty while it says nothing that can be read."""
        try:
            return json.loads(self.run("cat /run/ridelog/status.json", 60).out)
        except ValueError:
            return {}

    def cut_power(self) -> None:
        """End it as a cut of its power does: at once, with all that its kernel had not written."""
        if self._process is not None:
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._process = None

    def shut_down(self, timeout_s: float = 120) -> None:
        """Switch it off in the proper way."""
        self.begin("systemctl poweroff")
        if self._process is not None:
            try:
                self._process.wait(timeout_s)
            except subprocess.TimeoutExpired as error:
                raise GuestFailed("it did not shut down") from error
            self.cut_power()

    def _command(self) -> list[str]:
        raise NotImplementedError


class UmlGuest(Guest):
    """User-mode Linux on a layer over ``base``. ``serial`` is a terminal of the host, the guest's /dev/ttyS0."""

    boot_limit_s = 240.0

    def __init__(self, folder: Path, base: Path, serial: str | None = None) -> None:
        super().__init__(folder)
        self.base = base
        self.layer = folder / "disk.cow"
        self.serial = serial
        self.umid = f"bench-{os.getpid()}-{folder.name}"

    def save_as(self, disk: Path) -> None:
        """Make a new base disk of this guest's, which must be off."""
        new = disk.with_suffix(".new")
        run("uml_moo", "-b", self.base, self.layer, new)
        new.rename(disk)

    def _command(self) -> list[str]:
        words = ["linux.uml", UML_MEMORY, f"ubd0={self.layer},{self.base}", "root=/dev/ubda", f"umid={self.umid}",
                 "con=null", "con0=null,fd:1", "ssl=null", f"bench_share={self.share}", *KERNEL_WORDS]
        return words if self.serial is None else [*words, f"ssl0=tty:{self.serial}"]


class QemuGuest(Guest):
    """An emulated machine on a copy of ``image``'s disk; ``arch`` amd64 (a PC) or arm64 (board "virt")."""

    boot_limit_s = 900.0

    def __init__(self, folder: Path, image: Image, base: Path | None = None, arch: str = "amd64") -> None:
        super().__init__(folder)
        self.image = image
        self.base = base or image.disk
        self.arch = arch
        self.layer = folder / "disk.img"
        self.devices: list[str] = []
        self._monitor = folder / "monitor"

    def ask(self, command: str, **arguments: Any) -> Any:
        """One command of QEMU's machine protocol (QMP). GuestFailed when it is refused."""
        with socket.socket(socket.AF_UNIX) as wire:
            wire.settimeout(30)
            wire.connect(str(self._monitor))
            file = wire.makefile("rw")
            file.readline()
            answer: dict[str, Any] = {}
            for execute, words in (("qmp_capabilities", {}), (command, arguments)):
                file.write(json.dumps({"execute": execute, "arguments": words}) + "\n")
                file.flush()
                answer = json.loads(file.readline())
                while "event" in answer:
                    answer = json.loads(file.readline())
        if "error" in answer:
            raise GuestFailed(f"{command}: {answer['error']}")
        return answer["return"]

    def _command(self) -> list[str]:
        if not self.layer.exists():
            run("cp", "--sparse=always", self.base, self.layer)
        machine = (["qemu-system-x86_64", "-machine", "q35", "-cpu", "max"] if self.arch == "amd64" else
                   ["qemu-system-aarch64", "-machine", "virt", "-cpu", "cortex-a72"])
        console = "ttyS0" if self.arch == "amd64" else "ttyAMA0"
        return [*machine, "-accel", "tcg,thread=multi", "-m", "640", "-smp", "1", "-display", "none", "-no-reboot",
                "-kernel", str(self.image.kernel), "-initrd", str(self.image.initrd),
                "-append", " ".join(["root=/dev/vda", f"console={console}", "bench_share=9p", *KERNEL_WORDS]),
                "-drive", f"file={self.layer},format=raw,if=virtio,cache=writeback",
                "-fsdev", f"local,id=share,path={self.share},security_model=none",
                "-device", "virtio-9p-pci,fsdev=share,mount_tag=share",
                "-device", "qemu-xhci,id=usb", "-serial", "stdio",
                "-qmp", f"unix:{self._monitor},server=on,wait=off", "-nic", "none", *self.devices]
