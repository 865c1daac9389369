"""Filters in integers: how near they are to floating point, how fast, and what they cost the service."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib import resources
from pathlib import Path

import numpy as np
from scipy import signal

from logger.dsp.filters import BlockFilter
from logger.dsp.fixed_point import FULL_SCALE_MPS2, FULL_SCALE_SLOPE, FixedFilter, fixed_cascade
from logger.dsp.weightings.wk import WEIGHTING
from logger.roads import iso8608
from logger.roads.iri import golden_car_sections
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.units import STANDARD_GRAVITY_MPS2

from ..support.drives.simulated_drive import DrivePlan, RoadStretch, simulate_drive
from .figures import Figures

Floats = np.ndarray
SAMPLES_TIMED = 100_000
PIECE = 50  # what the service hands over at once
WK = np.asarray(WEIGHTING.sections[100])


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    for road_class in "ABC":
        wk_noise(figures, road_class, road_acceleration(iso8608.CLASS_GD_N0_CM3[road_class]))
    for spacing_m in (0.25, 0.05, 0.025):
        for road_class in "AC":
            car_noise(figures, road_class, spacing_m)
    speed(figures, "Wk", WK, FULL_SCALE_MPS2)
    speed(figures, "Golden Car, 0.05 m", golden_car_sections(0.05), FULL_SCALE_SLOPE)
    replay_speed(figures)
    return 1 if figures.missed else 0


def road_acceleration(gd_n0_cm3: float) -> Floats:
    """A minute of a RAV4 at 14 m/s, gravity included, at 100 Hz [m/s2]."""
    plan = DrivePlan(speed_knots=((0, 14), (60, 14)), stretches=(RoadStretch(1000, gd_n0_cm3),))
    drive = simulate_drive(plan, read_vehicle(vehicle_file("rav4-2009")))
    return drive.accel_mps2[::10] + STANDARD_GRAVITY_MPS2


def wk_noise(figures: Figures, road_class: str, accel_mps2: Floats) -> None:
    """Wk in 32 bits against scipy, and the 16-bit form at two full scales."""
    exact = BlockFilter(WK)
    exact.reset(accel_mps2[0])
    wanted = exact.process(accel_mps2)
    name = f"Wk, class {road_class}, a_w {np.sqrt(np.mean(wanted**2)):.2f} m/s2"
    for range_g in (16, 2):
        for bits in (32, 16):
            fixed = FixedFilter(fixed_cascade(WK, range_g * STANDARD_GRAVITY_MPS2, bits))
            fixed.reset(accel_mps2[0])
            snr(figures, f"{name}, {bits} bit, {range_g} g", bits, wanted, fixed.process(accel_mps2))


def car_noise(figures: Figures, road_class: str, spacing_m: float) -> None:
    """The Golden Car's slope in integers, and its IRI."""
    elevation_m = iso8608.generate(iso8608.CLASS_GD_N0_CM3[road_class], 1000.0, spacing_m, 1)
    base = int(0.25 / spacing_m + 0.5)
    slope = (elevation_m[base:] - elevation_m[:-base]) / (base * spacing_m)
    wanted = signal.sosfilt(golden_car_sections(spacing_m), slope)
    for bits in (32, 16):
        found = FixedFilter(fixed_cascade(golden_car_sections(spacing_m), FULL_SCALE_SLOPE, bits)).process(slope)
        snr(figures, f"Golden Car, class {road_class}, {spacing_m} m, {bits} bit", bits, wanted, found)
        off = np.abs(found).mean() / np.abs(wanted).mean() - 1
        print(f"{'  its IRI is off by':48s} {100 * off:10.2g} %")


def snr(figures: Figures, name: str, bits: int, wanted: Floats, found: Floats) -> None:
    """Signal to noise, with a goal for 32 bits."""
    value_db = float(10 * np.log10(np.sum(wanted**2) / np.sum((wanted - found) ** 2)))
    if bits == 32:
        figures.at_least(name, value_db, 90, "dB")
    else:
        print(f"{name:48s} {value_db:10.4g} dB")


def speed(figures: Figures, name: str, sos: Floats, full_scale: float) -> None:
    """Samples per second of one core: integers, blocks, and scipy on the whole record."""
    x = np.random.default_rng(1).standard_normal(SAMPLES_TIMED) * 0.01 * full_scale
    fixed, block = FixedFilter(fixed_cascade(sos, full_scale)), BlockFilter(sos)
    figures.at_least(f"{name}: fixed", rate(fixed.process, x), 100_000, "/s")
    figures.at_least(f"{name}: fixed, {PIECE} samples at a time", rate(in_pieces(fixed.process), x), 100_000, "/s")
    print(f"{name + ': BlockFilter':48s} {rate(block.process, x):10.4g} /s")
    print(f"{name + ': scipy.signal.sosfilt':48s} {rate(lambda record: signal.sosfilt(sos, record), x):10.4g} /s")


def in_pieces(process: Callable[[Floats], Floats]) -> Callable[[Floats], Floats]:
    """The same, as the service calls it."""
    return lambda x: np.concatenate([process(x[first : first + PIECE]) for first in range(0, len(x), PIECE)])


def rate(process: Callable[[Floats], Floats], x: Floats) -> float:
    """Samples per second, the best of three."""
    times_s = []
    for _ in range(3):
        started_s = time.perf_counter()
        process(x)
        times_s.append(time.perf_counter() - started_s)
    return len(x) / min(times_s)


def replay_speed(figures: Figures) -> None:
    """Replay of the demonstration drive in both arithmetics, the median of three."""
    dump = resources.files("logger.demo") / "drive.dump.gz"
    ridelog = Path(sys.executable).with_name("ridelog")
    for arithmetic in ("float", "fixed"):
        speeds = []
        for _ in range(3):
            with tempfile.TemporaryDirectory() as folder:
                settings = Path(folder) / "settings.yaml"
                settings.write_text(f"pipeline:\n  arithmetic: {arithmetic}\n", encoding="ascii")
                out = Path(folder) / "out"
                command = [ridelog, "replay", str(dump), "--config", settings, "--out", out, "--json"]
                outcome = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
                speeds.append(outcome["played_s"] / outcome["wall_s"])
        figures.at_least(f"replay, arithmetic: {arithmetic}", sorted(speeds)[1], 300, "x real")


if __name__ == "__main__":
    sys.exit(main())
