"""Numbers that each run has of its own: an engine and a wheel stand elsewhere whenever a drive begins.

A law in which something turns has two strengths, of its even and its odd part, which together are how strong it is and
where it stands as a run begins. Where that is another place in each run, each run has two of its own, and all of them
count. A model with such a law, compared with other runs, takes them for the first, the second, ... of those: its error
there is that of a refit.
"""

from __future__ import annotations

from collections.abc import Sequence

from logger.lab.laws.families.family import LawContext

ALL_ALIKE: Sequence[str] = ("",)
EACH = "_each"
"""How variants of laws end that begin in each run elsewhere."""
BEGINS = ", beginning elsewhere in each run"
_MOST = 8


def each_run(context: LawContext) -> Sequence[str]:
    """A mark for each run that is learned from; none where there is one alone, or so many that laws cannot be read."""
    count = len(context.runs)
    return [f"run_{number}" for number in range(1, count + 1)] if 1 < count <= _MOST else []


def in_run(name: str, run: str, unit: str) -> str:
    """The name of a number of a run, its unit last."""
    return "_".join(filter(None, (name, run, unit)))


def of_run(run: str) -> str:
    """The same in words, behind what it is."""
    return f" in run {run.removeprefix('run_')}" if run else ""
