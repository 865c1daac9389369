"""Units and rules: checked by systemd's own tool where it is there, against the program's own settings everywhere."""

from __future__ import annotations

import fnmatch
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from logger.commands.main import command
from logger.installation import PROGRAM, Installation
from logger.service.config import MACHINE_CONFIG, Config
from logger.service.main_loop import HANG_US
from logger.service.serve import LONGEST_BEAT_S
from logger.service.systemd_notify import PRIORITY
from logger.shipped import shipped
from logger.store.export import sticks

SERVICE, EXPORT, CAR = "ridelog.service", "ridelog-export@.service", "ridelog-car.service"
MOST_EXPOSURE = 1.5
needs_systemd = pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze here")


def settings(unit: str) -> dict[str, list[str]]:
    """Every value of every key of a unit, in order."""
    found: dict[str, list[str]] = {}
    for line in (shipped("systemd") / unit).read_text().splitlines():
        if line and line[0] not in "#[":
            key, _, value = line.partition("=")
            found.setdefault(key, []).append(value)
    return found


@pytest.fixture
def units(tmp_path: Path) -> list[Path]:
    """The units as they are installed, the template for one stick."""
    for step in Installation(tmp_path, Path(sys.executable).with_name("ridelog"), lambda words: None).install():
        if step.act is not None:
            step.act()
    folder = tmp_path / "etc/systemd/system"
    shutil.copy(folder / EXPORT, folder / "ridelog-export@sda1.service")
    return [folder / SERVICE, folder / "ridelog-export@sda1.service", folder / CAR]


@needs_systemd
def test_systemd_finds_nothing_wrong(units: list[Path]) -> None:
    done = subprocess.run(["systemd-analyze", "verify", "--man=no", *units], capture_output=True, text=True)
    assert [line for line in (done.stdout + done.stderr).splitlines() if "ridelog" in line] == []
    assert done.returncode == 0


@needs_systemd
def test_systemd_would_find_something_wrong(units: list[Path]) -> None:
    """The check can fail."""
    text = units[0].read_text()
    units[0].write_text(text.replace("WatchdogSec=30", "WatchdogSec=soon\nWachtdog=20"))
    done = subprocess.run(["systemd-analyze", "verify", "--man=no", units[0]], capture_output=True, text=True)
    assert len([line for line in (done.stdout + done.stderr).splitlines() if "ridelog.service" in line]) == 2


@needs_systemd
def test_exposure_is_low(units: list[Path]) -> None:
    for unit in units:
        done = subprocess.run(["systemd-analyze", "security", "--offline=true", "--no-pager", unit],
                              capture_output=True, text=True, check=True)
        level = re.search(r"exposure level for \S+: ([0-9.]+)", done.stdout)
        assert level is not None
        assert float(level[1]) <= MOST_EXPOSURE


RUNS = ("ExecStartPre", "ExecStart", "ExecStop", "ExecStopPost")
"""What a unit runs, in this order."""

IN_THE_NAMESPACE_OF_PID_1 = ["/usr/bin/nsenter", "--mount=/proc/1/ns/mnt"]
ONE_AT_A_TIME = "/usr/bin/flock"


def written_lines(unit: str) -> list[str]:
    return [value for key in RUNS for value in settings(unit).get(key, [])]


def command_lines(unit: str) -> list[list[str]]:
    return [shlex.split(line.lstrip("-+")) for line in written_lines(unit)]


def inner(line: list[str]) -> list[str]:
    """What a line runs in the end: without the program that puts it into a namespace, or has it wait its turn."""
    if line[: len(IN_THE_NAMESPACE_OF_PID_1)] == IN_THE_NAMESPACE_OF_PID_1:
        return line[len(IN_THE_NAMESPACE_OF_PID_1):]
    if line[0] == ONE_AT_A_TIME:
        return next(line[place:] for place, word in enumerate(line) if place and word.startswith(("/usr/", "/opt/")))
    return line


def runs_of(program: str) -> list[list[str]]:
    return [line for line in map(inner, command_lines(EXPORT)) if line[0] == program]


def test_every_command_line_is_one_that_the_program_takes() -> None:
    ours = [line for unit in (SERVICE, EXPORT, CAR) for line in map(inner, command_lines(unit))
            if line[0] == str(PROGRAM)]
    assert len(ours) == 5
    for line in ours:
        command(line[1])[0].parse_args(line[2:])


def test_no_unit_and_no_rule_runs_a_shell() -> None:
    programs = {inner(line)[0] for unit in (SERVICE, EXPORT, CAR) for line in command_lines(unit)}
    assert programs <= {str(PROGRAM), "/usr/bin/mount", "/usr/bin/umount", "/usr/bin/touch", "/usr/bin/rm"}
    text = (shipped("systemd") / "90-ridelog.rules").read_text()
    assert set(re.findall(r'RUN\+="(\S+)', text)) == {"/usr/bin/chgrp", "/usr/bin/chmod"}


def test_only_mounting_is_done_as_root() -> None:
    """And it is done where it lasts: systemd gives each command of a unit mounts of its own, that of a command with
    ``+`` too, and a mount that is made among those ends with the command (systemd issue 14977)."""
    privileged = [shlex.split(value.lstrip("-+")) for value in written_lines(EXPORT) if "+" in value.split("/")[0]]
    assert [line[:2] for line in privileged] == [IN_THE_NAMESPACE_OF_PID_1] * 3
    assert [inner(line)[0] for line in privileged] == ["/usr/bin/mount", "/usr/bin/umount", "/usr/bin/umount"]
    assert len(runs_of("/usr/bin/mount") + runs_of("/usr/bin/umount")) == len(privileged)
    assert not [value for value in written_lines(SERVICE) if "+" in value.split("/")[0]]
    assert settings(SERVICE)["User"] == settings(EXPORT)["User"] == settings(CAR)["User"] == ["ridelog"]


def test_the_stick_is_mounted_so_that_nothing_on_it_can_act() -> None:
    mount, = runs_of("/usr/bin/mount")
    options = set(mount[mount.index("-o") + 1].split(","))
    assert {"nosuid", "nodev", "noexec", "uid=ridelog", "gid=ridelog"} <= options
    assert mount[mount.index("-t") + 1] == "vfat,exfat"
    copy = next(line for line in runs_of(str(PROGRAM)) if "--to" in line)
    assert {mount[-1]} == {umount[-1] for umount in runs_of("/usr/bin/umount")} == {copy[copy.index("--to") + 1]}


def test_what_a_stick_that_was_pulled_has_on_it_stops_no_later_export() -> None:
    """FAT keeps no journal: a name may have reached the stick before the list of its blocks. Removing such a file is an
    error after which Linux lets nothing more be written, unless it is asked to go on. Every file is read back."""
    mount, = runs_of("/usr/bin/mount")
    assert "errors=continue" in mount[mount.index("-o") + 1].split(",")


def test_folders_are_those_of_the_settings() -> None:
    service, export, config = settings(SERVICE), settings(EXPORT), Config()
    assert Path("/var/lib", *service["StateDirectory"]) == Path("/var/lib", *export["StateDirectory"])
    assert Path("/var/lib", *service["StateDirectory"]) == config.log.directory
    assert Path("/run", *service["RuntimeDirectory"]) == config.status_file.parent
    assert Path("/run", *export["RuntimeDirectory"]) == sticks.FOLDER
    assert str(MACHINE_CONFIG) in service["ExecStart"][0]


def test_it_is_watched_and_never_given_up() -> None:
    service = settings(SERVICE)
    assert service["Type"] == ["notify"]
    watchdog_s = float(service["WatchdogSec"][0])
    assert 2 * LONGEST_BEAT_S < watchdog_s <= 60
    assert watchdog_s > HANG_US / 1e6
    assert service["Restart"] == ["always"]
    assert "RestartPreventExitStatus" not in service
    assert service["StartLimitIntervalSec"] == settings(EXPORT)["StartLimitIntervalSec"] == ["0"]


def test_who_boots_without_memory_limits_is_reported() -> None:
    assert "MemoryMax" in settings(SERVICE)
    for place in (shipped("systemd") / SERVICE, Path(__file__).resolve().parents[2] / "docs/installation.md"):
        assert {"cgroup_disable=memory", "cgroup_enable=memory"} <= set(re.findall(r"cgroup_\w+=memory",
                                                                                  place.read_text()))


def test_real_time_is_permitted_and_no_condition() -> None:
    service = settings(SERVICE)
    assert service["LimitRTPRIO"] == [str(PRIORITY)]
    assert int(service["Nice"][0]) < 0
    assert not {"CPUSchedulingPolicy", "CPUSchedulingPriority", "RestrictRealtime"} & set(service)
    allowed = [line for line in service["SystemCallFilter"] if not line.startswith("~")]
    assert allowed == ["@system-service", "sched_setscheduler"]
    assert service["SystemCallFilter"][-1] == "sched_setscheduler"


def test_nothing_waits_for_a_clock_or_a_network() -> None:
    ordered = " ".join(settings(SERVICE)["After"] + settings(SERVICE)["Wants"] + settings(EXPORT)["After"])
    assert not {"time-sync.target", "time-set.target", "network.target", "network-online.target"} & set(ordered.split())


def test_devices_are_those_of_i2c_iio_and_serial_ports() -> None:
    assert settings(SERVICE)["DevicePolicy"] == settings(EXPORT)["DevicePolicy"] == ["closed"]
    assert {value.split()[0] for value in settings(SERVICE)["DeviceAllow"]} == {
        "char-i2c", "char-iio", "char-ttyAMA", "char-ttyS", "char-ttyUSB", "char-ttyACM", "char-rfcomm"}


def rules() -> list[list[tuple[str, str, str]]]:
    """The rules of udev as lists of (key, operator, value)."""
    lines = [line for line in (shipped("systemd") / "90-ridelog.rules").read_text().splitlines()
             if line and not line.startswith("#")]
    token = r'([A-Z]+(?:\{[A-Za-z_]+\})?)(==|!=|\+=|=)"([^"]*)"'
    assert all(re.fullmatch(rf"{token}(, {token})*", line) for line in lines)
    return [re.findall(token, line) for line in lines]


def the_rule(key: str, operator: str, value: str) -> dict[tuple[str, str], str]:
    found, = (rule for rule in rules() if (key, operator, value) in rule)
    return {(key, operator): value for key, operator, value in found}


def list_of(rule: dict[tuple[str, str], str]) -> list[tuple[str, str, str]]:
    return [(key, operator, value) for (key, operator), value in rule.items()]


def the_stick() -> dict[tuple[str, str], str]:
    return the_rule("ENV{RIDELOG_STICK}", "=", "1")


def wanted_by(properties: dict[str, str], parents: tuple[str, ...]) -> str:
    """The unit that the rules start for a disk with these properties, below devices of these subsystems: they are
    carried out as udev does it, as far as they ask for nothing else (man udev)."""
    env = dict(properties)
    known = {"ACTION": "add", "SUBSYSTEM": "block", "KERNEL": "sda1"}

    def holds(key: str, pattern: str) -> bool:
        if key == "SUBSYSTEMS":
            found = ["block", *parents]
        else:
            found = [env.get(key[4:-1], "") if key.startswith("ENV{") else known.get(key, "")]
        return any(fnmatch.fnmatchcase(one, part) for one in found for part in pattern.split("|"))

    for rule in rules():
        if all(holds(key, value) == (operator == "==") for key, operator, value in rule if operator in ("==", "!=")):
            env |= {key[4:-1]: value for key, operator, value in rule if operator in ("=", "+=") and "ENV{" in key}
    return env.get("SYSTEMD_WANTS", "")


USB_PARENTS = ("scsi", "usb", "pci")
FAT = {"ID_FS_USAGE": "filesystem", "ID_FS_TYPE": "vfat", "DEVTYPE": "partition"}


@pytest.mark.parametrize(("properties", "parents", "is_stick"), [
    ({"ID_BUS": "usb"}, USB_PARENTS, True),
    ({"ID_BUS": "ata", "ID_USB_DRIVER": "uas"}, USB_PARENTS, True),
    ({"ID_BUS": "ata", "ID_USB_DRIVER": "usb-storage"}, (), True),
    ({"ID_BUS": "scsi", "ID_USB_VENDOR": "Samsung"}, (), True),
    ({"ID_BUS": "nvme"}, USB_PARENTS, True),
    ({}, USB_PARENTS, True),
    ({"ID_BUS": "ata"}, ("scsi", "pci"), False),
    ({"ID_BUS": "nvme"}, ("nvme", "pci"), False),
    ({}, ("mmc", "platform"), False),
])
@pytest.mark.parametrize("label", ["RIDELOG", "ridelog", "Ridelog", "rideLOG", "RIDELOG2", ""])
def test_a_disk_on_usb_with_the_label_gets_the_logs_whatever_udev_calls_its_bus(
        properties: dict[str, str], parents: tuple[str, ...], is_stick: bool, label: str) -> None:
    wanted = wanted_by({**FAT, **properties, "ID_FS_LABEL": label}, parents)
    assert wanted.startswith("ridelog-export@") == (is_stick and label.upper() == "RIDELOG")


def test_the_rule_asks_for_the_label_and_starts_the_template() -> None:
    stick = the_stick()
    assert re.fullmatch(EXPORT.replace("@", "@.+"), stick["ENV{SYSTEMD_WANTS}", "+="])
    light = the_rule("KERNEL", "==", "ACT")
    assert light["SUBSYSTEM", "=="] == "leds"
    assert all("/sys/class/leds/ACT" in line for line in runs_of(str(PROGRAM)))


def test_a_stick_with_another_file_system_is_refused_in_words() -> None:
    """Its label asks for the logs: the export starts, cannot mount it, and says which kinds it takes."""
    assert not [key for key, _ in the_stick() if key == "ENV{ID_FS_TYPE}"]
    copy = next(line for line in runs_of(str(PROGRAM)) if "--to" in line)
    assert "--mounted" in copy


def test_a_stick_without_partitions_that_shows_as_a_disk_and_a_partition_is_one() -> None:
    """mkfs.fat 4.2 gives a whole disk a table with one partition that begins where the disk does: both have the label,
    and the second cannot be mounted. The disk goes first, and what it says of itself is there for its partitions."""
    stick = the_stick()
    assert stick["ENV{RIDELOG_STICK}", "!="] == stick["ENV{RIDELOG_STICK}", "="] == "1"
    phantom = the_rule("IMPORT{parent}", "=", "RIDELOG_STICK")
    assert (phantom["ENV{DEVTYPE}", "=="], phantom["ATTR{start}", "=="]) == ("partition", "0")
    assert rules().index(list_of(phantom)) < rules().index(list_of(stick))


def test_each_time_that_a_stick_is_plugged_in_is_an_instance_of_its_own() -> None:
    """A name such as sda1 comes back within a second, and systemd refuses to start an instance that it is still
    stopping, for good. The sequence number of a disk is given out once (Linux 5.15 and later)."""
    stick = the_stick()
    instance = stick["ENV{SYSTEMD_WANTS}", "+="].removeprefix("ridelog-export@").removesuffix(".service")
    assert "$env{DISKSEQ}" in instance
    assert stick["SYMLINK", "+="] == f"ridelog/{instance}"
    assert stick["TAG", "+="] == "systemd"
    number_of_the_disk = the_rule("IMPORT{parent}", "=", "DISKSEQ")
    assert number_of_the_disk["ENV{DEVTYPE}", "=="] == "partition"
    unit = settings(EXPORT)
    assert unit["BindsTo"] == ["dev-ridelog-%i.device"]
    assert "dev-ridelog-%i.device" in unit["After"][0].split()
    assert unit["DeviceAllow"] == ["/dev/ridelog/%i rw"]
    mount, = runs_of("/usr/bin/mount")
    assert mount[-2] == "/dev/ridelog/%i"
    assert all("%i" in value for value in (*unit["ReadWritePaths"][:1], mount[-1]))


def test_the_note_of_a_stick_comes_first_and_goes_before_anything_that_takes_time() -> None:
    lines = [inner(line) for line in command_lines(EXPORT)]
    note = f"{sticks.FOLDER}/%i.json"
    assert lines[0] == ["/usr/bin/touch", note]
    stopping = [inner(shlex.split(line.lstrip("-+"))) for line in settings(EXPORT)["ExecStopPost"]]
    assert stopping[:2] == [["/usr/bin/rm", "--force", note],
                            ["/usr/bin/umount", "--quiet", "--lazy", "/run/ridelog-stick/%i"]]
    assert all(note in line for line in runs_of(str(PROGRAM)))


def test_one_stick_at_a_time_gets_the_logs() -> None:
    """A stick may have a hundred partitions of that label. The others wait, in a program that takes no memory. That a
    stick may be pulled is shown at once, and not after the next one's copy."""
    ours = [line for line in command_lines(EXPORT) if inner(line)[0] == str(PROGRAM)]
    assert all(line[0] == ONE_AT_A_TIME for line in ours)
    places = {next(Path(word) for word in line if word.startswith("/run/")): "--to" in line for line in ours}
    assert sorted(places.values()) == [False, True]
    assert {place.parent for place in places} == {sticks.FOLDER}
