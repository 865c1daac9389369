"""What happens to the machine itself: a hung process, a full disk, a read-only root, clocks that jump, a long run."""

from __future__ import annotations

import time
from pathlib import Path

from ..bench import Bench, Car
from ..catalogue import Report, trial
from ..guest import GuestFailed
from .sensors import rows, uptime_s

PID = "systemctl show ridelog -p MainPID --value"
LIMIT_MB = 140  # MemoryHigh of the unit
WRITES_NOTHING = "ridelog status | head -1 | grep -q NOTHING"
WRITES = "! ridelog status | head -1 | grep -q NOTHING"


def restarts(car: Car) -> int:
    """How often systemd has started the service again."""
    return int(car.guest.must("systemctl show ridelog -p NRestarts --value"))


@trial("a process that hangs is replaced within 45 s (the watchdog's 30 s, and 15 s to end), one that is killed "
       "within seconds; rows go on")
def watchdog(bench: Bench, report: Report) -> None:
    """SIGSTOP and SIGKILL."""
    with bench.car("watchdog", chip="dump") as car:
        car.boot()
        car.wait_for_rows(5)
        for signal, limit_s in (("STOP", 60), ("KILL", 20)):
            pid = car.guest.must(PID).strip()
            car.guest.must(f"kill -{signal} {pid}")
            took_s = car.wait_for("another process",
                                  f"p=$({PID}); [ $p != 0 ] && [ $p != {pid} ] && systemctl is-active ridelog", 180)
            report.check(f"after SIG{signal} another one serves", took_s < limit_s, f"after {took_s:.0f} s")
            report.check("rows go on", car.wait_for_rows(4) >= 0)
        sessions = int(car.guest.must("ls /var/lib/ridelog/*.csv* | sed 's|.*/||; s/-.*//' | sort -u | wc -l"))
        report.check("one session for each", sessions == 3, sessions)
        rc = car.guest.run("systemctl stop ridelog; ridelog verify /var/lib/ridelog", 120)
        report.check("ridelog verify of all", rc.rc == 0, rc.out.splitlines()[0])


@trial("a full disk is reported, rows wait in memory, and all of them are written when there is room again")
def full_disk(bench: Bench, report: Report) -> None:
    """Below the floor of free space, and full to the last block."""
    with bench.car("full", chip="dump", card="honest") as car:
        car.boot()
        car.wait_for_rows(5)
        for what, leave in (("less than keep_free_bytes free", 100_000_000), ("not a block free", 0)):
            car.guest.must("cd /var/lib/ridelog; free=$(df --output=avail -B1 . | tail -1); "
                           + (f"fallocate -l $((free - {leave})) /var/lib/ridelog/filler" if leave else
                              "cat /dev/zero > filler 2>/dev/null; cat /dev/zero > filler2 2>/dev/null; sync; true"),
                           300)
            took_s = car.wait_for("status to say so", WRITES_NOTHING, 120)
            status = car.guest.status()
            report.check(f"{what}: status says that nothing is written", True,
                         f"after {took_s:.0f} s: {status['storage']['trouble'][:120]}")
            time.sleep(15)
            waiting = car.guest.status()["storage"]["rows_waiting"]
            car.guest.must("rm -f /var/lib/ridelog/filler*; sync")
            took_s = car.wait_for("rows to be written", WRITES, 120)
            status = car.guest.status()
            report.check("room again: rows that waited are written, none lost",
                         waiting > 0 and status["storage"]["rows_lost"] == 0,
                         f"{waiting} waited; all is well after {took_s:.0f} s")
        report.check("restarts", restarts(car) == 0, restarts(car))
        car.guest.must("systemctl stop ridelog")
        numbers = [int(row["segment"]) for row in rows(car)]
        rc = car.guest.run("ridelog verify /var/lib/ridelog", 120)
        report.check("ridelog verify of all", rc.rc == 0, rc.out.splitlines()[0])
        report.check("segments in a row", numbers == list(range(numbers[0], numbers[0] + len(numbers))), len(numbers))


@trial("a root file system that is read-only at boot, or becomes so later, is reported; the service stays up, and "
       "writes again when it can")
def read_only_root(bench: Bench, report: Report) -> None:
    """The kernel's emergency remount, an error of the file system, and a boot with a read-only root."""
    with bench.car("read-only", chip="dump") as car:
        car.boot()
        car.wait_for_rows(5)
        car.guest.must("echo 1 > /proc/sys/kernel/sysrq; echo u > /proc/sysrq-trigger; sleep 3")
        reported(car, report, "emergency remount (the kernel then takes writes and fsync of open files, and keeps "
                              "nothing)")
        car.guest.must("mount -o remount,rw /")
        took_s = car.wait_for("rows to be written", WRITES, 180)
        status = car.guest.status()
        report.check("writable again: rows are written, none lost", status["storage"]["rows_lost"] == 0,
                     f"after {took_s:.0f} s")
        # as Raspberry Pi OS and Debian mount a root: an error makes it read-only until it is checked at the next boot
        car.guest.must("mount -o remount,errors=remount-ro /; echo bench > /sys/fs/ext4/ubda/trigger_fs_error; sleep 3")
        reported(car, report, "an error of ext4 that makes it read-only")
        report.check("restarts", restarts(car) == 0, restarts(car))
        car.guest.cut_power()
        car.boot()
        car.wait_for_rows(3)
        report.check("the next boot checks it, and rows come", True)
        car.guest.must("sed -i 's/defaults/defaults,ro/' /etc/fstab; sync")
        car.guest.cut_power()
        car.boot()
        report.check("the root is read-only after the next boot", " ro," in car.guest.must("grep ' / ' /proc/mounts"))
        time.sleep(20)
        said = car.guest.run("ridelog status; systemctl show ridelog -p ActiveState,StatusText; "
                             "journalctl -u ridelog -b -o cat -n 3", 120).out
        report.check("status or journal says so", "ead-only" in said, said[-300:].strip())
        car.guest.must("mount -o remount,rw /")
        advice = "sudo systemctl restart ridelog"  # its own mount of the folder was made read-only at its start
        report.check("status says what to do then", advice in car.guest.run("ridelog status", 120).out, advice)
        car.guest.must("systemctl restart ridelog", 120)
        took_s = car.wait_for("the service", f"systemctl is-active ridelog && ls /var/lib/ridelog/*.part && {WRITES}",
                              240)
        car.wait_for_rows(3)
        report.check("writable again: rows come", True, f"after {took_s:.0f} s")


def reported(car: Car, report: Report, what: str) -> None:
    """Check that status says within a minute that nothing is written."""
    began_s = time.monotonic()
    try:
        car.wait_for("status to say so", WRITES_NOTHING, 60)
        words = car.guest.status()["storage"]["trouble"][:120]
        report.check(f"{what}: status says so", True, f"after {time.monotonic() - began_s:.0f} s: {words}")
    except GuestFailed:
        said = car.guest.run("ridelog status", 120).out.split("What to do")[-1]
        report.check(f"{what}: status says so", False, " ".join(said.split()))


@trial("clocks that jump, to 2001 and to 2031, change no row: time comes from the receiver")
def clock_jumps(bench: Bench, report: Report) -> None:
    """``date -s`` under the service."""
    with bench.car("clock", chip="dump") as car:
        car.boot()
        car.wait_for_rows(10)
        pid = car.guest.must(PID)
        for day in ("2001-02-03", "2031-02-03"):
            before = len(rows(car))
            car.guest.must(f"date -s {day}")
            time.sleep(20)
            found = rows(car)
            report.check(f"{day}: rows go on", len(found) > before + 5, f"{len(found) - before} in 20 s")
        utc = [row["t_utc"] for row in found if row["t_utc"]]
        seconds = [float(row["t_s"]) for row in found]
        report.check("UTC in rows is the receiver's", bool(utc) and all(text.startswith("2026-06-09") for text in utc),
                     f"{utc[0]} to {utc[-1]}")
        report.check("time in rows only grows", seconds == sorted(seconds))
        report.check("the same process", car.guest.must(PID) == pid)


@trial("in ten minutes memory does not grow, rows come and nothing restarts; the processor share is measured")
def ten_minutes(bench: Bench, report: Report) -> None:
    """Processor share, memory, and samples, with the chip on its bus and the receiver on its line."""
    seconds = 60 if bench.quick else 600
    with bench.car("ten-minutes") as car:
        boot_s = car.boot()
        first_s = boot_s + car.wait_for_rows(1)
        report.measure("power on to first row [s]", f"{first_s:.0f}")
        car.wait_for_rows(10)
        first, last = look(car), {}
        middle_mb = 0.0
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            time.sleep(min(30.0, seconds / 4))
            last = look(car)
            if not middle_mb and time.monotonic() > end_s - seconds / 2:
                middle_mb = last["rss_mb"]
        span_s = last["t_s"] - first["t_s"]
        share = 100 * (last["cpu_s"] - first["cpu_s"]) / span_s
        whole = 100 * (last["busy_s"] - first["busy_s"]) / span_s
        report.measure("processor share of one core [%]", f"{share:.1f} in {span_s:.0f} s of the guest (the whole "
                     f"guest, with what plays the chip: {whole:.0f}); system calls cost far more in the guest than on "
                     "a machine: compare tests/benchmarks/live.py")
        report.check("memory at the end, and at the most [MB]", last["peak_mb"] < LIMIT_MB,
                     f"{last['rss_mb']:.0f}, {last['peak_mb']:.0f}")
        report.check("memory no longer grows in the second half [MB]", last["rss_mb"] < middle_mb + 2,
                     f"{middle_mb:.1f} to {last['rss_mb']:.1f}")
        rate = (last["readings"] - first["readings"]) / span_s
        report.measure("readings a second, of 100", f"{rate:.1f} (the host's load: {load()})")
        report.check("rows", last["rows"] > first["rows"] + span_s, int(last["rows"] - first["rows"]))
        flagged = [row["flags"] for row in rows(car)[5:-1]]
        report.measure("rows without a flag", f"{sum(not text for text in flagged)} of {len(flagged)}")
        report.check("restarts", restarts(car) == 0, restarts(car))


def look(car: Car) -> dict[str, float]:
    """Processor time, memory and counts of the service now."""
    out = car.guest.must(f"p=$({PID}); cut -d' ' -f14,15 /proc/$p/stat; grep -E 'VmHWM|VmRSS' /proc/$p/status; "
                         "head -1 /proc/stat; getconf CLK_TCK").splitlines()
    tick = float(out[4])
    memory = {line.split(":")[0]: float(line.split()[1]) / 1024 for line in out[1:3]}
    busy = out[3].split()[1:]
    status = car.guest.status()
    return {"t_s": uptime_s(car), "cpu_s": sum(map(float, out[0].split())) / tick,
            "busy_s": sum(float(busy[i]) for i in (0, 1, 2, 5, 6)) / tick, "rss_mb": memory["VmRSS"],
            "peak_mb": memory["VmHWM"], "readings": status["accelerometer"]["readings"],
            "rows": status["rows_written"]}


def load() -> str:
    """The host's load of the last minute."""
    return Path("/proc/loadavg").read_text().split()[0]
