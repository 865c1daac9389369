"""Results of the studies, each computed once for all tests that look at it."""

from __future__ import annotations

from functools import cache

from logger.studies.study import Result, Workload, studies

STUDIES = studies()


@cache
def study_result(name: str, share: float = 0.01) -> Result:
    """With this share of the full effort."""
    return STUDIES[name].run(Workload(share))
