"""A serial sensor at rates other than 100 Hz, and on lines that lose samples: IRI beside that at 100 Hz, and what is
flagged; losses that are seen though there are none, through what brings the bytes; and what dating a sample costs."""

from __future__ import annotations

import sys
import time

import numpy as np

from drivers.sample_clock import SampleClock

from ..support.drives.serial_drives import evenly_lost, mean_iri, randomly_lost, rows_at, rows_without, same_rows
from .figures import Figures

CASES = ((100, 0.0), (96, 0.0), (98, 0.0), (104, 0.0), (120, 0.0), (150, 0.0), (200, 0.0), (400, 0.0), (800, 0.0),
         (80, 0.0), (100, 0.1), (100, 0.03), (100, 0.01), (100, 0.005), (100, 0.02), (150, 0.1),
         (150, 0.01), (200, 0.05), (200, 0.01), (400, 0.05))
EVENLY_LOST = ((100, 100, 1), (100, 50, 1), (100, 100, 2), (100, 25, 1), (96, 100, 1), (98, 50, 1), (104, 50, 1),
               (125, 50, 1), (150, 50, 1), (150, 100, 2), (150, 100, 1), (200, 50, 1), (200, 100, 2), (200, 100, 4),
               (250, 50, 2), (400, 100, 2))
SEEDS = (1, 2, 3, 4, 5)
MINUTES = 20
ENOUGH_ROWS = 5  # of fewer the mean is chance


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    usual = rows_at(100)[1]
    drives = {f"{rate_hz} Hz, {100 * lost:g} % lost": rows_at(rate_hz, lost)[1] for rate_hz, lost in CASES}
    for rate_hz, every, lines in EVENLY_LOST:
        drives[f"{rate_hz} Hz, {lines} in {every} lost"] = rows_without(rate_hz, evenly_lost(rate_hz, every, lines))
    for name, rows in drives.items():
        mean, count = mean_iri(rows)
        flagged = sum("gap" in row.flags for row in rows.records)
        pairs = same_rows(rows, usual)
        ratio = np.divide(*np.mean(pairs, axis=0)) if pairs else 1.0
        print(f"  {name}: mean IRI {mean:.2f} of {count} rows without a flag, "
              f"{100 * (ratio - 1):+.1f} % beside the same rows at 100 Hz; {flagged} rows flagged gap")
        if len(pairs) >= ENOUGH_ROWS:
            figures.at_most(f"error at {name}", 100 * abs(ratio - 1), 3, "%")
    for rate_hz in (200, 250, 400, 800):
        pairs = [pair for seed in SEEDS for pair in same_rows(
            rows_without(rate_hz, frozenset(randomly_lost(rate_hz, 0.01, seed))), usual)]
        ratio = np.divide(*np.mean(pairs, axis=0))
        print(f"  {rate_hz} Hz, 1 % lost, {len(SEEDS)} seeds: {100 * (ratio - 1):+.1f} % in {len(pairs)} rows")
        figures.at_most(f"error at {rate_hz} Hz, 1 % lost, {len(SEEDS)} seeds", 100 * abs(ratio - 1), 3, "%")
    for name, arrivals in _lines().items():
        for period_us in (10_000.0, 10_003.7, 9_998.1, 6_667.0, 5_000.0, 4_001.3, 2_500.0):
            clock = SampleClock(100, 0.02)
            taken_us = np.arange(MINUTES * 60e6 / period_us) * period_us
            arrivals_us = arrivals(taken_us, np.random.default_rng(5))
            began_s = time.process_time()
            for piece in np.array_split(arrivals_us, MINUTES * 120):
                clock.feed(piece)
            spent_s = time.process_time() - began_s
            what = f"{name}, {1e6 / period_us:.1f} Hz"
            false = 1e4 * (clock.lost + clock.resyncs) / len(taken_us)
            figures.at_most(f"{what}: false losses in 10,000", false, 10 if "radio" in name else 0.1, "")
            figures.at_most(f"{what}: dating, of one core", 100 * spent_s / (MINUTES * 60), 0.5, "%")
    return 1 if figures.missed else 0


def _lines() -> dict:
    """What brings the bytes: times of samples [us] to times at which they are read [us]."""
    return {"direct": _direct, "adapter with a timer of 16 ms": _adapter, "radio, 30 ms": _radio}


def _read(there_us: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """By the service: it waits for a byte, reads, sleeps 50 to 60 ms, reads what is there, and waits again."""
    out = np.empty(len(there_us), dtype=np.int64)
    k = 0
    while k < len(there_us):
        woken_us = there_us[k] + rng.exponential(80)
        end = int(np.searchsorted(there_us, woken_us, "right"))
        out[k:end] = woken_us
        slept_us = woken_us + 50_100 + rng.uniform(0, 10_000) + rng.exponential(80)
        k = int(np.searchsorted(there_us, slept_us, "right"))
        out[end:k] = slept_us
    return out


def _direct(taken_us: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return _read(taken_us, rng)


def _adapter(taken_us: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Bytes leave the adapter at the ticks of its timer."""
    return _read(np.ceil(taken_us / 16_003.0) * 16_003.0, rng)


def _radio(taken_us: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    bursts = np.sort(rng.integers(0, len(taken_us), len(taken_us) // 3))
    last = np.append(bursts, len(taken_us) - 1)[np.searchsorted(bursts, np.arange(len(taken_us)))]
    late_us = rng.uniform(0, 30_000, len(taken_us))
    return _read(np.maximum.accumulate(taken_us[last] + late_us[last]), rng)


if __name__ == "__main__":
    sys.exit(main())
