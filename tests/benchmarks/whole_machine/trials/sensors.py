"""The chip and the receiver: late, gone, back, frozen, and without its settings."""

from __future__ import annotations

import csv
import io
import time

from ..bench import CHIP, Bench, Car
from ..catalogue import Report, trial

LOGS = "cat $(ls -t /var/lib/ridelog/*.csv* | head -1)"
DRIVE_S = 25
BROWNOUT_LIMIT_S = 5.0


def rows(car: Car) -> list[dict[str, str]]:
    """The rows of the newest log."""
    return list(csv.DictReader(io.StringIO(car.guest.run(LOGS).out)))


def uptime_s(car: Car) -> float:
    """The guest's monotonic time [s]."""
    return float(car.guest.must("cut -d' ' -f1 /proc/uptime"))


def figures(some: list[dict[str, str]]) -> list[float]:
    """Weighted accelerations of rows that have them [m/s2]."""
    return [float(row["a_w_mps2"]) for row in some if row["a_w_mps2"]]


def mean(values: list[float]) -> float:
    """The mean; 0 of none."""
    return sum(values) / len(values) if values else 0.0


@trial("a chip that loses its settings under the running service (a brown-out: another range, no filter) is restarted "
       "within seconds, status says so, and no row holds figures made of its wrong readings")
def chip_loses_its_settings(bench: Bench, report: Report) -> None:
    """Registers poked under the service; the readings are 8 times too small until they are restored."""
    report.times = 2 if bench.quick else 5
    with bench.car("brownout") as car:
        car.boot()
        car.wait_for_rows(20)
        range_of = "i2cget -y -f 0 0x0a 0x22"
        before_s = uptime_s(car)
        took_s, restored = [], 0
        for _ in range(report.times):
            car.guest.must("touch /host/BROWNOUT; for i in $(seq 100); do [ -e /host/BROWNOUT ] || exit 0; sleep 0.05; "
                           "done; exit 1")
            began_s = time.monotonic()
            while time.monotonic() < began_s + DRIVE_S:
                if car.guest.run(f"{range_of} | grep -qE '0x?[04c8]$'").rc == 0:
                    restored += 1
                    took_s.append(time.monotonic() - began_s)
                    break
                time.sleep(0.2)
            time.sleep(DRIVE_S)
        after_s = uptime_s(car)
        found = rows(car)
        status = car.guest.status()
        said = car.guest.run("ridelog status", 120).out.split("What to do")[-1].strip()
        journal = car.guest.run("journalctl -u ridelog -o cat | grep -iE 'settings|lost' | tail -2").out.strip()
        good = figures([row for row in found if float(row["t_s"]) < before_s])
        later = [row for row in found if before_s <= float(row["t_s"]) < after_s]
        # the drive's roughness changes by a factor of some two; the wrong readings are 8 times too small
        wrong = [value for value in figures(later) if value < mean(good) / 4]
        report.check("restarted", restored == report.times, f"{restored} of {report.times}, after "
                     f"{', '.join(f'{s:.1f}' for s in took_s)} s (a look each 0.2 s from the host)")
        report.check(f"within {BROWNOUT_LIMIT_S:.0f} s", bool(took_s) and max(took_s) < BROWNOUT_LIMIT_S)
        report.check("rows with figures made of wrong readings", not wrong,
                     f"{len(wrong)} of {len(later)} rows since; mean a_w before {mean(good):.2f}, since "
                     f"{mean(figures(later)):.2f} m/s2")
        report.check("rows with figures since", len(figures(later)) > len(later) // 4,
                     f"{len(figures(later))} of {len(later)}")
        report.check("status or journal says so", "setting" in said or "setting" in journal,
                     f"status: {said[:200]}; journal: {journal[-200:]}; counters {status['accelerometer']['counters']}")


@trial("a chip whose bus comes after the service is found by itself; one that gives the same reading for ever is "
       "reported")
def chip_late_and_frozen(bench: Bench, report: Report) -> None:
    """The bus's module is loaded when the service runs; then its readings stop changing."""
    with bench.car("chip-late", chip="late") as car:
        car.boot()
        car.wait_for("the service", "systemctl is-active ridelog", 180)
        time.sleep(10)
        report.check("without a bus status says what to do", "i2c" in car.guest.run("ridelog status", 120).out.lower())
        car.guest.must(CHIP)
        took_s = car.wait_for("the chip", "grep -q '\"accelerometer\": {[^}]*\"state\": \"ok\"' "
                              "/run/ridelog/status.json", 120)
        report.measure("found, seconds after its bus came", f"{took_s:.0f}")
        car.wait_for_rows(12)
        car.guest.must("pkill -STOP -f in_guest/chip.py")
        began_s = time.monotonic()
        car.wait_for("the frozen sensor", "ridelog status | grep -iE 'doubtful|frozen'", 150, 2)
        report.check("frozen readings are reported after [s]", True, f"{time.monotonic() - began_s:.0f}")
        time.sleep(15)
        last = rows(car)[-3:]
        report.check("rows are flagged and hold no figures", all("frozen" in row["flags"] and not row["a_w_mps2"]
                                                                 for row in last), [row["flags"] for row in last])


@trial("a receiver that falls silent and comes back goes on by itself; its rows are flagged meanwhile")
def receiver_silent_and_back(bench: Bench, report: Report) -> None:
    """Its sentences stop for a minute, three times for a second."""
    with bench.car("receiver", chip="dump") as car:
        car.boot()
        car.wait_for_rows(20)
        for pause_s in (1, 60):
            car.receiver.silent.set()
            time.sleep(pause_s)
            if pause_s == 60:
                said = car.guest.run("ridelog status", 120).out
                report.check("status says that it is silent", "GPS: silent" in said, said[-160:].strip())
            car.receiver.silent.clear()
            took_s = car.wait_for("the receiver", "grep -q '\"gps\": {[^}]*\"state\": \"ok\"' /run/ridelog/status.json",
                                  60)
            report.check(f"back after {pause_s} s of silence, within [s]", True, f"{took_s:.0f}")
        time.sleep(30)
        found = rows(car)
        flags = [row["flags"] for row in found]
        report.check("rows of the minute are flagged",
                     any("blind" in text and "gps_lost" in text for text in flags[5:]),
                     f"{sum('gps_lost' in text for text in flags)} of {len(flags)} rows say gps_lost")
        report.check("rows after it hold figures again", bool(found[-1]["iri_m_per_km"] or found[-5]["iri_m_per_km"]),
                     flags[-1] or "no flag")


@trial("what the service recorded replays to the same rows, byte for byte")
def recording_replays(bench: Bench, report: Report) -> None:
    """A minute with the chip on its bus and the receiver on its line, recorded, and replayed in the guest."""
    with bench.car("replay", settings="log: {record_dump: true}\n") as car:
        car.boot()
        car.wait_for_rows(40)
        car.guest.must("systemctl stop ridelog")
        out = car.guest.must("cd /var/lib/ridelog; n=$(ls -t *.dump.gz | head -1); s=${n%%[-.]*}; rm -rf /tmp/again; "
                             "ridelog replay $n --out /tmp/again --config /etc/ridelog/ridelog.yaml >/tmp/replay.txt; "
                             "cat $s-*.csv >/tmp/live.csv; cat /tmp/again/*.csv >/tmp/again.csv; "
                             "wc -l < /tmp/live.csv; cmp /tmp/live.csv /tmp/again.csv && echo same", 400)
        report.check("the same to the byte", "same" in out, f"{out.split()[0]} lines: {out.strip()[-100:]}")
