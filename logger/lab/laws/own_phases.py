"""Amplitudes and phases of each run: an engine and a wheel begin each drive with another phase.

A periodic law has two strengths, of its even and its odd part: its amplitude and its phase as a run begins. Where the
phases of runs differ, each run has two strengths of its own, and all of them are counted as parameters. A model with
such a law, compared with other runs, takes them for the first, the second, ... of those: its error there is that of a
refit.
"""

from __future__ import annotations

from collections.abc import Sequence

from logger.lab.laws.families.family import LawContext

ALL_ALIKE: Sequence[str] = ("",)
EACH = "_each"
"""End of the names of laws with a phase in each run."""
BEGINS = ", beginning elsewhere in each run"
_MOST = 8


def each_run(context: LawContext) -> Sequence[str]:
    """Names of the runs in such a law's numbers; none for a single run, or for more runs than a law can list."""
    count = len(context.runs)
    return [f"run_{number}" for number in range(1, count + 1)] if 1 < count <= _MOST else []


def in_run(name: str, run: str, unit: str) -> str:
    """Name of a number of a run, its unit last."""
    return "_".join(filter(None, (name, run, unit)))


def of_run(run: str) -> str:
    """The run in words, as the end of a meaning."""
    return f" in run {run.removeprefix('run_')}" if run else ""
