"""The live service on a recorded I2C bus and a pseudo-terminal, in real time.

Prints start to first sample, CPU share, peak memory, samples lost, and how far the samples' times are from their
schedule; then replays what was recorded and compares the rows byte for byte.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tty
from pathlib import Path

import numpy as np

from drivers.dump import Event, open_dump
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle

from ..support.drives.simulated_drive import DrivePlan, RoadStretch, record, simulate_drive
from .figures import Figures

STEP_US = 10_000
WARM_UP_S = 5.0


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0)
    seconds = 60 * parser.parse_args().minutes
    figures = Figures()
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        dump = work / "drive.dump.gz"
        _record_drive(seconds + 30, dump)
        master, slave = os.openpty()
        tty.setraw(slave)
        stop = threading.Event()
        threading.Thread(target=_send, args=(_sentences(dump), master, stop), daemon=True).start()
        (work / "ridelog.yaml").write_text(
            f"accelerometer: {{bma220: {{i2c_bus: 'dump:{dump}'}}}}\n"
            f"gps: {{port: {os.ttyname(slave)}}}\n"
            f"log: {{directory: {work / 'log'}, record_dump: true}}\n"
            f"status_file: {work / 'status.json'}\n"
        )
        _measure(work, seconds, figures)
        stop.set()
        _compare(work, figures)
    return 1 if figures.missed else 0


def _record_drive(seconds: float, path: Path) -> None:
    """Town and country in turn, with a halt every two minutes."""
    knots = [(0.0, 0.0)]
    while knots[-1][0] < seconds:
        t_s = knots[-1][0]
        knots += [(t_s + 5, 0), (t_s + 15, 12), (t_s + 60, 14), (t_s + 75, 24), (t_s + 100, 24), (t_s + 115, 0)]
    plan = DrivePlan(speed_knots=knots, stretches=(RoadStretch(500, 60), RoadStretch(500, 200)), seed=11)
    record(simulate_drive(plan, read_vehicle(vehicle_file("rav4-2009"))), path)


def _measure(work: Path, seconds: float, figures: Figures) -> None:
    ridelog = Path(sys.executable).with_name("ridelog")
    began_us = time.monotonic_ns() // 1000
    process = subprocess.Popen([ridelog, "run", "--config", work / "ridelog.yaml"], env=_one_thread())
    time.sleep(WARM_UP_S)
    cpu_s, wall_s = _cpu_s(process.pid), time.monotonic()
    time.sleep(seconds)
    share = (_cpu_s(process.pid) - cpu_s) / (time.monotonic() - wall_s)
    peak_mb = _peak_mb(process.pid)
    process.send_signal(signal.SIGTERM)
    process.wait(timeout=10)
    t_us = _sample_times_us(work)
    late_us = _lateness_us(t_us)
    figures.at_most("start to first sample", (t_us[0] - began_us) / 1e6, 2, "s")
    figures.at_most("CPU share at 100 Hz, of one core", 100 * share, 2, "%")
    figures.at_most("peak memory", peak_mb, 80, "MB")
    figures.at_most(f"samples lost in {seconds:.0f} s", float(_lost(t_us)), 0, "")
    figures.at_most("time off schedule, 99th percentile", float(np.percentile(late_us, 99)) / 1000, 1, "ms")
    figures.at_most("time off schedule, 99.9th percentile", float(np.percentile(late_us, 99.9)) / 1000, 5, "ms")


def _compare(work: Path, figures: Figures) -> None:
    ridelog = Path(sys.executable).with_name("ridelog")
    (recording,) = (work / "log").glob("*.dump.gz")
    command = [ridelog, "replay", recording, "--out", work / "again", "--config", work / "ridelog.yaml"]
    subprocess.run(command, check=True, capture_output=True)
    live = b"".join(path.read_bytes() for path in sorted((work / "log").glob("*.csv")))
    again = b"".join(path.read_bytes() for path in sorted((work / "again").glob("*.csv")))
    figures.at_least("rows recorded live", float(live.count(b"\n")), 10, "rows")
    figures.at_most("bytes that differ when replayed", float(live != again), 0, "")


def _sentences(dump: Path) -> list[Event]:
    with open_dump(dump) as reader:
        return [event for event in reader if event.source == "nmea"]


def _send(events: list[Event], master: int, stop: threading.Event) -> None:
    began_s = time.monotonic()
    for event in events:
        wait_s = began_s + (event.t_us - events[0].t_us) / 1e6 - time.monotonic()
        if stop.wait(max(wait_s, 0)):
            return
        os.write(master, event.data)


def _sample_times_us(work: Path) -> np.ndarray:
    (recording,) = (work / "log").glob("*.dump.gz")
    with open_dump(recording) as reader:
        return np.array([event.t_us for event in reader if event.source == "bma220"], dtype=np.int64)


def _lateness_us(t_us: np.ndarray) -> np.ndarray:
    """Time after the schedule: the schedule is the lattice of 10 ms through the earliest sample of its phase."""
    phase_us = (t_us - t_us[0] + STEP_US // 2) % STEP_US - STEP_US // 2
    return phase_us - np.percentile(phase_us, 0.1)


def _lost(t_us: np.ndarray) -> int:
    return round((t_us[-1] - t_us[0]) / STEP_US) + 1 - len(t_us)


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _peak_mb(pid: int) -> float:
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024


def _one_thread() -> dict[str, str]:
    return os.environ | {"OPENBLAS_NUM_THREADS": "1"}


if __name__ == "__main__":
    sys.exit(main())
