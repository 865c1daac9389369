"""The picture of a law: a curve over the motions of the runs, or the loop of a memory, as high as the law says."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from logger.chart_data import Curves
from logger.lab.laws.draft import Family, LawContext
from logger.lab.laws.families.mount_as_a_whole import FAMILY as MOUNT
from logger.lab.laws.families.sliding_behind_spring import FAMILY as SLIDING
from logger.lab.laws.picture import _LOOP_HZ, picture
from logger.vehicle.effect import chosen
from logger.vehicle.uncertain import NumberErrors

from ...support.lab.secret_runs import posterior_of, secret_runs


def drawn_of(family: Family, known: Callable[[LawContext, Mapping[str, float]], Mapping[str, float]]
             ) -> tuple[Curves, LawContext]:
    """The loops of a family's first law with what is known of its numbers, by its usual ones, as a part that a bench
    moves as far as the runs moved the suspension."""
    posterior = posterior_of(secret_runs())
    context = LawContext(posterior, posterior.start())
    part = SimpleNamespace(vehicle=replace(context.vehicle, model="component"), reach=context.reach)
    draft = family.drafts(part)[0]  # type: ignore[arg-type]
    usual = {one.name: one.start for one in draft.parameters}
    found = picture(draft, chosen(draft.effect, usual | known(context, usual)), NumberErrors({}, ()), context)
    assert found is not None
    return found, context


def drawn(**values: float) -> Curves:
    """The loop of what slides behind a spring."""
    def known(_: LawContext, usual: Mapping[str, float]) -> Mapping[str, float]:
        yields_m = (values["yield_m"] if "yield_m" in values
                    else usual["sliding_rate_m_per_s"] * values["relaxation_time_s"])
        return {"power_ratio": values["power_ratio"], "yield_travel_m": yields_m, "sliding_force_n": 8000.0 * yields_m}

    return drawn_of(SLIDING, known)[0]


def test_a_loop_has_the_law_s_spring_in_it() -> None:
    nothing = dict.fromkeys(("spring_square_n", "damper_n", "creep_n_per_m", "friction_n"), 0.0)
    found, context = drawn_of(MOUNT, lambda context, usual: {**nothing, "spring_cube_n": 100.0})
    usual_m = context.reach("travel_m", 0.9)
    assert found.lines
    for line in found.lines:
        assert line.y == pytest.approx(100.0 * (line.x / usual_m) ** 3, abs=0.01)


def test_a_friction_that_does_not_slide_yet_is_a_spring() -> None:
    found = drawn(power_ratio=40.0, yield_m=0.05)
    assert found.lines
    for line in found.lines:
        slope = float(np.polyfit(line.x, line.y, 1)[0])
        assert slope == pytest.approx(8000.0, rel=0.03)


def test_a_damper_behind_a_spring_draws_a_loop() -> None:
    """A branch of Maxwell loses pi k X^2 w T / (1 + w^2 T^2) a turn."""
    found = drawn(power_ratio=1.0, relaxation_time_s=1 / (2 * np.pi * _LOOP_HZ))
    for line in found.lines:
        half_m = float(np.ptp(line.x)) / 2
        assert abs(float(np.trapezoid(line.y, line.x))) == pytest.approx(np.pi * 8000.0 * half_m**2 / 2, rel=0.02)
