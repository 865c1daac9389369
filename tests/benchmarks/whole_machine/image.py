"""A disk with Debian and ridelog on it, made from packages.

Stages, each kept in the work folder under a name that says what it was made of: Debian's packages (mmdebstrap), the
wheels that ridelog needs, the root folder with ridelog installed by the README's first line (pip, in a venv under
/opt/ridelog), and a raw ext4 disk of it. The README's second line, ``ridelog install``, is the first trial: it needs
a running machine.
"""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from .shell import run

SUITE = "bookworm"
DISK_BYTES = 3_000_000_000
UML_MODULES = Path("/usr/lib/uml/modules")
IN_GUEST = Path(__file__).parent / "in_guest"
PACKAGES = ("systemd", "systemd-sysv", "udev", "dbus", "kmod", "python3", "python3-venv", "ca-certificates",
            "i2c-tools", "util-linux", "e2fsprogs")
KERNELS = {"amd64": "linux-image-amd64", "arm64": "linux-image-arm64"}
LIBRARIES = {"amd64": "x86_64", "arm64": "aarch64"}
WHEEL_TAGS = ("manylinux2014", "manylinux_2_17", "manylinux_2_24", "manylinux_2_27", "manylinux_2_28")
# What takes time at boot and has no part in any trial (a login's units too). The getty on ttyS0 would eat what the
# receiver says.
MASKED = ("getty@tty1.service", "serial-getty@ttyS0.service", "getty.target", "apt-daily.timer",
          "apt-daily-upgrade.timer", "dpkg-db-backup.timer", "e2scrub_all.timer", "e2scrub_reap.service",
          "fstrim.timer", "systemd-timesyncd.service", "cron.service", "systemd-networkd.service",
          "networking.service", "ifupdown-pre.service", "logrotate.timer", "rsyslog.service", "systemd-logind.service",
          "systemd-binfmt.service", "proc-sys-fs-binfmt_misc.automount", "modprobe@drm.service",
          "systemd-pstore.service", "modprobe@efi_pstore.service")
# Modules of Debian's stock kernel that stand between its start and its disk, and those of the shared folder.
INITRAMFS_MODULES = ("virtio_pci", "virtio_blk", "ext4", "9pnet_virtio", "9p", "virtio_mmio")


@dataclass(frozen=True)
class Image:
    """A raw ext4 disk, and the kernel and first file system of QEMU's guests that lie beside it."""

    disk: Path
    kernel: Path
    initrd: Path


def build(work: Path, tree: Path, arch: str = "amd64") -> Image:
    """The image of the commit that is checked out in ``tree``; what exists already is not made again."""
    work.mkdir(parents=True, exist_ok=True)
    commit = run("git", "-C", tree, "rev-parse", "HEAD").strip()[:12]
    image = Image(*(work / f"{arch}-{commit}.{end}" for end in ("img", "vmlinuz", "initrd")))
    if all(path.exists() for path in (image.disk, image.kernel, image.initrd)):
        return image
    root = work / f"root-{arch}-{commit}"
    if root.exists():
        shutil.rmtree(root)
    root.mkdir()
    run("tar", "-xf", _debian(work, arch), "-C", root)
    _install(root, tree, _wheels(work, tree, arch))
    _furnish(root, arch)
    _initramfs(root, image)
    new = image.disk.with_suffix(".new")
    new.unlink(missing_ok=True)
    run("mkfs.ext4", "-q", "-L", "root", "-d", root, new, f"{DISK_BYTES // 1024}k")
    new.rename(image.disk)
    shutil.rmtree(root)
    return image


def _debian(work: Path, arch: str) -> Path:
    """Debian's packages, as an archive."""
    archive = work / f"{SUITE}-{arch}.tar"
    if not archive.exists():
        new = archive.with_suffix(".new.tar")
        include = ",".join((*PACKAGES, KERNELS[arch]))
        run("mmdebstrap", "--mode=root", "--variant=important", f"--architectures={arch}", f"--include={include}",
            SUITE, new, timeout_s=7200)
        new.rename(archive)
    return archive


def _wheels(work: Path, tree: Path, arch: str) -> Path:
    """What ridelog depends on, for the guest's machine and Python: the newest wheels a Pi would be given."""
    folder = work / f"wheels-{arch}"
    if not folder.exists():
        new = folder.with_suffix(".new")
        text = (tree / "pyproject.toml").read_text()
        needs = re.findall(r'"([^"]+)"', re.search(r"\ndependencies = \[(.*?)\]", text, re.DOTALL)[1])
        tags = [f"--platform={tag}_{LIBRARIES[arch]}" for tag in WHEEL_TAGS]
        run(sys.executable, "-m", "pip", "download", "-q", "--dest", new, "--only-binary=:all:", *tags,
            "--python-version=3.11", *needs, "setuptools>=68", "wheel")
        new.rename(folder)
    return folder


def _install(root: Path, tree: Path, wheels: Path) -> None:
    """The README's first line, with wheels carried in for want of a network."""
    shutil.copytree(wheels, root / "root/wheels")
    put_source(tree, root / "root/ridelog")
    # ensurepip's own pip serves; nothing is asked of a network
    script = ("cd /root/ridelog && python3 -m venv /opt/ridelog && /opt/ridelog/bin/pip install -q --no-index "
              "--find-links /root/wheels .")
    run("chroot", root, "/bin/sh", "-c", script, timeout_s=7200)


def put_source(tree: Path, folder: Path) -> None:
    """The tree's commit, without its history, as a new folder."""
    folder.mkdir(parents=True)
    archive = subprocess.run(["git", "-C", tree, "archive", "HEAD"], check=True, capture_output=True).stdout
    subprocess.run(["tar", "-x", "-C", folder], input=archive, check=True)


def _furnish(root: Path, arch: str) -> None:
    """The modules of user-mode Linux, the agent, and nothing that waits or talks."""
    if arch == "amd64" and platform.machine() == "x86_64":
        for modules in UML_MODULES.iterdir():
            shutil.copytree(modules, root / "lib/modules" / modules.name, symlinks=True)
    bench = root / "opt/bench"
    bench.mkdir(parents=True)
    shutil.copy(IN_GUEST / "start.sh", bench)
    units = root / "etc/systemd/system"
    (units / "sysinit.target.wants").mkdir(exist_ok=True)
    for unit in ("bench-boot.service", "bench-agent.service"):
        shutil.copy(IN_GUEST / unit, units)
        (units / "sysinit.target.wants" / unit).symlink_to(f"/etc/systemd/system/{unit}")
    for unit in MASKED:
        (units / unit).unlink(missing_ok=True)
        (units / unit).symlink_to("/dev/null")
    (root / "etc/fstab").write_text("LABEL=root / ext4 defaults,noatime 0 1\n")
    (root / "etc/hostname").write_text("bench\n")
    (root / "etc/machine-id").write_text("0123456789abcdef0123456789abcdef\n")
    (root / "etc/systemd/journald.conf.d").mkdir(parents=True, exist_ok=True)
    (root / "etc/systemd/journald.conf.d/bench.conf").write_text("[Journal]\nStorage=persistent\nRateLimitBurst=0\n")
    (root / "var/log/journal").mkdir(parents=True, exist_ok=True)


def _initramfs(root: Path, image: Image) -> None:
    """A small first file system for QEMU: a big one takes a minute to unpack without KVM."""
    kernel = next((root / "boot").glob("vmlinuz-*"))
    version = kernel.name.removeprefix("vmlinuz-")
    (root / "etc/initramfs-tools/modules").write_text("\n".join(INITRAMFS_MODULES) + "\n")
    conf = root / "etc/initramfs-tools/initramfs.conf"
    conf.write_text(re.sub(r"^MODULES=.*$", "MODULES=list", conf.read_text(), flags=re.MULTILINE))
    run("chroot", root, "mkinitramfs", "-o", "/boot/bench.initrd", version, timeout_s=3600)
    shutil.copy(root / "boot/bench.initrd", image.initrd)
    shutil.copy(kernel, image.kernel)
