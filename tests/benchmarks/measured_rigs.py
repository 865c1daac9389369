"""Rigs that somebody measured, by the studies of them, beside the goals: what is named, and how near simulations come.

    python -m tests.benchmarks.measured_rigs --silverbox DIR --emps DIR

``ridelog study silverbox`` and ``ridelog study emps`` say where their files are to be had.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from ..support.command import called
from .figures import Figures

GOALS = {
    "silverbox": {"Silverbox multisine, r.m.s. error [mV]": 1.0, "Silverbox arrow, r.m.s. error [mV]": 1.0,
                  "Silverbox arrow without extrapolation, r.m.s. error [mV]": 0.8},
    "emps": {"NRMSE of the force": 0.04, "mass [kg]": 0.01, "viscous friction [N s/m]": 0.01,
             "Coulomb friction [N]": 0.01},
}
"""Of an error its most; of a number how far it may be from the published one, as a share."""


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser, figures = argparse.ArgumentParser(description=__doc__), Figures()
    for name in GOALS:
        parser.add_argument(f"--{name}", type=Path, metavar="DIR")
    for name, folder in vars(parser.parse_args()).items():
        if folder is not None:
            show(figures, name, folder)
    return 1 if figures.missed else 0


def show(figures: Figures, name: str, folder: Path) -> None:
    """The checks of a study, each beside its goal; what is named has to be named."""
    found = called("study", name, folder, "--json")
    if not found.stdout:
        raise SystemExit(found.stderr)
    for table in json.loads(found.stdout)["tables"][:2]:
        for row in (dict(zip(table["columns"], one, strict=True)) for one in table["rows"]):
            words, ours = row["value" if "value" in row else "figure"], row["ridelog"]
            goal = GOALS[name].get(words)
            if goal is None:
                figures.at_least(words, ours, 1.0, "")
            elif "value" in row and name == "emps":
                figures.at_most(f"{words}, apart from the published", abs(ours / row["published"] - 1), goal, "")
            else:
                figures.at_most(words, ours, goal, "")


if __name__ == "__main__":
    sys.exit(main())
