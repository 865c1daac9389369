"""The IRI of one drive by two vehicle files against the truth, for a person and for a program."""

from __future__ import annotations

from typing import Any

import numpy as np

from logger.estimation.assessment import Assessment, figures

HEADS = ("IRI", "Mean [m/km]", "Bias", "R2", "Within 1", "Within 2")
IN_HINT = ("Within 1 and 2: the share of windows whose truth lies within one and two standard errors of the estimate "
           "(right: 68 % and 95 %).")


def figures_of(found: Assessment) -> dict[str, Any]:
    """Figures of the windows in which the car moved; its ``comparison`` with the profile must be there."""
    return figures(found, found.windows.speed_mps > 0)


def rows(before: Assessment, after: Assessment) -> list[tuple[str, ...]]:
    """The table of ``HEADS``: by the file as it was given, by the last one, and the truth."""
    estimated = [_row("by the file as it was", figures_of(before)), _row("by the last file", figures_of(after))]
    known = after.exact_m_per_km[np.isfinite(after.exact_m_per_km)]
    return [*estimated, ("as it was measured", f"{known.mean():.2f}", "", "", "", "")]


def _row(name: str, found: dict[str, Any]) -> tuple[str, ...]:
    beside = found["comparison"]
    return (name, f"{found['iri_m_per_km']:.2f}", f"{beside['bias']:+.1%}", f"{beside['r2']:.3f}",
            f"{beside['within_one']:.0%}", f"{beside['within_two']:.0%}")
