"""Replay speed and memory: the demonstration drive through the whole chain, with files, on one core.

The drive is a BMA220's. It is also counted in seconds of the processor, start of the command and all, for the plain
car, for one with each of some nonlinear effects, and for one whose file also has standard errors; the same drive with
four reads per sample, as the chip is read by default, and with a serial sensor. The command runs from
compiled bytecode, as an installed one does, whatever ``PYTHONDONTWRITEBYTECODE`` says here.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from importlib import resources
from itertools import product
from pathlib import Path

from drivers.accelerometers.bma220 import USUAL_OVERSAMPLE
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle

from ..support.drives.simulated_drive import LINES, PLAN, DrivePlan, record, simulate_drive
from .figures import Figures
from .noise import ASSUMED_MPS2, wider

_FRICTION = "{name: dry_friction, friction_force_n: 150}"
_ERRORS = "\nstandard_errors: {sprung_mass_kg: 8, pitch_inertia_kg_m2: 13, contact_patch_m: 0.003, " + ", ".join(
    f"{place}.unsprung_mass_kg: 0.5, {place}.suspension_stiffness_n_per_m: 250, "
    f"{place}.suspension_damping_n_s_per_m: 18, {place}.tire_stiffness_n_per_m: 2100, {place}.cg_distance_m: 0.005"
    for place in ("front", "rear")) + "}"
CARS = {
    "a plain car": "[]",
    "uneven dampers": "[{name: damper_asymmetry, rebound_to_bump_ratio: 3.0}]",
    "digressive dampers": "[{name: damper_blow_off, knee_velocity_m_per_s: 0.05, slope_ratio: 0.3}]",
    "progressive springs": "[{name: progressive_spring, cubic_stiffness_n_per_m3: 3.0e+7}]",
    "dry friction": f"[{_FRICTION}]",
    "dry friction, 13 numbers with standard errors": f"[{_FRICTION}]{_ERRORS}",
}


def recorded(plan: DrivePlan, path: Path, **says: int) -> str:
    """A drive as a dump whose header ``says`` so of the accelerometer."""
    drive = simulate_drive(plan, read_vehicle(vehicle_file("rav4-2009")))
    record(replace(drive, header=replace(drive.header, accelerometer=drive.header.accelerometer | says)), path)
    return str(path)


def per_processor_second(ridelog: Path, dump: str, vehicle: Path) -> float:
    """Seconds of the drive that a second of the processor replays."""
    with tempfile.TemporaryDirectory() as out:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        command = [ridelog, "replay", dump, "--out", out, "--vehicle", str(vehicle), "--json"]
        played_s = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)["played_s"]
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return float(played_s / (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime))


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    compiled = tempfile.TemporaryDirectory()
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = compiled.name
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    dump = resources.files("logger.demo") / "drive.dump.gz"
    ridelog = Path(sys.executable).with_name("ridelog")
    speeds, demos_s = [], []
    for _ in range(3):
        with tempfile.TemporaryDirectory() as out:
            command = [ridelog, "replay", str(dump), "--out", out, "--json"]
            outcome = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
            speeds.append(outcome["played_s"] / outcome["wall_s"])
            started_s = time.monotonic()
            subprocess.run([ridelog, "demo", "--out", out, "--json"], check=True, capture_output=True)
            demos_s.append(time.monotonic() - started_s)
    figures.at_least("replay, median of 3", sorted(speeds)[1], 300, "x real")
    figures.at_most("ridelog demo, whole command, median of 3", sorted(demos_s)[1], 15, "s")
    plain = vehicle_file("rav4-2009")
    with tempfile.TemporaryDirectory() as folder:
        often = replace(PLAN, rate_hz=100 * USUAL_OVERSAMPLE, noise_mps2=ASSUMED_MPS2 * wider(USUAL_OVERSAMPLE))
        drives = {
            "1 read": str(dump),
            f"{USUAL_OVERSAMPLE} reads": recorded(often, Path(folder) / "often.dump", oversample=USUAL_OVERSAMPLE),
            "a serial sensor": recorded(replace(PLAN, sensor=LINES), Path(folder) / "serial.dump"),
        }
        for (drive, played), (car, effects) in product(drives.items(), CARS.items()):
            vehicle = Path(folder) / "car.yaml"
            vehicle.write_text(plain.read_text().replace("effects: []", f"effects: {effects}"))
            found = max(per_processor_second(ridelog, played, vehicle) for _ in range(3))
            figures.at_least(f"replay of {drive}, {car}, of processor, best of 3", found, 150, "x real")
    peak_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    figures.at_most("peak memory of replay and demo", peak_mb, 80, "MB")
    return 1 if figures.missed else 0


if __name__ == "__main__":
    sys.exit(main())
