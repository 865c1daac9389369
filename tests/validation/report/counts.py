"""What an examination counted, for a program: the goals that are shares of cases, and which cases there were."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..cases.seeds import RELEASE_SEEDS
from ..marking.marks import Record, goals


def counts(records: Sequence[Record], asked: int) -> dict[str, Any]:
    """The counts as ``ridelog study lab-examination`` reads them."""
    seeds = [record["seed"] for record in records]
    return {"first_seed": min(seeds), "last_seed": max(seeds), "cases": len(records), "asked": asked,
            "release": all(seed in RELEASE_SEEDS for seed in seeds),
            "goals": [{"name": goal.name, "goal": goal.goal, "at_least": goal.at_least, "count": goal.found.count,
                       "of": goal.found.of} for goal in goals(records)]}
