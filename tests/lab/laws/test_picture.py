"""The picture of a law: a curve over the motions of the runs, or the loop of a memory, as high as the law says."""

from __future__ import annotations

import numpy as np
import pytest

from logger.chart_data import Curves
from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.spring_with_memory import FAMILY as RUBBER
from logger.lab.laws.picture import _LOOP_HZ, picture
from logger.vehicle.effect import chosen
from logger.vehicle.uncertain import NumberErrors

from ...support.lab.secret_runs import posterior_of, secret_runs


def drawn(family, **values: float) -> Curves:  # type: ignore[no-untyped-def]
    posterior = posterior_of(secret_runs())
    context = LawContext(posterior, posterior.start())
    draft = family.drafts(context)[0]
    usual = {one.name: one.start for one in draft.parameters}
    found = picture(draft, chosen(draft.effect, usual | values), NumberErrors({}, ()), context)
    assert found is not None
    return found


def test_a_rubber_that_has_no_time_to_creep_is_a_spring() -> None:
    found = drawn(RUBBER, stiffness_n_per_m=8000.0, creep_time_s=5.0)
    assert found.lines
    for line in found.lines:
        slope = float(np.polyfit(line.x, line.y, 1)[0])
        assert slope == pytest.approx(8000.0, rel=0.03)


def test_a_rubber_that_creeps_as_fast_as_it_is_moved_draws_a_loop() -> None:
    """A branch of Maxwell loses pi k X^2 w T / (1 + w^2 T^2) a turn."""
    found = drawn(RUBBER, stiffness_n_per_m=8000.0, creep_time_s=1 / (2 * np.pi * _LOOP_HZ))
    for line in found.lines:
        half_m = float(np.ptp(line.x)) / 2
        assert abs(float(np.trapezoid(line.y, line.x))) == pytest.approx(np.pi * 8000.0 * half_m**2 / 2, rel=0.02)
