"""Diagnosis: processor and clock seconds of each kind of case of the examination, beside the goals.

    python -m tests.benchmarks.diagnosis --kinds one outsider --cases 3

Cases are those of development (``tests.validation.cases.seeds``). A goal of the clock is for two cores that do nothing
else; on a busy machine the processor's seconds tell more.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from ..validation.cases.case_files import write_case
from ..validation.cases.random_case import KINDS, case
from ..validation.cases.seeds import DEVELOPMENT_SEEDS, seeds
from ..validation.marking.sitting import asked
from .figures import Figures

CORES = 2
MEDIAN_S, LONGEST_S, GOAL_MB = 15.0, 97.0, 1000.0


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=["none", "one", "two", "outsider", "wandering"])
    parser.add_argument("--cases", type=int, default=1, help="of each kind (default: %(default)s)")
    parser.add_argument("--first-seed", type=int, default=DEVELOPMENT_SEEDS[0])
    options = parser.parse_args()
    figures, every = Figures(), []
    for kind in options.kinds:
        costs = [cost_of(kind, seed) for seed in seeds(options.first_seed, options.cases, release=False)]
        figures.at_most(f"{kind}: of the processor, median", float(np.median([one["cpu_s"] for one in costs])),
                        CORES * MEDIAN_S, "s")
        figures.at_most(f"{kind}: of the processor, longest", max(one["cpu_s"] for one in costs),
                        CORES * LONGEST_S, "s")
        every += costs
    figures.at_most("all: by the clock, median", float(np.median([one["wall_s"] for one in every])), MEDIAN_S, "s")
    figures.at_most("all: by the clock, longest", max(one["wall_s"] for one in every), LONGEST_S, "s")
    figures.at_most("all: memory, most", max(one["peak_mb"] for one in every), GOAL_MB, "MB")
    return 1 if figures.missed else 0


def cost_of(kind: str, seed: int) -> dict[str, float]:
    """What one diagnosis took, by the command."""
    with tempfile.TemporaryDirectory() as name:
        folder, made = Path(name), case(kind, seed)
        write_case(made, folder)
        runs = [str(folder / f"run{number}") for number in range(1, len(made.recordings) + 1)]
        return asked(["diagnose", "--json", "--vehicle", str(folder / "vehicle.yaml"), *runs], in_process=False)[1]


if __name__ == "__main__":
    sys.exit(main())
