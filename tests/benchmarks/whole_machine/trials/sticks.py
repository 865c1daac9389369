"""USB sticks on user-mode Linux: real udev, systemd and file systems, disks of the kernel's scsi_debug."""

from __future__ import annotations

import json
import time
from typing import Any

from ..bench import Bench, Car
from ..catalogue import Report, trial
from ..shell import run

STICK_MB = 40
DUMPS = 24
"""Recordings of 0.9 MB beside the logs, so that copying takes some seconds."""

EXPORT_S = 150.0
MISSING = ("grep -v '^#' /var/lib/ridelog/exported-marks 2>/dev/null | while read -r sha size time stick name; do "
           "[ -n \"$name\" ] || continue; "
           "f=$(find . -name $name -type f | head -1); [ \"$(sha256sum <$f 2>/dev/null | cut -c1-64)\" = $sha ] || "
           "echo $name; done")
"""Names of files that the logger takes for exported and that do not lie, as they were, in this folder."""

NOTES = "cat /run/ridelog-export/*.json 2>/dev/null"


class Sticks:
    """A car with logs to fetch, and some sticks that are not plugged in yet."""

    def __init__(self, bench: Bench, name: str, contents: list[list[str]], megabytes: int = STICK_MB) -> None:
        """``contents``: per stick of that size the commands of the host that fill its image ``IMAGE``."""
        self.car: Car = bench.car(name, chip="dump")
        for number, commands in enumerate(contents):
            image = self.car.guest.share / f"stick-{number}.img"
            with image.open("wb") as file:
                file.truncate(megabytes * 1_000_000)
            for command in commands:
                run("sh", "-c", command.replace("IMAGE", str(image)))
        self._count = len(contents)
        self._megabytes = megabytes

    def __enter__(self) -> Sticks:
        self.car.__enter__()
        self.car.boot()
        self.car.wait_for("the service", "systemctl is-active ridelog", 180)
        self.car.guest.must(
            # two starts of the service leave a finished log, so that there is something to fetch
            f"sleep 20; systemctl restart ridelog; cd /var/lib/ridelog; for n in $(seq {DUMPS}); do "
            "cp /host/drive.dump.gz 000$((n + 10)).dump.gz; done; chown ridelog: *.gz; sync", 180)
        loads = "; ".join(f"load {number} /host/stick-{number}.img" for number in range(self._count))
        self.do(f"sticks_ready {self._count} {self._megabytes}; {loads}")
        return self

    def __exit__(self, *error: Any) -> None:
        self.car.__exit__(*error)

    def do(self, script: str, timeout_s: float = 180) -> str:
        """Run a script that knows ``plug N``, ``pull N``, ``stick N`` and ``look N COMMAND``."""
        return self.car.guest.must(f". /host/in_guest/sticks.sh; {script}", timeout_s)

    def notes(self) -> list[dict[str, Any]]:
        """What ``ridelog status --json`` says about sticks."""
        out = self.car.guest.run("ridelog status --json", 120).out
        try:
            return json.loads(out.strip().splitlines()[-1])["sticks"]
        except (ValueError, KeyError, IndexError):
            return []

    def ready(self, count: int = 1, timeout_s: float = EXPORT_S, stick: str = "") -> list[dict[str, Any]]:
        """Wait until that many sticks (or the one of this name) may be pulled, as status says; what it says of them."""
        end_s = time.monotonic() + timeout_s
        while True:
            notes = [note for note in self.notes() if stick in ("", note["stick"]) or "." not in note["stick"]]
            if sum(note["state"] == "ready" for note in notes) >= count or time.monotonic() > end_s:
                return notes
            time.sleep(0.5)

    def no_notes(self, timeout_s: float = 60) -> bool:
        """Whether status stops speaking of sticks within this time."""
        end_s = time.monotonic() + timeout_s
        while time.monotonic() < end_s:
            if not self.notes():
                return True
            time.sleep(0.5)
        return False

    def verify(self, number: int) -> tuple[int, str]:
        """What ``ridelog verify`` says of a stick that is plugged in: its exit status and its first line."""
        done = self.car.guest.run(f". /host/in_guest/sticks.sh; look {number} 'ridelog verify . 2>&1'", 300)
        lines = done.out.strip().splitlines()
        return done.rc, lines[0] if lines else ""

    def journal(self) -> str:
        """The last words of the export units."""
        return self.car.guest.run("journalctl -u 'ridelog-export@*' -o cat -n 12; journalctl -b -o cat | "
                                  "grep -iE 'destructive|failed to enqueue' | tail -3").out


FAT = ["mkfs.vfat -n RIDELOG --mbr=n IMAGE >/dev/null"]


def words(notes: list[dict[str, Any]]) -> str:
    """Notes in one line."""
    return "; ".join(f"{note['state']}, {'ok' if note['ok'] else 'WRONG'}: {note['text']}" for note in notes) or "none"


@trial("a FAT stick labelled RIDELOG is mounted, gets every finished file, checked, and is unmounted; plugged in again "
       "it gets what is new")
def stick_fat(bench: Bench, report: Report) -> None:
    """The retrieval as the README has it."""
    with Sticks(bench, "stick-fat", [FAT, ["mkfs.vfat -n RIDELOG --mbr=y IMAGE >/dev/null"]]) as sticks:
        began_s = time.monotonic()
        sticks.do("plug 0")
        notes = sticks.ready()
        took_s = time.monotonic() - began_s
        report.check("status says that it may be pulled, with everything on it",
                     len(notes) == 1 and notes[0]["ok"], f"{took_s:.0f} s; {words(notes)}")
        report.check("it is not mounted then", "sd" not in sticks.do("grep /dev/sd /proc/mounts || true"))
        files = int(sticks.do("look 0 'find . -type f | wc -l'"))
        report.check("files on it", files >= DUMPS + 2, files)
        rc, last = sticks.verify(0)
        report.check("ridelog verify of it", rc == 0, last)
        sticks.do("pull 0")
        report.check("pulled: status no longer mentions it", sticks.no_notes())
        sticks.do("systemctl restart ridelog; sleep 8; plug 0")
        notes = sticks.ready()
        more = int(sticks.do("look 0 'find . -type f | wc -l'"))
        report.check("plugged in again it gets what is new", bool(notes) and notes[0]["ok"] and more > files,
                     f"{more - files} more files; {words(notes)}")
        sticks.do("pull 0; plug 1")
        notes = sticks.ready()
        time.sleep(5)
        notes = sticks.notes() or notes
        report.check("a whole disk that mkfs.vfat gave a phantom partition is one stick",
                     len(notes) == 1 and notes[0]["ok"], words(notes))
        if not report.held:
            report.check("journal", False, sticks.journal()[-600:])


@trial("a stick that is plugged in again within a second is served every time, and the note of the previous time is "
       "not shown")
def stick_back_within_a_second(bench: Bench, report: Report) -> None:
    """Pulled when it may be, or early, and back at once."""
    report.times = 3 if bench.quick else 20
    with Sticks(bench, "stick-back", [FAT]) as sticks:
        sticks.do("plug 0")
        served, stayed, stale = 0, 0, 0
        notes = sticks.ready()
        for number in range(report.times):
            pause_s = 0.3 if number % 2 == 0 else 0.9
            name = sticks.do(f"pull 0; sleep {pause_s}; plug 0; n=$(stick 0); echo $n.$(cat /sys/block/$n/diskseq)")
            # older units name the note by the device alone; then one that is ready at once is that of the last time
            stale += any(note["state"] == "ready" and note["stick"] != name.strip() for note in sticks.notes())
            if number % 3 == 0:  # pulled again while it is being served
                time.sleep(number % 5)
                continue
            stayed += 1
            notes = sticks.ready(timeout_s=100, stick=name.strip())
            fresh = bool(notes) and all(note["ok"] for note in notes)
            served += fresh
            if not fresh:
                print(f"    {number}: {words(notes)}", flush=True)
        report.check("served", served == stayed, f"{served} of {stayed} that stayed in (the others were pulled again "
                     f"within 5 s); {words(notes)}")
        report.check("status shows a note of the last time, just after it is plugged in", stale == 0,
                     f"{stale} of {report.times}")
        report.check("jobs that systemd refused", "estructive" not in sticks.journal(), sticks.journal()[-300:])


@trial("two sticks at once: both get everything")
def two_sticks_at_once(bench: Bench, report: Report) -> None:
    """Plugged in in the same instant."""
    with Sticks(bench, "stick-two", [FAT, FAT]) as sticks:
        began_s = time.monotonic()
        sticks.do("plug 0; plug 1")
        time.sleep(3)
        first = sticks.notes()
        report.check("both are shown at once", len(first) == 2, words(first))
        notes = sticks.ready(2, 2 * EXPORT_S)
        report.check("both may be pulled, with everything", len(notes) == 2 and all(note["ok"] for note in notes),
                     f"{time.monotonic() - began_s:.0f} s; {words(notes)}")
        for number in (0, 1):
            rc, last = sticks.verify(number)
            report.check(f"ridelog verify of stick {number + 1}", rc == 0, last)


@trial("a stick that cannot get everything says so in words; others' files stay; one without our label is left alone")
def sticks_of_other_kinds(bench: Bench, report: Report) -> None:
    """ext4, no label, full, and with files of others."""
    contents = [
        ["mkfs.ext4 -q -F -L RIDELOG IMAGE"],
        ["mkfs.vfat -n HOLIDAY --mbr=n IMAGE >/dev/null"],
        [*FAT, "true"],
        [*FAT, "true"],
    ]
    fill = ("rm -f /run/on-usb; scan {n}; udevadm settle; mkdir -p /mnt/f; mount /dev/$(stick {n}) /mnt/f; "
            "mkdir -p /mnt/f/photos /mnt/f/ridelog; echo mine > /mnt/f/photos/a.txt; echo mine > /mnt/f/ridelog/b.txt; "
            "{more} umount /mnt/f; pull {n}")
    with Sticks(bench, "stick-kinds", contents) as sticks:
        sticks.do(fill.format(n=2, more="head -c 30M /dev/zero > /mnt/f/big.bin;"))
        sticks.do(fill.format(n=3, more=""))
        sticks.do("plug 0")
        notes = sticks.ready(timeout_s=60)
        report.check("ext4 labelled RIDELOG: refused in words", bool(notes) and not notes[0]["ok"], words(notes))
        report.check("and not changed", sticks.do("look 0 'ls'").split() == ["lost+found"])
        sticks.do("pull 0")
        sticks.no_notes()
        sticks.do("plug 1; sleep 8")
        report.check("another label: nothing happens", not sticks.notes(), words(sticks.notes()))
        report.check("and it is not changed", not sticks.do("look 1 'ls'").split())
        sticks.do("pull 1; plug 2")
        notes = sticks.ready()
        report.check("full: said in words, may be pulled", len(notes) == 1 and not notes[0]["ok"], words(notes))
        rc, last = sticks.verify(2)
        report.check("what is on it is whole", rc == 0, last)
        report.check("others' files on it stay",
                     sticks.do("look 2 'cat photos/a.txt ridelog/b.txt; stat -c %s big.bin'").split()
                     == ["mine", "mine", str(30 << 20)])
        sticks.do("pull 2")
        sticks.no_notes()
        sticks.do("plug 3")
        notes = sticks.ready()
        report.check("with others' files: everything is on it", len(notes) == 1 and notes[0]["ok"], words(notes))
        report.check("others' files stay", sticks.do("look 3 'cat photos/a.txt ridelog/b.txt'").split()
                     == ["mine", "mine"])


@trial("if a stick is pulled in mid-copy, only files that are whole on it count as exported; plugged in again, it "
       "gets everything")
def stick_pulled_in_mid_copy(bench: Bench, report: Report) -> None:
    """Pulled after a while that grows, then back."""
    report.times = 3 if bench.quick else 12
    # every pull leaves clusters in use that belong to no file: room for all of them
    with Sticks(bench, "stick-pulled", [FAT], 4 * STICK_MB) as sticks:
        early, unlisted, wrong, missing, gone = 0, 0, [], [], 0
        for number in range(report.times):
            sticks.do(f"plug 0; for i in $(seq 300); do {NOTES} | grep -qE 'copying|ready' && break; sleep 0.1; done; "
                      f"sleep {0.4 * number:.1f}")
            early += "copying" in sticks.car.guest.run(NOTES).out
            sticks.do("pull 0")
            gone += sticks.no_notes(90)
            sticks.do("rm -f /run/on-usb; scan 0; udevadm settle")
            out = sticks.car.guest.run(". /host/in_guest/sticks.sh; look 0 'ridelog verify . 2>&1'", 300)
            if " 0 torn, 0 corrupt" not in out.out:
                wrong.append(" ".join(out.out.split())[-200:])
            unlisted += "WRONG" in out.out
            missing += sticks.do(f"look 0 '{MISSING}'").split()
            sticks.do("pull 0")
        report.check("pulled while it copied", early > 0, f"{early} of {report.times}")
        report.check("files that count as exported and are not whole on it", not missing,
                     f"{len(missing)} {missing[:3] or ''}")
        report.check("pulls after which a row or file on it is torn or corrupt", not wrong,
                     f"{len(wrong)} {wrong[:1] or ''}")
        report.measure("pulls after which ridelog verify says that the export was cut short: export again", unlisted)
        report.check("status no longer mentions a pulled stick", gone == report.times, f"{gone} of {report.times}")
        sticks.do("plug 0")
        notes = sticks.ready()
        report.check("finally everything is on it", len(notes) == 1 and notes[0]["ok"], words(notes))
        rc, last = sticks.verify(0)
        report.check("ridelog verify of it", rc == 0, last)
        report.check("mounts that were left behind", not sticks.do("grep ridelog-stick /proc/mounts | grep -v "
                     "\"$(stick 0)\" || true").strip())


