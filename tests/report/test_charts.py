"""Axes: their values are round."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from logger.report.charts import nice_step, nice_ticks


@given(st.floats(1e-6, 1e9), st.integers(3, 10))
def test_ticks_are_round_and_within(end: float, about: int) -> None:
    ticks = nice_ticks(0.0, end, about)
    assert ticks[0] == 0.0
    assert ticks[-1] <= end * (1 + 1e-9)
    assert 1 < len(ticks) <= about + 1
    assert ticks[1] == pytest.approx(nice_step(end / about))
    assert re.fullmatch(r"[125]0*(e[-+]\d+)?|0\.0*[125]", f"{ticks[1]:g}")
