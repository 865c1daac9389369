"""Frequency weightings by name."""

from __future__ import annotations

from collections.abc import Mapping

from logger.dsp.weightings.weighting import Weighting
from logger.errors import BadInput
from logger.plugins import catalogue


def weightings() -> Mapping[str, Weighting]:
    """All there are, by name."""
    return catalogue("logger.dsp.weightings", "WEIGHTING")


def weighting_named(name: str) -> Weighting:
    """A weighting by its name, in capitals or not: ``wk``, ``Wk``. Raises BadInput for one that there is not."""
    known = weightings()
    if name.lower() not in known:
        raise BadInput(f"weighting {name!r}: expected one of {', '.join(known)}")
    return known[name.lower()]
