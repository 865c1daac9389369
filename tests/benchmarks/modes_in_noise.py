"""Modes of shaken quarter cars and nine-floor frames: found, missed, invented, and how often the errors hold."""

from __future__ import annotations

import sys

import numpy as np

from logger.modal.analysis import find_modes

from ..modal.shaken import RATE_HZ, matched, records
from .figures import Figures

SEEDS = range(4)


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    for method in ("n4sid", "ssi"):
        found, missed, invented, off, count = 0, 0, 0, [], 0
        for one in records(SEEDS):
            modes = find_modes(one.samples, RATE_HZ, one.inputs if method == "n4sid" else None, decay=False).modes
            pairs, extra = matched(one, modes)
            invented += extra
            count += 1
            missed += sum(mode is None for mode in pairs)
            for (hz, ratio), mode in zip(one.true.tolist(), pairs, strict=True):
                if mode is not None:
                    found += 1
                    off.append((abs(mode.frequency_hz - hz) / max(mode.frequency_std_hz, 1e-6 * hz),
                                abs(mode.damping_ratio - ratio) / max(mode.damping_std, 1e-6)))
        within = 100 * (np.array(off) < 2).mean(axis=0)
        print(f"{method}: {count} records, {found} modes found, {missed} missed, {invented} that are not there")
        figures.at_most(f"{method}: false modes", invented, 0, "")
        figures.at_most(f"{method}: modes missed", missed, {"n4sid": 12, "ssi": 20}[method], "")
        for what, share in zip(("frequency", "damping"), within.tolist(), strict=True):
            figures.at_least(f"{method}: {what} within 2 sd", share, 88, "%")
    return 1 if figures.missed else 0


if __name__ == "__main__":
    sys.exit(main())
