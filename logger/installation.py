"""The logger put in place on a machine, and taken away again.

Problem. A service needs a user, groups, units, rules and settings in six folders, and somebody will want to see what
is done before it is done as root, do it again with a newer version, and undo it, without losing what they changed by
hand. Solution: everything is a list of small steps that are made before any is taken, so that a dry run prints what a
real one does. A record of the checksums of all files put in place shows what is still ours: only that is replaced or
removed. What has been changed by hand stays, and a newer version of it is put beside it as ``NAME.new``. The same steps
fill a folder that is to become a machine's root. Logs are never touched.
"""

import hashlib
import json
import os
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from logger.errors import BadInput, CheckFailed
from logger.files import make_folder, replace_bytes
from logger.shipped import shipped

PROGRAM = Path("/opt/ridelog/bin/ridelog")
"""Where the shipped units expect the program; another place is put into them."""

RECORD = "etc/ridelog/installed.json"
LOGS = "var/lib/ridelog"
CONFIG = "etc/ridelog/ridelog.yaml"
SYSUSERS = "etc/sysusers.d/ridelog.conf"
FILES = {
    SYSUSERS: "systemd/ridelog.sysusers",
    CONFIG: "config/ridelog.yaml",
    "etc/systemd/system/ridelog.service": "systemd/ridelog.service",
    "etc/systemd/system/ridelog-export@.service": "systemd/ridelog-export@.service",
    "etc/systemd/system/ridelog-car.service": "systemd/ridelog-car.service",
    "etc/udev/rules.d/90-ridelog.rules": "systemd/90-ridelog.rules",
}
ENABLED = "etc/systemd/system/multi-user.target.wants/ridelog.service"
COMMAND = "usr/local/bin/ridelog"

_HIDDEN_FROM_SERVICES = ("/home", "/root", "/run/user", "/tmp", "/var/tmp")

Run = Callable[[Sequence[str]], None]


@dataclass(frozen=True)
class InstallationStep:
    """One step: what it does in words, and the doing of it; ``act`` None: what is left as it is."""

    words: str
    act: Callable[[], None] | None = None


@dataclass
class Installation:
    """An installation in ``root`` of ``program``. ``run`` carries out a command line, and raises CheckFailed."""

    root: Path
    program: Path
    run: Run
    _record: dict[str, str] = field(init=False)

    def __post_init__(self) -> None:
        self._record = self._read_record()

    def install(self) -> list[InstallationStep]:
        """The steps that put everything in place. Raises BadInput for a root whose folders lead out of it."""
        files = {name: self._shipped(source) for name, source in FILES.items()}
        steps = [self._put(name, data) for name, data in files.items()]
        steps += [self._link(ENABLED, Path("/etc/systemd/system/ridelog.service")), self._link(COMMAND, self.program)]
        links = {COMMAND: str(self.program)} if self._is_ours(COMMAND, self.program) else {}
        steps.append(self._put_record({name: _digest(data) for name, data in files.items()} | links))
        sysusers = ["systemd-sysusers", str(self.root / SYSUSERS)]
        if not self._is_this_machine:
            return [*steps, self._command("systemd-sysusers", f"--root={self.root}", sysusers[1])]
        return [
            *steps,
            self._command(*sysusers),
            self._command("systemctl", "daemon-reload"),
            self._command("udevadm", "control", "--reload"),
            self._command("udevadm", "trigger", "--action=add", "--subsystem-match=leds"),
            self._command("systemctl", "restart", "ridelog.service"),
        ]

    def uninstall(self) -> list[InstallationStep]:
        """The steps that take away what ``install`` put in place, but for logs and for what was changed since."""
        steps = []
        if self._is_this_machine:
            steps.append(self._stop())
        steps += [self._unlink(ENABLED, Path("/etc/systemd/system/ridelog.service")),
                  self._unlink(COMMAND, self.program)]
        put = {name: digest for name, digest in self._record.items() if name in FILES}
        steps += [self._take(name, digest) for name, digest in put.items()]
        steps += [self._take(f"{name}.new", digest) for name, digest in put.items()
                  if self._place(f"{name}.new").exists()]
        steps += [self._take_record(), self._take_folder("etc/ridelog")]
        if self._is_this_machine:
            steps += [self._command("systemctl", "daemon-reload"), self._command("udevadm", "control", "--reload")]
        logs = self.root / LOGS
        return [*steps, InstallationStep(f"keep {logs} and the user ridelog who owns it" if logs.exists()
                             else "keep the user ridelog (userdel ridelog removes it)")]

    @property
    def _is_this_machine(self) -> bool:
        return self.root == Path("/")

    def _shipped(self, source: str) -> bytes:
        folder, name = source.split("/")
        data = (shipped(folder) / name).read_bytes()
        return data if folder == "config" else data.replace(os.fsencode(PROGRAM), os.fsencode(self.program))

    def _place(self, name: str) -> Path:
        path = self.root / name
        if not path.parent.resolve().is_relative_to(self.root.resolve()):
            raise BadInput(f"{path.parent}: expected a folder inside {self.root}; a link leads out of it")
        return path

    def _put(self, name: str, data: bytes) -> InstallationStep:
        path = self._place(name)
        found = _content(path)
        if found == data:
            return InstallationStep(f"keep {path}: it is there")
        if path.is_symlink() or (found is not None and _digest(found) != self._record.get(name)):
            new = path.with_name(f"{path.name}.new")
            return InstallationStep(f"keep {path}: it was changed; write {new} beside it", lambda: _write(new, data))
        return InstallationStep(f"{'write' if found is None else 'replace'} {path}", lambda: _write(path, data))

    def _take(self, name: str, digest: str) -> InstallationStep:
        path = self._place(name)
        found = _content(path)
        if found is None:
            return InstallationStep(f"nothing at {path}")
        if path.is_symlink() or _digest(found) != digest:
            return InstallationStep(f"keep {path}: it was changed")
        return InstallationStep(f"remove {path}", path.unlink)

    def _link(self, name: str, target: Path) -> InstallationStep:
        path = self._place(name)
        if path.is_symlink() and path.readlink() == target:
            return InstallationStep(f"keep {path}: it is there")
        if not self._is_ours(name, target):
            return InstallationStep(f"keep {path}: ridelog did not make it")
        if path.is_symlink():
            return InstallationStep(f"link {path} to {target}, no longer to {path.readlink()}",
                                    lambda: _make_link(path, target))
        return InstallationStep(f"link {path} to {target}", lambda: _make_link(path, target))

    def _unlink(self, name: str, target: Path) -> InstallationStep:
        path = self._place(name)
        if path.is_symlink() and self._is_ours(name, target):
            return InstallationStep(f"remove {path}", path.unlink)
        return InstallationStep(f"keep {path}: ridelog did not make it" if path.is_symlink() or path.exists() else
                                f"nothing at {path}")

    def _is_ours(self, name: str, target: Path) -> bool:
        """True where a link is ours to make or to remove: to our target, to one that we recorded, or there is none."""
        path = self._place(name)
        if not path.is_symlink():
            return not path.exists()
        return str(path.readlink()) in (str(target), self._record.get(name))

    def _stop(self) -> InstallationStep:
        """systemctl fails for a unit that it does not know: then there is nothing to stop."""
        unit = self._place("etc/systemd/system/ridelog.service")
        if unit.exists():
            return self._command("systemctl", "stop", "ridelog.service", "ridelog-export@*.service",
                                 "ridelog-car*.service")  # an older ridelog put no such unit
        return InstallationStep(f"nothing to stop: no {unit}")

    def _put_record(self, digests: dict[str, str]) -> InstallationStep:
        path = self._place(RECORD)
        data = (json.dumps(digests, indent=1) + "\n").encode("ascii")
        return InstallationStep(f"write {path}", lambda: _write(path, data))

    def _take_record(self) -> InstallationStep:
        path = self._place(RECORD)
        return InstallationStep(f"remove {path}", lambda: path.unlink(missing_ok=True))

    def _take_folder(self, name: str) -> InstallationStep:
        path = self._place(name)

        def remove() -> None:
            if path.is_dir() and not any(path.iterdir()):
                path.rmdir()

        return InstallationStep(f"remove {path} if it is empty", remove)

    def _command(self, *words: str) -> InstallationStep:
        return InstallationStep(f"run {' '.join(words)}", lambda: self.run(words))

    def _read_record(self) -> dict[str, str]:
        """Checksums of what was put in place, and where the command leads, by name; nothing where there is no record
        that can be read."""
        try:
            found = json.loads((self.root / RECORD).read_text("ascii"))
            return {name: str(found[name]) for name in (*FILES, COMMAND) if name in found}
        except (OSError, ValueError, TypeError):
            return {}


def hidden_from_services(program: Path) -> bool:
    """True for a program in a place that the hardened units do not let a service see."""
    return any(program.is_relative_to(place) for place in _HIDDEN_FROM_SERVICES)


def run_command(words: Sequence[str]) -> None:
    """Carry out a command. Raises CheckFailed with its own words when it fails or is not there."""
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False)
    except OSError as error:
        raise CheckFailed(f"{words[0]}: expected this command here ({error.strerror})") from None
    if done.returncode:
        raise CheckFailed(f"{' '.join(words)}: {done.stderr.strip() or f'exit status {done.returncode}'}")


def _content(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None


def _write(path: Path, data: bytes) -> None:
    make_folder(path.parent)
    replace_bytes(path, data, 0o644)


def _make_link(path: Path, target: Path) -> None:
    make_folder(path.parent)
    new = path.with_name(f".{path.name}.ridelog-tmp")
    new.unlink(missing_ok=True)
    new.symlink_to(target)
    new.replace(path)


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
