"""The IRI of 10 km at 25 mm: the whole command, the reader, the filter, and the loop that others use."""

from __future__ import annotations

import contextlib
import importlib
import io
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from logger.commands.main import main as ridelog
from logger.roads import iso8608
from logger.roads.iri import golden_car_sections, rectified_slope
from logger.store.formats.profile_file import read_profile
from logger.vehicle.models import GOLDEN_CAR, quarter_car
from logger.vehicle.structure import straight_step

from .figures import Figures

LENGTH_M, SPACING_M = 10_000.0, 0.025


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    elevation = iso8608.generate(40.0, LENGTH_M, SPACING_M, 1)
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "road.csv"
        rows = (f"{SPACING_M * number:.3f},{height:.6f}\n" for number, height in enumerate(elevation.tolist()))
        path.write_text("distance_m,elevation_m\n" + "".join(rows))
        for module in ("logger.commands.iri", "logger.roads.iri", "logger.store.formats.profile_file"):
            importlib.import_module(module)
        silent = io.StringIO()
        with contextlib.redirect_stdout(silent):
            command_s = median_s(lambda: ridelog(["iri", str(path), "--json"]))
        figures.at_most("ridelog iri, 10 km at 25 mm, after imports", command_s, 0.5, "s")
        figures.at_most("  of which reading 400,001 lines", median_s(lambda: read_profile(path)), 0.3, "s")
    filter_s = median_s(lambda: rectified_slope(elevation, SPACING_M))
    figures.at_most("  of which the Golden Car", filter_s, 0.05, "s")
    loop_s = median_s(lambda: plain_loop(elevation), 1)
    figures.at_least("faster than a state-transition loop by", loop_s / filter_s, 20, "times")
    figures.at_least("Golden Car", len(elevation) / filter_s / 1e6, 8, "MS/s")
    figures.at_most("  beside scipy.signal.sosfilt, all at once", filter_s / sosfilt_s(elevation), 20, "times")
    return 1 if figures.missed else 0


def median_s(work: Callable[[], object], times: int = 7) -> float:
    """How long it takes [s]."""
    taken = []
    for _ in range(times):
        started_s = time.perf_counter()
        work()
        taken.append(time.perf_counter() - started_s)
    return sorted(taken)[times // 2]


def plain_loop(elevation_m: np.ndarray) -> float:
    """IRI [m/km] as published programs take it: one matrix product per sample."""
    base = round(0.25 / SPACING_M)
    slope = (elevation_m[base:] - elevation_m[:-base]) / (base * SPACING_M)
    transition, *ends = straight_step(*quarter_car(GOLDEN_CAR).state_space(), SPACING_M * 3.6 / 80)
    gain = ends[0] + ends[1]  # held over the step
    state, column, total = np.zeros(4), gain[:, 0], 0.0
    for value in slope:
        state = transition @ state + column * value
        total += abs(state[0] - state[1])
    return 1000 * total / len(slope)


def sosfilt_s(elevation_m: np.ndarray) -> float:
    """The same sections by SciPy, which must have the whole record [s]."""
    from scipy.signal import sosfilt

    sos, slope = golden_car_sections(SPACING_M), np.diff(elevation_m) / SPACING_M
    return median_s(lambda: np.abs(sosfilt(sos, slope)))


if __name__ == "__main__":
    sys.exit(main())
