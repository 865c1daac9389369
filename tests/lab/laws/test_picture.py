"""The picture of a law: a curve over the motions of the runs, or the loop of a memory, as high as the law says."""

from __future__ import annotations

import numpy as np
import pytest

from logger.chart_data import Curves
from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.friction_with_memory import FAMILY as FRICTION
from logger.lab.laws.families.spring_with_memory import FAMILY as RUBBER
from logger.lab.laws.picture import picture
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


def test_friction_with_a_memory_draws_a_loop_between_its_limits() -> None:
    found = drawn(FRICTION, yield_force_n=150.0)
    largest = max(found.lines, key=lambda line: float(np.ptp(line.x)))
    assert float(np.abs(largest.y).max()) == pytest.approx(150.0, rel=0.05)
    area = abs(float(np.trapezoid(largest.y, largest.x)))
    assert area > 150.0 * float(np.ptp(largest.x))  # of 2 F times the way to and fro, most
